#include "tools/starloop/truth_files.h"

#include <algorithm>
#include <cstdio>
#include <stdexcept>

#include <nlohmann/json.hpp>

namespace starloop {

namespace fs = std::filesystem;
using engine::seconds;
using engine::TruthMask;
using Json = nlohmann::ordered_json;

namespace {

// As much as the loop's own masks hold.
constexpr std::size_t kRunsPerRow = 8;

/// What is not a number, JSON has no word for but null.
Json place(const engine::PixelPoint& p) { return Json::array({p.u, p.v}); }

Json runs_of(const TruthMask& mask) {
  Json runs = Json::array();
  for (const TruthMask::Run& run : mask.runs())
    runs.push_back(Json::array({run.row, run.begin, run.end}));
  return {{"runs_row_begin_end", std::move(runs)}, {"truncated", mask.truncated()}};
}

std::string picture_name(std::uint64_t sequence) {
  char name[40];
  std::snprintf(name, sizeof name, "frame_%06llu.png", static_cast<unsigned long long>(sequence));
  return name;
}

/// The brightest is null where there is none in the frame.
Json stars_of(const engine::StarReport& stars) {
  Json brightest;
  if (stars.in_frame > 0)
    brightest = {{"place_px", place(stars.brightest_px)},
                 {"v", stars.brightest_v},
                 {"light_e", stars.brightest_e}};
  return {{"in_frame", stars.in_frame},
          {"too_faint", stars.faint},
          {"too_faint_peak_e", stars.left_out_peak_e},
          {"no_room", stars.no_room},
          {"brightest", std::move(brightest)}};
}

/// By name.
Json companions_of(const engine::FrameTruth& truth, const std::vector<std::string>& names) {
  Json all = Json::object();
  for (std::size_t i = 0; i < std::min(truth.companions, names.size()); ++i) {
    const engine::CompanionTruth& c = truth.companion[i];
    all[names[i]] = {{"range_m", c.range_m},
                     {"phase_angle_rad", c.phase_angle_rad},
                     {"target_px", place(c.target_px)},
                     {"smear_px", c.smear_px},
                     {"visible_fraction", c.visible_fraction},
                     {"sun_irradiance_w_m2", c.sun_irradiance_w_m2}};
  }
  return all;
}

/// By name.
Json parts_of(const engine::FrameTruth& truth, const std::vector<std::string>& names) {
  Json all = Json::object();
  for (std::size_t i = 0; i < std::min(truth.parts, names.size()); ++i) {
    const engine::PartTruth& part = truth.part[i];
    all[names[i]] = {{"angle_rad", part.angle_rad},
                     {"second_angle_rad", part.second_angle_rad},
                     {"at_limit", part.at_limit}};
  }
  return all;
}

Json truth_of(const hil::FrameRecord& record) {
  const engine::FrameTruth& t = record.report.truth;
  const hil::MeasuredAttitude& m = record.measured;
  return {
      {"frame", record.sequence},
      {"time_s", seconds(record.shutter_open)},
      {"handed_over", record.handed_over},
      {"range_m", t.range_m},
      {"range_rate_m_s", t.range_rate_m_s},
      {"line_of_sight_rate_rad_s", t.line_of_sight_rate_rad_s},
      {"phase_angle_rad", t.phase_angle_rad},
      {"target_px", place(t.target_px)},
      {"photocentre_px", place(t.photocentre_px)},
      {"smear_px", t.smear_px},
      {"peak_e", t.peak_e},
      {"box_px", t.box.empty() ? Json(nullptr)
                               : Json::array({t.box.left, t.box.top, t.box.right, t.box.bottom})},
      {"mask_px", t.mask_px},
      {"signal_to_noise", t.signal_to_noise},
      {"visible_fraction", t.visible_fraction},
      {"sun_irradiance_w_m2", t.sun_irradiance_w_m2},
      {"earthshine_w_m2", t.earthshine_w_m2},
      {"earth_behind", t.earth_behind},
      {"roll_is_fallback", t.roll_is_fallback},
      {"attitude_is_fallback", t.attitude_is_fallback},
      {"stars", stars_of(record.report.stars)},
      {"trim_rad", record.trim_rad},
      {"measured_j2000_to_camera_wxyz", m.j2000_to_camera},
      {"measured_rate_rad_s", m.rate_rad_s}};
}

}  // namespace

std::vector<std::uint32_t> coco_run_lengths(std::span<const TruthMask::Run> runs, int width_px,
                                            int height_px) {
  const auto height = static_cast<std::size_t>(height_px);
  const std::size_t pixels = static_cast<std::size_t>(width_px) * height;
  // The mask turned on its side: down a column, pixels are neighbours.
  std::vector<bool> inside(pixels);
  for (const TruthMask::Run& run : runs)
    for (std::size_t u = run.begin; u < run.end; ++u) inside[u * height + run.row] = true;
  std::vector<std::uint32_t> lengths;
  bool now = false;
  std::size_t since = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    if (inside[i] == now) continue;
    lengths.push_back(static_cast<std::uint32_t>(i - since));
    since = i;
    now = !now;
  }
  lengths.push_back(static_cast<std::uint32_t>(pixels - since));
  return lengths;
}

