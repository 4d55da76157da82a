#include "engine/core/config_reader.h"

#include <functional>
#include <limits>

#include <gtest/gtest.h>

#include "tests/support/temp_file.h"

namespace engine {
namespace {

constexpr const char* kText =
    "# a scenario\n"
    "[detector]\n"
    "full_well_e = -30000\n"
    "bits = 11\n"
    "name = \"x\"\n"
    "half = 0.5\n"
    "on = true\n"
    "list = [1, 2]\n"
    "[orbit.camera]\n"
    "a = 7000\n"
    "[orbit.target]\n"
    "a = nan\n"
    "b = inf\n";

ConfigReader reader() { return ConfigReader::from_text(kText, "config/flyby.toml"); }

std::string complaint(const std::function<void()>& action) {
  try {
    action();
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "no complaint";
}

TEST(ConfigReader, ReadsNumbersWordsAndTables) {
  const ConfigReader config = reader();
  const ConfigTable detector = config.table("detector");
  EXPECT_EQ(detector.number("half", any_number()), 0.5);
  EXPECT_EQ(detector.number("bits", any_number()), 11.0);
  EXPECT_EQ(detector.integer("bits", between(8, 16)), 11);
  EXPECT_EQ(detector.text("name"), "x");
  EXPECT_TRUE(detector.has("bits"));
  EXPECT_FALSE(detector.has("bit"));
  EXPECT_TRUE(detector.is_text("name"));
  EXPECT_FALSE(detector.is_text("bits"));
  EXPECT_EQ(config.table("orbit.camera").number("a", any_number()), 7000.0);
  EXPECT_EQ(config.tables_below("orbit"), (std::vector<std::string>{"camera", "target"}));
  EXPECT_TRUE(config.tables_below("nowhere").empty());
  EXPECT_EQ(config.name(), "config/flyby.toml");
}

TEST(ConfigReader, FallsBackOnlyWhereNothingStands) {
  const ConfigReader config = reader();
  const ConfigTable detector = config.table("detector");
  EXPECT_EQ(detector.number_or("gain", 2.5, positive()), 2.5);
  EXPECT_EQ(detector.integer_or("depth", 3, positive()), 3);
  EXPECT_EQ(detector.text_or("word", "w"), "w");
  EXPECT_EQ(config.table("nowhere").number_or("x", 1.0, any_number()), 1.0);
  EXPECT_THROW(static_cast<void>(detector.number_or("full_well_e", 1.0, positive())), ConfigError);
}

TEST(ConfigReader, ComplaintPointsAtTheLine) {
  const ConfigReader config = reader();
  const ConfigTable detector = config.table("detector");
  EXPECT_EQ(complaint([&] { static_cast<void>(detector.number("full_well_e", positive())); }),
            "config/flyby.toml:3: detector.full_well_e must be > 0, got -30000");
  EXPECT_EQ(complaint([&] { static_cast<void>(detector.number("half", between(1, 2))); }),
            "config/flyby.toml:6: detector.half must be >= 1 and <= 2, got 0.5");
  EXPECT_EQ(complaint([&] { static_cast<void>(detector.number("half", from_below(-1, 0.5))); }),
            "config/flyby.toml:6: detector.half must be >= -1 and < 0.5, got 0.5");
  EXPECT_EQ(complaint([&] { static_cast<void>(detector.number("name", positive())); }),
            "config/flyby.toml:5: detector.name must be > 0, got \"x\"");
  EXPECT_EQ(complaint([&] { static_cast<void>(detector.number("on", positive())); }),
            "config/flyby.toml:7: detector.on must be > 0, got true");
  EXPECT_EQ(complaint([&] { static_cast<void>(detector.text("half")); }),
            "config/flyby.toml:6: detector.half must be text, got 0.5");
  EXPECT_EQ(complaint([&] { static_cast<void>(detector.integer("half", any_number())); }),
            "config/flyby.toml:6: detector.half must be a whole number, got 0.5");
  EXPECT_EQ(complaint([&] { static_cast<void>(detector.number("gain", positive())); }),
            "config/flyby.toml: detector.gain is missing, expected > 0");
  EXPECT_EQ(complaint([&] { static_cast<void>(config.table("detector.bits")); }),
            "config/flyby.toml:4: detector.bits must be a table, got 11");
}

TEST(ConfigReader, TakesNoNumberThatIsNotFinite) {
  const ConfigReader config = reader();
  const ConfigTable target = config.table("orbit.target");
  EXPECT_EQ(complaint([&] { static_cast<void>(target.number("a", any_number())); }),
            "config/flyby.toml:12: orbit.target.a must be a number, got nan");
  EXPECT_THROW(static_cast<void>(target.number("b", any_number())), ConfigError);
  EXPECT_THROW(static_cast<void>(target.integer("b", any_number())), ConfigError);
}

TEST(ConfigReader, TakesOneOfAFewWords) {
  const ConfigReader config = reader();
  const ConfigTable detector = config.table("detector");
  const ConfigTable::Choices<int> choices{{"x", 1}, {"y", 2}};
  EXPECT_EQ(detector.choice_or<int>("name", "y", choices), 1);
  EXPECT_EQ(detector.choice_or<int>("other", "y", choices), 2);
  EXPECT_EQ(complaint([&] {
              static_cast<void>(detector.choice_or<int>("name", "y", {{"y", 2}, {"z", 3}}));
            }),
            "config/flyby.toml:5: detector.name must be one of \"y\", \"z\", got \"x\"");
}

TEST(ConfigReader, RefusesKeysThatNobodyAskedFor) {
  const ConfigReader config =
      ConfigReader::from_text("[a]\nx = 1\n[a.b]\ny = 2\nzz = 3\n", "s.toml");
  static_cast<void>(config.table("a").number("x", any_number()));
  static_cast<void>(config.table("a.b").number("y", any_number()));
  EXPECT_EQ(complaint([&] { config.reject_unknown_keys(); }),
            "s.toml:5: a.b.zz is not a key of a scenario");
  static_cast<void>(config.table("a.b").has("zz"));
  EXPECT_NO_THROW(config.reject_unknown_keys());
}

TEST(ConfigReader, SetOverridesAndIsNamedInComplaints) {
  ConfigReader config = reader();
  config.set("detector.full_well_e=20000");
  config.set("detector.name=plain word");
  config.set("new.table.key=1.5");
  EXPECT_EQ(config.table("detector").number("full_well_e", positive()), 20000.0);
  EXPECT_EQ(config.table("detector").text("name"), "plain word");
  EXPECT_EQ(config.table("new.table").number("key", positive()), 1.5);
  config.set("detector.half=-1");
  EXPECT_EQ(
      complaint([&] { static_cast<void>(config.table("detector").number("half", positive())); }),
      "--set detector.half=-1: detector.half must be > 0, got -1");
  config.set("detector.half=3");
  EXPECT_EQ(config.table("detector").number("half", positive()), 3.0);
  config.set("detector.typo=3");
  for (const char* key : {"full_well_e", "bits", "name", "on", "list"})
    static_cast<void>(config.table("detector").has(key));
  static_cast<void>(config.table("orbit.camera").has("a"));
  static_cast<void>(config.table("orbit.target").has("a"));
  static_cast<void>(config.table("orbit.target").has("b"));
  EXPECT_EQ(complaint([&] { config.reject_unknown_keys(); }),
            "--set detector.typo=3: detector.typo is not a key of a scenario");
}

TEST(ConfigReader, SetRefusesWhatIsNoAssignment) {
  ConfigReader config = reader();
  for (const char* wrong : {"", "=", "a", "a=1", ".a=1", "a.=1", "detector=1", "detector.bits",
                            "detector.bits.deep=1", "orbit.camera=1"})
    EXPECT_THROW(config.set(wrong), ConfigError) << wrong;
  EXPECT_EQ(config.table("detector").integer("bits", any_number()), 11);
}

TEST(ConfigReader, SetTakesTextWithEqualsAndDots) {
  ConfigReader config = reader();
  config.set("scenario.epoch=2022-01-01T00:00:00");
  EXPECT_EQ(config.table("scenario").text("epoch"), "2022-01-01T00:00:00");
  config.set("scenario.epoch=2022-01-01T00:00:00x");
  config.set("target.mesh=a.b/c=d.obj");
  EXPECT_EQ(config.table("target").text("mesh"), "a.b/c=d.obj");
  EXPECT_EQ(config.table("scenario").text("epoch"), "2022-01-01T00:00:00x");
}

TEST(ConfigReader, NamesTheLineOfASyntaxError) {
  const std::string words =
      complaint([] { static_cast<void>(ConfigReader::from_text("[a]\nx = \n", "s.toml")); });
  EXPECT_TRUE(words.starts_with("s.toml:2: ")) << words;
  for (const char* wrong : {"[a\n", "x = 1\nx = 2\n", "[[[[", "x = \"\n", "\xff\xfe", "x = 1 2\n"})
    EXPECT_THROW(static_cast<void>(ConfigReader::from_text(wrong, "s.toml")), ConfigError) << wrong;
}

TEST(ConfigReader, SurvivesDeepNesting) {
  const std::string deep(100000, '[');
  EXPECT_THROW(static_cast<void>(ConfigReader::from_text("x = " + deep, "s.toml")), ConfigError);
}

TEST(ConfigReader, ReadsAFileAndNamesOneThatIsNotThere) {
  const test_support::TempFile file("s.toml", "[a]\nx = 4\n");
  EXPECT_EQ(ConfigReader::from_file(file.path()).table("a").number("x", positive()), 4.0);
  EXPECT_TRUE(complaint([] {
                static_cast<void>(ConfigReader::from_file("/nowhere/s.toml"));
              }).starts_with("/nowhere/s.toml: "));
  EXPECT_THROW(static_cast<void>(ConfigReader::from_file("/")), ConfigError);
}

TEST(Range, KnowsItsEnds) {
  EXPECT_TRUE(positive().holds(1e-300));
  EXPECT_FALSE(positive().holds(0.0));
  EXPECT_TRUE(at_least(0.0).holds(0.0));
  EXPECT_TRUE(between(0.0, 1.0).holds(1.0));
  EXPECT_FALSE(from_below(0.0, 1.0).holds(1.0));
  EXPECT_FALSE(any_number().holds(std::numeric_limits<double>::quiet_NaN()));
  EXPECT_EQ(positive().text(), "> 0");
  EXPECT_EQ(from_below(0.0, 1.0).text(), ">= 0 and < 1");
  EXPECT_EQ(any_number().text(), "a number");
}

}  // namespace
}  // namespace engine
