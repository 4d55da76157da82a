// The program as its user meets it: arguments in, files and an exit code out.

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <starloop_test_paths.h>
#include <nlohmann/json.hpp>

#include "engine/core/fits.h"
#include "hil/frame_store.h"
#include "tests/tools/program.h"

namespace {

namespace fs = std::filesystem;
using program::content_of;
using program::Outcome;
using program::starloop;
using program::TemporaryFolder;

const std::string kFlyby = STARLOOP_SOURCE_DIR "/config/flyby.toml";
constexpr int kGood = 0;
constexpr int kCriterionFailed = 1;
constexpr int kBadInput = 2;
constexpr int kDeviceFault = 3;

/// A lockstep run with few samples, for laws that do not depend on how good the picture is.
Outcome short_run(const fs::path& out, const std::vector<std::string>& more) {
  std::vector<std::string> arguments = {"run", kFlyby, "--quiet", "--out", out.string()};
  for (const std::string set : {"run.clock=lockstep", "render.samples_per_pixel=9"}) {
    arguments.emplace_back("--set");
    arguments.push_back(set);
  }
  arguments.insert(arguments.end(), more.begin(), more.end());
  return starloop(arguments);
}

nlohmann::json report_of(const fs::path& out) {
  return nlohmann::json::parse(content_of(out / "latest" / "report.json"));
}

std::vector<std::vector<std::string>> table_of(const fs::path& file) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(content_of(file));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream cells(line);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(cell);
  }
  return rows;
}

TEST(StarloopRun, OpenLoopLosesTheTarget) {
  const TemporaryFolder folder;
  const Outcome run = short_run(folder.path(), {"--open-loop", "--set", "run.duration_s=12"});
  // Without a loop there is no criterion to miss.
  EXPECT_EQ(run.exit_code, kGood) << run.err;
  const nlohmann::json report = report_of(folder.path());
  EXPECT_EQ(report.at("open_loop"), true);
  EXPECT_TRUE(report.at("criteria_met").is_null());
  EXPECT_EQ(report.at("frames").at("due"), 121);
  EXPECT_EQ(report.at("frames").at("sent"), 121);
  // 200 urad + 50 urad/s t is the way from the boresight to the edge of the frame, 512.5 px of
  // 1.4444 urad, at 10.8 s; 0.3 s are three frames.
  ASSERT_TRUE(report.at("pointing").at("lost_after_s").is_number());
  EXPECT_NEAR(report.at("pointing").at("lost_after_s").get<double>(), 10.8, 0.3);
  // Reports were heard, and nothing was obeyed.
  EXPECT_EQ(report.at("commands").at("taken"), 121);
  const auto frames = table_of(folder.path() / "latest" / "frames.csv");
  const auto& header = frames.front();
  const auto trim = static_cast<std::size_t>(
      std::find(header.begin(), header.end(), "trim_x_urad") - header.begin());
  ASSERT_LT(trim, header.size());
  for (std::size_t i = 1; i < frames.size(); ++i) EXPECT_EQ(std::stod(frames[i][trim]), 0.0);
}

TEST(StarloopRun, OneThreadAndTwoMakeTheSameRunToTheBit) {
  std::map<std::string, TemporaryFolder> folders;
  for (const std::string threads : {"1", "2"}) {
    const Outcome run = short_run(folders[threads].path(),
                                  {"--threads", threads, "--set", "run.duration_s=3", "--set",
                                   "run.record_every=5", "--set", "criteria.pointing_rms_px=0"});
    ASSERT_EQ(run.exit_code, kGood) << run.err;
    EXPECT_EQ(report_of(folders[threads].path()).at("threads"), std::stoi(threads));
  }
  const fs::path one = folders["1"].path() / "latest";
  const fs::path two = folders["2"].path() / "latest";
  EXPECT_EQ(content_of(one / "commands.csv"), content_of(two / "commands.csv"));

  const auto a = table_of(one / "frames.csv");
  const auto b = table_of(two / "frames.csv");
  ASSERT_EQ(a.size(), 32U);  // a header, and 31 frames in 3 s
  ASSERT_EQ(b.size(), a.size());
  int measured_times = 0;
  for (std::size_t column = 0; column < a[0].size(); ++column) {
    const std::string& name = a[0][column];
    if (name.size() > 3 && name.substr(name.size() - 3) == "_ms") {
      ++measured_times;
      continue;
    }
    for (std::size_t row = 0; row < a.size(); ++row)
      EXPECT_EQ(a[row].at(column), b[row].at(column)) << name << ", frame " << row - 1;
  }
  EXPECT_EQ(measured_times, 6);

  // A slow disk costs pictures, which is why not all of them are asked for.
  int pictures = 0;
  for (int frame = 0; frame < 31; frame += 5) {
    char name[32];
    std::snprintf(name, sizeof name, "frame_%06d.png", frame);
    if (!fs::exists(one / name) || !fs::exists(two / name)) continue;
    const std::string picture = content_of(one / name);
    EXPECT_EQ(picture.substr(1, 3), "PNG");
    EXPECT_TRUE(picture == content_of(two / name)) << name << " differs";
    ++pictures;
  }
  EXPECT_GE(pictures, 4);
}

