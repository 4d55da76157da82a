// The device as a USB function: what it tells the kernel it is, and what it does with what a host
// does, on a model of functionfs.

#include "drivers/usb_device/function_fs.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include <gtest/gtest.h>
#include <linux/usb/functionfs.h>

#include "drivers/little_endian.h"
#include "drivers/usb_device/function_fs_files.h"
#include "tests/support/function_fs_model.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/usb_frames.h"

namespace {

using drivers::FrameIntake;
using drivers::FunctionFs;
using drivers::PixelFormat;
using drivers::UsbMessage;
using Bytes = FunctionFsModel::Bytes;

unsigned byte(std::span<const std::byte> bytes, std::size_t at) {
  return std::to_integer<unsigned>(bytes[at]);
}

TEST(FunctionDescriptors, AreCountedAndLongAsTheySayAtEachSpeed) {
  const Bytes all = drivers::function_descriptors();
  EXPECT_EQ(drivers::get<std::uint32_t>(all, 0), std::uint32_t{FUNCTIONFS_DESCRIPTORS_MAGIC_V2});
  EXPECT_EQ(drivers::get<std::uint32_t>(all, 4), all.size());
  EXPECT_EQ(drivers::get<std::uint32_t>(all, 8), 7U) << "full, high and super speed, and no more";
  std::size_t at = 24;
  const std::array<unsigned, 3> packets{64, 512, 1024};
  for (std::size_t speed = 0; speed < 3; ++speed) {
    unsigned interfaces = 0;
    std::vector<unsigned> addresses;
    unsigned last_type = 0;
    const auto count = drivers::get<std::uint32_t>(all, 12 + 4 * speed);
    for (std::uint32_t i = 0; i < count; ++i) {
      ASSERT_LT(at + 1, all.size());
      const unsigned bytes = byte(all, at);
      const unsigned type = byte(all, at + 1);
      ASSERT_LE(at + bytes, all.size());
      if (type == USB_DT_INTERFACE) {
        ++interfaces;
        EXPECT_EQ(bytes, 9U);
        EXPECT_EQ(byte(all, at + 4), 2U) << "endpoints";
        EXPECT_EQ(byte(all, at + 5), unsigned{drivers::kUsbClass});
        EXPECT_EQ(byte(all, at + 6), unsigned{drivers::kUsbSubclass});
        EXPECT_EQ(byte(all, at + 7), unsigned{drivers::kUsbProtocol});
        EXPECT_EQ(byte(all, at + 8), 1U) << "the name is the first string";
      } else if (type == USB_DT_ENDPOINT) {
        EXPECT_EQ(bytes, 7U);
        addresses.push_back(byte(all, at + 2));
        EXPECT_EQ(byte(all, at + 3), 2U) << "bulk";
        EXPECT_EQ(drivers::get<std::uint16_t>(all, at + 4), packets[speed]);
      } else {
        EXPECT_EQ(type, unsigned{USB_DT_SS_ENDPOINT_COMP});
        EXPECT_EQ(bytes, 6U);
        EXPECT_EQ(speed, 2U);
        EXPECT_EQ(last_type, unsigned{USB_DT_ENDPOINT}) << "a companion follows its endpoint";
      }
      last_type = type;
      at += bytes;
    }
    EXPECT_EQ(interfaces, 1U);
    ASSERT_EQ(addresses.size(), 2U);
    EXPECT_EQ(addresses[0] & 0x80U, 0U) << "ep1 is OUT: the program opens it by that name";
    EXPECT_EQ(addresses[1] & 0x80U, 0x80U);
    EXPECT_EQ(count, speed == 2 ? 5U : 3U);
  }
  EXPECT_EQ(at, all.size());
}

TEST(FunctionDescriptors, TheStringsAreOneInOneLanguage) {
  const Bytes all = drivers::function_strings();
  EXPECT_EQ(drivers::get<std::uint32_t>(all, 0), std::uint32_t{FUNCTIONFS_STRINGS_MAGIC});
  EXPECT_EQ(drivers::get<std::uint32_t>(all, 4), all.size());
  EXPECT_EQ(drivers::get<std::uint32_t>(all, 8), 1U);
  EXPECT_EQ(drivers::get<std::uint32_t>(all, 12), 1U);
  EXPECT_EQ(drivers::get<std::uint16_t>(all, 16), 0x0409U);
  EXPECT_EQ(std::find(all.begin() + 18, all.end(), std::byte{0}), all.end() - 1)
      << "one string, ended, and nothing behind it";
}

/// Frames of a camera of so many pixels.
Bytes frame_bytes(std::uint64_t sequence, PixelFormat format = PixelFormat::kPacked11,
                  int width_px = usb_frames::kWidth_px, int height_px = usb_frames::kHeight_px) {
  engine::DnImage image(width_px, height_px);
  numbered_frames::fill(image, sequence);
  Bytes out(drivers::kUsbHeaderBytes + drivers::usb_payload_bytes(format, width_px, height_px));
  out.resize(drivers::encode_usb_frame(usb_frames::frame(sequence, image), format, out).value());
  return out;
}

Bytes beginning_of(Bytes frame, std::size_t bytes) {
  frame.resize(bytes);
  return frame;
}

/// The function on a model, and what it has handed over.
class Rig {
 public:
  explicit Rig(const drivers::UsbLimits& limits = usb_frames::limits())
      : function(model, limits, [this](FrameIntake& intake) {
          for (auto f = intake.front(); f; f = intake.front()) {
            EXPECT_TRUE(usb_frames::shows(*f, f->header.sequence));
            seen.push_back(f->header.sequence);
            intake.pop();
          }
        }) {}

