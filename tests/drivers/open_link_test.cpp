#include "drivers/open_link.h"

#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "drivers/client/starloop_client.h"

namespace {

using drivers::LinkKind;
using drivers::LinkSpec;
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
  EXPECT_EQ(none.kind, LinkKind::kMock);
  EXPECT_FALSE(none.telemetry_row);
  const LinkSpec all = read("kind = 'shm'\nname = '/a-b'\nslots = 7\ntelemetry_row = true\n");
  EXPECT_EQ(all.kind, LinkKind::kShm);
  EXPECT_EQ(all.name, "/a-b");
  EXPECT_EQ(all.slots, 7);
  EXPECT_TRUE(all.telemetry_row);
}

TEST(ReadLink, WhatIsWrongIsNamedWithItsLine) {
  EXPECT_EQ(complaint("kind = 'usb9'\n"),
            "x.toml:2: link.kind must be one of \"mock\", \"shm\", got \"usb9\"");
  EXPECT_NE(complaint("slots = 1\n").find("x.toml:2: link.slots must be"), std::string::npos);
  EXPECT_NE(complaint("slots = 17\n").find("x.toml:2: link.slots must be"), std::string::npos);
  EXPECT_EQ(complaint("telemetry_row = 1\n"),
            "x.toml:2: link.telemetry_row must be true or false, got 1");
  for (const std::string name : {"", "/", "a/b", "../a", "//a"})
    EXPECT_NE(complaint("name = '" + name + "'\n").find("x.toml:2: link.name must be"),
              std::string::npos)
        << name;
}

TEST(OpenLink, AMockHasItsDevicesSideAndNoOtherKindDoes) {
  const auto mock = drivers::open_link(LinkSpec{}, 8, 6, drivers::WhenFull::kWait);
  EXPECT_NE(mock.mock(), nullptr);
  LinkSpec spec{.kind = LinkKind::kShm};
  spec.name = "starloop-open-test-" + std::to_string(getpid());
  const auto shm = drivers::open_link(spec, 8, 6, drivers::WhenFull::kWait);
  EXPECT_EQ(shm.mock(), nullptr);
  EXPECT_FALSE(shm.frames().has_reader());
  starloop_client* client = nullptr;
  ASSERT_EQ(starloop_open(&client, spec.name.c_str(), 0), STARLOOP_OK) << starloop_last_error();
  EXPECT_TRUE(shm.frames().has_reader());
  starloop_close(client);
}

}  // namespace
