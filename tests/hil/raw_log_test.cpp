#include "hil/raw_log.h"

#include <algorithm>
#include <csignal>
#include <cstring>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/support/temp_file.h"

namespace {

using engine::Duration;
using hil::RawLog;
using hil::RawLogReader;
using hil::RawRecord;
using test_support::TempFile;

using Bytes = std::vector<std::byte>;

struct Stored {
  std::uint32_t type;
  Bytes payload;
  friend bool operator==(const Stored&, const Stored&) = default;
};

/// Record `i` of all logs here: its type, length and bytes follow from its number.
Stored make_stored(std::uint32_t i) {
  std::minstd_rand random(i + 1);
  Bytes payload(random() % 40 + (i % 7 == 3 ? 0 : 8));
  for (std::byte& b : payload) b = static_cast<std::byte>(random());
  return {i % 5, payload};
}

const Stored& stored(std::uint32_t i) {
  static std::vector<Stored> all;
  while (all.size() <= i) all.push_back(make_stored(static_cast<std::uint32_t>(all.size())));
  return all[i];
}

engine::Status append(RawLog& log, std::uint32_t i) {
  const Stored& record = stored(i);
  const std::span<const std::byte> payload(record.payload);
  // In two parts, at a place that changes.
  const std::size_t cut = payload.size() * (i % 4) / 3;
  return log.append(record.type, payload.first(cut), payload.subspan(cut));
}

void write_log(const std::string& path, std::uint32_t records) {
  RawLog log(path, Duration{});
  for (std::uint32_t i = 0; i < records; ++i) ASSERT_TRUE(append(log, i).ok());
}

struct Read {
  std::uint64_t records = 0;
  std::uint64_t offset = 0;
  const char* fault = nullptr;
  bool right = true;  ///< each record was the one that was written
};
Read read_log(const std::string& path) {
  RawLogReader reader(path);
  Read out;
  for (RawRecord record; reader.next(record); ++out.records) {
    const Stored& expected = stored(static_cast<std::uint32_t>(out.records));
    out.right = out.right && record.type == expected.type &&
                std::ranges::equal(record.payload, expected.payload);
  }
  EXPECT_EQ(reader.records(), out.records);
  out.offset = reader.offset();
  out.fault = reader.fault();
  return out;
}

std::string content_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void put(const std::string& path, std::string_view content) {
  std::ofstream(path, std::ios::binary) << content;
}

/// Where record `i` begins.
std::vector<std::uint64_t> starts(std::uint32_t records) {
  std::vector<std::uint64_t> at{0};
  for (std::uint32_t i = 0; i < records; ++i)
    at.push_back(at.back() + hil::kRecordHeaderBytes + stored(i).payload.size() +
                 hil::kRecordChecksumBytes);
  return at;
}

TEST(RawLog, EveryRecordComesBackInOrder) {
  const TempFile file("log.slog");
  write_log(file.path(), 300);
  const Read read = read_log(file.path());
  EXPECT_EQ(read.records, 300U);
  EXPECT_EQ(read.offset, content_of(file.path()).size());
  EXPECT_EQ(read.offset, starts(300).back());
  EXPECT_EQ(read.fault, nullptr);
  EXPECT_TRUE(read.right);
}

TEST(RawLog, CutAnywhereItGivesTheWholeRecordsBefore) {
  const TempFile file("log.slog");
  constexpr std::uint32_t kRecords = 40;
  write_log(file.path(), kRecords);
  const auto at = starts(kRecords);
  std::uint64_t whole = kRecords;
  for (std::uint64_t size = at.back() + 1; size-- > 0;) {
    ASSERT_EQ(::truncate(file.path().c_str(), static_cast<off_t>(size)), 0);
    if (size < at[whole]) --whole;
    const Read read = read_log(file.path());
    ASSERT_EQ(read.records, whole) << size;
    ASSERT_EQ(read.offset, at[whole]) << size;
    ASSERT_EQ(read.fault == nullptr, size == at[whole]) << size;
    ASSERT_TRUE(read.right) << size;
  }
  EXPECT_EQ(whole, 0U);
}

TEST(RawLog, ABitFlippedAnywhereEndsItBeforeThatRecord) {
  const TempFile file("log.slog");
  constexpr std::uint32_t kRecords = 40;
  write_log(file.path(), kRecords);
  const std::uint64_t bytes = content_of(file.path()).size();
  const auto at = starts(kRecords);
  const int log = ::open(file.path().c_str(), O_RDWR);
  ASSERT_GE(log, 0);
  std::mt19937_64 random(1);
  for (int flip = 0; flip < 10'000; ++flip) {
    const std::uint64_t bit = random() % (8 * bytes);
    const auto place = static_cast<off_t>(bit / 8);
    char byte = 0;
    ASSERT_EQ(::pread(log, &byte, 1, place), 1);
    const char wrong = static_cast<char>(byte ^ (1 << (bit % 8)));
    ASSERT_EQ(::pwrite(log, &wrong, 1, place), 1);
    const auto hit = std::upper_bound(at.begin(), at.end(), bit / 8) - at.begin() - 1;
    const Read read = read_log(file.path());
    ASSERT_EQ(read.records, static_cast<std::uint64_t>(hit)) << bit;
    ASSERT_NE(read.fault, nullptr) << bit;
    ASSERT_TRUE(read.right) << bit;
    ASSERT_EQ(::pwrite(log, &byte, 1, place), 1);
  }
  ::close(log);
  EXPECT_EQ(read_log(file.path()).records, kRecords);
}

TEST(RawLog, ARecordTakenOutOrPutInTwiceIsNoticed) {
  const TempFile file("log.slog");
  write_log(file.path(), 20);
  const std::string all = content_of(file.path());
  const auto at = starts(20);
  put(file.path(), all.substr(0, at[7]) + all.substr(at[8]));
  EXPECT_EQ(read_log(file.path()).records, 7U);
  put(file.path(), all.substr(0, at[8]) + all.substr(at[7]));
  const Read read = read_log(file.path());
  EXPECT_EQ(read.records, 8U);
  EXPECT_STREQ(read.fault, "a record is missing");
}

TEST(RawLog, WhatIsNoLogHasNoRecordsAndSaysWhy) {
  for (const std::string path : {"/nowhere/x.slog", "/", "/dev/zero"}) {
    RawLogReader reader(path);
    RawRecord record;
    EXPECT_FALSE(reader.next(record)) << path;
    EXPECT_STREQ(reader.fault(), "no file that can be read") << path;
  }
  // A pipe that nobody writes to must not hold the reader up.
  const TempFile pipe("pipe");
  ASSERT_EQ(::mkfifo(pipe.path().c_str(), 0600), 0);
  EXPECT_EQ(read_log(pipe.path()).records, 0U);
  std::mt19937 random(3);
  std::string noise(5000, ' ');
  for (char& c : noise) c = static_cast<char>(random());
  const TempFile file("noise.slog", noise);
  const Read read = read_log(file.path());
  EXPECT_EQ(read.records, 0U);
  EXPECT_STREQ(read.fault, "not the start of a record");
  const TempFile empty("empty.slog", "");
  EXPECT_EQ(read_log(empty.path()).fault, nullptr);
}

TEST(RawLog, AFullDiskIsAStatusAndTheRestIsCounted) {
  RawLog log("/dev/full", Duration{});
  for (std::uint32_t i = 0; i < 5; ++i) {
    const engine::Status status = append(log, i);
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().fault, engine::Fault::kSystem);
    EXPECT_EQ(status.error().code, ENOSPC);
  }
  EXPECT_EQ(log.written(), 0U);
  EXPECT_EQ(log.lost(), 5U);
  EXPECT_EQ(log.fault().code, ENOSPC);
  EXPECT_THROW(RawLog("/nowhere/x.slog", Duration{}), std::runtime_error);
}

