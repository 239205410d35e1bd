// SPDX-License-Identifier: MIT
// World: configuration files in ptp4l's format; the settings of linuxptp 3.1.1's default.cfg, as
// names and values.
#include "apps/ftcs/config_file.h"

#include <gtest/gtest.h>

#include "apps/ftcs/ptp_option_table.h"
#include "apps/ftcs/ptp_presets.h"

namespace ftcs::app {
namespace {

std::string error_of(const char* text) {
  daemon::PtpOptions options;
  return read_config_text(text, "ptp.conf", options).value_or("");
}

daemon::PtpOptions options_of(const char* text) {
  daemon::PtpOptions options;
  const auto wrong = read_config_text(text, "ptp.conf", options);
  EXPECT_EQ(wrong.value_or(""), "");
  return options;
}

// A line of 10 MB took 35 s to be compared with every name, and was printed.
TEST(ConfigFile, endless_lines_and_control_characters_are_refused_without_being_repeated) {
  const std::string endless = "[global]\n" + std::string(10'000'000, 'x') + " 1\n";
  EXPECT_EQ(error_of(endless.c_str()),
            "ptp.conf:2: a line of 10000002 characters; expected 1000 at most");
  const std::string escape = error_of("[global]\n\x1b[2Jdomain 1\n");
  EXPECT_EQ(escape.find('\x1b'), std::string::npos);
  EXPECT_NE(escape.find("ptp.conf:2: unknown setting '?[2Jdomain'"), std::string::npos) << escape;
}

TEST(ConfigFile, settings_mean_what_they_mean_to_ptp4l) {
  const daemon::PtpOptions options = options_of(
      "[global]\n"
      "domainNumber\t24\n"
      "  logSyncInterval   -3  \n"
      "time_stamping software\r\n"
      "tx_timestamp_timeout 50\n"
      "first_step_threshold 0.00002\n"
      "max_frequency 100000\n"
      "egressLatency 12\n"
      "delay_filter_length 4\n"
      "clock_servo pi\n"
      "pi_proportional_const 0.7\n"
      "clockIdentity 001122.fffe.334455\n"
      "# nothing\n"
      "\n"
      "[eth3]\n"
      "delayAsymmetry -100\n");
  EXPECT_EQ(options.interface, "eth3");
  EXPECT_EQ(options.protocol.domain, 24);
  EXPECT_EQ(options.transmitter.log_sync_interval, -3);
  EXPECT_EQ(options.timestamps, platform::TimestampMode::kSoftware);
  EXPECT_EQ(options.socket.tx_timestamp_timeout, Nanoseconds{50'000'000});
  EXPECT_EQ(options.follower.first_step_threshold, Nanoseconds{20'000});
  EXPECT_NEAR(options.follower.servo.limits.fastest.ppb(), 100'000.0, 1e-3);
  EXPECT_EQ(options.protocol.egress_latency, Nanoseconds{12});
  EXPECT_EQ(options.receiver.delay_asymmetry, Nanoseconds{-100});
  EXPECT_EQ(options.follower.servo.two_way.path_delay.filter.length, 4U);
  EXPECT_TRUE(options.follower.filter_is_chosen);
  EXPECT_EQ(options.follower.servo.kind, ServoKind::kLinuxptpPi);
  EXPECT_DOUBLE_EQ(options.follower.servo.linuxptp_pi.proportional_const, 0.7);
  EXPECT_EQ(to_text(*options.protocol.clock_identity).view(), "001122.fffe.334455");
}

TEST(ConfigFile, delay_filters_are_ptp4ls_and_one_more) {
  const auto kind = [](const std::string& name) {
    const daemon::PtpOptions options =
        options_of(("[global]\ndelay_filter " + name + "\n").c_str());
    EXPECT_TRUE(options.follower.filter_is_chosen);
    return options.follower.servo.two_way.path_delay.filter.kind;
  };
  EXPECT_EQ(kind("moving_median"), DelayFilterKind::kMovingMedian);
  EXPECT_EQ(kind("moving_minimum"), DelayFilterKind::kMovingMinimum);
  EXPECT_EQ(kind("steady_mean"), DelayFilterKind::kSteadyMean);
  EXPECT_FALSE(options_of("[global]\n").follower.filter_is_chosen);
}

TEST(ConfigFile, both_spellings_of_the_roles_are_known) {
  EXPECT_EQ(options_of("[global]\nmasterOnly 1\n").role, daemon::Role::kTimeTransmitter);
  EXPECT_EQ(options_of("[global]\nserverOnly 1\n").role, daemon::Role::kTimeTransmitter);
  EXPECT_EQ(options_of("[global]\nslaveOnly 1\n").role, daemon::Role::kTimeReceiver);
  EXPECT_EQ(options_of("[global]\nclientOnly 1\n").role, daemon::Role::kTimeReceiver);
  EXPECT_EQ(options_of("[global]\nslaveOnly 0\n").notes.size(), 1U);
}

TEST(ConfigFile, settings_without_effect_are_accepted_only_with_the_value_that_is_true_anyway) {
  EXPECT_EQ(error_of("[global]\ntwoStepFlag 1\nhybrid_e2e 0\nuserDescription a b c\n"), "");
  EXPECT_EQ(error_of("[global]\ntwoStepFlag 0\n"),
            "ptp.conf:2: twoStepFlag: '0' is not supported, only 1");
  EXPECT_EQ(error_of("[global]\nclock_type BC\n"),
            "ptp.conf:2: clock_type: 'BC' is not supported, only OC");
}

TEST(ConfigFile, a_byte_order_mark_is_no_setting) {
  EXPECT_EQ(error_of("\xEF\xBB\xBF[global]\ndomainNumber 3\n"), "");
}

TEST(ConfigFile, every_error_names_file_line_and_setting) {
  EXPECT_EQ(error_of("[global]\n\n#\ncolour blue\n"), "ptp.conf:4: unknown setting 'colour'");
  EXPECT_EQ(error_of("[global]\ndomainNumber\n"), "ptp.conf:2: 'domainNumber' has no value");
  EXPECT_EQ(error_of("[global]\npriority1 256\n"),
            "ptp.conf:2: priority1: '256': expected an integer from 0 to 255");
  EXPECT_EQ(error_of("domainNumber 0\n"), "ptp.conf:1: a setting before the first section");
  EXPECT_EQ(error_of("[global\n"), "ptp.conf:1: a section needs a closing bracket");
  EXPECT_EQ(error_of("[]\n"), "ptp.conf:1: section '' is not supported");
  EXPECT_EQ(error_of("[eth0]\n[eth1]"),
            "ptp.conf:2: a second interface 'eth1': only one port is supported");
}

TEST(ConfigFile, a_missing_file_is_named) {
  daemon::PtpOptions options;
  EXPECT_EQ(read_config_file("/nonexistent/ptp.conf", options).value_or(""),
            "/nonexistent/ptp.conf: No such file or directory");
}

TEST(Presets, gptp_is_an_end_station_of_802_1as) {
  daemon::PtpOptions options;
  EXPECT_EQ(apply_preset(options, "gptp").value_or(""), "");
  EXPECT_EQ(options.socket.transport, platform::NetworkTransport::kEthernet);
  EXPECT_EQ(options.socket.primary_mac, options.socket.peer_mac);
  EXPECT_TRUE(options.protocol.peer_to_peer());
  EXPECT_TRUE(options.protocol.peer_delay_config().capability_needed);
  EXPECT_EQ(options.protocol.peer_delay_config().highest, Nanoseconds{800});
  EXPECT_EQ(options.protocol.major_sdo_id, 1);
  EXPECT_EQ(options.transmitter.log_sync_interval, -3);
  EXPECT_EQ(options.receiver.sync_receipt_timeout, 3);
  EXPECT_TRUE(options.transmitter.follow_up_info && options.transmitter.path_trace &&
              options.protocol.assume_two_step);
  // As ptp4l's asCapable true; and what is set later wins.
  EXPECT_EQ(apply_setting(options, "asCapable", "true").value_or(""), "");
  EXPECT_FALSE(options.protocol.peer_delay_config().capability_needed);
}

TEST(Presets, default_profiles_differ_in_the_delay_mechanism_and_ask_nothing_of_a_neighbour) {
  for (const bool peer_to_peer : {false, true}) {
    daemon::PtpOptions options;
    EXPECT_EQ(apply_preset(options, peer_to_peer ? "default-p2p" : "default-e2e").value_or(""), "");
    EXPECT_EQ(options.protocol.peer_to_peer(), peer_to_peer);
    EXPECT_FALSE(options.protocol.peer_delay_config().capability_needed);
    EXPECT_EQ(options.socket.transport, platform::NetworkTransport::kUdpIpv4);
  }
  daemon::PtpOptions options;
  EXPECT_EQ(apply_preset(options, "g8275").value_or(""),
            "unknown preset 'g8275' (known: default-e2e, default-p2p, gptp)");
}

TEST(Settings, transports_addresses_and_limits_have_ptp4ls_names_and_units) {
  daemon::PtpOptions options;
  EXPECT_EQ(apply_setting(options, "ptp_dst_mac", "01:80:C2:00:00:0E").value_or(""), "");
  EXPECT_EQ(options.socket.primary_mac, (platform::MacAddress{1, 0x80, 0xC2, 0, 0, 0x0E}));
  EXPECT_EQ(apply_setting(options, "udp6_scope", "0x05").value_or(""), "");
  EXPECT_EQ(options.socket.ipv6_scope, 5);
  EXPECT_EQ(apply_setting(options, "neighborPropDelayThresh", "1500").value_or(""), "");
  EXPECT_EQ(options.protocol.peer_delay.highest, Nanoseconds{1500});
  EXPECT_EQ(apply_setting(options, "delayAsymmetry", "-40").value_or(""), "");
  EXPECT_EQ(options.receiver.delay_asymmetry, Nanoseconds{-40});
  EXPECT_NE(apply_setting(options, "udp6_scope", "16"), std::nullopt);
  EXPECT_NE(apply_setting(options, "logMinPdelayReqInterval", "8"), std::nullopt);
}

}  // namespace
}  // namespace ftcs::app
