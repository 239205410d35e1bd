// SPDX-License-Identifier: MIT
// The world: a MainDevice and three modelled drives in simulated time, and a wire that changes what
// comes back. Whatever it is, the bring-up ends with one failure that names it, or goes on.
#include <gtest/gtest.h>

#include "test/support/main_bench.h"

namespace ftcs::ethercat {
namespace {

class BadInput : public ::testing::Test {
 protected:
  BadInput() {
    MainDeviceConfig config;
    config.clocks.drift_pulses = 10;
    bench_.configure(config);
    bench_.add_line(3, Nanoseconds{50});
  }
  /// Each drive is given one object: an SDO download in its bring-up.
  void configure_one_object() {
    static constexpr SdoDownload kObject[] = {{{0x6060, 0}, 1, 8}};
    MainDeviceConfig config;
    config.clocks.drift_pulses = 10;
    config.process.objects = kObject;
    bench_.configure(config);
  }
  const Failure& bring_up() {
    bench_.bring_up();
    return bench_.main().failure();
  }
  /// Every answer to a read of this register.
  void change(std::uint16_t offset, const std::function<void(const Datagram&)>& what) {
    bench_.tamper = [offset, what](const FrameView& frame) {
      for (const Datagram datagram : frame) {
        const bool read =
            datagram.command() == Command::kFprd || datagram.command() == Command::kBrd;
        if (read && datagram.offset() == offset) what(datagram);
      }
    };
  }
  static void set_counter(const Datagram& datagram, unsigned counter) {
    datagram.add_to_working_counter(counter - datagram.working_counter());
  }
  test::MainBench bench_;
};

TEST_F(BadInput, without_any_the_bring_up_succeeds) {
  EXPECT_FALSE(bring_up()) << name(bench_.main().failure().kind);
}

TEST_F(BadInput, a_wire_that_only_reflects_has_no_subdevices) {
  MainDevice main{{}};
  const ConstBytes frame = main.next_frame();
  std::vector<std::uint8_t> reflected(frame.begin(), frame.end());
  EXPECT_EQ(main.on_frame(reflected, {}), FrameOutcome::kStopped);
  EXPECT_EQ(main.failure().kind, FailureKind::kNoSubDevices);
}

TEST_F(BadInput, plant_time_does_not_fit_a_reference_clock_of_32_bits) {
  bench_.plant_time = true;
  bench_.tamper = [](const FrameView& frame) {
    for (const Datagram datagram : frame) {
      const std::size_t at = datagram.offset();
      const bool read = datagram.command() == Command::kFprd;
      if (!read || at > reg::kFeatures || at + datagram.data().size() <= reg::kFeatures) continue;
      datagram.data()[reg::kFeatures - at] &= static_cast<std::uint8_t>(~reg::kFeatureDc64);
    }
  };
  EXPECT_EQ(bring_up().kind, FailureKind::kNarrowClock);
  EXPECT_EQ(bring_up().position, 0U);
  EXPECT_NE(std::string(name(bring_up().kind)).find("32 bits"), std::string::npos);
}

TEST_F(BadInput, more_subdevices_than_there_is_memory_for) {
  change(reg::kType, [](const Datagram& datagram) {
    if (datagram.command() == Command::kBrd) set_counter(datagram, kMaxSubDevices + 1);
  });
  EXPECT_EQ(bring_up().kind, FailureKind::kTooManySubDevices);
  EXPECT_EQ(bring_up().received, kMaxSubDevices + 1);
  EXPECT_EQ(bring_up().expected, kMaxSubDevices);
}

TEST_F(BadInput, one_that_was_counted_and_does_not_answer) {
  change(reg::kType, [](const Datagram& datagram) {
    if (datagram.command() == Command::kFprd && datagram.position() == kFirstStation + 1) {
      set_counter(datagram, 0);
    }
  });
  EXPECT_EQ(bring_up().kind, FailureKind::kNotAnswering);
  EXPECT_EQ(bring_up().position, 1);
}

TEST_F(BadInput, an_sii_whose_checksum_is_wrong) {
  change(reg::kSiiControl, [](const Datagram& datagram) {
    const Bytes data = datagram.data();
    const bool first_words = data.size() > 6 && load<std::uint32_t>(data, 2) == 0;
    if (first_words) data[6] ^= 0x01;
  });
  EXPECT_EQ(bring_up().kind, FailureKind::kBadSii);
  EXPECT_EQ(bring_up().position, 0);
}

TEST_F(BadInput, an_sii_that_never_ends_is_an_error_and_no_endless_reading) {
  // Each category claims to be one word long and to be followed by another.
  change(reg::kSiiControl, [](const Datagram& datagram) {
    const Bytes data = datagram.data();
    const std::uint32_t word = data.size() > 6 ? load<std::uint32_t>(data, 2) : 0;
    if (word < sii::kCategoriesWord) return;
    for (std::size_t at = 6; at < data.size(); ++at) data[at] = 0x01;
  });
  const Failure& failure = bring_up();
  EXPECT_EQ(failure.kind, FailureKind::kBadSii) << name(failure.kind);
}

TEST_F(BadInput, an_sii_interface_that_stays_busy) {
  change(reg::kSiiControl,
         [](const Datagram& datagram) { store(datagram.data(), 0, std::uint16_t{0x8000}); });
  EXPECT_EQ(bring_up().kind, FailureKind::kSiiTimeout);
}

/// Word 0x18 on: start and size of the mailboxes, read eight bytes at a time.
TEST_F(BadInput, a_mailbox_that_no_frame_holds_or_that_holds_no_sdo_is_refused_at_the_scan) {
  for (const std::uint16_t size : {std::uint16_t{1467}, std::uint16_t{0xFFFF}, std::uint16_t{15}}) {
    test::MainBench bench;
    bench.add_line(3, Nanoseconds{50});
    bench.tamper = [size](const FrameView& frame) {
      for (const Datagram datagram : frame) {
        const Bytes data = datagram.data();
        if (datagram.offset() != reg::kSiiControl || data.size() < 14) continue;
        if (load<std::uint32_t>(data, 2) == sii::kMailboxWord) store(data, 8, size);
      }
    };
    bench.bring_up();
    EXPECT_EQ(bench.main().stage(), Stage::kStopped);
    EXPECT_EQ(bench.main().failure().kind, FailureKind::kMailboxUnusable);
    EXPECT_EQ(bench.main().failure().position, 0);
    EXPECT_EQ(bench.main().failure().received, size);
    EXPECT_EQ(bench.main().failure().expected, size < 1000 ? 16 : 1466);
  }
}

TEST_F(BadInput, a_mailbox_full_of_something_else_does_not_prolong_the_deadline_of_an_sdo) {
  // Each read of a mailbox brings an emergency (CoE service 1), for ever.
  configure_one_object();
  bench_.tamper = [](const FrameView& frame) {
    const Datagram datagram = frame[0];
    if (datagram.command() != Command::kFprd || datagram.data().size() < 64) return;
    store(datagram.data(), 0, std::uint16_t{10});
    datagram.data()[5] = kMailboxTypeCoe;
    store(datagram.data(), 6, std::uint16_t{1U << 12});
    set_counter(datagram, 1);
  };
  const WireTime before = bench_.now();
  const Failure& failure = bring_up();
  EXPECT_EQ(failure.kind, FailureKind::kSdoTimeout) << name(failure.kind);
  EXPECT_EQ(failure.object.index, 0x6060);
  EXPECT_LT((bench_.now() - before).seconds(), 1.5);
}

// An answer is lost, and then the host stands still for longer than the drive has to answer.
TEST_F(BadInput, a_host_that_stands_still_for_a_second_asks_for_an_sdo_again) {
  configure_one_object();
  bool stood_still = false;
  bench_.tamper = [&](const FrameView& frame) {
    const Datagram datagram = frame[0];
    if (datagram.command() != Command::kFprd || datagram.data().size() < 64 ||
        datagram.working_counter() == 0 || stood_still) {
      return;
    }
    stood_still = true;
    datagram.data()[5] = 0;  // of no protocol: passed over
    bench_.wait(Nanoseconds{1'200'000'000});
  };
  bring_up();
  EXPECT_TRUE(stood_still);
  EXPECT_TRUE(bench_.main().cyclic()) << name(bench_.main().failure().kind);
}

TEST_F(BadInput, a_bring_up_that_takes_too_long_as_a_whole_is_given_up) {
  MainDeviceConfig config;
  config.clocks.drift_pulses = 100'000;  // 20 us each
  config.bring_up_timeout = Nanoseconds{1'000'000'000};
  bench_.configure(config);
  EXPECT_EQ(bring_up().kind, FailureKind::kBringUpTimeout);
}

TEST_F(BadInput, a_name_from_the_wire_has_no_control_characters) {
  bench_.tamper = [](const FrameView& frame) {
    for (const Datagram datagram : frame) {
      const Bytes data = datagram.data();
      if (datagram.offset() != reg::kSiiControl || data.size() < 14) continue;
      for (std::size_t at = 6; at < data.size(); ++at) {
        if (data[at] == 'v') data[at] = 0x1B;  // ESC, in "servo drive"
      }
    }
  };
  bring_up();
  ASSERT_FALSE(bench_.main().failure()) << name(bench_.main().failure().kind);
  const std::string text = bench_.main().network().devices[0].sii.device_name.data();
  EXPECT_NE(text.find('?'), std::string::npos) << text;
  for (const char c : text) EXPECT_TRUE(c >= 0x20 && c < 0x7F) << text;
}

TEST_F(BadInput, ports_that_do_not_form_a_tree) {
  change(reg::kDlStatus,
         [](const Datagram& datagram) { store(datagram.data(), 0, std::uint16_t{0xFFFF}); });
  EXPECT_EQ(bring_up().kind, FailureKind::kImpossibleTopology);
}

TEST_F(BadInput, a_subdevice_that_does_not_come_down_to_init) {
  change(reg::kAlStatus, [](const Datagram& datagram) {
    if (datagram.data().size() >= 6) store(datagram.data(), 0, std::uint16_t{0x12});
  });
  const Failure& failure = bring_up();
  EXPECT_EQ(failure.kind, FailureKind::kStateTimeout);
  EXPECT_EQ(failure.wanted, AlState::kInit);
}

TEST_F(BadInput, foreign_and_malformed_frames_between_the_answers_are_counted_and_passed_over) {
  std::uint64_t sent = 0;
  bench_.tamper = [this, &sent](const FrameView&) {
    std::array<std::uint8_t, 60> rubbish{};
    rubbish.fill(static_cast<std::uint8_t>(sent++));
    EXPECT_EQ(bench_.main().on_frame(rubbish, {}), FrameOutcome::kIgnored);
  };
  EXPECT_FALSE(bring_up()) << name(bench_.main().failure().kind);
  EXPECT_EQ(bench_.main().counters().ignored, sent);
}

}  // namespace
}  // namespace ftcs::ethercat
