// SPDX-License-Identifier: MIT
//
// The world: a socket and a shared-memory segment of this process. Layouts and signs as chronyd and
// ntpd read them: reference = system + offset.
#include "ftcs/platform/ntp_feed.h"

#include <cstring>
#include <sys/shm.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "ftcs/platform/local_socket.h"

namespace ftcs::platform {
namespace {

constexpr std::int64_t kNow = 1'795'299'184'123'456'789;

template <class T>
T read(const std::uint8_t* bytes, std::size_t offset) {
  T value{};
  std::memcpy(&value, bytes + offset, sizeof value);
  return value;
}

TEST(ChronySock, TheDatagramHasChronysLayout) {
  const auto bytes = ChronySocket::encode({kNow, Nanoseconds{-1500}, -1, 1e-7});
  EXPECT_EQ(read<std::int64_t>(bytes.data(), 0), kNow / 1'000'000'000);
  EXPECT_EQ(read<std::int64_t>(bytes.data(), 8), 123'456);
  EXPECT_DOUBLE_EQ(read<double>(bytes.data(), 16), -1.5e-6);
  EXPECT_EQ(read<int>(bytes.data(), 24), 0);                // no pulse
  EXPECT_EQ(read<int>(bytes.data(), 28), 2);                // a second less
  EXPECT_EQ(std::memcmp(bytes.data() + 36, "KCOS", 4), 0);  // 0x534f434b, little-endian
}

TEST(ChronySock, ASystemClockThatIsBehindHasAPositiveOffset) {
  EXPECT_GT(read<double>(ChronySocket::encode({kNow, Nanoseconds{10}}).data(), 16), 0.0);
  EXPECT_LT(read<double>(ChronySocket::encode({kNow, Nanoseconds{-10}}).data(), 16), 0.0);
}

TEST(ChronySock, LeapsHaveNtpsNumbers) {
  for (const auto& [leap, indicator] : {std::pair{0, 0}, {1, 1}, {-1, 2}}) {
    EXPECT_EQ(read<int>(ChronySocket::encode({kNow, {}, leap}).data(), 28), indicator);
  }
}

TEST(ChronySock, ArrivesAndSurvivesTheReader) {
  auto reader = LocalSocket::client();
  ASSERT_TRUE(reader.ok());
  const std::string path = reader->path();
  auto writer = ChronySocket::open(path);
  ASSERT_TRUE(writer.ok());
  EXPECT_FALSE(writer->send({kNow, Nanoseconds{5}}).has_value());
  const auto datagram = reader->receive();
  ASSERT_TRUE(datagram.has_value());
  EXPECT_EQ(datagram->bytes.size(), 40U);
  { auto gone = std::move(*reader); }
  EXPECT_TRUE(writer->send({kNow, Nanoseconds{5}}).has_value());
  EXPECT_FALSE(ChronySocket::open(std::string(300, 'x')).ok());
}

TEST(NtpPrecision, IsTheNextPowerOfTwo) {
  EXPECT_EQ(ntp_precision(1e-6), -19);   // 1.9 us
  EXPECT_EQ(ntp_precision(1e-9), -29);   // 1.9 ns
  EXPECT_EQ(ntp_precision(1e-12), -30);  // no better than a nanosecond
  EXPECT_EQ(ntp_precision(0.5), -1);
  EXPECT_EQ(ntp_precision(100.0), 0);
  EXPECT_EQ(ntp_precision(0.0), 0);
  EXPECT_EQ(ntp_precision(std::nan("")), 0);
}

TEST(NtpSharedMemory, HasNtpdsLayout) {
  const int unit = 100 + static_cast<int>(::getpid() % 150);
  {
    auto shm = NtpShm::open(unit);
    ASSERT_TRUE(shm.ok());
    shm->write({kNow, Nanoseconds{-123'456'790}, 1, 3e-7});
    const int id = ::shmget(0x4e545030 + unit, 96, 0);
    ASSERT_GE(id, 0);
    const auto* const bytes = static_cast<const std::uint8_t*>(::shmat(id, nullptr, SHM_RDONLY));
    EXPECT_EQ(read<int>(bytes, 0), 1);                                  // mode
    EXPECT_EQ(read<int>(bytes, 4) % 2, 0);                              // nothing is being written
    EXPECT_EQ(read<std::int64_t>(bytes, 8), kNow / 1'000'000'000 - 1);  // reference
    EXPECT_EQ(read<int>(bytes, 16), 999'999);
    EXPECT_EQ(read<std::int64_t>(bytes, 24), kNow / 1'000'000'000);  // system clock
    EXPECT_EQ(read<int>(bytes, 32), 123'456);
    EXPECT_EQ(read<int>(bytes, 36), 1);    // leap
    EXPECT_EQ(read<int>(bytes, 40), -21);  // 477 ns
    EXPECT_EQ(read<int>(bytes, 48), 1);    // valid
    EXPECT_EQ(read<unsigned>(bytes, 52), 999'999'999U);
    EXPECT_EQ(read<unsigned>(bytes, 56), 123'456'789U);
    const int count = read<int>(bytes, 4);
    shm->write({kNow, {}, 0, 3e-7});
    EXPECT_EQ(read<int>(bytes, 4), count + 2);
    { auto closed = std::move(*shm); }
    EXPECT_EQ(read<int>(bytes, 48), 0);  // who stops takes the last sample with him
    ::shmdt(bytes);
    ::shmctl(id, IPC_RMID, nullptr);
  }
}

}  // namespace
}  // namespace ftcs::platform