TruthRecorder::TruthRecorder(const Spec& spec)
    : spec_(spec), file_(spec.folder / "truth.jsonl"), coco_(std::make_unique<Json>()) {
  if (!file_) throw std::runtime_error((spec.folder / "truth.jsonl").string() + ": cannot be made");
  if (spec.camera) {
    meter_.emplace(spec.width_px, spec.height_px);
    qualities_.emplace(spec.folder / "quality.csv");
  }
  for (std::size_t i = 0; i < kSlots; ++i) {
    slots_[i].mask = TruthMask(kRunsPerRow * static_cast<std::size_t>(spec.height_px));
    ENSURE(free_.push(i));
  }
  free_count_.release(kSlots);
  *coco_ = {
      {"info",
       {{"description",
         "What starloop's frames really show. Pixel (0, 0) reaches from 0 to 1; segmentation: "
         "where the target's light, free of noise, is above one sigma of a dark pixel's "
         "noise; companions have no annotations"}}},
      {"categories", Json::array({{{"id", 1}, {"name", "target"}}})},
      {"images", Json::array()},
      {"annotations", Json::array()}};
  writer_ = std::jthread([this] { serve(); });
}

TruthRecorder::~TruthRecorder() {
  try {
    finish();
  } catch (const std::exception& e) {
    std::fprintf(stderr, "starloop: %s\n", e.what());
  }
}

engine::Status TruthRecorder::send(const hil::Frame& frame, engine::Duration timeout) noexcept {
  const bool free = spec_.when_busy == hil::WhenBusy::kWait ? free_count_.try_acquire_for(timeout)
                                                            : free_count_.try_acquire();
  std::size_t i = 0;
  if (!free || !free_.pop(i)) {
    ++masks_lost_;
    return engine::Error{engine::Fault::kBusy, 0, "truth"};
  }
  Slot& slot = slots_[i];
  slot.sequence = frame.sequence;
  slot.mask.clear();
  if (frame.truth_mask != nullptr) slot.mask.copy(*frame.truth_mask);
  slot.quality.reset();
  if (meter_ && frame.pixels != nullptr)
    slot.quality = meter_->measure(*frame.pixels, *spec_.camera);
  ENSURE(ready_.push(i));
  news_.release();
  return engine::Done{};
}

void TruthRecorder::add(const hil::FrameRecord& record) noexcept {
  if (!records_.push(record)) {
    ++records_lost_;
    return;
  }
  news_.release();
}

void TruthRecorder::finish() {
  if (!writer_.joinable()) return;
  done_ = true;
  news_.release();
  writer_.join();
  write_coco();
}

void TruthRecorder::serve() noexcept {
  try {
    for (;;) {
      news_.acquire();
      // Before looking: what came before the end is then seen.
      const bool all_is_in = done_;
      while (write_next(all_is_in)) {
      }
      if (all_is_in) break;
    }
    file_.close();
    if (!file_) throw std::runtime_error("truth.jsonl: cannot be written to its end");
    if (qualities_) qualities_->close();
  } catch (const std::exception& e) {
    std::fprintf(stderr, "starloop: %s\n", e.what());
  }
}

