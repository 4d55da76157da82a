#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "hil/faults/fault_record.h"
#include "tests/support/faulty_line.h"

namespace {

using namespace faulty_line;
using engine::ConfigError;
using hil::FaultKind;

TEST(FaultWords, ARecordReadsAsARowAndAsJson) {
  const FaultSpec spec = faults("[faults.belt]\nkind = \"rays\"\n[faults.command_lost]");
  FaultRecord ray;
  ray.frame = 12;
  ray.since_start = Duration(1'200'000'000);
  ray.fault = 0;
  ray.kind = FaultKind::kRays;
  ray.place = 77;
  ray.count = 5;
  ray.amount = 1234;
  FaultRecord lost;
  lost.frame = 13;
  lost.since_start = Duration(1'300'000'001);
  lost.command = 9;
  lost.fault = 1;
  lost.kind = FaultKind::kCommandLost;
  std::ostringstream csv;
  hil::write_faults_csv(csv, spec, std::vector{ray, lost});
  EXPECT_EQ(csv.str(),
            "frame,since_start_s,fault,kind,command,place,count,amount\n"
            "12,1.2,belt,rays,,77,5,1234\n"
            "13,1.300000001,command_lost,command_lost,9,0,0,0\n");
  EXPECT_EQ(hil::fault_json(spec, ray),
            R"({"frame":12,"since_start_s":1.2,"fault":"belt","kind":"rays",)"
            R"("place":77,"count":5,"amount":1234})");
  EXPECT_EQ(hil::fault_json(spec, lost),
            R"({"frame":13,"since_start_s":1.300000001,"fault":"command_lost",)"
            R"("kind":"command_lost","command":9,"place":0,"count":0,"amount":0})");
}

std::string complaint(const std::string& toml) {
  try {
    static_cast<void>(faults(toml));
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "none";
}

TEST(FaultWords, AWrongScenarioIsToldWhereItIsWrong) {
  EXPECT_EQ(complaint("[faults.dropped]\nprobability = 1.5"),
            "faults.toml:2: faults.dropped.probability must be >= 0 and <= 1, got 1.5");
  EXPECT_EQ(complaint("[faults.dropped]\nfrom_s = 3\nto_s = 3"),
            "faults.toml:3: faults.dropped.to_s must be after from_s");
  EXPECT_EQ(complaint("[faults.late]\nframes = 0"),
            "faults.toml:2: faults.late.frames must be >= 1 and <= 32, got 0");
  EXPECT_EQ(complaint("[faults.hot_column]\ndn = 2048"),
            "faults.toml:2: faults.hot_column.dn must be >= 1 and <= 2047, got 2048");
  EXPECT_EQ(complaint("[faults.stuck_column]\ncolumn = 23\ncolumns = 2"),
            "faults.toml:2: faults.stuck_column.column must be >= 0 and <= 22, got 23");
  EXPECT_EQ(complaint("[faults.dropped]\nframes = 2"),
            "faults.toml:2: faults.dropped.frames is not a key of a scenario");
  EXPECT_EQ(complaint("[faults]\ndropped = 1"),
            "faults.toml:2: faults.dropped is not a key of a scenario");
  EXPECT_NE(complaint("[faults.storm]\nprobability = 1").find("must be one of \"away\", "),
            std::string::npos);
  EXPECT_NE(complaint("[faults.flipped]").find("faults.flipped.bit_error_rate is missing"),
            std::string::npos);
  EXPECT_NE(complaint("[faults.\"a,b\"]\nkind = \"dropped\"").find("letters"), std::string::npos);
}

}  // namespace
