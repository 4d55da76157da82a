#pragma once

#include <array>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "engine/core/time.h"
#include "tools/quality/image_quality.h"

namespace starloop {

/// How programs get it: what could not be measured is null.
[[nodiscard]] nlohmann::ordered_json json_of(const quality::ImageQuality& quality);
/// The same for people, in a line.
[[nodiscard]] std::string text_of(const quality::ImageQuality& quality);

/// What QualityTable::json() says, in a line for people; empty for null.
[[nodiscard]] std::string summary_of(const nlohmann::ordered_json& image_quality);

/// What a run's frames are like as pictures: quality.csv, a line for each that was measured, and
/// what is to be said of all of them.
/// Thread: one.
class QualityTable {
 public:
  /// Throws std::runtime_error when the file cannot be made.
  explicit QualityTable(const std::filesystem::path& csv);
  void add(std::uint64_t frame, engine::SimTime shutter_open, const quality::ImageQuality& quality);
  /// Throws std::runtime_error when it cannot be written to its end.
  void close();
  /// report.json's "image_quality": medians, and the worst frame of those that have a score.
  /// frames == scored + what has none, by cause.
  [[nodiscard]] nlohmann::ordered_json json() const;

 private:
  std::filesystem::path path_;
  std::ofstream file_;
  std::array<std::uint64_t, quality::kVerdicts> by_verdict_{};
  std::vector<double> score_db_;
  std::vector<double> sharpness_;
  std::vector<double> contrast_sigma_;
  std::vector<double> noise_dn_;
  std::uint64_t worst_frame_ = 0;
  double worst_db_ = 0;
};

}  // namespace starloop