bool TruthRecorder::write_next(bool all_is_in) {
  const auto drop_mask = [this] {
    ENSURE(free_.push(*next_mask_));
    free_count_.release();
    next_mask_.reset();
  };
  if (!next_record_) {
    hil::FrameRecord record;
    if (records_.pop(record)) next_record_ = record;
  }
  if (!next_mask_) {
    std::size_t i = 0;
    if (ready_.pop(i)) next_mask_ = i;
  }
  if (!next_record_) {
    // A mask without a record tells of nothing any more once all is in.
    if (!all_is_in || !next_mask_) return false;
    drop_mask();
    return true;
  }
  const std::uint64_t wanted = next_record_->sequence;
  if (next_mask_ && slots_[*next_mask_].sequence < wanted) {
    drop_mask();
    return true;
  }
  const bool here = next_mask_ && slots_[*next_mask_].sequence == wanted;
  if (!here && !next_mask_ && next_record_->handed_over && !all_is_in) return false;
  write_line(*next_record_, here ? &slots_[*next_mask_] : nullptr);
  if (here) drop_mask();
  next_record_.reset();
  return true;
}

void TruthRecorder::write_line(const hil::FrameRecord& record, const Slot* slot) {
  const TruthMask* mask = slot != nullptr ? &slot->mask : nullptr;
  Json line = truth_of(record);
  if (!spec_.companions.empty())
    line["companions"] = companions_of(record.report.truth, spec_.companions);
  if (!spec_.parts.empty()) line["parts"] = parts_of(record.report.truth, spec_.parts);
  if (qualities_) {
    const bool scored = slot != nullptr && slot->quality;
    line["image_quality"] = scored ? json_of(*slot->quality) : Json(nullptr);
    if (scored) qualities_->add(record.sequence, record.shutter_open, *slot->quality);
  }
  line["mask"] = mask != nullptr ? runs_of(*mask) : Json(nullptr);
  file_ << line.dump() << '\n';
  ++lines_;
  if (mask != nullptr && record.sequence % spec_.picture_every == 0) add_to_coco(record, *mask);
}

void TruthRecorder::add_to_coco(const hil::FrameRecord& record, const TruthMask& mask) {
  if (mask.truncated()) return;  // half a mask would teach a detector something wrong
  const engine::FrameTruth& t = record.report.truth;
  const std::uint64_t id = record.sequence + 1;  // some readers take 0 for nothing
  (*coco_)["images"].push_back({{"id", id},
                                {"file_name", picture_name(record.sequence)},
                                {"width", spec_.width_px},
                                {"height", spec_.height_px},
                                {"frame", record.sequence},
                                {"time_s", seconds(record.shutter_open)}});
  if (mask.runs().empty()) return;
  (*coco_)["annotations"].push_back(
      {{"id", id},
       {"image_id", id},
       {"category_id", 1},
       {"iscrowd", 0},
       {"bbox", {t.box.left, t.box.top, t.box.width(), t.box.height()}},
       {"area", t.mask_px},
       {"segmentation",
        {{"size", {spec_.height_px, spec_.width_px}},
         {"counts", coco_run_lengths(mask.runs(), spec_.width_px, spec_.height_px)}}}});
}

void TruthRecorder::write_coco() {
  Json& coco = *coco_;
  std::vector<std::uint64_t> kept;
  Json images = Json::array();
  for (Json& image : coco["images"]) {
    if (!fs::exists(spec_.folder / image["file_name"].get<std::string>())) continue;
    kept.push_back(image["id"].get<std::uint64_t>());
    images.push_back(std::move(image));
  }
  Json annotations = Json::array();
  for (Json& annotation : coco["annotations"])
    if (std::ranges::binary_search(kept, annotation["image_id"].get<std::uint64_t>()))
      annotations.push_back(std::move(annotation));
  coco["images"] = std::move(images);
  coco["annotations"] = std::move(annotations);
  const fs::path path = spec_.folder / "coco.json";
  std::ofstream file(path);
  file << coco.dump() << '\n';
  file.close();
  if (!file) throw std::runtime_error(path.string() + ": cannot be written");
}

nlohmann::ordered_json TruthRecorder::quality_json() const {
  return qualities_ ? qualities_->json() : Json(nullptr);
}

nlohmann::ordered_json TruthRecorder::json() const {
  return {{"frames", lines_}, {"frames_lost", records_lost_}, {"masks_lost", masks_lost_}};
}

}  // namespace starloop
