// SPDX-License-Identifier: MIT
// World: the fake kernel of kernel_clock_test.cpp, and this machine's files and names where locks
// are meant; no clock of it is opened.
#include "ftcs/platform/clock_device.h"

#include <array>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <string>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "test/support/fake_clocks.h"

namespace ftcs::platform {
namespace {

TEST(ClockDevice, the_second_program_on_a_clock_is_refused) {
  FakeClocks kernel;
  for (const bool system : {true, false}) {
    const auto open = [&] {
      return system ? ClockDevice::open_system(kernel, ClockAccess::kSteer)
                    : ClockDevice::open_phc(kernel, "/dev/ptp0", ClockAccess::kSteer);
    };
    const auto first = open();
    ASSERT_TRUE(first.ok());
    const auto second = open();
    ASSERT_FALSE(second.ok());
    EXPECT_EQ(second.error().kind, OsErrorKind::kAddressInUse);
  }
  EXPECT_TRUE(ClockDevice::open_phc(kernel, "/dev/ptp0", ClockAccess::kRead).ok());
  EXPECT_EQ(kernel.commands, 0);
}

TEST(ClockDevice, another_name_is_no_other_clock) {
  FakeClocks kernel;
  const auto first = ClockDevice::open_phc(kernel, "/dev/ptp0", ClockAccess::kSteer);
  ASSERT_TRUE(first.ok());
  const auto link = ClockDevice::open_phc(kernel, "/dev/ptp_nic", ClockAccess::kSteer);
  ASSERT_FALSE(link.ok());
  EXPECT_EQ(link.error().message(), "/dev/ptp_nic: already in use by another program");
  const auto node = ClockDevice::open_phc(kernel, "/dev/ptp_node", ClockAccess::kSteer);
  ASSERT_FALSE(node.ok()) << "another node of the same device";
  EXPECT_EQ(node.error().message(), "/dev/ptp_node: already in use by another program");
  kernel.held_names.erase("ftcs clock ptp-248-0");  // as seen from another network namespace
  EXPECT_FALSE(ClockDevice::open_phc(kernel, "/dev/ptp_node", ClockAccess::kSteer).ok());
  EXPECT_TRUE(ClockDevice::open_system(kernel, ClockAccess::kSteer).ok()) << "is another clock";
}

TEST(ClockDevice, is_recognised_by_the_device_and_only_for_want_of_that_by_the_name) {
  for (const bool known : {true, false}) {
    FakeClocks kernel;
    kernel.device_numbers_known = known;
    const auto open = [&](const char* path) {
      return ClockDevice::open_phc(kernel, path, ClockAccess::kRead);
    };
    const auto clock = open("/dev/ptp0");
    const auto system = ClockDevice::open_system(kernel, ClockAccess::kRead);
    ASSERT_TRUE(clock.ok() && system.ok());
    EXPECT_TRUE(clock->is_same_clock(*open("/dev/ptp0")));
    EXPECT_EQ(clock->is_same_clock(*open("/dev/ptp_node")), known);
    EXPECT_EQ(clock->is_same_clock(*open("/dev/ptp_nic")), known);
    EXPECT_FALSE(clock->is_same_clock(*system));
    EXPECT_TRUE(system->is_same_clock(*system));
  }
}

TEST(LinuxKernel, a_device_has_one_number_whatever_leads_to_it) {
  LinuxKernel kernel;
  const auto number = [&](const std::string& path) {
    const Descriptor device(kernel, kernel.open(path.c_str(), O_RDONLY));
    return device.is_open() ? kernel.device_number(device.get()) : -1;
  };
  const std::int64_t null = number("/dev/null");
  EXPECT_GT(null, 0);
  EXPECT_NE(null, number("/dev/zero"));
  std::string folder = (std::filesystem::temp_directory_path() / "ftcs-node-XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  EXPECT_EQ(number(folder), 0) << "no device";
  std::filesystem::create_symlink("/dev/null", folder + "/link");
  EXPECT_EQ(number(folder + "/link"), null);
  struct stat status {};
  ASSERT_EQ(::stat("/dev/null", &status), 0);
  const bool made = ::mknod((folder + "/node").c_str(), S_IFCHR | 0600, status.st_rdev) == 0;
  const std::int64_t of_node = made ? number(folder + "/node") : -1;
  std::filesystem::remove_all(folder);
  if (of_node < 0) GTEST_SKIP() << "nodes can be made or opened only as root, outside of nodev";
  EXPECT_EQ(of_node, null);
}

TEST(ClockDevice, the_system_clock_is_one_in_all_network_namespaces) {
  for (const bool file : {true, false}) {
    FakeClocks kernel;
    kernel.run_folder_is_writable = file;
    const auto first = ClockDevice::open_system(kernel, ClockAccess::kSteer);
    ASSERT_TRUE(first.ok());
    kernel.held_names.erase("ftcs clock realtime");  // as seen from another network namespace
    EXPECT_EQ(ClockDevice::open_system(kernel, ClockAccess::kSteer).ok(), !file);
  }
}

TEST(ClockDevice, a_file_is_locked_whatever_it_is_called) {
  LinuxKernel kernel;
  std::string folder = (std::filesystem::temp_directory_path() / "ftcs-lock-XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  const std::string file = folder + "/ptp0";
  const std::string link = folder + "/ptp_nic";
  Descriptor made(kernel, kernel.open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC));
  ASSERT_TRUE(made.is_open());
  std::filesystem::create_symlink(file, link);
  EXPECT_EQ(kernel.lock(made.get()), 0);
  {
    const Descriptor other(kernel, kernel.open(link.c_str(), O_RDWR));
    EXPECT_EQ(kernel.lock(other.get()), -EWOULDBLOCK);
  }
  made.reset();
  const Descriptor again(kernel, kernel.open(link.c_str(), O_RDWR));
  EXPECT_EQ(kernel.lock(again.get()), 0) << "free again once it is closed";
  std::filesystem::remove_all(folder);
}

TEST(ClockDevice, a_name_of_this_host_is_held_by_one_process) {
  LinuxKernel kernel;
  const std::string name =
      "ftcs test of a name " + std::to_string(kernel.clock_ns(CLOCK_MONOTONIC));
  {
    const Descriptor first(kernel, kernel.hold_name(name.c_str()));
    if (!first.is_open()) GTEST_SKIP() << "no UNIX sockets here";
    EXPECT_EQ(kernel.hold_name(name.c_str()), -EADDRINUSE);
  }
  const Descriptor again(kernel, kernel.hold_name(name.c_str()));
  EXPECT_TRUE(again.is_open()) << "free again once it is closed";
}

// Anybody may bind a public name: root's clock was then "already in use".
TEST(ClockDevice, a_name_that_somebody_else_took_is_told_apart) {
  LinuxKernel kernel;
  const std::string name =
      "ftcs test of a stranger " + std::to_string(kernel.clock_ns(CLOCK_MONOTONIC));
  const int stranger = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (stranger < 0) GTEST_SKIP() << "no UNIX sockets here";
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  name.copy(address.sun_path + 1, sizeof address.sun_path - 1);
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  ASSERT_EQ(::bind(stranger, reinterpret_cast<const sockaddr*>(&address), size), 0);
  EXPECT_EQ(kernel.hold_name(name.c_str()), -EPERM) << "none of ours listens there";
  ::close(stranger);
}

// A service runs as a system account: root beside it steered the same clock.
TEST(ClockDevice, a_name_that_a_service_holds_is_in_use_and_a_persons_is_told_apart) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can become somebody";
  for (const uid_t holder : {uid_t{1}, uid_t{54'321}}) {
    LinuxKernel kernel;
    const std::string name = "ftcs test of user " + std::to_string(holder) + " " +
                             std::to_string(kernel.clock_ns(CLOCK_MONOTONIC));
    std::array<int, 2> ready{};
    ASSERT_EQ(::pipe(ready.data()), 0);
    const pid_t child = ::fork();
    if (child == 0) {
      const bool held = ::setuid(holder) == 0 && kernel.hold_name(name.c_str()) >= 0;
      (void)!::write(ready[1], held ? "y" : "n", 1);
      ::pause();
      ::_exit(0);
    }
    char held = 'n';
    ASSERT_EQ(::read(ready[0], &held, 1), 1);
    EXPECT_EQ(held, 'y');
    EXPECT_EQ(kernel.hold_name(name.c_str()), holder == 1 ? -EADDRINUSE : -EPERM);
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    ::close(ready[0]);
    ::close(ready[1]);
  }
}

TEST(ClockDevice, missing_rights_are_found_without_touching_the_clock) {
  FakeClocks kernel;
  kernel.adjust_errno = EPERM;
  const auto system = ClockDevice::open_system(kernel, ClockAccess::kSteer);
  ASSERT_FALSE(system.ok());
  EXPECT_EQ(system.error().kind, OsErrorKind::kNotPermitted);
  EXPECT_TRUE(ClockDevice::open_system(kernel, ClockAccess::kRead).ok());
  kernel.phc_open_errno = EACCES;
  const auto phc = ClockDevice::open_phc(kernel, "/dev/ptp0", ClockAccess::kSteer);
  ASSERT_FALSE(phc.ok());
  EXPECT_EQ(phc.error().kind, OsErrorKind::kNotPermitted);
  EXPECT_EQ(kernel.commands, 0);
}

TEST(ClockDevice, says_what_cannot_be_had) {
  FakeClocks kernel;
  const auto missing = ClockDevice::open_phc(kernel, "/dev/ptp7", ClockAccess::kSteer);
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().message(), "/dev/ptp7: no such device");
  kernel.interface_exists = false;
  const auto gone = ClockDevice::open_phc_of(kernel, "eth9", ClockAccess::kSteer);
  ASSERT_FALSE(gone.ok());
  EXPECT_EQ(gone.error().message(), "interface eth9: no such device");
  kernel.interface_exists = true;
  const auto without = ClockDevice::open_phc_of(kernel, "eth0", ClockAccess::kSteer);
  ASSERT_FALSE(without.ok());
  EXPECT_NE(without.error().message().find("no PTP hardware clock"), std::string::npos);
  kernel.max_adj_ppb = 0;
  EXPECT_FALSE(ClockDevice::open_phc(kernel, "/dev/ptp0", ClockAccess::kSteer).ok());
}

}  // namespace
}  // namespace ftcs::platform
