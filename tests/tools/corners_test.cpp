// The table of `starloop selftest`.

#include <algorithm>
#include <set>
#include <sstream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/tools/program.h"

namespace {

using nlohmann::json;
using program::Outcome;
using program::starloop;

const Outcome& table_as_json() {
  static const Outcome outcome = starloop({"selftest", "--corners", "--json"});
  return outcome;
}
json rows() { return json::parse(table_as_json().out); }

TEST(Corners, AreAllWithinTheirBounds) {
  EXPECT_EQ(table_as_json().exit_code, 0) << table_as_json().err;
  EXPECT_GE(rows().size(), 55U);
  for (const json& row : rows()) EXPECT_TRUE(row["ok"].get<bool>()) << row.dump(2);
}

TEST(Corners, AreSuchThatThePlainMethodFailsThere) {
  for (const json& row : rows()) EXPECT_TRUE(row["plain_method_fails"].get<bool>()) << row.dump(2);
}

TEST(Corners, AreEachThereOnceAndSayWhereTheirBoundIsFrom) {
  std::set<std::string> regimes;
  for (const json& row : rows()) {
    EXPECT_TRUE(regimes.insert(row["regime"]).second) << row["regime"];
    EXPECT_GT(row["why"].get<std::string>().size(), 40U) << row["regime"];
  }
}

TEST(Corners, BreachedEndWithOne) {
  const Outcome outcome = starloop({"selftest", "--corners", "--bounds", "1e-9"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.out.find(" NOT\n"), std::string::npos) << outcome.out;
}

TEST(Corners, ThatShowNothingAreTold) {
  const Outcome outcome = starloop({"selftest", "--bounds", "1e9"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_NE(outcome.out.find("show nothing"), std::string::npos) << outcome.out;
}

TEST(Corners, MakeATableThatFitsATerminal) {
  for (const char* option : {"--corners", "--explain"}) {
    std::istringstream lines(starloop({"selftest", option}).out);
    std::size_t longest = 0;
    for (std::string line; std::getline(lines, line);) longest = std::max(longest, line.size());
    EXPECT_GT(longest, 80U);
    EXPECT_LE(longest, 110U) << option;
  }
}

}  // namespace