  void plug_and_begin(std::uint32_t session, std::size_t packet_bytes = 512) {
    model.plug(packet_bytes);
    model.begin_session(session);
    // An event at a time: the kernel drops what a younger one overtakes.
    function.step();
    function.step();
    EXPECT_TRUE(model.answered());
  }
  void send(std::span<const std::byte> bytes, bool ends = true) {
    model.send(bytes, ends);
    for (int i = 0; i < 40; ++i) function.step();
  }
  [[nodiscard]] std::optional<UsbMessage> message() {
    function.step();
    auto bytes = model.message();
    if (!bytes) return std::nullopt;
    last_message = *bytes;
    return drivers::decode_usb_message(last_message).value();
  }

  FunctionFsModel model;
  FunctionFs function;
  std::vector<std::uint64_t> seen;
  Bytes last_message;
};

/// Frames that end in the middle of a packet, with a packet, and with a read.
TEST(FunctionFs, AFrameOfAnyLengthIsOverWhenItsLastPacketCame) {
  for (const std::size_t packet : {64U, 512U, 1024U}) {
    drivers::UsbLimits limits = usb_frames::limits();
    limits.width_px = 4096;
    limits.height_px = 4096;
    limits.payload_bytes = 1U << 20;
    Rig rig(limits);
    rig.plug_and_begin(1, packet);
    std::uint64_t sequence = 0;
    bool with_packet = false;
    bool with_read = false;
    const std::size_t before = frame_bytes(1, PixelFormat::kPlain16, 1, 1).size() - 2;
    for (const std::size_t length :
         {std::size_t{1000}, std::size_t{2048}, drivers::kFunctionReadBytes - 2,
          drivers::kFunctionReadBytes, drivers::kFunctionReadBytes + 512,
          2 * drivers::kFunctionReadBytes, 10 * drivers::kFunctionReadBytes}) {
      // As wide as it takes, in rows of up to 4096.
      const std::size_t pixels = (length - before) / 2;
      int rows = 1;
      while (pixels % static_cast<std::size_t>(rows) != 0 ||
             pixels / static_cast<std::size_t>(rows) > 4096)
        ++rows;
      ASSERT_LE(rows, 4096);
      const Bytes frame =
          frame_bytes(++sequence, PixelFormat::kPlain16, static_cast<int>(pixels) / rows, rows);
      ASSERT_EQ(frame.size(), length);
      with_packet |= length % packet == 0;
      with_read |= length % drivers::kFunctionReadBytes == 0;
      rig.send(frame);
      ASSERT_EQ(rig.seen.size(), sequence) << length << " in packets of " << packet;
    }
    EXPECT_TRUE(with_packet && with_read);
    EXPECT_EQ(rig.function.intake().status().good, sequence);
    EXPECT_EQ(rig.function.intake().status().short_frames, 0U);
  }
}

TEST(FunctionFs, ReadsAreInFlightWheneverAHostIsThere) {
  Rig rig;
  rig.function.step();
  EXPECT_EQ(rig.model.reads_in_flight(), 0U);
  rig.plug_and_begin(1);
  EXPECT_EQ(rig.model.reads_in_flight(), drivers::kFunctionReads);
  rig.send(frame_bytes(1));
  EXPECT_EQ(rig.model.reads_in_flight(), drivers::kFunctionReads);
  rig.model.unplug();
  rig.function.step();
  EXPECT_EQ(rig.model.reads_in_flight(), 0U);
}

TEST(FunctionFs, TellsLimitsAndStatusNoLongerThanAsked) {
  Rig rig;
  rig.plug_and_begin(7);
  rig.model.ask({0xC1, 1, 0, 0, 64});
  rig.function.step();
  ASSERT_EQ(rig.model.answer().size(), drivers::kUsbLimitsBytes);
  const auto limits = drivers::decode_limits(rig.model.answer());
  ASSERT_TRUE(limits.ok());
  EXPECT_EQ(limits.value().width_px, usb_frames::limits().width_px);
  rig.model.ask({0xC1, 3, 0, 0, 56});
  rig.function.step();
  const auto status = drivers::decode_usb_message(rig.model.answer());
  ASSERT_TRUE(status.ok());
  EXPECT_EQ(status.value().session, 7U);
  EXPECT_EQ(status.value().status.credits, 2U);
  for (const unsigned length : {0U, 5U}) {
    rig.model.ask({0xC1, 1, 0, 0, length});
    rig.function.step();
    EXPECT_TRUE(rig.model.answered());
    EXPECT_EQ(rig.model.answer().size(), length);
  }
}

TEST(FunctionFs, WhatItDoesNotKnowIsStalledAndTheNextRequestIsAnswered) {
  Rig rig;
  rig.plug_and_begin(7);
  const std::vector<FunctionFsModel::Setup> strange = {
      {0xC1, 4, 0, 0, 8},   // no such question
      {0x41, 9, 0, 0, 4},   // no such order
      {0x41, 9, 0, 0, 0},   // and no data
      {0x41, 2, 0, 0, 3},   // half a session
      {0x41, 2, 1, 0, 4},   // a value
      {0xC1, 1, 0, 1, 32},  // another interface
      {0x41, 1, 0, 0, 4},   // the wrong way round
      {0xC0, 1, 0, 0, 32},  // to the device
      {0xA1, 1, 0, 0, 32},  // a class's
  };
  for (const auto& setup : strange) {
    rig.model.ask(setup, Bytes(setup.length));
    rig.function.step();
    EXPECT_TRUE(rig.model.stalled()) << setup.type << ' ' << setup.request;
    EXPECT_FALSE(rig.model.answered());
    rig.model.ask({0xC1, 1, 0, 0, 32});
    rig.function.step();
    EXPECT_TRUE(rig.model.answered());
  }
  EXPECT_EQ(rig.function.counts().refused, strange.size());
  EXPECT_EQ(rig.function.counts().sessions, 1U) << "none of them began one";
}

/// The host gave up in the middle, and its next frame comes the moment the reset is answered.
TEST(FunctionFs, AfterAResetInMidFrameTheFirstFrameOfTheNewSessionIsWhole) {
  Rig rig;
  rig.plug_and_begin(1);
  const Bytes lost = frame_bytes(1);
  for (std::uint32_t session = 2; session < 6; ++session) {
    rig.send(std::span(lost).first(512 * (session - 1)), false);
    rig.model.begin_session(session, frame_bytes(session));
    rig.function.step();
    for (int i = 0; i < 40; ++i) rig.function.step();
    ASSERT_EQ(rig.seen.size(), session - 1) << "the tail of the old one was taken for a header";
    EXPECT_EQ(rig.seen.back(), session);
    EXPECT_EQ(rig.function.intake().status().bad_headers, 0U);
    EXPECT_EQ(rig.function.intake().status().good, 1U);
  }
}

TEST(FunctionFs, AHostThatGivesUpItsResetCostsTheFrameInHandAlone) {
  Rig rig;
  rig.plug_and_begin(1);
  rig.send(beginning_of(frame_bytes(1), 1024), false);
  rig.model.ask({0x41, 2, 0, 0, 4}, Bytes(2));  // it sends half of the number
  rig.function.step();
  EXPECT_EQ(rig.function.counts().sessions, 1U);
  rig.send(frame_bytes(2));
  EXPECT_EQ(rig.seen, std::vector<std::uint64_t>{2});
  EXPECT_EQ(rig.function.intake().status().short_frames, 0U)
      << "its only bytes were taken back with the reads";
}

TEST(FunctionFs, SaysCreditsWhenASessionBeginsAndNothingBefore) {
  Rig rig;
  rig.model.plug();
  rig.function.step();
  EXPECT_FALSE(rig.message().has_value()) << "a host heeds its own session's messages alone";
  rig.model.begin_session(9);
  const auto first = rig.message();
  ASSERT_TRUE(first.has_value());
  EXPECT_EQ(first->session, 9U);
  EXPECT_EQ(first->status.credits, 2U);
  rig.send(frame_bytes(1));
  const auto next = rig.message();
  ASSERT_TRUE(next.has_value());
  EXPECT_EQ(next->status.good, 1U);
  EXPECT_EQ(next->status.credits, 3U);
}

/// At full speed a trim is two packets exactly: without an end of its own the host would wait.
TEST(FunctionFs, MessagesOfWholePacketsAreEnded) {
  for (const std::size_t packet : {64U, 512U}) {
    Rig rig;
    rig.plug_and_begin(3, packet);
    ASSERT_TRUE(rig.message().has_value());
    bool whole_packets = false;
    for (const auto kind : {hil::CommandKind::kTrim, hil::CommandKind::kPing,
                            hil::CommandKind::kTrim, hil::CommandKind::kAttitude}) {
      hil::Command command;
      command.kind = kind;
      const hil::CommandPacket packet_of_it = hil::encode_command(command);
      whole_packets |= (packet_of_it.used + drivers::kUsbMessageHeaderBytes) % packet == 0;
      rig.function.command(packet_of_it);
      rig.function.step();
      const auto m = rig.message();
      ASSERT_TRUE(m.has_value());
      ASSERT_EQ(m->kind, UsbMessage::Kind::kCommand);
      EXPECT_TRUE(std::equal(m->command.begin(), m->command.end(), packet_of_it.bytes().begin(),
                             packet_of_it.bytes().end()));
    }
    EXPECT_EQ(whole_packets, packet == 64);
  }
}

TEST(FunctionFs, CommandsWaitForASessionNowhereAndInOneTheyComeInOrder) {
  Rig rig;
  hil::Command command;
  rig.function.command(hil::encode_command(command));
  EXPECT_GT(rig.model.wakes(), 0) << "or it would lie until something else happens";
  rig.function.step();
  EXPECT_EQ(rig.function.counts().commands_lost, 1U);
  rig.plug_and_begin(1);
  ASSERT_TRUE(rig.message().has_value());
  for (std::uint64_t k = 0; k < 20; ++k) {
    command.sequence = k;
    rig.function.command(hil::encode_command(command));
  }
  for (std::uint64_t k = 0; k < 16; ++k) {
    const auto m = rig.message();
    ASSERT_TRUE(m.has_value()) << k;
    EXPECT_EQ(hil::decode_command(m->command).value().sequence, k);
  }
  EXPECT_FALSE(rig.message().has_value());
  EXPECT_EQ(rig.function.counts().commands_lost, 5U) << "no more wait than there is room for";
}

TEST(FunctionFs, UnpluggedInMidFrameItIsInStepWithTheNextHost) {
  Rig rig;
  for (std::uint32_t round = 1; round <= 20; ++round) {
    rig.plug_and_begin(round);
    rig.send(frame_bytes(round));
    ASSERT_EQ(rig.seen.size(), round);
    rig.send(beginning_of(frame_bytes(99), 512 + 64 * round), false);
    // Every second time nobody looks before it is back.
    rig.model.unplug();
    if (round % 2 == 0) rig.function.step();
  }
  EXPECT_EQ(rig.function.counts().connections, 20U);
  EXPECT_EQ(rig.function.counts().sessions, 20U);
  EXPECT_EQ(rig.function.counts().failed_reads, 0U) << "to be unplugged is no failure";
}

TEST(FunctionFs, AWholeFrameJustBeforeTheCableIsPulledIsHandedOver) {
  Rig rig;
  rig.plug_and_begin(1);
  rig.model.before_next_event([&rig] {
    rig.model.send(frame_bytes(1), true);
    rig.model.replug();
  });
  rig.function.step();
  EXPECT_EQ(rig.seen, std::vector<std::uint64_t>{1});
  EXPECT_EQ(rig.model.reads_in_flight(), drivers::kFunctionReads) << "and it reads again";
}

TEST(FunctionFs, AMessageNobodyTakesIsForgottenWithTheCable) {
  Rig rig;
  rig.model.stop_listening();
  rig.plug_and_begin(1);
  rig.function.step();
  rig.model.unplug();
  rig.function.step();
  EXPECT_FALSE(rig.message().has_value());
  EXPECT_EQ(rig.function.counts().failed_writes, 0U);
}

/// It was the one with the frame's end.
TEST(FunctionFs, AReadThatFailsCostsItsFrameAlone) {
  drivers::UsbLimits limits = usb_frames::limits();
  limits.width_px = 4094;
  limits.payload_bytes = 1U << 20;
  Rig rig(limits);
  rig.plug_and_begin(1);
  const Bytes frame = frame_bytes(1, PixelFormat::kPlain16, 4094, 8);
  ASSERT_GT(frame.size(), drivers::kFunctionReadBytes);
  rig.send(std::span(frame).first(drivers::kFunctionReadBytes), false);
  rig.model.fail_a_read(EPROTO);
  rig.send(std::span(frame).subspan(drivers::kFunctionReadBytes));
  EXPECT_TRUE(rig.seen.empty());
  EXPECT_EQ(rig.function.counts().failed_reads, 1U);
  EXPECT_EQ(rig.function.intake().status().short_frames, 1U);
  rig.send(frame_bytes(2));
  EXPECT_EQ(rig.seen, std::vector<std::uint64_t>{2});
}

TEST(FunctionFs, EndsOfReadsThatAreToldOutOfOrderChangeNothing) {
  Rig rig;
  rig.plug_and_begin(1);
  rig.model.send(frame_bytes(1), true);
  rig.model.send(frame_bytes(2), true);
  rig.model.swap_ends();
  rig.function.step();
  EXPECT_EQ(rig.seen, (std::vector<std::uint64_t>{1, 2}));
}

/// For what it tries again ten times a second.
class Patience {
 public:
  [[nodiscard]] bool lasts() const { return std::chrono::steady_clock::now() < end_; }