TEST(StarloopRun, ExitCodeAndReportSayWhetherTheCriterionWasMet) {
  for (const bool met : {true, false}) {
    const TemporaryFolder folder;
    const Outcome run = short_run(
        folder.path(), {"--set", "run.duration_s=0.5", "--set", "criteria.after_s=0", "--set",
                        std::string("criteria.pointing_rms_px=") + (met ? "1000" : "0.001")});
    EXPECT_EQ(run.exit_code, met ? kGood : kCriterionFailed) << run.err;
    const nlohmann::json report = report_of(folder.path());
    EXPECT_EQ(report.at("criteria_met"), met);
    EXPECT_EQ(report.at("command_latency_frames"), 1);
    const nlohmann::json& f = report.at("frames");
    EXPECT_EQ(f.at("due").get<int>(), 6);
    EXPECT_EQ(f.at("due").get<int>(), f.at("sent").get<int>() + f.at("skipped").get<int>() +
                                          f.at("dropped").get<int>() + f.at("faults").get<int>());
  }
}

TEST(StarloopRun, AMissedCriterionOfDetectionIsSaidAndEndsWithOne) {
  const TemporaryFolder folder;
  // Lockstep takes one frame from an answer to the first that shows it; none is asked for.
  const Outcome run = short_run(
      folder.path(), {"--set", "run.duration_s=0.5", "--set", "criteria.pointing_rms_px=0", "--set",
                      "criteria.max_latency_frames=0", "--set", "criteria.min_detection_rate=0.9"});
  EXPECT_EQ(run.exit_code, kCriterionFailed);
  EXPECT_NE(run.err.find("the largest latency in frames is 1, and must be at most 0"),
            std::string::npos)
      << run.err << run.err;
  EXPECT_EQ(run.err.find("the detection rate"), std::string::npos) << run.out;
  const nlohmann::json report = report_of(folder.path());
  EXPECT_EQ(report.at("criteria_met"), false);
  EXPECT_EQ(report.at("detection").at("detected"), 6);
  EXPECT_EQ(report.at("statistics").at("latency").at("max"), 1.0);
  EXPECT_EQ(report.at("truth"),
            (nlohmann::json{{"frames", 6}, {"frames_lost", 0}, {"masks_lost", 0}}));
}

TEST(StarloopRun, TruthOfEveryFrameAndOfEveryPictureIsInTheFolder) {
  const TemporaryFolder folder;
  ASSERT_EQ(short_run(folder.path(), {"--set", "run.duration_s=0.5", "--set", "run.record_every=2",
                                      "--set", "criteria.pointing_rms_px=0"})
                .exit_code,
            kGood);
  const fs::path latest = folder.path() / "latest";
  std::istringstream lines(content_of(latest / "truth.jsonl"));
  int frames = 0;
  for (std::string line; std::getline(lines, line); ++frames) {
    const nlohmann::json truth = nlohmann::json::parse(line);
    EXPECT_EQ(truth.at("frame"), frames);
    int pixels = 0;
    for (const nlohmann::json& run : truth.at("mask").at("runs_row_begin_end"))
      pixels += run.at(2).get<int>() - run.at(1).get<int>();
    // 13 m at 300 km are 30 px.
    EXPECT_GT(pixels, 100);
    EXPECT_EQ(truth.at("mask_px"), pixels);
    EXPECT_EQ(truth.at("visible_fraction"), 1.0);
  }
  EXPECT_EQ(frames, 6);
  const nlohmann::json coco = nlohmann::json::parse(content_of(latest / "coco.json"));
  ASSERT_EQ(coco.at("images").size(), 3U);
  EXPECT_EQ(coco.at("annotations").size(), 3U);
  for (const nlohmann::json& image : coco.at("images"))
    EXPECT_TRUE(fs::exists(latest / image.at("file_name")));
  EXPECT_EQ(table_of(latest / "detections.csv").size(), 7U);
}

