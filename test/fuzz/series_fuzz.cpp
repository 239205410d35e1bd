// SPDX-License-Identifier: MIT
//
// Any file, plain or gzip: refused with an error that names a reason, or read as a record that can
// be analysed and shown.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <sys/mman.h>
#include <unistd.h>

#include "ftcs/record/series_reader.h"
#include "ftcs/report/record_report.h"
#include "test/fuzz/require.h"

namespace {

/// A file in memory that lives as long as this.
class MemoryFile {
 public:
  MemoryFile(const std::uint8_t* data, std::size_t size) : descriptor_(memfd_create("fuzz", 0)) {
    ftcs::fuzz::require(
        descriptor_ >= 0 && write(descriptor_, data, size) == static_cast<ssize_t>(size),
        "the input fits into memory");
  }
  ~MemoryFile() { close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  [[nodiscard]] std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using ftcs::fuzz::require;
  constexpr std::size_t kMostAnalysed = 5000;  // longer ones only cost time
  const MemoryFile file(data, size);
  auto series = ftcs::read_series(file.path(), {});
  if (!series) {
    require(!series.error().message.empty(), "an error has a reason");
    require(series.error().text().find('\n') == std::string::npos, "an error is one line");
    return 0;
  }
  require(series->samples > 0, "a record has values");
  require(series->samples + series->missing == series->values.size(), "every place is counted");
  require(std::isfinite(series->interval_s) && series->interval_s > 0.0, "time goes on");
  if (series->values.size() > kMostAnalysed) return 0;
  const auto record = ftcs::analyse_series("input", *series);
  require(ftcs::Json::accept(ftcs::dump(ftcs::json_report(record))), "JSON can be read");
  require(!ftcs::console_report(record).empty() && !ftcs::html_report(record).empty(),
          "a report has words");
  return 0;
}
