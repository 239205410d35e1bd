// SPDX-License-Identifier: MIT
// World: children of this process, each confined in its own way.
#include "ftcs/platform/confinement.h"

#include <csignal>
#include <fstream>
#include <functional>
#include <linux/capability.h>
#include <string>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
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