TEST(StarloopRun, BadInputIsTwoAndSaysWhatIsWrong) {
  const TemporaryFolder folder;
  struct Case {
    std::vector<std::string> arguments;
    std::string says;
  };
  const std::string out = folder.path().string();
  const std::vector<Case> cases = {
      {{}, "subcommand"},
      {{"fly", kFlyby}, "subcommand"},
      {{"run"}, "scenario"},
      {{"run", kFlyby, "--quick"}, "--quick"},
      {{"run", kFlyby, "--threads", "0"}, "--threads"},
      {{"run", kFlyby, "--threads", "many"}, "--threads"},
      {{"run", "/nowhere/at_all.toml", "--out", out}, "/nowhere/at_all.toml"},
      {{"run", kFlyby, "--out", out, "--set", "run.pass=17"}, "run.pass"},
      {{"run", kFlyby, "--out", out, "--set", "detector.bits=0"}, "detector.bits"},
      {{"run", kFlyby, "--out", out, "--set", "nonsense"}, "nonsense"},
      {{"run", kFlyby, "--out", out, "--set", "target.mesh=/nowhere/x.obj"}, "/nowhere/x.obj"},
      {{"passes", "/nowhere/at_all.toml"}, "/nowhere/at_all.toml"},
      {{"passes", kFlyby, "--time", "3"}, "--time"},
      {{"passes", kFlyby, "--pass", "0"}, "--pass"},
      {{"render", kFlyby}, "--time"},
      {{"render", kFlyby, "--time", "soon"}, "--time"},
      {{"render", kFlyby, "--time", "-1"}, "--time"},
      {{"render", "/nowhere/at_all.toml", "--time", "1"}, "/nowhere/at_all.toml"},
  };
  for (const Case& c : cases) {
    std::string line = "starloop";
    for (const std::string& argument : c.arguments) line += " " + argument;
    SCOPED_TRACE(line);
    const Outcome run = starloop(c.arguments);
    EXPECT_EQ(run.exit_code, kBadInput);
    EXPECT_NE(run.err.find(c.says), std::string::npos) << run.err;
  }
  EXPECT_TRUE(fs::is_empty(folder.path())) << "bad input left something behind";
}

TEST(StarloopRun, AFolderThatCannotBeMadeIsTheMachinesFault) {
  const Outcome run = short_run("/proc/starloop", {"--set", "run.duration_s=0.1"});
  EXPECT_EQ(run.exit_code, kDeviceFault);
  EXPECT_NE(run.err.find("/proc/starloop"), std::string::npos) << run.err;
}

TEST(StarloopRun, HelpIsNoMistake) {
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"--help"}, {"run", "--help"}, {"passes", "-h"}}) {
    const Outcome run = starloop(arguments);
    EXPECT_EQ(run.exit_code, kGood);
    EXPECT_FALSE(run.out.empty());
  }
}

TEST(StarloopRun, APatternGoesOverEveryLinkAndComesBackFromItsLog) {
  const TemporaryFolder folder;
  const fs::path frames = folder.path() / "frames";
  const Outcome run =
      short_run(folder.path(), {"--pattern", "--no-pictures", "--set", "run.duration_s=0.5",
                                "--set", "link.to=[\"mock\", \"file:" + frames.string() + "\"]"});
  EXPECT_EQ(run.exit_code, kGood) << run.err;
  const nlohmann::json report = report_of(folder.path());
  EXPECT_TRUE(report.at("criteria_met").is_null()) << "there is nothing to judge";
  EXPECT_EQ(report.at("pass").at("truncated"), false);
  EXPECT_EQ(report.at("links").at(0).at("name"), "mock");
  EXPECT_EQ(report.at("links").at(1).at("sent"), 6);
  EXPECT_EQ(report.at("links").at(1).at("failed"), 0);
  for (std::uint64_t k = 0; k < 6; ++k) {
    const auto image = engine::read_fits((frames / hil::frame_name(k, "fits")).string());
    ASSERT_EQ(image.width(), 1024);
    for (int v = 0; v < 1024; v += 11) {
      for (int u = 0; u < 1024; u += 13) {
        const auto i = static_cast<std::size_t>(1024 * v + u);
        ASSERT_EQ(image.pixels()[i], (static_cast<std::uint64_t>(u + 3 * v) + 7 * k) % 2048);
      }
    }
  }
  const Outcome replay = starloop({"replay", (folder.path() / "latest").string()});
  EXPECT_EQ(replay.exit_code, kGood) << replay.out << replay.err;
  EXPECT_NE(replay.out.find("6 of 6 frames equal"), std::string::npos);
}

