#include "hil/packet_auth.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/contract.h"
#include "engine/core/crc32c.h"
#include "hil/space_packet.h"
#include "tests/support/temp_file.h"

namespace {

using hil::CommandPacket;
using hil::decode_command;
using hil::PacketFault;
using hil::PacketKey;
using test_support::TempFile;

using Bytes = std::vector<std::byte>;

Bytes bytes_of(const std::string& text) {
  Bytes out;
  for (const char c : text) out.push_back(static_cast<std::byte>(c));
  return out;
}
Bytes repeated(unsigned value, std::size_t n) { return Bytes(n, static_cast<std::byte>(value)); }

std::string hex(std::span<const std::byte> bytes) {
  std::string out;
  for (const std::byte b : bytes) {
    out += "0123456789abcdef"[static_cast<unsigned>(b) >> 4];
    out += "0123456789abcdef"[static_cast<unsigned>(b) & 15];
  }
  return out;
}

PacketKey key(unsigned value = 0x42) { return PacketKey(repeated(value, 32)); }

CommandPacket signed_packet(const PacketKey& k, hil::CommandKind kind = hil::CommandKind::kTrim) {
  hil::Command c;
  c.kind = kind;
  c.sequence = 77;
  c.more_follow = true;
  c.trim_offset_rad = {1e-4, -2e-4};
  CommandPacket packet = hil::encode_command(c);
  hil::sign(packet, k);
  return packet;
}

/// Makes the checksum right again: what only the signature catches.
void mend(CommandPacket& packet) {
  const std::size_t end = packet.used - 4;
  const std::uint32_t crc = engine::crc32c(std::span(packet.storage).first(end));
  for (std::size_t i = 0; i < 4; ++i)
    packet.storage[end + i] = static_cast<std::byte>(crc >> (24 - 8 * i));
}

void expect_refused(std::span<const std::byte> bytes, const PacketKey* k, PacketFault fault) {
  const auto got = decode_command(bytes, k);
  ASSERT_FALSE(got.ok());
  EXPECT_EQ(got.error().fault, engine::Fault::kRejected);
  EXPECT_EQ(static_cast<PacketFault>(got.error().code), fault) << got.error().step;
}

// RFC 4231, section 4: test cases 1 to 4, 6 and 7 (5 is about truncation).
TEST(PacketAuth, SignsAsTheStandardsTestCasesSay) {
  Bytes counting;
  for (unsigned i = 1; i <= 25; ++i) counting.push_back(static_cast<std::byte>(i));
  struct Case {
    Bytes key;
    Bytes data;
    const char* expected;
  };
  const std::vector<Case> cases = {
      {repeated(0x0B, 20), bytes_of("Hi There"),
       "b0344c61d8db38535ca8afceaf0bf12b881dc200c9833da726e9376c2e32cff7"},
      {bytes_of("Jefe"), bytes_of("what do ya want for nothing?"),
       "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843"},
      {repeated(0xAA, 20), repeated(0xDD, 50),
       "773ea91e36800e46854db8ebd09181a72959098b3ef8c122d9635514ced565fe"},
      {counting, repeated(0xCD, 50),
       "82558a389a443c0ea4cc819899f2083a85f0faa3e578f8077a2e3ff46729665b"},
      {repeated(0xAA, 131), bytes_of("Test Using Larger Than Block-Size Key - Hash Key First"),
       "60e431591ee0b67f0d8a26aacbf5b77f8e0bc6213728c5140546040f0ee37f54"},
      {repeated(0xAA, 131),
       bytes_of("This is a test using a larger than block-size key and a larger than block-size "
                "data. The key needs to be hashed before being used by the HMAC algorithm."),
       "9b09ffa71b942fcb27635fbcd5b0e944bfdc63644f0713938a7f51535c3a35e2"}};
  for (const Case& c : cases) {
    const PacketKey k(c.key);
    // Twice: the second signature starts over as well.
    EXPECT_EQ(hex(k.sign(c.data)), c.expected);
    EXPECT_EQ(hex(k.sign(c.data)), c.expected);
    EXPECT_TRUE(k.matches(c.data, k.sign(c.data)));
  }
}

TEST(PacketAuth, ASignedCommandComesBackWithItsKeyAndOnlyWithIt) {
  const PacketKey mine = key(1);
  const PacketKey other = key(2);
  for (const auto kind : {hil::CommandKind::kReport, hil::CommandKind::kTrim,
                          hil::CommandKind::kAttitude, hil::CommandKind::kMode}) {
    const CommandPacket packet = signed_packet(mine, kind);
    const auto got = decode_command(packet.bytes(), &mine);
    ASSERT_TRUE(got.ok()) << got.error().step;
    EXPECT_EQ(got.value().sequence, 77U);
    EXPECT_TRUE(got.value().more_follow);
    EXPECT_EQ(hil::packet_bytes(packet.bytes()), packet.used);
    expect_refused(packet.bytes(), &other, PacketFault::kSignature);
    expect_refused(packet.bytes(), nullptr, PacketFault::kSignature);
  }
}

TEST(PacketAuth, WithAKeyAnUnsignedCommandIsNone) {
  const PacketKey k = key();
  const CommandPacket packet = hil::encode_command(hil::Command{});
  EXPECT_TRUE(decode_command(packet.bytes()).ok());
  expect_refused(packet.bytes(), &k, PacketFault::kUnsigned);
}

TEST(PacketAuth, EverySingleBitIsUnderTheSignature) {
  const PacketKey k = key();
  const CommandPacket good = signed_packet(k);
  for (std::size_t bit = 0; bit < 8 * (good.used - 4); ++bit) {
    CommandPacket forged = good;
    forged.storage[bit / 8] ^= static_cast<std::byte>(1U << (bit % 8));
    mend(forged);
    ASSERT_FALSE(decode_command(forged.bytes(), &k).ok()) << bit;
  }
  EXPECT_TRUE(decode_command(good.bytes(), &k).ok());
}

TEST(PacketAuth, ASignatureThatIsTakenOffLeavesNoCommand) {
  const PacketKey k = key();
  CommandPacket packet = signed_packet(k);
  packet.used -= hil::kSignatureBytes;
  packet.storage[5] = static_cast<std::byte>(packet.used - 7);
  mend(packet);
  expect_refused(packet.bytes(), &k, PacketFault::kMalformed);  // it still says it is signed
  packet.storage[7] = std::byte{1};
  mend(packet);
  expect_refused(packet.bytes(), &k, PacketFault::kUnsigned);
}

TEST(PacketAuth, AShorterSignatureNeverMatches) {
  const PacketKey k = key();
  const Bytes data = bytes_of("data");
  const hil::Signature right = k.sign(data);
  for (std::size_t n = 0; n < right.size(); ++n)
    EXPECT_FALSE(k.matches(data, std::span(right).first(n))) << n;
}

TEST(PacketAuth, AKeyFileIsHexadecimalOrElseItsBytes) {
  const std::string digits = "000102030405060708090a0B0C0D0E0F";
  Bytes expected;
  for (unsigned i = 0; i < 16; ++i) expected.push_back(static_cast<std::byte>(i));
  const Bytes message = bytes_of("message");
  const TempFile lines("key_hex", digits.substr(0, 16) + "\n  " + digits.substr(16) + "\r\n");
  EXPECT_EQ(PacketKey::from_file(lines.path(), "k").sign(message),
            PacketKey(expected).sign(message));
  const std::string words = "correct horse battery staple\n";
  const TempFile raw("key_raw", words);
  EXPECT_EQ(PacketKey::from_file(raw.path(), "k").sign(message),
            PacketKey(bytes_of(words)).sign(message));
}

std::string complaint(const std::string& path) {
  try {
    static_cast<void>(PacketKey::from_file(path, "a.toml:3: port.key_file"));
  } catch (const engine::ConfigError& e) {
    return e.what();
  }
  return "none";
}

TEST(PacketAuth, AFileThatIsNoKeyIsComplainedOf) {
  const TempFile hex_short("key_short", "000102030405060708090a0b0c0d0e");
  EXPECT_EQ(
      complaint(hex_short.path()),
      "a.toml:3: port.key_file must be a key of 16 to 1024 bytes, got 15 in " + hex_short.path());
  const TempFile raw_short("key_raw_short", "fifteen letters");
  EXPECT_NE(complaint(raw_short.path()).find("got 15"), std::string::npos);
  const TempFile empty("key_empty", "");
  EXPECT_NE(complaint(empty.path()).find("got 0"), std::string::npos);
  const TempFile huge("key_huge", std::string(100'000, 'x'));
  EXPECT_NE(complaint(huge.path()).find("must be a key"), std::string::npos);
  EXPECT_EQ(complaint("/nonexistent/key"),
            "a.toml:3: port.key_file cannot read the key file /nonexistent/key");
  EXPECT_EQ(complaint("/"), "a.toml:3: port.key_file cannot read the key file /");
  const TempFile right("key_right", "sixteen letters!");
  EXPECT_EQ(complaint(right.path()), "none");
}

}  // namespace
