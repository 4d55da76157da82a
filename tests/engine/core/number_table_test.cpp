#include "engine/core/number_table.h"

#include <gtest/gtest.h>

#include "engine/core/contract.h"
#include "tests/support/temp_file.h"

namespace {

using engine::NumberTable;
using engine::read_number_table;
using test_support::TempFile;

/// What is said about a file that holds `content`, without the file's name; at most three rows.
std::string complaint(const std::string& content) {
  const TempFile file("table.csv", content);
  try {
    static_cast<void>(read_number_table(file.path(), "a,b", 3));
  } catch (const engine::ConfigError& e) {
    const std::string text = e.what();
    EXPECT_EQ(text.substr(0, file.path().size()), file.path());
    return text.substr(file.path().size());
  }
  return "";
}

TEST(NumberTable, RowsKnowTheirLines) {
  const TempFile file("table.csv", "# from the bench\n\na, b\n1,2\n# between\r\n-3e-7 , 4.5\r\n");
  const NumberTable table = read_number_table(file.path(), "a,b", 3);
  ASSERT_EQ(table.rows.size(), 2U);
  EXPECT_EQ(table.rows[0].line, 4);
  EXPECT_EQ(table.rows[0].values, (std::vector<double>{1.0, 2.0}));
  EXPECT_EQ(table.rows[1].line, 6);
  EXPECT_EQ(table.rows[1].values, (std::vector<double>{-3e-7, 4.5}));
}

TEST(NumberTable, LastLineNeedsNoEnd) { EXPECT_EQ(complaint("a,b\n1,2"), ""); }

TEST(NumberTable, ColumnsMustBeNamed) {
  EXPECT_EQ(complaint(""), ":1: must name the columns \"a,b\", got nothing");
  EXPECT_EQ(complaint("#\n1,2\n"), ":2: must name the columns \"a,b\", got \"1,2\"");
}

TEST(NumberTable, CellsMustBeFiniteNumbersAndAsManyAsColumns) {
  for (const char* row :
       {"1", "1,", ",1", "1,2,3", "1,2,", "1;2", "x,2", "1,2x", "nan,1", "1,inf", "1e999,1"}) {
    EXPECT_EQ(complaint("a,b\n" + std::string(row) + "\n"),
              ":2: must be 2 finite numbers with commas between, got \"" + std::string(row) + "\"");
  }
}

TEST(NumberTable, TooManyRowsAreRefused) {
  EXPECT_EQ(complaint("a,b\n1,2\n1,2\n1,2\n"), "");
  EXPECT_EQ(complaint("a,b\n1,2\n1,2\n1,2\n1,2\n"), ":5: is beyond the 3 rows that are allowed");
}

TEST(NumberTable, AFileWithoutLineEndsIsNotTakenInWhole) {
  EXPECT_EQ(complaint("a,b\n" + std::string(1'000'000, '7')), ":2: is longer than 1000 characters");
  EXPECT_NE(complaint(std::string(100'000, '\0')), "");
}

TEST(NumberTable, AMissingFileIsNamed) {
  try {
    static_cast<void>(read_number_table("/nonexistent/x.csv", "a,b", 3));
    FAIL();
  } catch (const engine::ConfigError& e) {
    EXPECT_STREQ(e.what(), "/nonexistent/x.csv: expected a table, found no file to read");
  }
}

}  // namespace
