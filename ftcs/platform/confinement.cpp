// SPDX-License-Identifier: MIT
#include "ftcs/platform/confinement.h"

#include <algorithm>
#include <array>
#include <cap-ng.h>
#include <cerrno>
#include <initializer_list>
#include <linux/sched.h>
#include <pwd.h>
#include <seccomp.h>
#include <span>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <system_error>
#include <unistd.h>

namespace ftcs::platform {
namespace {

using Calls = std::initializer_list<const char*>;

// Names that an architecture does not have are passed over.
constexpr Calls kEveryProgram = {
    "read",
    "write",
    "readv",
    "writev",
    "pread64",
    "pwrite64",
    "close",
    "lseek",
    "fstat",
    "newfstatat",
    "statx",
    "fcntl",
    "ioctl",
    "dup",
    "dup2",
    "dup3",
    "poll",
    "ppoll",
    "select",
    "pselect6",
    "mmap",
    "munmap",
    "mremap",
    "mprotect",
    "madvise",
    "brk",
    "futex",
    "rt_sigaction",
    "rt_sigprocmask",
    "rt_sigreturn",
    "sigaltstack",
    "restart_syscall",
    "exit",
    "exit_group",
    "clock_gettime",
    "clock_getres",
    "clock_nanosleep",
    "nanosleep",
    "gettimeofday",
    "time",
    "getpid",
    "gettid",
    "getuid",
    "geteuid",
    "getgid",
    "getegid",
    "getgroups",
    "tgkill",
    "getrandom",
    "sched_yield",
    "getcpu",
    "rseq",
    "uname",
    "sysinfo",
    "prlimit64",
    "getrlimit",
    "getrusage",
    "sched_getaffinity",
    "pipe2",
    "eventfd2",
    "timerfd_create",
    "timerfd_settime",
    "timerfd_gettime",
};
constexpr Calls kFiles = {
    "open",       "openat",    "openat2",    "access", "faccessat", "faccessat2", "readlink",
    "readlinkat", "unlink",    "unlinkat",   "rename", "renameat",  "renameat2",  "link",
    "linkat",     "mkdir",     "mkdirat",    "rmdir",  "stat",      "lstat",      "ftruncate",
    "fsync",      "fdatasync", "getdents64", "chmod",  "fchmod",    "fchmodat",   "chown",
    "fchown",     "fchownat",  "flock",      "umask",  "getcwd",    "statfs",     "fstatfs",
    "fallocate",  "utimensat",
};
constexpr Calls kNetwork = {
    "socket",      "socketpair", "bind",       "connect",  "listen",   "getsockname",
    "getpeername", "setsockopt", "getsockopt", "sendto",   "recvfrom", "sendmsg",
    "recvmsg",     "sendmmsg",   "recvmmsg",   "shutdown",
};
constexpr Calls kSharedMemory = {"shmget", "shmat", "shmdt", "shmctl"};
constexpr Calls kSteering = {"clock_adjtime", "adjtimex", "clock_settime"};
constexpr Calls kRealTime = {
    "mlockall",
    "munlockall",
    "mlock",
    "munlock",
    "sched_setscheduler",
    "sched_getscheduler",
    "sched_setparam",
    "sched_getparam",
    "sched_setattr",
    "sched_setaffinity",
    "sched_get_priority_max",
    "sched_get_priority_min",
    "setpriority",
};
constexpr Calls kThreads = {"set_robust_list", "set_tid_address", "membarrier"};
constexpr Calls kServer = {"accept",    "accept4",    "epoll_create1",
                           "epoll_ctl", "epoll_wait", "epoll_pwait"};
/// What the same calls are called where a word has 32 bits. Not socketcall and ipc, which stand for
/// many: libseccomp allows them with the arguments of those that are on the lists.
constexpr Calls kOf32Bits = {
    "mmap2",
    "fstat64",
    "stat64",
    "lstat64",
    "fstatat64",
    "fcntl64",
    "_llseek",
    "ftruncate64",
    "statfs64",
    "fstatfs64",
    "ugetrlimit",
    "getuid32",
    "geteuid32",
    "getgid32",
    "getegid32",
    "getgroups32",
    "_newselect",
    "sigreturn",
    "set_tls",
    "cacheflush",
    "clock_gettime64",
    "clock_getres_time64",
    "clock_nanosleep_time64",
    "futex_time64",
    "ppoll_time64",
    "pselect6_time64",
    "timerfd_settime64",
    "timerfd_gettime64",
    "recvmmsg_time64",
    "utimensat_time64",
};
constexpr Calls kSteeringOf32Bits = {"clock_adjtime64", "clock_settime64"};

constexpr Calls kChangeOfUser = {"setuid",      "setgid",      "setresuid",   "setresgid",
                                 "setgroups",   "capget",      "capset",      "getresuid",
                                 "getresgid",   "setuid32",    "setgid32",    "setresuid32",
                                 "setresgid32", "setgroups32", "getresuid32", "getresgid32"};

Calls calls_of(SystemCalls kind) {
  switch (kind) {
    case SystemCalls::kFiles:
      return kFiles;
    case SystemCalls::kNetwork:
      return kNetwork;
    case SystemCalls::kSharedMemory:
      return kSharedMemory;
    case SystemCalls::kSteering:
      return kSteering;
    case SystemCalls::kRealTime:
      return kRealTime;
    case SystemCalls::kThreads:
      return kThreads;
    case SystemCalls::kServer:
      break;
  }
  return kServer;
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kMayFilter = false;
#else
constexpr bool kMayFilter = true;
#endif

std::string failed(const char* what, int code) {
  return std::string(what) + ": " + std::generic_category().message(code);
}

class Filter {
 public:
  Filter() : context_(seccomp_init(SCMP_ACT_KILL_PROCESS)) {}
  ~Filter() { seccomp_release(context_); }
  Filter(const Filter&) = delete;
  Filter& operator=(const Filter&) = delete;

  void allow(Calls names) {
    for (const char* const name : names) {
      const int call = seccomp_syscall_resolve_name(name);
      if (call != __NR_SCMP_ERROR) keep(seccomp_rule_add(context_, SCMP_ACT_ALLOW, call, 0));
    }
  }
  void allow_names_of_threads() {
    for (const int option : {PR_SET_NAME, PR_GET_NAME, PR_SET_TIMERSLACK}) {
      allow_if(SCMP_SYS(prctl), {0, SCMP_CMP_EQ, static_cast<scmp_datum_t>(option), 0});
    }
  }
  void allow_change_of_user() {
    allow(kChangeOfUser);
    keep(seccomp_rule_add(context_, SCMP_ACT_ALLOW, SCMP_SYS(prctl), 0));
  }
  /// A thread of this process, no process: clone3 hides its flags, and glibc does without.
  void allow_threads() {
    allow(kThreads);
    allow_if(SCMP_SYS(clone), {0, SCMP_CMP_MASKED_EQ, CLONE_THREAD, CLONE_THREAD});
    keep(seccomp_rule_add(context_, SCMP_ACT_ERRNO(ENOSYS), SCMP_SYS(clone3), 0));
  }
  [[nodiscard]] std::optional<std::string> load() {
    keep(seccomp_load(context_));
    if (code_ == 0) return std::nullopt;
    return failed("the filter of system calls", -code_);
  }

 private:
  void allow_if(int call, const scmp_arg_cmp& first) {
    keep(seccomp_rule_add_array(context_, SCMP_ACT_ALLOW, call, 1, &first));
  }
  void keep(int code) {
    const bool known = code == -EEXIST || code == -EDOM;
    if (code < 0 && code_ == 0 && !known) code_ = code;
  }
  scmp_filter_ctx context_;
  int code_ = 0;
};

std::optional<std::string> load_filter(const Confinement& confinement) {
  Filter filter;
  filter.allow(kEveryProgram);
  if (sizeof(void*) == 4) filter.allow(kOf32Bits);
  for (const SystemCalls kind : confinement.calls) {
    if (kind == SystemCalls::kThreads) {
      filter.allow_threads();
    } else {
      filter.allow(calls_of(kind));
      if (kind == SystemCalls::kSteering) filter.allow(kSteeringOf32Bits);
    }
  }
  if (confinement.will_change_user) {
    filter.allow_change_of_user();
  } else {
    filter.allow_names_of_threads();
  }
  return filter.load();
}

/// Of those wanted, the ones that this process has: nobody can keep what he never had.
void choose(std::span<const int> capabilities) {
  capng_get_caps_process();
  std::vector<int> had;
  for (const int capability : capabilities) {
    const auto number = static_cast<unsigned>(capability);
    if (capng_have_capability(CAPNG_PERMITTED, number) != 0) had.push_back(capability);
  }
  capng_clear(CAPNG_SELECT_BOTH);
  for (const int capability : had) {
    capng_update(CAPNG_ADD,
                 static_cast<capng_type_t>(CAPNG_EFFECTIVE | CAPNG_PERMITTED | CAPNG_BOUNDING_SET),
                 static_cast<unsigned>(capability));
  }
}

/// Whether the process has a right that it is not to keep. Of what capng_get_caps_process() found.
bool has_more_than(std::span<const int> kept) {
  for (int capability = 0; capability <= CAP_LAST_CAP; ++capability) {
    const bool has = capng_have_capability(CAPNG_PERMITTED, static_cast<unsigned>(capability)) != 0;
    if (has && std::find(kept.begin(), kept.end(), capability) == kept.end()) return true;
  }
  return false;
}

std::optional<std::string> keep_capabilities(const Confinement& confinement) {
  std::vector<int> kept = confinement.capabilities;
  if (confinement.will_change_user) kept.insert(kept.end(), {CAP_SETUID, CAP_SETGID, CAP_SETPCAP});
  capng_get_caps_process();
  const bool bounds = capng_have_capability(CAPNG_EFFECTIVE, CAP_SETPCAP) != 0;
  // A service whose unit left it just these needs no call, and its unit may allow none.
  const bool gives_up = has_more_than(kept);
  choose(kept);
  if (bounds) (void)capng_apply(CAPNG_SELECT_BOUNDS);
  if (gives_up && capng_apply(CAPNG_SELECT_CAPS) != 0) {
    return failed("keeping few capabilities", errno);
  }
  // What a service manager made ambient is not handed on either.
  (void)::prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_CLEAR_ALL, 0, 0, 0);
  return std::nullopt;
}

}  // namespace

std::optional<std::string> confine(const Confinement& confinement) {
  if (auto error = keep_capabilities(confinement)) return error;
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return failed("no new privileges", errno);
  if (!kMayFilter) return std::nullopt;
  if (confinement.most_memory > 0) {
    rlimit limit{};
    (void)::getrlimit(RLIMIT_DATA, &limit);
    limit.rlim_cur = std::min<rlim_t>(confinement.most_memory, limit.rlim_max);
    if (::setrlimit(RLIMIT_DATA, &limit) != 0) return failed("the limit of memory", errno);
  }
  return load_filter(confinement);
}

std::optional<User> find_user(const std::string& name) {
  const passwd* const found = ::getpwnam(name.c_str());
  if (found == nullptr) return std::nullopt;
  return User{name, found->pw_uid, found->pw_gid};
}

std::optional<std::string> become_user(const User& user, const std::vector<int>& capabilities) {
  choose(capabilities);
  const int code =
      capng_change_id(static_cast<int>(user.uid), static_cast<int>(user.gid), CAPNG_DROP_SUPP_GRP);
  if (code == 0) return std::nullopt;
  return "becoming user " + user.name + ": code " + std::to_string(code) + " of libcap-ng";
}

}  // namespace ftcs::platform
