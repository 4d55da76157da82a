#include "tools/starloop/quality_files.h"

#include <algorithm>
#include <cstdio>
#include <optional>
#include <stdexcept>

#include <nlohmann/json.hpp>

namespace starloop {
namespace {

using Json = nlohmann::ordered_json;
using quality::Verdict;

Json or_null(const std::optional<double>& figure) { return figure ? Json(*figure) : Json(nullptr); }

Json median_of(std::vector<double> values) {
  if (values.empty()) return nullptr;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Empty where there is none.
std::string cell(const std::optional<double>& figure, const char* format = ",%.4f") {
  if (!figure) return ",";
  char text[40];
  std::snprintf(text, sizeof text, format, *figure);
  return text;
}

}  // namespace

nlohmann::ordered_json json_of(const quality::ImageQuality& q) {
  const bool target = q.lit_px > 0;
  return {{"verdict", quality::name_of(q.verdict)},
          {"score_db", or_null(q.score_db)},
          {"place_px", or_null(q.place_px)},
          {"sharpness", or_null(q.sharpness)},
          {"edge_px", or_null(q.edge_px)},
          {"contrast_dn", target ? Json(q.contrast_dn) : Json(nullptr)},
          {"contrast_sigma", target ? Json(q.contrast_sigma) : Json(nullptr)},
          {"noise_dn", or_null(q.noise_dn)},
          {"background_dn", q.background_dn},
          {"even_background", q.even_background},
          {"lit_px", q.lit_px},
          {"saturated_px", q.saturated_px},
          {"box_px", target ? Json::array({q.box.left, q.box.top, q.box.right, q.box.bottom})
                            : Json(nullptr)}};
}

std::string text_of(const quality::ImageQuality& q) {
  char noise[60] = "noise below what rounding shows";
  if (q.noise_dn) std::snprintf(noise, sizeof noise, "noise %.3g DN", *q.noise_dn);
  char text[240];
  if (q.verdict == Verdict::kTooSmall) return std::string(sentence_of(q.verdict));
  if (!q.score_db) {
    std::snprintf(text, sizeof text, "no score: %s; background %.2f DN, %s",
                  std::string(sentence_of(q.verdict)).c_str(), q.background_dn, noise);
    return text;
  }
  std::snprintf(text, sizeof text,
                "%.1f dB (a place to %.2g px); target of %d px, contrast %.1f DN = %.0f sigma; "
                "background %.2f DN, %s",
                *q.score_db, *q.place_px, q.lit_px, q.contrast_dn, q.contrast_sigma,
                q.background_dn, noise);
  std::string line = text;
  if (q.sharpness) line += cell(q.sharpness, "; sharpness %.2f");
  if (q.edge_px) line += cell(q.edge_px, ", as of edges blurred by %.2f px");
  if (q.saturated_px > 0) line += "; " + std::to_string(q.saturated_px) + " px at full scale";
  return line;
}

std::string summary_of(const nlohmann::ordered_json& q) {
  if (q.is_null()) return "";
  std::string line =
      "pictures: " + q["scored"].dump() + " of " + q["frames"].dump() + " frames have a score";
  if (q["worst_frame"].is_null()) return line;
  char text[120];
  std::snprintf(text, sizeof text, ", median %.1f dB, worst %.1f dB in frame %s",
                q["median_score_db"].get<double>(), q["worst_score_db"].get<double>(),
                q["worst_frame"].dump().c_str());
  return line + text;
}

QualityTable::QualityTable(const std::filesystem::path& csv) : path_(csv), file_(csv) {
  if (!file_) throw std::runtime_error(csv.string() + ": cannot be made");
  file_ << "frame,time_s,score_db,place_px,sharpness,edge_px,contrast_dn,contrast_sigma,noise_dn,"
           "background_dn,lit_px,saturated_px,verdict\n";
}

void QualityTable::add(std::uint64_t frame, engine::SimTime shutter_open,
                       const quality::ImageQuality& q) {
  const std::optional<double> contrast_dn =
      q.lit_px > 0 ? std::optional(q.contrast_dn) : std::nullopt;
  const std::optional<double> contrast_sigma =
      q.lit_px > 0 ? std::optional(q.contrast_sigma) : std::nullopt;
  file_ << frame << cell(engine::seconds(shutter_open), ",%.9f") << cell(q.score_db)
        << cell(q.place_px, ",%.3e") << cell(q.sharpness) << cell(q.edge_px) << cell(contrast_dn)
        << cell(contrast_sigma) << cell(q.noise_dn) << cell(q.background_dn) << ',' << q.lit_px
        << ',' << q.saturated_px << ',' << name_of(q.verdict) << '\n';
  ++by_verdict_[static_cast<std::size_t>(q.verdict)];
  if (q.noise_dn) noise_dn_.push_back(*q.noise_dn);
  if (contrast_sigma) contrast_sigma_.push_back(*contrast_sigma);
  if (q.sharpness) sharpness_.push_back(*q.sharpness);
  if (!q.score_db) return;
  if (score_db_.empty() || *q.score_db < worst_db_) {
    worst_db_ = *q.score_db;
    worst_frame_ = frame;
  }
  score_db_.push_back(*q.score_db);
}

void QualityTable::close() {
  file_.close();
  if (!file_) throw std::runtime_error(path_.string() + ": cannot be written to its end");
}

nlohmann::ordered_json QualityTable::json() const {
  std::uint64_t frames = 0;
  Json without = Json::object();
  for (std::size_t i = 0; i < by_verdict_.size(); ++i) {
    frames += by_verdict_[i];
    const auto verdict = static_cast<Verdict>(i);
    if (verdict != Verdict::kMeasured) without[std::string(name_of(verdict))] = by_verdict_[i];
  }
  const bool any = !score_db_.empty();
  return {{"frames", frames},
          {"scored", score_db_.size()},
          {"without_score", std::move(without)},
          {"median_score_db", median_of(score_db_)},
          {"worst_score_db", any ? Json(worst_db_) : Json(nullptr)},
          {"worst_frame", any ? Json(worst_frame_) : Json(nullptr)},
          {"median_sharpness", median_of(sharpness_)},
          {"median_contrast_sigma", median_of(contrast_sigma_)},
          {"median_noise_dn", median_of(noise_dn_)}};
}

}  // namespace starloop
