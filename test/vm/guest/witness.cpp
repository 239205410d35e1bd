// SPDX-License-Identifier: MIT
// What a job inside the virtual machine needs to know of its clocks; see usage() for its commands.
// Runs in the guest alone.
#include <algorithm>
#include <arpa/inet.h>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iostream>
#include <linux/if_packet.h>
#include <linux/ptp_clock.h>
#include <map>
#include <net/ethernet.h>
#include <net/if.h>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <sys/socket.h>
#include <sys/timex.h>
#include <unistd.h>
#include <utility>
#include <vector>

namespace {

using Arguments = std::vector<std::string>;
constexpr auto kTruth = "/sys/kernel/debug/vptp/truth";

[[noreturn]] void usage() {
  std::cerr << R"(usage:
  witness truth SECONDS INTERVAL        vptp's truth, a line every INTERVAL seconds
  witness annotate                      each line of standard input, behind the truth at its arrival
  witness busy SECONDS                  keeps a processor busy
  witness system [reset]                what the kernel says of CLOCK_REALTIME; its own rate, not synchronised, no leap second
  witness forge DEVICE OFFSET FLAGS COUNT
      COUNT Announces behind the next one that DEVICE sends, as if from the same port, with this UTC offset (s) and the second octet of the flags
      (hexadecimal: 1 leap61, 2 leap59, 4 the offset is valid, 8 PTP timescale), 50 ms apart
  witness judge FILE A-B [limit=V ...]  A minus B in a file of the truth, ns. A, B: real, phc0, phc1, ...
      target=NS  what A - B should be (0)      band=NS   of the lock (100)
      lock=S     within the band from so many seconds on, or never: failed
      from=S     where rms and worst are counted from (half of the time)   until=S
      rms=NS     greatest RMS   sd=NS   greatest spread   drift=PPB   greatest change of the error
      worst=NS   greatest error from `from` on             peak=NS    at any time
  witness sigma FILE A-B [target=NS] [from=S] [share=PERCENT]
      how often the error is within three times the offset_sigma_ns that --csv stated in an annotated file,
      plus what the stated correction of the rate brings until the truth is read
)";
  std::exit(2);
}

