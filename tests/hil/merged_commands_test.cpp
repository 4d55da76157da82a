#include "hil/merged_commands.h"

#include <vector>

#include <gtest/gtest.h>

#include "tests/support/fakes.h"

namespace {

using engine::Duration;
using engine::Error;
using engine::Fault;
using hil::Command;
using hil::MergedCommands;

constexpr Duration kLong{20'000'000'000};  // only a source that is wrong waits this long

TEST(MergedCommands, BothSourcesAreHeardAndEachKeepsItsOrder) {
  fakes::QueueSource first;
  fakes::QueueSource second;
  MergedCommands merged({&first, &second});
  for (int i = 0; i < 100; ++i) {
    first.give(Command{});
    second.give(Command{});
  }
  std::array<std::uint64_t, 2> last{};
  for (int i = 0; i < 200; ++i) {
    const auto command = merged.receive(kLong);
    ASSERT_TRUE(command.ok()) << i;
    const std::size_t which = command.value().sender >> 29;
    EXPECT_EQ(command.value().sequence, last[which] + 1);
    last[which] = command.value().sequence;
  }
  EXPECT_EQ(last[0], 100U);
  EXPECT_EQ(last[1], 100U);
  EXPECT_FALSE(merged.receive(Duration{}).ok());
}

// Both may call their first client number one; a gate must not take them for the same.
TEST(MergedCommands, SendersOfTheSameNumberAreToldApart) {
  fakes::QueueSource first;
  fakes::QueueSource second;
  MergedCommands merged({&first, &second});
  Command command;
  command.sender = 1;
  first.give(command);
  second.give(command);
  const auto a = merged.receive(kLong);
  const auto b = merged.receive(kLong);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_NE(a.value().sender, b.value().sender);
}

TEST(MergedCommands, AFaultOfEitherComesThrough) {
  fakes::QueueSource first;
  fakes::QueueSource second;
  MergedCommands merged({&first, &second});
  second.give(Error{Fault::kRejected, 7, "checksum"});
  const auto fault = merged.receive(kLong);
  ASSERT_FALSE(fault.ok());
  EXPECT_EQ(fault.error().fault, Fault::kRejected);
  EXPECT_STREQ(fault.error().step, "checksum");
}

TEST(MergedCommands, AFloodOnOneSourceIsBoundedAndCountedAndDoesNotSilenceTheOther) {
  fakes::QueueSource first;
  fakes::QueueSource second;
  MergedCommands merged({&first, &second});
  for (int i = 0; i < 1000; ++i) first.give(Command{});
  first.wait_until_taken();
  second.give(Command{});
  second.wait_until_taken();
  int heard = 0;
  int lost = 0;
  bool other = false;
  for (int i = 0; i < 1001; ++i) {
    const auto command = merged.receive(kLong);
    if (command.ok()) {
      ++heard;
      other = other || command.value().sender >> 29 == 1;
    } else {
      EXPECT_EQ(command.error().fault, Fault::kBusy);
      ++lost;
    }
  }
  EXPECT_EQ(heard + lost, 1001);
  EXPECT_EQ(heard, 257);
  EXPECT_TRUE(other);
}

}  // namespace
