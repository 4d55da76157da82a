#include "drivers/open_link.h"

#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "drivers/client/starloop_client.h"
#include "engine/core/fits.h"
#include "hil/frame_store.h"
#include "tests/support/temporary_folder.h"

namespace {

using drivers::LinkCamera;
using drivers::LinkKind;
using drivers::LinkSpec;
using drivers::OpenLink;
using engine::ConfigError;
using engine::ConfigReader;

LinkSpec read(const std::string& text) {
  const ConfigReader config = ConfigReader::from_text("[link]\n" + text, "x.toml");
  const LinkSpec spec = drivers::read_link(config.table("link"));
  config.reject_unknown_keys();
  return spec;
}

std::string complaint(const std::string& text) {
  try {
    static_cast<void>(read(text));
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "";
}

TEST(ReadLink, AnEmptyTableIsTheMockAndEveryKeyIsRead) {
  const LinkSpec none = read("");
  ASSERT_EQ(none.to.size(), 1U);
  EXPECT_EQ(none.to[0].kind, LinkKind::kMock);
  EXPECT_FALSE(none.telemetry_row);
  const LinkSpec all = read(
      "to = 'shm:/a-b'\nslots = 7\ntelemetry_row = true\nv4l2_format = 'grey'\n"
      "v4l2_method = 'mapped'\nv4l2_to_top = true\nusb_packed = false\n");
  ASSERT_EQ(all.to.size(), 1U);
  EXPECT_EQ(all.to[0].kind, LinkKind::kShm);
  EXPECT_EQ(all.to[0].place, "/a-b");
  EXPECT_EQ(all.slots, 7);
  EXPECT_TRUE(all.telemetry_row);
  EXPECT_EQ(all.v4l2_format, drivers::V4l2Format::kGrey);
  EXPECT_EQ(all.v4l2_method, drivers::V4l2Method::kMapped);
  EXPECT_TRUE(all.v4l2_to_top);
  EXPECT_FALSE(all.usb_packed);
}

TEST(ReadLink, NamesOfAllKinds) {
  const LinkSpec all = read(
      "to = ['mock', 'v4l2:/dev/video2', 'v4l2:cam b', 'usb', 'usb:1209:00aF:SN:7', 'file:out/x']");
  ASSERT_EQ(all.to.size(), 6U);
  EXPECT_TRUE(all.has(LinkKind::kMock));
  EXPECT_FALSE(all.has(LinkKind::kShm));
  EXPECT_EQ(all.to[1].kind, LinkKind::kV4l2);
  EXPECT_EQ(all.to[1].place, "/dev/video2");
  EXPECT_EQ(all.to[2].place, "cam b");
  EXPECT_EQ(all.to[3].kind, LinkKind::kUsb);
  EXPECT_EQ(all.to[3].usb.vendor, 0);
  EXPECT_EQ(all.to[4].usb.vendor, 0x1209);
  EXPECT_EQ(all.to[4].usb.product, 0xAF);
  EXPECT_EQ(all.to[4].usb.serial, "SN:7");
  EXPECT_EQ(all.to[5].kind, LinkKind::kFile);
  EXPECT_EQ(all.to[5].place, "out/x");
}

TEST(ReadLink, WhatIsWrongIsNamedWithItsLine) {
  for (const std::string name :
       {"usb9",        "",         "mock:",    "mock:x", "shm",   "shm:", "shm:/",    "shm:a/b",
        "shm:../a",    "shm://a",  "v4l2",     "v4l2:",  "file:", "usb:", "usb:1209", "usb:1209:",
        "usb:12345:1", "usb:-1:1", "usb:xy:1", "udp:1",  ":",     "USB"}) {
    const std::string text = complaint("to = '" + name + "'\n");
    EXPECT_NE(text.find("x.toml:2: link.to must be"), std::string::npos) << name << ": " << text;
    EXPECT_NE(text.find("got \"" + name + "\""), std::string::npos) << text;
  }
  EXPECT_NE(complaint("to = []\n").find("must name 1 to 7 links, got 0"), std::string::npos);
  EXPECT_NE(complaint("to = ['mock', 'mock']\n").find("twice"), std::string::npos);
  EXPECT_NE(complaint("to = ['mock', 3]\n").find("must be a list of texts"), std::string::npos);
  EXPECT_NE(complaint("slots = 1\n").find("x.toml:2: link.slots must be"), std::string::npos);
  EXPECT_NE(complaint("slots = 17\n").find("x.toml:2: link.slots must be"), std::string::npos);
  EXPECT_EQ(complaint("telemetry_row = 1\n"),
            "x.toml:2: link.telemetry_row must be true or false, got 1");
}

const LinkCamera kCamera{8, 6, 11, engine::Duration(100'000'000)};

TEST(OpenLink, AMockHasItsDevicesSideAndNoOtherKindDoes) {
  const OpenLink mock(LinkSpec{}, kCamera, hil::WhenBusy::kWait);
  EXPECT_NE(mock.mock(), nullptr);
  const std::string name = "starloop-open-test-" + std::to_string(getpid());
  const OpenLink shm(read("to = 'shm:" + name + "'\n"), kCamera, hil::WhenBusy::kWait);
  EXPECT_EQ(shm.mock(), nullptr);
  EXPECT_FALSE(shm.frames().has_reader());
  starloop_client* client = nullptr;
  ASSERT_EQ(starloop_open(&client, name.c_str(), 0), STARLOOP_OK) << starloop_last_error();
  EXPECT_TRUE(shm.frames().has_reader());
  starloop_close(client);
}

hil::Frame numbered(std::uint64_t sequence, engine::DnImage& image) {
  for (std::uint16_t& dn : image.pixels()) dn = static_cast<std::uint16_t>(sequence);
  hil::Frame frame;
  frame.sequence = sequence;
  frame.pixels = &image;
  return frame;
}

TEST(OpenLink, SeveralLinksGetEveryFrameAndTheFirstOneSaysWhatBecameOfIt) {
  const test_support::TemporaryFolder folder;
  OpenLink link(read("to = ['mock', 'file:" + (folder.path() / "frames").string() + "']\n"),
                kCamera, hil::WhenBusy::kWait);
  EXPECT_EQ(link.text(),
            "frames go to the built-in tracker, file:" + (folder.path() / "frames").string());
  EXPECT_EQ(link.commands().size(), 1U);
  engine::DnImage image(8, 6);
  for (std::uint64_t k = 0; k < 3; ++k)
    ASSERT_TRUE(link.frames().send(numbered(k, image), engine::Duration(1'000'000'000)).ok());
  // Nobody takes a frame from the mock: its three slots are full, and that is what the loop is
  // told.
  const auto busy = link.frames().send(numbered(3, image), engine::Duration(1'000'000));
  ASSERT_FALSE(busy.ok());
  EXPECT_EQ(busy.error().fault, engine::Fault::kBusy);
  link.finish();
  const auto outcomes = link.outcomes();
  ASSERT_EQ(outcomes.size(), 2U);
  EXPECT_TRUE(outcomes[0].first);
  EXPECT_EQ(outcomes[1].sent, 4U);
  EXPECT_EQ(outcomes[1].left_out + outcomes[1].failed, 0U);
  for (std::uint64_t k = 0; k < 4; ++k) {
    const auto path = folder.path() / "frames" / hil::frame_name(k, "fits");
    EXPECT_EQ(engine::read_fits(path.string()).pixels()[5], k);
  }
}

TEST(OpenLink, ALinkBesideTheFirstThatFailsIsCountedAndSaysWhy) {
  const test_support::TemporaryFolder folder;
  const auto frames = folder.path() / "frames";
  OpenLink link(read("to = ['mock', 'file:" + frames.string() + "']\n"), kCamera,
                hil::WhenBusy::kWait);
  std::filesystem::remove_all(frames);
  engine::DnImage image(8, 6);
  EXPECT_TRUE(link.frames().send(numbered(0, image), engine::Duration(1'000'000'000)).ok());
  link.finish();
  EXPECT_EQ(link.outcomes()[1].failed, 1U);
  EXPECT_EQ(link.outcomes()[1].failure, "file: not written");
}

TEST(OpenLink, ALinkWithoutAWayBackHasASourceThatSaysNothing) {
  const test_support::TemporaryFolder folder;
  const OpenLink link(read("to = 'file:" + folder.path().string() + "'\n"), kCamera,
                      hil::WhenBusy::kDropFrame);
  ASSERT_EQ(link.commands().size(), 1U);
  EXPECT_EQ(link.commands()[0]->receive({}).error().fault, engine::Fault::kTimeout);
}

}  // namespace