TEST(StarloopLinks, SaysWhatThereIsAndWhatIsMissing) {
  const Outcome links = starloop({"links"});
  EXPECT_EQ(links.exit_code, kGood);
  for (const char* kind : {"mock ", "file ", "shm ", "v4l2 ", "usb "})
    EXPECT_NE(links.out.find(kind), std::string::npos) << links.out;
  EXPECT_NE(links.out.find("link.to=file:"), std::string::npos);
}

TEST(StarloopPasses, PrintsSixteenObjectsWithTheDocumentedKeys) {
  const Outcome run = starloop({"passes", kFlyby, "--json"});
  ASSERT_EQ(run.exit_code, kGood) << run.err;
  const nlohmann::json passes = nlohmann::json::parse(run.out);
  ASSERT_TRUE(passes.is_array());
  ASSERT_EQ(passes.size(), 16U);
  double last_end_s = 0;
  for (const nlohmann::json& p : passes) {
    ASSERT_EQ(p.size(), 17U);
    for (const char* key :
         {"start_s", "end_s", "duration_s", "closest_s", "min_range_km", "start_range_rate_km_s",
          "end_range_rate_km_s", "max_line_of_sight_rate_mrad_s", "closest_phase_angle_deg",
          "least_lit_fraction", "earth_behind_share"})
      ASSERT_TRUE(p.at(key).is_number()) << key;
    for (const char* key :
         {"start_utc", "closest_utc", "end_utc", "start_limited_by", "end_limited_by"})
      ASSERT_TRUE(p.at(key).is_string()) << key;
    EXPECT_EQ(p.at("truncated"), false);
    EXPECT_GT(p.at("start_s").get<double>(), last_end_s);
    EXPECT_GT(p.at("end_s").get<double>(), p.at("start_s").get<double>());
    EXPECT_NEAR(p.at("duration_s").get<double>(),
                p.at("end_s").get<double>() - p.at("start_s").get<double>(), 2e-9);
    EXPECT_LT(p.at("min_range_km").get<double>(), 300.0);
    last_end_s = p.at("end_s").get<double>();
  }
}

TEST(StarloopPasses, TellsWhatThePapersPassIsLike) {
  const Outcome run = starloop({"passes", kFlyby, "--json"});
  ASSERT_EQ(run.exit_code, kGood) << run.err;
  const nlohmann::json pass = nlohmann::json::parse(run.out).at(2);
  // range_windows_15d.csv, to the digits that stand there.
  EXPECT_EQ(pass.at("start_utc"), "2022-01-04T14:02:41.630");
  EXPECT_EQ(pass.at("end_utc"), "2022-01-04T14:03:21.782");
  EXPECT_NEAR(pass.at("max_line_of_sight_rate_mrad_s").get<double>(), 210.890042, 1e-5);
  EXPECT_NEAR(pass.at("closest_phase_angle_deg").get<double>(), 109.0832, 5e-5);
  EXPECT_NEAR(pass.at("earth_behind_share").get<double>(),
              (309790.435773 - 309773.159663) / 40.151593, 1e-6);
  EXPECT_EQ(pass.at("least_lit_fraction"), 1.0);
  // The range is sqrt(r0^2 + (v t)^2) of 300 km with 68.966 km at the closest, 14.544 km/s: the
  // bend of the orbits leaves some m/s.
  const double rate_km_s = 14.544238 * std::sqrt(1.0 - std::pow(68.965979 / 300.0, 2));
  EXPECT_NEAR(pass.at("start_range_rate_km_s").get<double>(), -rate_km_s, 0.03);
  EXPECT_NEAR(pass.at("end_range_rate_km_s").get<double>(), rate_km_s, 0.03);
}