// A limit on the file's size stops a write in its middle, as a disk that fills up does.
TEST(RawLog, AWriteCutShortLeavesNoHalfRecordAndNothingFollowsTheGap) {
  const TempFile file("log.slog");
  constexpr std::uint64_t kLimit = 500;
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{kLimit, kLimit};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    RawLog log(file.path(), Duration{});
    for (std::uint32_t i = 0; i < 100; ++i) static_cast<void>(append(log, i));
    ::_exit(log.written() + log.lost() == 100 && log.lost() > 0 ? static_cast<int>(log.written())
                                                                : 255);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  const auto at = starts(100);
  const auto fit = std::upper_bound(at.begin(), at.end(), kLimit) - at.begin() - 1;
  EXPECT_EQ(WEXITSTATUS(status), fit);
  const Read read = read_log(file.path());
  EXPECT_EQ(read.records, static_cast<std::uint64_t>(fit));
  EXPECT_EQ(read.fault, nullptr) << "half a record was left behind";
  EXPECT_TRUE(read.right);
}

// What a log has acknowledged survives its program's death, whenever that comes.
TEST(RawLog, TwoHundredKillsTearAtMostTheLastRecord) {
  std::mt19937 random(7);
  const TempFile file("killed.slog");
  std::uint64_t most = 0;
  for (int kill_number = 0; kill_number < 200; ++kill_number) {
    int acknowledged[2];
    ASSERT_EQ(::pipe(acknowledged), 0);
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      RawLog log(file.path(), Duration{});
      for (std::uint32_t i = 0;; ++i) {
        if (!append(log, i).ok()) ::_exit(1);
        if (::write(acknowledged[1], "a", 1) != 1) ::_exit(1);
      }
    }
    ::close(acknowledged[1]);
    // The death comes after some acknowledgements, at a place that nobody chose.
    const std::uint64_t enough = random() % 100;
    std::uint64_t count = 0;
    char buffer[64];
    while (count < enough) {
      const ssize_t got = ::read(acknowledged[0], buffer, sizeof buffer);
      ASSERT_GT(got, 0);
      count += static_cast<std::uint64_t>(got);
    }
    ASSERT_EQ(::kill(child, SIGKILL), 0);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status));
    for (ssize_t got = 0; (got = ::read(acknowledged[0], buffer, sizeof buffer)) > 0;)
      count += static_cast<std::uint64_t>(got);
    ::close(acknowledged[0]);
    if (count == 0) continue;  // killed before it had made the file
    const Read read = read_log(file.path());
    // One may be written and not yet acknowledged.
    ASSERT_GE(read.records, count);
    ASSERT_LE(read.records, count + 1);
    ASSERT_TRUE(read.right);
    const std::uint64_t torn = content_of(file.path()).size() - read.offset;
    ASSERT_LT(torn, 100U) << "more than one record is torn";
    most = std::max(most, count);
  }
  EXPECT_GT(most, 50U);
}

}  // namespace
