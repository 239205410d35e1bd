// SPDX-License-Identifier: MIT
#include "ftcs/experiment/servo_library.h"

#include <cstdint>
#include <cstdlib>
#include <dlfcn.h>
#include <filesystem>
#include <stdexcept>

#include <fmt/format.h>

namespace ftcs::experiment {
namespace {

using Entry = decltype(&ftcs_servo_entry);

[[noreturn]] void fail(const std::string& path, const std::string& why) {
  throw std::runtime_error(fmt::format("--servo {}: {}", path, why));
}

template <class Function>
Function symbol(void* library, const char* name) {
  return reinterpret_cast<Function>(dlsym(library, name));
}

void enter_library(const std::string& path, ftcs_servo_functions& functions) {
  // An absolute path: a bare name would be looked for among the system's libraries.
  const std::string file = std::filesystem::absolute(path);
  void* library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) fail(path, fmt::format("not a shared library: {}", dlerror()));
  const auto entry = symbol<Entry>(library, "ftcs_servo_entry");
  if (entry == nullptr) fail(path, "exports no ftcs_servo_entry(), see ftcs_servo_plugin.h");
  if (const auto refused = entry(FTCS_SERVO_ABI, &functions); refused != 0) {
    fail(path, fmt::format("its ftcs_servo_entry() refuses interface version {} (it returned {})",
                           FTCS_SERVO_ABI, refused));
  }
}

/// An interpreter of this process, without its headers: four functions of its stable ABI.
class Python {
 public:
  explicit Python(const std::string& path) {
    library_ = open();
    if (library_ == nullptr) {
      fail(path, "no libpython3 here to run it (Debian: libpython3.11; FTCS_LIBPYTHON names one)");
    }
    symbol<void (*)(int)>(library_, "Py_InitializeEx")(0);  // 0: our Ctrl-C stays ours
  }

  [[nodiscard]] bool run(const std::string& code) const {
    return symbol<int (*)(const char*, void*)>(library_, "PyRun_SimpleStringFlags")(code.c_str(),
                                                                                    nullptr) == 0;
  }
  /// From here on any thread may enter through a ctypes callback.
  void release() const { symbol<void* (*)()>(library_, "PyEval_SaveThread")(); }

 private:
  static void* open() {
    constexpr int kFlags = RTLD_NOW | RTLD_GLOBAL;  // extension modules need its symbols
    if (const char* named = std::getenv("FTCS_LIBPYTHON")) return dlopen(named, kFlags);
    constexpr int kNewest = 20;
    constexpr int kOldest = 8;
    for (int minor = kNewest; minor >= kOldest; --minor) {
      const std::string name = fmt::format("libpython3.{}.so.1.0", minor);
      if (void* library = dlopen(name.c_str(), kFlags)) return library;
    }
    return nullptr;
  }

  void* library_ = nullptr;
};

/// A quoted Python string whatever octets the path has.
std::string python_path(const std::string& path) {
  std::string digits;
  for (const char c : path) digits += fmt::format("{:02x}", static_cast<unsigned char>(c));
  return fmt::format("__import__('os').fsdecode(bytes.fromhex('{}'))", digits);
}

void enter_script(const std::string& path, ftcs_servo_functions& functions) {
  if (!std::filesystem::is_regular_file(path)) fail(path, "no such file");
  static bool started = false;
  if (started) fail(path, "one Python script at a time: a process has one interpreter");
  started = true;
  const Python python(path);
  // What the script made is kept: its callbacks must live as long as the program.
  int refused = 1;
  const std::string code = fmt::format(
      "import ctypes, os, runpy, sys, threading, traceback\n"
      "ftcs_first = threading.Lock()\n"
      // Else Python drops what a callback raises, and the run would go on without a servo. Seeds
      // run in threads of their own: the first one that fails speaks and ends all, the others wait.
      "def ftcs_raised(what):\n"
      "    ftcs_first.acquire()\n"
      "    traceback.print_exception(what.exc_type, what.exc_value, what.exc_traceback)\n"
      "    print(f'ftcs: --servo {{ftcs_path}}: raised in a callback; no result', "
      "file=sys.stderr)\n"
      "    sys.stderr.flush()\n"
      "    os._exit(1)\n"
      "ftcs_path = {}\n"
      "sys.unraisablehook = ftcs_raised\n"
      "try:\n"
      "    ftcs_kept = runpy.run_path(ftcs_path, run_name='ftcs_servo')\n"
      "    ftcs_refused = ftcs_kept['ftcs_servo_entry']({}, {})\n"
      "    ctypes.c_int.from_address({}).value = 1 if ftcs_refused else 0\n"
      "except BaseException:\n"
      "    traceback.print_exc()\n",
      python_path(path), FTCS_SERVO_ABI, reinterpret_cast<std::uintptr_t>(&functions),
      reinterpret_cast<std::uintptr_t>(&refused));
  if (!python.run(code) || refused != 0) {
    fail(path, fmt::format("its ftcs_servo_entry({}, address) failed or is not there; Python's own "
                           "words stand above",
                           FTCS_SERVO_ABI));
  }
  python.release();
}

}  // namespace

bool ServoLibrary::is_path(const std::string& servo) {
  return servo.find('/') != std::string::npos || servo.ends_with(".so") || servo.ends_with(".py");
}

ServoLibrary::ServoLibrary(const std::string& path) {
  if (path.ends_with(".py")) {
    enter_script(path, functions_);
  } else {
    enter_library(path, functions_);
  }
  check(path);
  name_ =
      functions_.name != nullptr ? functions_.name : std::filesystem::path(path).stem().string();
}

void ServoLibrary::check(const std::string& path) const {
  if (functions_.abi != FTCS_SERVO_ABI) {
    fail(path, fmt::format("made for version {} of ftcs_servo_plugin.h, this program has {}",
                           functions_.abi, FTCS_SERVO_ABI));
  }
  if (functions_.create == nullptr || functions_.destroy == nullptr ||
      functions_.reset == nullptr || functions_.update == nullptr) {
    fail(path, "its table needs create, destroy, reset and update");
  }
}

void ServoLibrary::add(const ExternalTally& tally) const noexcept {
  messages_ += tally.messages;
  commands_ += tally.commands;
  unsound_ += tally.unsound;
}

std::string ServoLibrary::doubt() const {
  if (unsound_ > 0) {
    return fmt::format(
        "{}: expected finite commands with a correction time of at least 0, {} of {} "
        "were not and were not obeyed",
        name_, unsound_.load(), unsound_ + commands_);
  }
  if (messages_ == 0 || commands_ > 0) return {};
  return fmt::format("{}: gave no command in {} messages, its clock ran free", name_,
                     messages_.load());
}

ServoInstance::~ServoInstance() {
  if (tally_) library_->add(*tally_);
}

ServoInstance::ServoInstance(const ServoLibrary& library, const ServoConfig& common)
    : library_(&library), instance_(nullptr, library.functions().destroy) {
  const auto& delay = common.two_way.fixed_path_delay;
  const ftcs_servo_setup setup{
      common.sync_interval.count(), common.limits.slowest.ppb(), common.limits.fastest.ppb(),
      delay ? static_cast<double>(delay->count()) : ServoSnapshot::kUnknown};
  instance_.reset(library.functions().create(&setup));
  if (!instance_) fail(library.name(), "its create() made no servo");
}

}  // namespace ftcs::experiment
