#include "hil/score.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

namespace hil {
namespace {

using engine::PixelPoint;

/// Left, top, right, bottom; pixel (0, 0) reaches from -0.5 to 0.5.
using Edges = std::array<double, 4>;

/// A detection, and the place of its frame among the records.
struct Claim {
  std::size_t frame = 0;
  Detection detection;
};

bool is_number(const PixelPoint& p) { return std::isfinite(p.u) && std::isfinite(p.v); }

Edges true_edges(const engine::FrameTruth& truth) {
  const PixelPoint& p = truth.photocentre_px;
  if (truth.box.empty()) return {p.u, p.v, p.u, p.v};
  return {truth.box.left - 0.5, truth.box.top - 0.5, truth.box.right - 0.5, truth.box.bottom - 0.5};
}

/// Intersection over union; 0 where a box has no area.
double overlap(const Edges& a, const Edges& b) {
  const auto area = [](const Edges& e) {
    return std::max(0.0, e[2] - e[0]) * std::max(0.0, e[3] - e[1]);
  };
  const double both = area(
      {std::max(a[0], b[0]), std::max(a[1], b[1]), std::min(a[2], b[2]), std::min(a[3], b[3])});
  const double either = area(a) + area(b) - both;
  return either > 0.0 ? both / either : 0.0;
}

std::optional<double> box_overlap(const engine::FrameTruth& truth, const Detection& d) {
  if (std::ranges::all_of(d.box_px, [](float x) { return x == 0.0F; })) return std::nullopt;
  Edges box;
  std::copy(d.box_px.begin(), d.box_px.end(), box.begin());
  return overlap(true_edges(truth), box);
}

/// Comparisons with what is not a number are false: such a truth or detection matches nothing.
bool matches(const engine::FrameTruth& truth, const Detection& d, const DetectionRules& rules) {
  const Edges box = true_edges(truth);
  const double m = rules.margin_px;
  const PixelPoint& c = d.centroid_px;
  if (c.u >= box[0] - m && c.u <= box[2] + m && c.v >= box[1] - m && c.v <= box[3] + m) return true;
  return box_overlap(truth, d).value_or(0.0) >= rules.min_box_iou;
}

double distance(const PixelPoint& a, const PixelPoint& b) {
  return std::hypot(a.u - b.u, a.v - b.v);
}

bool is_detectable(const engine::FrameTruth& truth, const DetectionRules& rules) {
  return truth.visible_fraction >= rules.min_visible_fraction &&
         truth.signal_to_noise >= rules.min_signal_to_noise && is_number(truth.photocentre_px);
}

/// Sorts the commands to the frames that they answer, and counts what belongs to none.
class Answers {
 public:
  Answers(std::span<const FrameRecord> frames, std::span<const CommandRecord> commands,
          DetectionScore& score)
      : score_(score) {
    places_.reserve(frames.size());
    for (std::size_t i = 0; i < frames.size(); ++i) {
      if (!frames[i].handed_over) continue;
      score.verdicts.emplace_back().sequence = frames[i].sequence;
      places_.push_back(i);
    }
    latencies_.reserve(commands.size());
    claims_.reserve(commands.size());
    for (const CommandRecord& record : commands) take(record);
    // Stable: of one frame's detections the first heard stays the first.
    std::ranges::stable_sort(claims_, {}, &Claim::frame);
    score.latency_frames = percentiles_of(latencies_);
  }

  /// The place of a verdict's frame among the records.
  [[nodiscard]] std::size_t place(std::size_t verdict) const { return places_[verdict]; }
  [[nodiscard]] std::span<const Claim> claims(std::size_t verdict) const {
    // Two searches: clang 14 does not compile the subrange of libstdc++ 12 that one returns.
    return {std::ranges::lower_bound(claims_, verdict, {}, &Claim::frame),
            std::ranges::upper_bound(claims_, verdict, {}, &Claim::frame)};
  }

 private:
  void take(const CommandRecord& record) {
    const Command& command = record.command;
    const bool claims = command.detection.confidence > 0.0F;
    if (claims) ++score_.detections;
    const auto it = std::ranges::lower_bound(score_.verdicts, command.answers_frame, {},
                                             &FrameVerdict::sequence);
    const bool known = it != score_.verdicts.end() && it->sequence == command.answers_frame &&
                       record.frame > command.answers_frame;
    if (!known) {
      if (claims) ++score_.strays;
      return;
    }
    it->answered = true;
    it->latency_frames = record.frame - command.answers_frame;
    latencies_.push_back(static_cast<double>(*it->latency_frames));
    if (claims)
      claims_.push_back(
          {static_cast<std::size_t>(it - score_.verdicts.begin()), command.detection});
  }