TEST(StarloopPasses, WritesTablesAndDrawsThem) {
  const TemporaryFolder folder;
  const std::string csv = (folder.path() / "table.csv").string();
  const fs::path out = folder.path() / "made" / "here";
  const Outcome run = starloop({"passes", kFlyby, "--csv", csv, "--out", out.string(), "--pass",
                                "12", "--set", "scenario.epoch=2022-01-03T00:00:00", "--set",
                                "visibility.shadow=cylinder", "--set", "visibility.span_days=12"});
  ASSERT_EQ(run.exit_code, kGood) << run.err;
  EXPECT_EQ(content_of(csv), content_of(out / "passes.csv"));
  const std::string table = content_of(csv);
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 17);
  // visible_windows_other_epochs.csv: the twelfth comes out of the cylinder's shadow.
  const nlohmann::json passes = nlohmann::json::parse(content_of(out / "passes.json"));
  EXPECT_NEAR(passes.at(11).at("start_s").get<double>(), 1015177.153943, 1e-3);
  EXPECT_EQ(passes.at(11).at("start_limited_by"), "eclipse");
  const std::string conditions = content_of(out / "conditions.csv");
  for (const char* row :
       {"\nspan,0.000000000,1036800.0", "\nrange,1015164.872", "\neclipse,", "\nline-of-sight,",
        "\nsun-exclusion,0.0", "\nall,1015177.153", "\nearth-behind,10151"})
    EXPECT_NE(conditions.find(row), std::string::npos) << row;
  const std::string curves = content_of(out / "pass_12.csv");
  EXPECT_EQ(std::count(curves.begin(), curves.end(), '\n'), 403);  // 401, the closest, a header
  if (run.out.find("no picture") != std::string::npos) GTEST_SKIP() << "no python3 with matplotlib";
  for (const char* name : {"passes.png", "pass_12.png"})
    EXPECT_GT(fs::file_size(out / name), 10'000U) << name;
}

TEST(StarloopPasses, OfAShadowWithAPenumbraBeginLater) {
  // That pass again: past the flattened Earth the last of the umbra is crossed at another time.
  const auto start_s = [](const std::string& shadow) {
    const Outcome run =
        starloop({"passes", kFlyby, "--json", "--set", "scenario.epoch=2022-01-03T00:00:00",
                  "--set", "visibility.shadow=" + shadow});
    EXPECT_EQ(run.exit_code, kGood) << run.err;
    return nlohmann::json::parse(run.out).at(11).at("start_s").get<double>();
  };
  const double cone_s = start_s("cone");
  // Half a penumbra of eight seconds or so before the cylinder lets go.
  EXPECT_NEAR(cone_s, 1015177.15 - 4.5, 1.5);
  EXPECT_LT(start_s("oblate-cone"), cone_s);  // a smaller Earth
}

TEST(StarloopPasses, ThatThereAreNoneIsSaidAndDrawn) {
  const TemporaryFolder folder;
  const fs::path out = folder.path() / "none";
  const Outcome run = starloop({"passes", kFlyby, "--out", out.string(), "--set",
                                "visibility.max_range_km=1", "--set", "visibility.span_days=1"});
  EXPECT_EQ(run.exit_code, kGood) << run.err;
  EXPECT_EQ(run.out.rfind("0 passes", 0), 0U) << run.out;
  EXPECT_EQ(nlohmann::json::parse(content_of(out / "passes.json")), nlohmann::json::array());
  const Outcome wrong = starloop({"passes", kFlyby, "--pass", "17"});
  EXPECT_EQ(wrong.exit_code, kBadInput);
  EXPECT_NE(wrong.err.find("--pass must be one of the 16 passes"), std::string::npos) << wrong.err;
}