double seconds(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

std::optional<std::string> find_truth() {
  std::ifstream file(kTruth);
  std::string line;
  return std::getline(file, line) ? std::optional(line) : std::nullopt;
}

std::string read_truth() {
  const auto line = find_truth();
  if (!line) throw std::runtime_error(std::string("cannot read ") + kTruth);
  return *line;
}

int truth(const Arguments& arguments) {
  if (arguments.size() != 2) usage();
  const double interval = std::stod(arguments[1]);
  const double start = seconds(CLOCK_MONOTONIC_RAW);
  const double end = start + std::stod(arguments[0]);
  for (double now = start; now < end; now = seconds(CLOCK_MONOTONIC_RAW)) {
    std::puts(read_truth().c_str());
    std::fflush(stdout);
    usleep(static_cast<useconds_t>(interval * 1e6));
  }
  return 0;
}

int annotate() {
  for (std::string line; std::getline(std::cin, line);) {
    const auto truth = find_truth();
    if (truth) std::cout << *truth << " | " << line << std::endl;  // else the device is gone
  }
  return 0;
}

int busy(const Arguments& arguments) {
  if (arguments.size() != 1) usage();
  const double end = seconds(CLOCK_MONOTONIC_RAW) + std::stod(arguments[0]);
  volatile unsigned work = 0;
  while (seconds(CLOCK_MONOTONIC_RAW) < end) {
    for (unsigned i = 0; i < 10000; ++i) work = work + i;
  }
  return 0;
}

int system_clock(const Arguments& arguments) {
  timex t{};
  if (arguments == Arguments{"reset"}) {
    t.modes = ADJ_FREQUENCY | ADJ_TICK | ADJ_STATUS | ADJ_TAI;
    t.tick = 1000000 / sysconf(_SC_CLK_TCK);
    t.status = STA_UNSYNC;
    return clock_adjtime(CLOCK_REALTIME, &t) < 0 ? 1 : 0;
  }
  const int state = clock_adjtime(CLOCK_REALTIME, &t);
  std::printf(
      "state=%d unsynchronised=%d freq_ppb=%.3f tick=%ld maxerror_us=%ld esterror_us=%ld tai=%d "
      "pending=%s\n",
      state, (t.status & STA_UNSYNC) != 0, static_cast<double>(t.freq) / 65.536, t.tick, t.maxerror,
      t.esterror, t.tai,
      (t.status & STA_INS) != 0   ? "insert"
      : (t.status & STA_DEL) != 0 ? "delete"
                                  : "none");
  return 0;
}

// IEEE 1588-2019, 13.5 and tables 36, 37, 43, behind the Ethernet header.
namespace announce {
constexpr std::size_t kType = 14, kFlags = 14 + 7, kSequence = 14 + 30, kUtcOffset = 14 + 44;
constexpr std::size_t kLength = 14 + 64;
constexpr unsigned kAnnounce = 0xB;
}  // namespace announce

int open_packets(const char* device) {
  const int packets = socket(AF_PACKET, SOCK_RAW, htons(ETH_P_ALL));  // what is sent is seen too
  sockaddr_ll address{};
  address.sll_family = AF_PACKET;
  address.sll_protocol = htons(ETH_P_ALL);
  address.sll_ifindex = static_cast<int>(if_nametoindex(device));
  if (packets < 0 || address.sll_ifindex == 0 ||
      bind(packets, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    throw std::runtime_error(std::string("cannot listen on ") + device);
  }
  return packets;
}

using Frame = std::array<std::uint8_t, announce::kLength>;

Frame next_announce(int packets) {
  Frame frame{};
  for (;;) {
    const auto length = recv(packets, frame.data(), frame.size(), MSG_TRUNC);
    if (length < 0) throw std::runtime_error("cannot receive");
    const bool ptp = frame[12] == 0x88 && frame[13] == 0xF7;
    if (ptp && length >= static_cast<ssize_t>(frame.size()) &&
        (frame[announce::kType] & 0xFU) == announce::kAnnounce) {
      return frame;
    }
  }
}

void put_u16(Frame& frame, std::size_t at, unsigned value) {
  frame[at] = static_cast<std::uint8_t>(value >> 8U);
  frame[at + 1] = static_cast<std::uint8_t>(value);
}

int forge(const Arguments& arguments) {
  if (arguments.size() != 4) usage();
  const int packets = open_packets(arguments[0].c_str());
  Frame frame = next_announce(packets);
  const unsigned sequence = frame[announce::kSequence] * 256U + frame[announce::kSequence + 1];
  put_u16(frame, announce::kUtcOffset, static_cast<unsigned>(std::stoi(arguments[1])));
  frame[announce::kFlags] = static_cast<std::uint8_t>(std::stoul(arguments[2], nullptr, 16));
  for (unsigned i = 1; i <= std::stoul(arguments[3]); ++i) {
    put_u16(frame, announce::kSequence, sequence + i);
    if (send(packets, frame.data(), frame.size(), 0) < 0) throw std::runtime_error("cannot send");
    usleep(50'000);
  }
  return 0;
}

// A-B, and what else is wanted of it.
struct Question {
  std::string a, b;
  std::map<std::string, double> wanted;

  std::optional<double> find(const std::string& name) const {
    const auto found = wanted.find(name);
    return found == wanted.end() ? std::nullopt : std::optional(found->second);
  }
  double get(const std::string& name, double otherwise) const {
    return find(name).value_or(otherwise);
  }
};

Question parse_question(const Arguments& arguments, const std::vector<std::string_view>& known) {
  if (arguments.size() < 2) usage();
  Question question;
  const auto dash = arguments[1].find('-');
  if (dash == std::string::npos) usage();
  question.a = arguments[1].substr(0, dash);
  question.b = arguments[1].substr(dash + 1);
  for (std::size_t i = 2; i < arguments.size(); ++i) {
    const auto equals = arguments[i].find('=');
    const std::string name = arguments[i].substr(0, equals);
    if (equals == std::string::npos || std::ranges::find(known, name) == known.end()) usage();
    question.wanted[name] = std::stod(arguments[i].substr(equals + 1));
  }
  return question;
}

struct Point {
  double time;       // s since the first line
  double error;      // ns
  std::string rest;  // of an annotated line
};

std::int64_t field(const std::map<std::string, std::int64_t>& fields, const std::string& name) {
  const auto found = fields.find(name);
  if (found == fields.end()) throw std::runtime_error("the truth has no clock " + name);
  return found->second;
}

std::vector<Point> read_points(const std::string& path, const Question& question) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot read " + path);
  std::vector<Point> points;
  std::optional<std::int64_t> start;
  for (std::string line; std::getline(file, line);) {
    const auto bar = line.find(" | ");
    std::istringstream words(line.substr(0, bar));
    std::map<std::string, std::int64_t> fields;
    std::string name;
    for (std::int64_t value = 0; words >> name >> value;) fields[name] = value;
    if (!start) start = field(fields, "raw");
    const std::int64_t difference = field(fields, question.a) - field(fields, question.b) -
                                    static_cast<std::int64_t>(question.get("target", 0));
    points.push_back({1e-9 * static_cast<double>(field(fields, "raw") - *start),
                      static_cast<double>(difference),
                      bar == std::string::npos ? "" : line.substr(bar + 3)});
  }
  if (points.empty()) throw std::runtime_error(path + " is empty");
  return points;
}

struct Verdict {
  bool good = true;

  void say(const char* name, double value, std::optional<double> limit) {
    std::printf(" %s=%.1f", name, value);
    if (!limit) return;
    std::printf("(limit %g)", *limit);
    if (!(value <= *limit)) good = false;
  }
};

// The time from which on the error stays in the band until the end; infinity if it does not.
double lock_time(const std::vector<Point>& points, double band, double until) {
  double lock = std::numeric_limits<double>::infinity();
  for (const Point& point : points) {
    if (point.time > until) break;
    if (std::abs(point.error) > band)
      lock = std::numeric_limits<double>::infinity();
    else if (std::isinf(lock))
      lock = point.time;
  }
  return lock;
}

int judge(const Arguments& arguments) {
  const Question question = parse_question(arguments, {"target", "band", "lock", "from", "until",
                                                       "rms", "sd", "drift", "worst", "peak"});
  const std::vector<Point> points = read_points(arguments[0], question);
  const double until = question.get("until", points.back().time);
  const double from = question.get("from", until / 2);
  double squares = 0, sum = 0, worst = 0, peak = 0;
  const Point *first = nullptr, *last = nullptr;
  int count = 0;
  for (const Point& point : points) {
    if (point.time > until) break;
    peak = std::max(peak, std::abs(point.error));
    if (point.time < from) continue;
    ++count;
    if (first == nullptr) first = &point;
    last = &point;
    sum += point.error;
    squares += point.error * point.error;
    worst = std::max(worst, std::abs(point.error));
  }
  if (count == 0)
    throw std::runtime_error(arguments[0] + " ends before " + std::to_string(from) + " s");
  Verdict verdict;
  verdict.say("lock", lock_time(points, question.get("band", 100), until), question.find("lock"));
  const double mean = sum / count;
  const double time = last->time - first->time;
  verdict.say("mean", mean, {});
  verdict.say("sd", std::sqrt(std::max(0.0, squares / count - mean * mean)), question.find("sd"));
  verdict.say("drift", time > 0 ? std::abs(last->error - first->error) / time : 0,
              question.find("drift"));
  verdict.say("rms", std::sqrt(squares / count), question.find("rms"));
  verdict.say("worst", worst, question.find("worst"));
  verdict.say("peak", peak, question.find("peak"));
  std::printf(" seconds=%.0f\n", until);
  return verdict.good ? 0 : 1;
}

using Words = std::vector<std::string>;

Words split(const std::string& line) {
  Words words;
  std::istringstream stream(line);
  for (std::string word; std::getline(stream, word, ',');) words.push_back(word);
  return words;
}

struct Statement {
  double offset_sigma = 0;  ///< ns
  double correction = 0;    ///< applied rate beyond the tracked one, ppb = ns/s
};

std::optional<double> value(const Words& header, const Words& words, std::string_view name) {
  const auto found = std::ranges::find(header, name);
  const auto column = static_cast<std::size_t>(found - header.begin());
  if (found == header.end() || column >= words.size() || words[column].empty()) return std::nullopt;
  return std::stod(words[column]);
}

std::optional<Statement> statement(const Words& header, const Words& words) {
  const auto sigma = value(header, words, "offset_sigma_ns");
  if (!sigma) return std::nullopt;
  const auto applied = value(header, words, "applied_rate_ppb");
  const auto tracked = value(header, words, "tracking_rate_ppb");
  return Statement{*sigma, applied && tracked ? *applied - *tracked : 0};
}

int sigma(const Arguments& arguments) {
  const Question question = parse_question(arguments, {"target", "from", "share"});
  const std::vector<Point> points = read_points(arguments[0], question);
  Words header;
  double before = 0;
  int count = 0, within = 0;
  for (const Point& point : points) {
    const auto words = split(point.rest);
    const double since = point.time - std::exchange(before, point.time);
    if (header.empty()) {
      if (std::ranges::find(words, "offset_sigma_ns") != words.end()) header = words;
      continue;
    }
    const auto stated = statement(header, words);
    if (!stated || point.time < question.get("from", 0)) continue;
    ++count;
    // A reading of the truth is whole nanoseconds, and comes later than the estimate whose
    // deviation is stated: the clock has run by the rate that was to correct it.
    const double on_its_way = std::abs(stated->correction) * since;
    if (std::abs(point.error) <= 3 * stated->offset_sigma + 1 + on_its_way) ++within;
  }
  if (count == 0) throw std::runtime_error(arguments[0] + ": no offset_sigma_ns was stated");
  const double outside = 100.0 * (count - within) / count;
  std::printf(" stated=%d beyond_3_sigma=%.1f%%\n", count, outside);
  // One of fewer than a hundred tells nothing.
  return count - within <= 1 || outside <= 100 - question.get("share", 99) ? 0 : 1;
}

int run(const std::string& command, const Arguments& arguments) {
  if (command == "truth") return truth(arguments);
  if (command == "annotate") return annotate();
  if (command == "busy") return busy(arguments);
  if (command == "system") return system_clock(arguments);
  if (command == "forge") return forge(arguments);
  if (command == "judge") return judge(arguments);
  if (command == "sigma") return sigma(arguments);
  usage();
}

}  // namespace

int main(int count, char** values) {
  if (count < 2) usage();
  try {
    return run(values[1], Arguments(values + 2, values + count));
  } catch (const std::exception& error) {
    std::cerr << "witness: " << error.what() << '\n';
    return 2;
  }
}