  DetectionScore& score_;
  std::vector<std::size_t> places_;  // verdict -> record
  std::vector<double> latencies_;
  std::vector<Claim> claims_;
};

/// Finds the match among one frame's detections; the rest are duplicates and false alarms.
void judge_frame(const engine::FrameTruth& truth, std::span<const Claim> claims,
                 const DetectionRules& rules, FrameVerdict& verdict, DetectionScore& score) {
  verdict.detectable = is_detectable(truth, rules);
  const Detection* best = nullptr;
  std::uint32_t judged = 0;
  for (std::size_t i = 0; i < claims.size(); ++i) {
    const Detection& d = claims[i].detection;
    const auto said = claims.first(i);
    if (std::ranges::any_of(said, [&](const Claim& c) { return c.detection.id == d.id; })) {
      ++score.duplicates;
      continue;
    }
    ++judged;
    if (!matches(truth, d, rules)) continue;
    if (best == nullptr || distance(d.centroid_px, truth.photocentre_px) <
                               distance(best->centroid_px, truth.photocentre_px))
      best = &d;
  }
  verdict.found = best != nullptr;
  verdict.false_alarms = judged - (verdict.found ? 1U : 0U);
  if (!verdict.found) return;
  verdict.error_px = {best->centroid_px.u - truth.photocentre_px.u,
                      best->centroid_px.v - truth.photocentre_px.v};
  verdict.box_iou = box_overlap(truth, *best);
}

void count(DetectionScore& score) {
  for (const FrameVerdict& v : score.verdicts) {
    ++score.frames;
    ++(v.answered ? score.answered : score.unanswered);
    score.detectable += v.detectable ? 1U : 0U;
    score.detected += v.detectable && v.found ? 1U : 0U;
    score.matches += v.found ? 1U : 0U;
    score.false_alarms += v.false_alarms;
  }
  const auto ratio = [](std::uint64_t part, std::uint64_t whole) -> std::optional<double> {
    if (whole == 0) return std::nullopt;
    return static_cast<double>(part) / static_cast<double>(whole);
  };
  score.detection_rate = ratio(score.detected, score.detectable);
  score.false_alarms_per_frame = ratio(score.false_alarms, score.frames);
}

void measure_centroids(DetectionScore& score) {
  std::vector<double> errors;
  errors.reserve(score.detected);
  double sum2 = 0;
  PixelPoint sum;
  double iou = 0;
  for (const FrameVerdict& v : score.verdicts) {
    if (!v.detectable || !v.found) continue;
    if (v.box_iou) {
      ++score.boxes;
      iou += *v.box_iou;
    }
    // A match by its box alone may have a centroid that is no number.
    if (!is_number(v.error_px)) continue;
    errors.push_back(std::hypot(v.error_px.u, v.error_px.v));
    sum2 += errors.back() * errors.back();
    sum.u += v.error_px.u;
    sum.v += v.error_px.v;
  }
  if (score.boxes > 0) score.box_iou_mean = iou / static_cast<double>(score.boxes);
  score.centroid_error_px = percentiles_of(errors);
  if (errors.empty()) return;
  const auto n = static_cast<double>(errors.size());
  score.centroid_rms_px = std::sqrt(sum2 / n);
  score.centroid_bias_px = {sum.u / n, sum.v / n};
  std::sort(errors.begin(), errors.end());
  score.centroid_p95_px = nearest_rank(errors, 950);
}

}  // namespace

DetectionScore score_detections(std::span<const FrameRecord> frames,
                                std::span<const CommandRecord> commands,
                                const DetectionRules& rules, PixelPoint boresight_px) {
  DetectionScore score;
  score.verdicts.reserve(frames.size());
  const Answers answers(frames, commands, score);
  std::uint64_t on_target = 0;
  std::optional<engine::SimTime> detectable_at;
  for (std::size_t i = 0; i < score.verdicts.size(); ++i) {
    const FrameRecord& record = frames[answers.place(i)];
    FrameVerdict& verdict = score.verdicts[i];
    judge_frame(record.report.truth, answers.claims(i), rules, verdict, score);
    if (distance(record.report.truth.photocentre_px, boresight_px) <= rules.on_target_px)
      ++on_target;
    if (!verdict.detectable) continue;
    if (!detectable_at) detectable_at = record.shutter_open;
    if (verdict.found && !score.acquisition_s)
      score.acquisition_s = engine::seconds(record.shutter_open - *detectable_at);
  }
  count(score);
  measure_centroids(score);
  if (score.frames > 0)
    score.time_on_target = static_cast<double>(on_target) / static_cast<double>(score.frames);
  return score;
}

DetectionCriteria read_criteria(const engine::ConfigTable& table) {
  using engine::at_least;
  using engine::between;
  const auto limit = [&](const char* key, const engine::Range& range) -> std::optional<double> {
    if (!table.has(key)) return std::nullopt;
    return table.number(key, range);
  };
  DetectionCriteria c;
  DetectionRules& r = c.rules;
  r.min_visible_fraction =
      table.number_or("detectable_fraction", r.min_visible_fraction, between(0.0, 1.0));
  r.min_signal_to_noise =
      table.number_or("detectable_signal_to_noise", r.min_signal_to_noise, at_least(0.0));
  r.margin_px = table.number_or("match_margin_px", r.margin_px, at_least(0.0));
  r.min_box_iou = table.number_or("match_box_iou", r.min_box_iou, between(0.01, 1.0));
  r.on_target_px = table.number_or("on_target_px", r.on_target_px, engine::positive());
  c.min_detection_rate = limit("min_detection_rate", between(0.0, 1.0));
  c.max_false_alarms_per_frame = limit("max_false_alarms_per_frame", at_least(0.0));
  c.max_centroid_rms_px = limit("max_centroid_rms_px", at_least(0.0));
  c.max_latency_frames = limit("max_latency_frames", at_least(0.0));
  c.max_acquisition_s = limit("max_acquisition_s", at_least(0.0));
  c.min_time_on_target = limit("min_time_on_target", between(0.0, 1.0));
  return c;
}

std::vector<JudgedCriterion> judge_detections(const DetectionCriteria& criteria,
                                              const DetectionScore& score) {
  std::vector<JudgedCriterion> judged;
  enum class Limit : std::uint8_t { kLeast, kMost };
  const auto judge = [&](const char* key, const char* what, Limit kind,
                         const std::optional<double>& limit, const std::optional<double>& reached,
                         const char* unmeasured) {
    if (!limit) return;
    const bool least = kind == Limit::kLeast;
    const bool met = reached && (least ? *reached >= *limit : *reached <= *limit);
    char text[200];
    if (reached) {
      std::snprintf(text, sizeof text, "%s is %.4g, and must be at %s %g", what, *reached,
                    least ? "least" : "most", *limit);
    } else {
      std::snprintf(text, sizeof text, "%s is unknown, for %s; it must be at %s %g", what,
                    unmeasured, least ? "least" : "most", *limit);
    }
    judged.push_back({key, *limit, reached, met, text});
  };
  const auto if_any = [](const Percentiles& p, double figure) {
    return p.count > 0 ? std::optional(figure) : std::nullopt;
  };
  judge("min_detection_rate", "the detection rate", Limit::kLeast, criteria.min_detection_rate,
        score.detection_rate, "no frame showed a target that could be detected");
  judge("max_false_alarms_per_frame", "the number of false alarms per frame", Limit::kMost,
        criteria.max_false_alarms_per_frame, score.false_alarms_per_frame, "no frame was sent");
  judge("max_centroid_rms_px", "the centroid's error in px, rms,", Limit::kMost,
        criteria.max_centroid_rms_px, if_any(score.centroid_error_px, score.centroid_rms_px),
        "nothing was detected");
  judge("max_latency_frames", "the largest latency in frames", Limit::kMost,
        criteria.max_latency_frames, if_any(score.latency_frames, score.latency_frames.max),
        "no frame was answered");
  judge("max_acquisition_s", "the time to acquisition in s", Limit::kMost,
        criteria.max_acquisition_s, score.acquisition_s, "nothing was detected");
  judge("min_time_on_target", "the share of time on target", Limit::kLeast,
        criteria.min_time_on_target, score.time_on_target, "no frame was sent");
  return judged;
}

std::vector<std::string> criteria_not_met(std::span<const JudgedCriterion> criteria) {
  std::vector<std::string> sentences;
  for (const JudgedCriterion& c : criteria)
    if (!c.met) sentences.push_back(c.sentence);
  return sentences;
}

}  // namespace hil