 private:
  std::chrono::steady_clock::time_point end_ =
      std::chrono::steady_clock::now() + std::chrono::seconds(20);
};

TEST(FunctionFs, AKernelWithoutMemoryForReadsIsAskedAgain) {
  Rig rig;
  rig.model.refuse_reads(true);
  rig.plug_and_begin(1);
  EXPECT_EQ(rig.model.reads_in_flight(), 0U);
  rig.model.refuse_reads(false);
  for (const Patience patience; rig.model.reads_in_flight() == 0 && patience.lasts();)
    rig.function.step();
  rig.send(frame_bytes(1));
  EXPECT_EQ(rig.seen, std::vector<std::uint64_t>{1});
}

TEST(FunctionFs, AMessageThatTheKernelHadNoMemoryForIsKept) {
  Rig rig;
  rig.model.refuse_writes(true);
  rig.plug_and_begin(1);
  EXPECT_FALSE(rig.message().has_value());
  rig.model.refuse_writes(false);
  std::optional<UsbMessage> m;
  for (const Patience patience; !m && patience.lasts();) m = rig.message();
  ASSERT_TRUE(m.has_value());
  EXPECT_EQ(m->session, 1U);
  EXPECT_EQ(m->count, 0U);
}

TEST(FunctionFs, AHostThatAsksWithoutEndDoesNotKeepItFromFrames) {
  Rig rig;
  rig.plug_and_begin(1);
  rig.model.ask_for_ever({0xC1, 1, 0, 0, 32});
  rig.send(frame_bytes(1));
  EXPECT_EQ(rig.seen, std::vector<std::uint64_t>{1});
}

TEST(FunctionFs, ARequestThatTheHostGaveUpIsNotAnsweredInThePlaceOfTheNext) {
  Rig rig;
  rig.plug_and_begin(1);
  rig.model.ask({0xC1, 1, 0, 0, 32});
  rig.model.give_up_request_once_read();
  rig.function.step();
  EXPECT_FALSE(rig.model.answered());
  rig.model.ask({0xC1, 3, 0, 0, 56});
  rig.function.step();
  EXPECT_EQ(rig.model.answer().size(), 56U);
}

/// A folder with the names that functionfs has, of ordinary files: the kernel's own transfers, and
/// no gadget.
class PlainFolder {
 public:
  explicit PlainFolder(const Bytes& frames) {
    for (const char* name : {"ep0", "ep1", "ep2"}) std::ofstream(folder_.path() / name);
    std::ofstream(folder_.path() / "ep1", std::ios::binary)
        .write(reinterpret_cast<const char*>(frames.data()),
               static_cast<std::streamsize>(frames.size()));
  }
  [[nodiscard]] std::string path() const { return folder_.path().string(); }
  [[nodiscard]] std::string content(const char* name) const {
    return test_support::content_of(folder_.path() / name);
  }

