// SPDX-License-Identifier: MIT
// World: children of this process, each confined in its own way.
#include "ftcs/platform/confinement.h"

#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <functional>
#include <linux/capability.h>
#include <mutex>
#include <poll.h>
#include <string>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/ptrace.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/statfs.h>
#include <sys/syscall.h>
#include <sys/timerfd.h>
#include <sys/timex.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>

namespace ftcs::platform {
namespace {

/// How a child ended: its exit code, or minus the signal.
int outcome(const Confinement& confinement, const std::function<int()>& act) {
  const pid_t pid = ::fork();
  if (pid == 0) {
    if (confine(confinement)) ::_exit(99);
    ::_exit(act());
  }
  int status = 0;
  EXPECT_EQ(::waitpid(pid, &status, 0), pid);
  return WIFSIGNALED(status) ? -WTERMSIG(status) : WEXITSTATUS(status);
}

std::string status_line(const std::string& name) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind(name + ":", 0) == 0) return line.substr(name.size() + 2);
  }
  return {};
}

class ConfinementTest : public testing::Test {
 protected:
  void SetUp() override {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "a sanitizer makes calls of its own: there is no filter and no limit of memory";
#endif
  }
};

const Confinement kReader{.calls = {SystemCalls::kFiles}};

TEST_F(ConfinementTest, a_call_that_no_list_names_ends_the_process) {
  const char* const arguments[] = {"/bin/true", nullptr};
  EXPECT_EQ(outcome(kReader, [&] { return ::execv("/bin/true", const_cast<char**>(arguments)); }),
            -SIGSYS);
  EXPECT_EQ(outcome(kReader, [] { return static_cast<int>(::fork()); }), -SIGSYS);
  EXPECT_EQ(outcome(kReader, [] { return static_cast<int>(::ptrace(PTRACE_TRACEME, 0, 0, 0)); }),
            -SIGSYS);
  EXPECT_EQ(outcome(kReader, [] { return ::mount("a", "/mnt", "tmpfs", 0, nullptr); }), -SIGSYS);
  EXPECT_EQ(outcome(kReader, [] { return ::setuid(0); }), -SIGSYS);
  EXPECT_EQ(outcome(kReader, [] { return ::socket(AF_INET, SOCK_DGRAM, 0) < 0; }), -SIGSYS)
      << "it has no network";
}

TEST_F(ConfinementTest, what_its_lists_name_goes_on) {
  EXPECT_EQ(outcome(kReader, [] { return std::ifstream("/proc/self/status") ? 0 : 1; }), 0);
  const Confinement network{.calls = {SystemCalls::kNetwork}};
  EXPECT_EQ(outcome(network, [] { return ::socket(AF_INET, SOCK_DGRAM, 0) < 0 ? 1 : 0; }), 0);
  const Confinement threads{.calls = {SystemCalls::kThreads}};
  EXPECT_EQ(outcome(threads,
                    [] {
                      int done = 1;
                      std::thread([&] { done = 0; }).join();
                      return done;
                    }),
            0);
  EXPECT_EQ(outcome(threads, [] { return static_cast<int>(::fork()); }), -SIGSYS)
      << "a thread is no process";
}

const Confinement kEverything{.calls = {SystemCalls::kFiles, SystemCalls::kNetwork,
                                        SystemCalls::kSteering, SystemCalls::kThreads,
                                        SystemCalls::kServer}};

/// By whichever names the C library of this system calls the kernel. Nothing is set.
int wait_in_all_ways() {
  timespec time{.tv_sec = 0, .tv_nsec = 1000};
  timeval short_time{.tv_sec = 0, .tv_usec = 1};
  timex status{};
  itimerspec timer{.it_interval = {}, .it_value = time};
  std::uint64_t expired = 0;
  const int timer_fd = ::timerfd_create(CLOCK_MONOTONIC, 0);
  bool good = ::timerfd_settime(timer_fd, 0, &timer, nullptr) == 0 &&
              ::read(timer_fd, &expired, sizeof expired) == sizeof expired &&
              ::timerfd_gettime(timer_fd, &timer) == 0;
  good = good && ::clock_gettime(CLOCK_MONOTONIC_RAW, &timer.it_value) == 0 &&
         ::clock_getres(CLOCK_REALTIME, &timer.it_value) == 0;
  good = good && ::clock_nanosleep(CLOCK_MONOTONIC, 0, &time, nullptr) == 0 &&
         ::nanosleep(&time, nullptr) == 0;
  good = good && ::clock_adjtime(CLOCK_REALTIME, &status) >= 0;
  good = good && ::poll(nullptr, 0, 1) == 0 && ::ppoll(nullptr, 0, &time, nullptr) == 0 &&
         ::select(0, nullptr, nullptr, nullptr, &short_time) == 0 &&
         ::pselect(0, nullptr, nullptr, nullptr, &time, nullptr) == 0;
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK, 0);
  mmsghdr message{};
  good = good && ::recvmmsg(socket, &message, 1, 0, &time) < 0 && errno == EAGAIN;
  std::mutex mutex;
  std::unique_lock lock(mutex);
  good = good && std::condition_variable().wait_for(lock, std::chrono::microseconds(1)) ==
                     std::cv_status::timeout;
  return good ? 0 : 1;
}

