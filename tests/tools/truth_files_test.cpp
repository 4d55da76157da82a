#include "tools/starloop/truth_files.h"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/temporary_folder.h"

namespace {

using engine::TruthMask;
using nlohmann::json;
using starloop::coco_run_lengths;
using starloop::TruthRecorder;
using test_support::content_of;
using test_support::TemporaryFolder;

constexpr int kWidth_px = 20;
constexpr int kHeight_px = 12;
constexpr engine::Duration kPatience = std::chrono::seconds(20);
using Pixels = std::vector<std::vector<bool>>;  // [row][column]

Pixels no_pixels() { return Pixels(kHeight_px, std::vector<bool>(kWidth_px)); }

/// A scatter that is different for each `salt`, and its runs.
Pixels scatter(std::uint32_t salt) {
  Pixels pixels = no_pixels();
  std::uint32_t x = salt * 2654435761U + 1;
  for (auto& row : pixels) {
    for (std::size_t u = 0; u < row.size(); ++u) {
      x = x * 1664525U + 1013904223U;
      row[u] = x >> 30 != 0;
    }
  }
  return pixels;
}

TruthMask mask_of(const Pixels& pixels, std::size_t most_runs = 1000) {
  TruthMask mask(most_runs);
  for (std::size_t v = 0; v < pixels.size(); ++v) {
    for (std::size_t u = 0; u < pixels[v].size(); ++u) {
      if (!pixels[v][u]) continue;
      std::size_t end = u;
      while (end < pixels[v].size() && pixels[v][end]) ++end;
      mask.add({static_cast<std::uint16_t>(v), static_cast<std::uint16_t>(u),
                static_cast<std::uint16_t>(end)});
      u = end;
    }
  }
  return mask;
}

/// As COCO's own decoder reads counts: down the columns, outside first.
Pixels decoded(const std::vector<std::uint32_t>& counts) {
  Pixels pixels = no_pixels();
  std::size_t at = 0;
  bool inside = false;
  for (const std::uint32_t count : counts) {
    for (std::uint32_t i = 0; i < count; ++i, ++at)
      pixels.at(at % kHeight_px).at(at / kHeight_px) = inside;
    inside = !inside;
  }
  EXPECT_EQ(at, static_cast<std::size_t>(kWidth_px * kHeight_px));
  return pixels;
}

std::vector<std::uint32_t> counts_of(const Pixels& pixels) {
  return coco_run_lengths(mask_of(pixels).runs(), kWidth_px, kHeight_px);
}

TEST(CocoRunLengths, DecodeToTheMaskAgain) {
  for (std::uint32_t salt = 0; salt < 50; ++salt) {
    const Pixels pixels = scatter(salt);
    EXPECT_EQ(decoded(counts_of(pixels)), pixels) << salt;
  }
}

TEST(CocoRunLengths, BeginWithWhatIsOutsideEvenIfThatIsNothing) {
  EXPECT_EQ(counts_of(no_pixels()), (std::vector<std::uint32_t>{kWidth_px * kHeight_px}));
  Pixels first = no_pixels();
  first[0][0] = true;
  EXPECT_EQ(counts_of(first), (std::vector<std::uint32_t>{0, 1, kWidth_px * kHeight_px - 1}));
  Pixels second_column = no_pixels();
  second_column[0][1] = second_column[1][1] = true;
  EXPECT_EQ(counts_of(second_column),
            (std::vector<std::uint32_t>{kHeight_px, 2, kWidth_px * kHeight_px - kHeight_px - 2}));
}

/// A frame of a run, as the sender sees it and as the observer does.
struct Shown {
  Pixels pixels;
  TruthMask mask;
  hil::Frame frame;
  hil::FrameRecord record;