 private:
  test_support::TemporaryFolder folder_;
};

TEST(FunctionFsFiles, TheKernelIsToldWhatItIsBeforeAnythingElse) {
  const PlainFolder folder({});
  const drivers::FunctionFsFiles files(folder.path());
  Bytes told = drivers::function_descriptors();
  const Bytes strings = drivers::function_strings();
  told.insert(told.end(), strings.begin(), strings.end());
  const std::string written = folder.content("ep0");
  ASSERT_EQ(written.size(), told.size());
  EXPECT_TRUE(std::equal(told.begin(), told.end(), std::as_bytes(std::span(written)).begin()));
}

TEST(FunctionFsFiles, TransfersOfTheKernelEndWithTheirBytes) {
  Bytes content(3000);
  for (std::size_t i = 0; i < content.size(); ++i) content[i] = static_cast<std::byte>(i * 7);
  const PlainFolder folder(content);
  drivers::FunctionFsFiles files(folder.path());
  Bytes place(2000);
  ASSERT_TRUE(files.read(5, place));
  std::optional<drivers::FunctionFiles::Ended> ended;
  for (int i = 0; i < 100 && !ended; ++i) {
    files.wait_for_transfer(engine::Duration{100'000'000});
    ended = files.next_ended();
  }
  ASSERT_TRUE(ended.has_value());
  EXPECT_TRUE(ended->is_read);
  EXPECT_EQ(ended->slot, 5U);
  EXPECT_EQ(ended->result, 2000);
  EXPECT_TRUE(std::equal(place.begin(), place.end(), content.begin()));
  EXPECT_FALSE(files.next_ended().has_value());
  const Bytes message(100, std::byte{0x5A});
  ASSERT_TRUE(files.write(message));
  ended.reset();
  for (int i = 0; i < 100 && !ended; ++i) {
    files.wait(engine::Duration{100'000'000});
    ended = files.next_ended();
  }
  ASSERT_TRUE(ended.has_value());
  EXPECT_FALSE(ended->is_read);
  EXPECT_EQ(ended->result, 100);
  EXPECT_EQ(folder.content("ep2"), std::string(100, 'Z'));
}

TEST(FunctionFsFiles, AFolderWithoutOneSaysWhatToLoad) {
  const test_support::TemporaryFolder empty;
  try {
    const drivers::FunctionFsFiles files(empty.path().string());
    FAIL() << "there is nothing";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("modprobe usb_f_fs"), std::string::npos) << e.what();
  }
}

TEST(FunctionFs, ARunEndsWhenItIsAskedToWhileNothingHappens) {
  Rig rig;  // its model never waits
  {
    const std::jthread running([&rig](const std::stop_token& stop) { rig.function.run(stop); });
  }
  EXPECT_GT(rig.model.wakes(), 0);
}

}  // namespace