TEST(StarloopMtf, WritesEveryTermAndTheirProduct) {
  const TemporaryFolder folder;
  const std::string csv = (folder.path() / "mtf.csv").string();
  const Outcome run = starloop({"mtf", kFlyby, "--out", csv, "--set", "optics.focus=infinity",
                                "--set", "optics.jitter_urad=0.5"});
  ASSERT_EQ(run.exit_code, kGood) << run.err;
  // At the closest, 68.966 km: D^2/8 of 1/Z.
  EXPECT_NE(run.out.find("defocus 234.9 nm"), std::string::npos) << run.out;
  std::ifstream file(csv);
  std::string line;
  ASSERT_TRUE(std::getline(file, line));
  EXPECT_EQ(line,
            "direction_deg,frequency_lp_mm,cycles_per_px,lens,defocus,jitter,vibration,table,"
            "pixel,smear,product_re,product_im");
  int rows = 0;
  while (std::getline(file, line)) {
    ++rows;
    std::vector<double> v;
    std::stringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) v.push_back(std::stod(cell));
    ASSERT_EQ(v.size(), 12U);
    // Nine digits are printed; the tables of the lens are of single precision.
    if (std::abs(v[3]) > 1e-2) {
      EXPECT_NEAR(v[3] * v[4] * v[5] * v[6] * v[7] * v[8] * v[9], v[10], 1e-6) << line;
    }
  }
  EXPECT_EQ(rows, 4 * 401);
  const Outcome bad = starloop({"mtf", kFlyby, "--out", "/nonexistent/mtf.csv"});
  EXPECT_EQ(bad.exit_code, kDeviceFault);
  EXPECT_NE(bad.err.find("/nonexistent/mtf.csv: cannot be written"), std::string::npos) << bad.err;
}

/// A camera so small that its bench takes a second.
const std::vector<std::string> kSmallCamera = {
    "--set", "camera.width_px=96", "--set", "camera.height_px=96", "--set", "detector.bits=12"};

Outcome characterized(const fs::path& out, const std::vector<std::string>& more) {
  std::vector<std::string> arguments = {"characterize", kFlyby, "--out", out.string()};
  arguments.insert(arguments.end(), kSmallCamera.begin(), kSmallCamera.end());
  arguments.insert(arguments.end(), more.begin(), more.end());
  return starloop(arguments);
}

TEST(StarloopCharacterize, WritesReportTablesAndPictures) {
  const TemporaryFolder folder;
  const fs::path out = folder.path() / "bench";
  const Outcome run = characterized(out, {});
  ASSERT_EQ(run.exit_code, kGood) << run.out << run.err;
  const auto report = nlohmann::json::parse(content_of(out / "report.json"));
  ASSERT_EQ(report["sensors"].size(), 2U);
  EXPECT_EQ(report["sensors"][0]["bits"], 12);
  EXPECT_EQ(report["sensors"][1]["bits"], 16);
  for (const auto& sensor : report["sensors"]) {
    const auto& gain = sensor["figures"][0];
    EXPECT_EQ(gain["key"], "gain_dn_e");
    EXPECT_NEAR(gain["measured"].get<double>() / gain["true"].get<double>(), 1.0, 0.005);
  }
  // The scenario has no pedestal: dark noise is cut off, and nobody says how large it is.
  const auto& hidden = report["sensors"][0]["figures"][9];
  EXPECT_EQ(hidden["key"], "read_noise_e");
  EXPECT_TRUE(hidden["measured"].is_null());
  EXPECT_EQ(hidden["standing"], "not measurable");
  EXPECT_NEAR(report["sensors"][1]["figures"][9]["measured"].get<double>(), 2.0, 0.02);
  for (const auto& edge : report["slanted_edge"])
    EXPECT_LT(std::abs(edge["worst_deviation"].get<double>()), 0.01);
  EXPECT_TRUE(report["missed"].empty());
  EXPECT_GT(table_of(out / "ptc.csv").size(), 100U);
  EXPECT_EQ(table_of(out / "dark.csv").size(), 1U + 2 * 17);
  EXPECT_EQ(table_of(out / "edge.csv").size(), 1U + 2 * 101);
  EXPECT_EQ(run.out.find(content_of(out / "report.txt")), 0U);
  if (run.out.find("no pictures") == std::string::npos) {
    for (const std::string name : {"transfer", "linearity", "dark", "snr", "edge"})
      EXPECT_GT(fs::file_size(out / (name + ".png")), 10'000U) << name;
  }
}

TEST(StarloopCharacterize, RefusesWhatItCannotMeasure) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "file";
  std::ofstream(file) << "here";
  const Outcome taken = characterized(file, {});
  EXPECT_EQ(taken.exit_code, kDeviceFault);
  EXPECT_NE(taken.err.find(file.string()), std::string::npos) << taken.err;
  const Outcome blind = characterized(folder.path() / "a", {"--set", "detector.pedestal_dn=5000"});
  EXPECT_EQ(blind.exit_code, kBadInput);
  EXPECT_NE(blind.err.find("flyby.toml: no light makes a signal"), std::string::npos) << blind.err;
  const Outcome tiny = characterized(folder.path() / "b", {"--set", "camera.width_px=16"});
  EXPECT_EQ(tiny.exit_code, kBadInput);
  EXPECT_NE(tiny.err.find("32 pixels are the least"), std::string::npos) << tiny.err;
  EXPECT_EQ(characterized(folder.path() / "c", {"--set", "detector.bits=7"}).exit_code, kBadInput);
}

