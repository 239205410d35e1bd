// SPDX-License-Identifier: MIT
// World: the names of JSON fields are an interface; these tests are what holds them.
#include "ftcs/report/json.h"

#include <gtest/gtest.h>

namespace ftcs {
namespace {

TEST(Json, writes_what_is_not_finite_as_null) {
  const RunningStatistics nothing;
  const Json json = Json::parse(dump(to_json(nothing, "ns")));
  EXPECT_TRUE(json.at("rms_ns").is_null());
  EXPECT_EQ(json.at("count"), 0);
}

TEST(Json, keeps_names_order_and_unit_of_statistics) {
  const double seconds[] = {1e-9, 3e-9};
  const Json json = to_json(summarize(seconds), "ns", 1e-9);
  EXPECT_NEAR(json.at("mean_ns").get<double>(), 2.0, 1e-12);
  EXPECT_NEAR(json.at("median_ns").get<double>(), 2.0, 1e-12);
  EXPECT_NEAR(json.at("absolute_percentile_95_ns").get<double>(), 2.9, 1e-12);
  EXPECT_EQ(json.begin().key(), "count");
}

TEST(Json, tells_never_from_at_once) {
  const double settled[] = {0.0};
  EXPECT_EQ(to_json(find_convergence(settled, 1.0)).at("cycles_from_first_message"), 0);
  const double never[] = {5.0};
  EXPECT_TRUE(to_json(find_convergence(never, 1.0)).at("settled_sample").is_null());
}

TEST(Json, writes_one_object_per_tau) {
  const double phase[] = {0.0, 1.0, 0.0, 1.0, 0.0};
  const std::size_t factors[] = {1, 2};
  const Json adev = to_json(stability(Deviation::kOverlappingAllan, {phase, 0.5}, factors));
  ASSERT_EQ(adev.size(), 2U);
  EXPECT_EQ(adev[1].at("tau_s"), 1.0);
  EXPECT_EQ(adev[0].at("terms"), 3);
  EXPECT_TRUE(adev[0].contains("lower"));
  const Json wander = to_json(mtie({phase, 0.5}, factors));
  EXPECT_EQ(wander[0].at("mtie_s"), 1.0);
  EXPECT_EQ(wander[0].at("windows"), 4);
}

TEST(Json, survives_bytes_that_are_not_utf8) {
  Json json;
  json["file"] = "\xff\xfe";
  EXPECT_TRUE(Json::accept(dump(json)));
}

}  // namespace
}  // namespace ftcs