int use_files_in_all_ways() {
  std::FILE* const file = std::tmpfile();
  if (file == nullptr) return 2;
  struct stat status {};
  struct statfs system {};
  const int fd = ::fileno(file);
  const bool good = ::fstat(fd, &status) == 0 && ::stat("/", &status) == 0 &&
                    ::lstat("/", &status) == 0 && ::fstatat(AT_FDCWD, "/", &status, 0) == 0 &&
                    ::fstatfs(fd, &system) == 0 && ::statfs("/", &system) == 0 &&
                    ::ftruncate(fd, 10) == 0 && ::lseek(fd, 5, SEEK_SET) == 5 &&
                    ::fcntl(fd, F_GETFL) >= 0 && ::futimens(fd, nullptr) == 0 &&
                    ::flock(fd, LOCK_EX) == 0 && ::fsync(fd) == 0;
  return good && std::filesystem::exists("/proc/self") ? 0 : 3;
}

TEST_F(ConfinementTest, waits_clocks_and_files_go_on_whatever_their_calls_are_named) {
  EXPECT_EQ(outcome(kEverything, wait_in_all_ways), 0);
  EXPECT_EQ(outcome(kEverything, use_files_in_all_ways), 0);
}

#if defined(SYS_clock_gettime64)
/// With arguments that no call can do anything with. Newer libraries use them where older ones use
/// those without 64.
TEST_F(ConfinementTest, the_calls_of_a_32_bit_system_are_on_the_lists) {
  for (const long call : {SYS_clock_gettime64,
                          SYS_clock_getres_time64,
                          SYS_clock_nanosleep_time64,
                          SYS_futex_time64,
                          SYS_ppoll_time64,
                          SYS_pselect6_time64,
                          SYS_timerfd_settime64,
                          SYS_timerfd_gettime64,
                          SYS_recvmmsg_time64,
                          SYS_utimensat_time64,
                          SYS_clock_adjtime64,
                          SYS_clock_settime64,
                          SYS_mmap2,
                          SYS_fstat64,
                          SYS_stat64,
                          SYS_lstat64,
                          SYS_fcntl64,
                          SYS__llseek,
                          SYS_ftruncate64,
                          SYS_statfs64,
                          SYS_fstatfs64,
                          SYS_ugetrlimit,
                          SYS_getuid32,
                          SYS_geteuid32,
                          SYS_getgid32,
                          SYS_getegid32,
                          SYS__newselect}) {
    const auto act = [call] { return ::syscall(call, -1, -1, -1, -1, -1, -1) == -2 ? 1 : 0; };
    EXPECT_EQ(outcome(kEverything, act), 0) << "system call " << call;
  }
  EXPECT_EQ(outcome(kReader, [] { return ::syscall(SYS_clock_settime64, -1, nullptr) < 0; }),
            -SIGSYS)
      << "who does not steer sets no clock";
}
#endif

TEST_F(ConfinementTest, the_kernel_knows_it) {
  EXPECT_EQ(outcome(kReader,
                    [] {
                      if (status_line("CapEff") != "0000000000000000") return 1;
                      if (status_line("CapPrm") != "0000000000000000") return 2;
                      if (status_line("NoNewPrivs") != "1") return 3;
                      return status_line("Seccomp") == "2" ? 0 : 4;
                    }),
            0);
  if (::geteuid() != 0) GTEST_SKIP() << "has no capability that it could keep";
  Confinement steering = kReader;
  steering.capabilities = {CAP_SYS_TIME};
  EXPECT_EQ(outcome(steering,
                    [] {
                      return status_line("CapEff") == "0000000002000000" &&
                                     status_line("CapBnd") == "0000000002000000"
                                 ? 0
                                 : 1;
                    }),
            0);
}

TEST_F(ConfinementTest, memory_is_bounded) {
  Confinement small = kReader;
  small.most_memory = std::uint64_t{64} << 20;
  EXPECT_EQ(outcome(small,
                    [] {
                      constexpr std::size_t kMuch = std::size_t{128} << 20;
                      void* const got = ::mmap(nullptr, kMuch, PROT_READ | PROT_WRITE,
                                               MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
                      return got == MAP_FAILED ? 0 : 1;
                    }),
            0);
}

TEST_F(ConfinementTest, another_user_keeps_the_capabilities_and_no_way_back) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can become somebody";
  const auto nobody = find_user("nobody");
  if (!nobody) GTEST_SKIP() << "no such user here";
  Confinement confinement = kReader;
  confinement.capabilities = {CAP_SYS_TIME};
  confinement.will_change_user = true;
  EXPECT_EQ(outcome(confinement,
                    [&] {
                      if (become_user(*nobody, confinement.capabilities)) return 1;
                      if (::geteuid() != nobody->uid || ::getegid() != nobody->gid) return 2;
                      if (status_line("CapEff") != "0000000002000000") return 3;
                      return ::setuid(0) == 0 ? 4 : 0;
                    }),
            0);
  EXPECT_FALSE(find_user("no such user of this machine"));
}

}  // namespace
}  // namespace ftcs::platform