TEST(StarloopPasses, PrintsALineForEach) {
  const Outcome quiet = starloop({"passes", kFlyby, "--quiet"});
  EXPECT_EQ(quiet.exit_code, kGood);
  EXPECT_EQ(std::count(quiet.out.begin(), quiet.out.end(), '\n'), 17);  // and a header
}

TEST(StarloopRender, WritesTheSameFitsAndPngOnAnyNumberOfThreads) {
  const TemporaryFolder folder;
  std::map<std::string, std::string> fits;
  std::map<std::string, std::string> png;
  for (const std::string threads : {"1", "2"}) {
    const fs::path file = folder.path() / ("frame" + threads + ".fits");
    const Outcome run =
        starloop({"render", kFlyby, "--time", "309781.7", "--threads", threads, "--out",
                  file.string(), "--set", "render.samples_per_pixel=9", "--quiet"});
    ASSERT_EQ(run.exit_code, kGood) << run.err;
    EXPECT_EQ(run.out, "");
    fits[threads] = content_of(file);
    png[threads] = content_of(fs::path(file).replace_extension(".png"));
  }
  EXPECT_EQ(fits["1"].substr(0, 9), "SIMPLE  =");
  // Blocks of 2880 bytes: a header, and 1024 x 1024 pixels of two bytes.
  EXPECT_EQ(fits["1"].size() % 2880, 0U);
  EXPECT_GE(fits["1"].size(), 2880U + 2U * 1024U * 1024U);
  EXPECT_EQ(png["1"].substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_TRUE(fits["1"] == fits["2"]);
  EXPECT_TRUE(png["1"] == png["2"]);
}

TEST(StarloopRender, SeedChangesTheNoiseAndNothingMore) {
  const TemporaryFolder folder;
  std::vector<std::string> frames;
  for (const std::string seed : {"1", "2", "1"}) {
    const fs::path file = folder.path() / "frame.fits";
    ASSERT_EQ(starloop({"render", kFlyby, "--time", "309781.7", "--seed", seed, "--out",
                        file.string(), "--set", "render.samples_per_pixel=4", "--quiet"})
                  .exit_code,
              kGood);
    frames.push_back(content_of(file));
  }
  EXPECT_TRUE(frames[0] == frames[2]);
  EXPECT_FALSE(frames[0] == frames[1]);
}

TEST(StarloopRender, SeveralTimesGiveFramesAsEachAloneAndASheet) {
  const TemporaryFolder folder;
  const auto render = [&](const std::string& times, const std::string& name) {
    const Outcome run =
        starloop({"render", "--set", "render.samples_per_pixel=4", "--quiet", "--tile", "100",
                  "--out", (folder.path() / name).string(), "--time", times, kFlyby});
    EXPECT_EQ(run.exit_code, kGood) << run.err;
  };
  render("309779.63,309782.63", "pass.fits");
  render("309782.63", "second.fits");
  EXPECT_TRUE(content_of(folder.path() / "pass_2.fits") ==
              content_of(folder.path() / "second.fits"));
  EXPECT_FALSE(content_of(folder.path() / "pass_1.fits") ==
               content_of(folder.path() / "pass_2.fits"));
  EXPECT_TRUE(fs::exists(folder.path() / "pass_1.png"));
  // PNG has the width and the height as its first numbers: two squares of 100 px in a row.
  const std::string sheet = content_of(folder.path() / "pass.png");
  ASSERT_GT(sheet.size(), 24U);
  const auto number = [&](std::size_t at) {
    return static_cast<unsigned char>(sheet[at + 2]) * 256 +
           static_cast<unsigned char>(sheet[at + 3]);
  };
  EXPECT_EQ(number(16), 2 * 100 + 3 * 4);
  EXPECT_GT(number(20), 100);
  EXPECT_LT(number(20), 150);
  EXPECT_FALSE(fs::exists(folder.path() / "pass.fits"));
}

TEST(StarloopMesh, TellsAndDrawsWhatIsWrongWithAFile) {
  const TemporaryFolder folder;
  const std::string file = folder.path() / "box.obj";
  // In millimetres, without a lid, one face flipped, one there twice, one without area.
  std::ofstream(file)
      << "v 0 0 0\nv 3e3 0 0\nv 3e3 2e3 0\nv 0 2e3 0\nv 0 0 1e3\nv 3e3 0 1e3\n"
         "v 3e3 2e3 1e3\nv 0 2e3 1e3\nusemtl foil\nf 4 3 2 1\nf 1 2 6 5\nf 6 7 3 2\n"
         "f 3 4 8 7\nf 4 1 5 8\nf 8 5 1 4\nf 1 1 2\n";
  const std::string picture = folder.path() / "box.png";
  const Outcome mesh =
      starloop({"mesh", file, "--units", "mm", "--axes=z x y", "--json", "-o", picture});
  ASSERT_EQ(mesh.exit_code, kGood) << mesh.err;
  const nlohmann::json report = nlohmann::json::parse(mesh.out);
  EXPECT_EQ(report.at("left_out").at("duplicate").at("first_lines"), nlohmann::json({15}));
  EXPECT_EQ(report.at("left_out").at("zero_area").at("first_lines"), nlohmann::json({16}));
  EXPECT_EQ(report.at("mended").at("flipped").at("first_lines"), nlohmann::json({12}));
  EXPECT_EQ(report.at("told").at("open_edges").at("count"), 4);
  EXPECT_EQ(report.at("told").at("t_junctions").at("count"), 0);
  EXPECT_EQ(report.at("materials").at(0).at("name"), "foil");
  EXPECT_NEAR(report.at("area_m2").get<double>(), 16.0, 1e-5);
  EXPECT_NEAR(report.at("high_m").at(0).get<double>(), 1.0, 1e-6);
  EXPECT_NEAR(report.at("high_m").at(1).get<double>(), 3.0, 1e-6);
  EXPECT_TRUE(report.at("warnings").empty());
  EXPECT_GT(fs::file_size(picture), 20'000U);
  // Nothing else is left beside it.
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 2);
}

TEST(StarloopMesh, DrawsAFileWithNamesThatAreNotUtf8AndTellsThePictureItWrote) {
  const TemporaryFolder folder;
  const std::string file = folder.path() / "wing.obj";
  std::ofstream(file) << "v 0 0 0\nv 3 0 0\nv 3 2 0\ng Fl\xfcgel\nusemtl wei\xdf\nf 1 2 3\n";
  const std::string picture = folder.path() / "wing";
  const Outcome mesh = starloop({"mesh", file, "-o", picture});
  ASSERT_EQ(mesh.exit_code, kGood) << mesh.err;
  EXPECT_NE(mesh.out.find("picture    " + picture + ".png\n"), std::string::npos) << mesh.out;
  EXPECT_GT(fs::file_size(picture + ".png"), 10'000U);
  // What cannot be drawn leaves nothing either.
  EXPECT_NE(starloop({"mesh", file, "-o", picture + ".nonsense"}).exit_code, kGood);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 2);
}

TEST(StarloopMesh, RefusesWhatIsNoMesh) {
  EXPECT_EQ(starloop({"mesh", "/nowhere/a.obj"}).err,
            "starloop: /nowhere/a.obj: expected an OBJ mesh, found no file to read\n");
  EXPECT_EQ(starloop({"mesh", "telescope", "--units", "mm"}).exit_code, kBadInput);
  EXPECT_EQ(starloop({"mesh", "telescope", "--axes=x y -z"}).exit_code, kBadInput);
  const Outcome program = starloop({"mesh", STARLOOP_PROGRAM, "-o", ""});
  EXPECT_EQ(program.exit_code, kBadInput);
  EXPECT_NE(program.err.find("expected the text of an OBJ mesh"), std::string::npos) << program.err;
}

}  // namespace