  explicit Shown(std::uint64_t sequence, std::size_t most_runs = 1000)
      : pixels(sequence % 5 == 4 ? no_pixels() : scatter(static_cast<std::uint32_t>(sequence))),
        mask(mask_of(pixels, most_runs)) {
    frame.sequence = sequence;
    record.sequence = sequence;
    record.shutter_open = engine::sim_time(0.5 * static_cast<double>(sequence));
    record.handed_over = true;
    engine::FrameTruth& t = record.report.truth;
    t.range_m = 1000.0 + static_cast<double>(sequence);
    if (mask.runs().empty()) return;
    t.box = {kWidth_px, kHeight_px, 0, 0};
    for (const TruthMask::Run& run : mask.runs()) {
      t.mask_px += run.end - run.begin;
      t.box = {std::min<int>(t.box.left, run.begin), std::min<int>(t.box.top, run.row),
               std::max<int>(t.box.right, run.end), std::max<int>(t.box.bottom, run.row + 1)};
    }
    t.photocentre_px = {7.25, 3.5};
  }
  /// With the mask's place, which a copy of a Shown changes.
  [[nodiscard]] hil::Frame sent() const {
    hil::Frame f = frame;
    f.truth_mask = &mask;
    return f;
  }
};

TruthRecorder::Spec spec_for(const TemporaryFolder& folder, hil::WhenBusy when_busy) {
  return {.folder = folder.path(),
          .picture_every = 2,
          .width_px = kWidth_px,
          .height_px = kHeight_px,
          .when_busy = when_busy};
}

std::vector<json> lines_of(const TemporaryFolder& folder) {
  std::vector<json> lines;
  std::istringstream text(content_of(folder.path() / "truth.jsonl"));
  for (std::string line; std::getline(text, line);) lines.push_back(json::parse(line));
  return lines;
}

Pixels painted(const json& mask) {
  Pixels pixels = no_pixels();
  for (const json& run : mask.at("runs_row_begin_end"))
    for (int u = run.at(1); u < run.at(2); ++u)
      pixels.at(run.at(0)).at(static_cast<std::size_t>(u)) = true;
  return pixels;
}

TEST(TruthRecorder, EveryFrameGetsItsOwnMaskWhicheverComesFirst) {
  const TemporaryFolder folder;
  TruthRecorder recorder(spec_for(folder, hil::WhenBusy::kWait));
  std::vector<Shown> shown;
  for (std::uint64_t i = 0; i < 300; ++i) shown.emplace_back(i);
  shown[17].record.handed_over = false;
  {
    const std::jthread sender([&] {
      for (const Shown& s : shown)
        if (s.record.handed_over) {
          EXPECT_TRUE(recorder.send(s.sent(), kPatience).ok());
        }
    });
    for (const Shown& s : shown) recorder.add(s.record);
  }
  recorder.finish();
  EXPECT_EQ(recorder.lines(), 300U);
  EXPECT_EQ(recorder.masks_lost(), 0U);
  const std::vector<json> lines = lines_of(folder);
  ASSERT_EQ(lines.size(), 300U);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    SCOPED_TRACE(i);
    const json& line = lines[i];
    EXPECT_EQ(line.at("frame"), i);
    EXPECT_EQ(line.at("range_m"), 1000.0 + static_cast<double>(i));
    if (i == 17) {
      EXPECT_TRUE(line.at("mask").is_null());
      EXPECT_EQ(line.at("handed_over"), false);
      continue;
    }
    EXPECT_EQ(painted(line.at("mask")), shown[i].pixels);
    EXPECT_EQ(line.at("mask").at("truncated"), false);
    if (i % 5 == 4) {
      EXPECT_TRUE(line.at("photocentre_px").at(0).is_null());
      EXPECT_TRUE(line.at("box_px").is_null());
    } else {
      EXPECT_EQ(line.at("photocentre_px"), (json{7.25, 3.5}));
    }
  }
}

TEST(TruthRecorder, NeverWaitsForTheDiskButLosesMasksAndCountsThem) {
  const TemporaryFolder folder;
  TruthRecorder recorder(spec_for(folder, hil::WhenBusy::kDropFrame));
  // No record yet, so that no mask can be written: 64 fit.
  std::vector<Shown> shown;
  for (std::uint64_t i = 0; i < 70; ++i) shown.emplace_back(i);
  for (const Shown& s : shown) {
    const engine::Status status = recorder.send(s.sent(), kPatience);
    EXPECT_EQ(status.ok(), s.frame.sequence < 64);
    if (!status.ok()) {
      EXPECT_EQ(status.error().fault, engine::Fault::kBusy);
    }
  }
  for (const Shown& s : shown) recorder.add(s.record);
  recorder.finish();
  EXPECT_EQ(recorder.masks_lost(), 6U);
  const std::vector<json> lines = lines_of(folder);
  ASSERT_EQ(lines.size(), 70U);
  for (std::size_t i = 0; i < lines.size(); ++i)
    EXPECT_EQ(lines[i].at("mask").is_null(), i >= 64) << i;
}

TEST(TruthRecorder, AMaskWhoseRecordWasLostDoesNotGoToAnotherFrame) {
  const TemporaryFolder folder;
  TruthRecorder recorder(spec_for(folder, hil::WhenBusy::kDropFrame));
  std::vector<Shown> shown;
  for (std::uint64_t i = 0; i < 6; ++i) shown.emplace_back(i);
  for (const Shown& s : shown) EXPECT_TRUE(recorder.send(s.sent(), kPatience).ok());
  for (const std::size_t i : {1U, 3U}) recorder.add(shown[i].record);
  recorder.finish();
  const std::vector<json> lines = lines_of(folder);
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(painted(lines[0].at("mask")), shown[1].pixels);
  EXPECT_EQ(painted(lines[1].at("mask")), shown[3].pixels);
}

