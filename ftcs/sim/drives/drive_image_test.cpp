// SPDX-License-Identifier: MIT
// What a modelled drive's EEPROM holds, read by the MainDevice's own decoder.
#include <gtest/gtest.h>

#include "ftcs/ethercat/wire/sii.h"
#include "ftcs/sim/drives/subdevice.h"

namespace ftcs::ethercat {
namespace {

TEST(SiiImage, of_a_drive_decodes_without_an_error) {
  const SiiImage image = make_drive_image({1, 2, 3, 4}, 77, true);
  const auto content = decode_sii(image);
  ASSERT_TRUE(content) << name(content.error());
  EXPECT_EQ(content->identity.product, 2U);
  EXPECT_EQ(content->alias, 77);
  EXPECT_STREQ(content->device_name.data(), "FTCS modelled servo drive");
  EXPECT_EQ(content->sync_manager_count, 4U);
  EXPECT_EQ(content->assign_activate, 0x0300);
  EXPECT_TRUE(content->coe());
}

// ETG.2010, category 30: CoE details at byte 5, EoE details at 7, flags at 11.
TEST(SiiImage, general_category_lies_where_other_masters_look_for_it) {
  SiiImage image = make_drive_image({1, 2, 3, 4}, 0, true);
  std::size_t at = sii::kCategoriesWord * 2;
  while (load<std::uint16_t>(image, at) != sii::kGeneral) {
    at += 4U + 2U * load<std::uint16_t>(image, at + 2);
  }
  const Bytes general = Bytes{image}.subspan(at + 4, 32);
  EXPECT_EQ(general[5], 0x0D) << "SDO, PDO assignment and configuration";
  EXPECT_EQ(general[6], 0) << "no FoE";
  EXPECT_EQ(general[7], 0) << "no EoE";
  EXPECT_EQ(decode_sii(image)->coe_details, 0x0D);
  EXPECT_TRUE(decode_sii(image)->logical_read_write_supported);
  general[11] = 0x02;
  EXPECT_FALSE(decode_sii(image)->logical_read_write_supported);
}

}  // namespace
}  // namespace ftcs::ethercat