TEST(TruthRecorder, CocoDescribesThePicturesThatAreThere) {
  const TemporaryFolder folder;
  TruthRecorder recorder(spec_for(folder, hil::WhenBusy::kDropFrame));
  std::vector<Shown> shown;
  for (std::uint64_t i = 0; i < 10; ++i) shown.emplace_back(i, i == 8 ? 3 : 1000);
  for (const Shown& s : shown) {
    EXPECT_TRUE(recorder.send(s.sent(), kPatience).ok());
    recorder.add(s.record);
    // Every second frame has a picture; that of frame 2 was left out.
    if (s.frame.sequence % 2 == 0 && s.frame.sequence != 2)
      std::ofstream(folder.path() / ("frame_00000" + std::to_string(s.frame.sequence) + ".png"));
  }
  recorder.finish();
  const json coco = json::parse(content_of(folder.path() / "coco.json"));
  // Frame 4 shows nothing, and of frame 8 the mask is not all there.
  std::vector<std::uint64_t> frames;
  for (const json& image : coco.at("images")) {
    frames.push_back(image.at("frame"));
    EXPECT_EQ(image.at("width"), kWidth_px);
    EXPECT_EQ(image.at("height"), kHeight_px);
    EXPECT_TRUE(std::filesystem::exists(folder.path() / image.at("file_name")));
  }
  EXPECT_EQ(frames, (std::vector<std::uint64_t>{0, 4, 6}));
  ASSERT_EQ(coco.at("annotations").size(), 2U);
  for (const json& annotation : coco.at("annotations")) {
    EXPECT_EQ(annotation.at("category_id"), coco.at("categories").at(0).at("id"));
    const std::uint64_t frame = annotation.at("image_id").get<std::uint64_t>() - 1;
    SCOPED_TRACE(frame);
    const json& segmentation = annotation.at("segmentation");
    EXPECT_EQ(segmentation.at("size"), (json{kHeight_px, kWidth_px}));
    const Pixels pixels = decoded(segmentation.at("counts"));
    EXPECT_EQ(pixels, shown[frame].pixels);
    int area = 0;
    int left = kWidth_px, top = kHeight_px, right = 0, bottom = 0;
    for (int v = 0; v < kHeight_px; ++v) {
      for (int u = 0; u < kWidth_px; ++u) {
        if (!pixels[static_cast<std::size_t>(v)][static_cast<std::size_t>(u)]) continue;
        ++area;
        left = std::min(left, u);
        top = std::min(top, v);
        right = std::max(right, u + 1);
        bottom = std::max(bottom, v + 1);
      }
    }
    EXPECT_EQ(annotation.at("area"), area);
    EXPECT_EQ(annotation.at("bbox"), (json{left, top, right - left, bottom - top}));
  }
}

/// A picture of a square of so many DN above a dark sky.
engine::DnImage square_of(std::uint16_t dn) {
  engine::DnImage image(kWidth_px, kHeight_px);
  for (int v = 3; v < 9; ++v)
    for (int u = 5; u < 14; ++u) image.at(u, v) = dn;
  return image;
}

TEST(TruthRecorder, EveryFrameThatWasHandedOverHasAScoreOfItsOwnPicture) {
  const TemporaryFolder folder;
  TruthRecorder::Spec spec = spec_for(folder, hil::WhenBusy::kWait);
  spec.camera = quality::CameraFigures{2047, 10.0};
  TruthRecorder recorder(spec);
  // More than there are slots: each is used again.
  for (std::uint64_t i = 0; i < 100; ++i) {
    Shown shown(i);
    const engine::DnImage picture = square_of(static_cast<std::uint16_t>(i * 20));
    hil::Frame frame = shown.sent();
    frame.pixels = &picture;
    shown.record.handed_over = i != 7;
    if (i != 7) {
      ASSERT_TRUE(recorder.send(frame, kPatience).ok());
    }
    recorder.add(shown.record);
  }
  recorder.finish();
  const std::vector<json> lines = lines_of(folder);
  ASSERT_EQ(lines.size(), 100U);
  EXPECT_TRUE(lines[7].at("image_quality").is_null());
  EXPECT_EQ(lines[0].at("image_quality").at("verdict"), "nothing");
  EXPECT_TRUE(lines[0].at("image_quality").at("score_db").is_null());
  for (const std::size_t i : {1U, 6U, 8U, 70U, 99U})
    EXPECT_EQ(lines[i].at("image_quality").at("contrast_dn"), 20.0 * static_cast<double>(i));
  const json summary = recorder.quality_json();
  EXPECT_EQ(summary.at("frames"), 99);
  EXPECT_EQ(summary.at("scored"), 98);
  EXPECT_EQ(summary.at("without_score").at("nothing"), 1);
  EXPECT_EQ(summary.at("worst_frame"), 1);  // the dimmest
  EXPECT_EQ(summary.at("median_contrast_sigma"),
            lines[50].at("image_quality").at("contrast_sigma"));
  const std::string csv = content_of(folder.path() / "quality.csv");
  EXPECT_EQ(std::ranges::count(csv, '\n'), 100);  // with its header
  EXPECT_EQ(csv.find("nan"), std::string::npos);
}

TEST(TruthRecorder, WithoutACameraNothingIsScored) {
  const TemporaryFolder folder;
  TruthRecorder recorder(spec_for(folder, hil::WhenBusy::kWait));
  Shown shown(3);
  ASSERT_TRUE(recorder.send(shown.sent(), kPatience).ok());
  recorder.add(shown.record);
  recorder.finish();
  EXPECT_TRUE(recorder.quality_json().is_null());
  EXPECT_FALSE(lines_of(folder).at(0).contains("image_quality"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "quality.csv"));
}

}  // namespace
