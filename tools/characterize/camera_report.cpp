#include "tools/characterize/camera_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace characterize {
namespace {

constexpr double kGainLimit = 0.01;
constexpr double kLinearityLimit = 0.2;  // %
constexpr double kEdgeLimit = 0.01;
constexpr double kSigmas = 5;
constexpr double kEdgeSigmas = 3;
constexpr double kBrightEdge = 0.8;    // of saturation
constexpr double kEdgeError = 0.0007;  // of the MTF at Nyquist, that is asked for
constexpr double kEdgeFrames = 16;     // at least
constexpr double kEdgeValues = 1e9;    // of pixels, at most

template <class... Values>
std::string text_of(const char* format, Values... values) {
  char text[240];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

std::vector<std::string> notes_of(const engine::DetectorSpec& spec, const SensorRecord& record,
                                  bool rays_left_out) {
  std::vector<std::string> notes;
  notes.push_back(
      text_of("%zu levels of light at %.4g ms, by the brightness of an integrating "
              "sphere; lines fitted from %.0f to %.0f %% of saturation",
              record.light.size(), 1e3 * record.exposure_s, 100.0 * PhotonTransfer::kFitFrom,
              100.0 * PhotonTransfer::kFitTo));
  if (!record.dark_stack.shows_noise())
    notes.push_back(
        text_of("1 DN is %.4g e-: below some %.0f e- over the dark the quantiser hides or "
                "distorts the noise",
                spec.gain_e_dn(), std::ceil(3.4 * spec.gain_e_dn())));
  if (spec.quantiser == engine::Quantiser::kFloor)
    notes.push_back("the quantiser rounds down: the mean is .5 DN low, at all levels alike");
  const auto in_dark = std::ranges::count(record.defects, true, &Defect::in_dark);
  if (!record.defects.empty())
    notes.push_back(
        text_of("%zu defects, %td of them seen in the dark at %.3g s: further than %.0f robust "
                "sigmas from the median; in defects.csv, and in no figure",
                record.defects.size(), in_dark, record.long_dark_stack.exposure_s, kDefectSigmas));
  if (spec.background_e_s > 0.0)
    notes.push_back(
        text_of("dark current has detector.background_e_s = %g e-/s in it", spec.background_e_s));
  if (rays_left_out) notes.push_back("detector.cosmic_rays_cm2_s is left out on the bench");
  return notes;
}

int frames_for_edges(const engine::CameraGeometry& camera, EdgePlan plan) {
  plan.frames = 1;
  const double error = std::max(mtf_error(camera, true, plan), mtf_error(camera, false, plan));
  const double most =
      std::max(kEdgeFrames, kEdgeValues / (1.0 * camera.width_px * camera.height_px));
  return 2 * static_cast<int>(
                 std::ceil(0.5 * std::clamp(std::pow(error / kEdgeError, 2), kEdgeFrames, most)));
}

}  // namespace

std::vector<std::string> missed_limits(const CameraReport& report) {
  std::vector<std::string> missed;
  for (const SensorReport& sensor : report.sensors) {
    for (const Figure& figure : sensor.figures) {
      const double off = std::abs(figure.measured.value - figure.truth);
      const bool clear = off > kSigmas * figure.measured.error;
      if (figure.key == "gain_dn_e" && clear && off > kGainLimit * figure.truth)
        missed.push_back(text_of("%d bits: the gain is %.2f %% off, 1 %% is the limit",
                                 sensor.spec.bits, 100.0 * off / figure.truth));
      if (figure.key == "linearity_error" && clear && off > kLinearityLimit)
        missed.push_back(text_of("%d bits: the linearity error is %.2f %%, .2 %% is the limit",
                                 sensor.spec.bits, figure.measured.value));
    }
  }
  for (const EdgeFigures& edge : report.edges) {
    if (std::abs(edge.worst) > kEdgeLimit + kEdgeSigmas * edge.mtf_error)
      missed.push_back(
          text_of("edge near the %s: the MTF is %.4f off at %.3f cycles/px, .01 is "
                  "the limit",
                  edge.near_vertical ? "columns" : "rows", edge.worst, edge.worst_cycles_per_px));
  }
  return missed;
}

engine::DetectorSpec at_16_bits(const engine::DetectorSpec& spec) {
  constexpr double kPedestalSigmas = 8;
  engine::DetectorSpec deep = spec;
  deep.bits = 16;
  deep.pedestal_dn =
      std::max(spec.pedestal_dn * (1 << (deep.bits - spec.bits)),
               std::ceil(kPedestalSigmas * (1.0 + spec.read_noise_e / deep.gain_e_dn())));
  return deep;
}

SensorReport characterize_sensor(engine::Optics& optics, const engine::DetectorSpec& spec,
                                 const engine::SensorMaps& maps,
                                 const engine::CameraGeometry& camera, engine::WorkerPool& pool,
                                 std::uint64_t seed, engine::Duration exposure,
                                 const RecordPlan& plan) {
  SensorReport report;
  report.spec = spec;
  report.spec.cosmic_rays_cm2_s = 0.0;
  // Another seed for each depth, or both would have the same electrons.
  Bench bench(optics, report.spec, maps, camera, pool,
              seed + static_cast<std::uint64_t>(spec.bits));
  report.record = record_sensor(bench, exposure, plan);
  report.transfer = photon_transfer(report.record.light);
  report.figures =
      sensor_figures(report.record, report.transfer,
                     sensor_truth(report.spec, maps, report.record.used, report.record.exposure_s));
  report.notes = notes_of(report.spec, report.record, spec.cosmic_rays_cm2_s > 0.0);
  return report;
}

std::vector<EdgeFigures> characterize_edges(engine::Optics& optics,
                                            const engine::OpticsSpec& optics_spec,
                                            const SensorReport& sensor,
                                            const engine::SensorMaps& maps,
                                            engine::WorkerPool& pool, std::uint64_t seed,
                                            engine::Duration exposure) {
  constexpr double kFar_m = std::numeric_limits<double>::infinity();
  const engine::OtfCascade cascade(optics_spec);
  const auto lens = cascade.focused(cascade.seen_defocus_m(optics_spec.defocus_m(kFar_m, kFar_m)));
  EdgePlan plan;
  plan.bright_w_m2 = kBrightEdge * sensor.record.light[sensor.transfer.saturation].irradiance_w_m2;
  plan.bright_e = kBrightEdge * sensor.transfer.saturation_e.value;
  plan.frames = frames_for_edges(optics_spec.camera, plan);
  Bench bench(optics, sensor.spec, maps, optics_spec.camera, pool, seed);
  const FieldFrames field = take_field(bench, exposure, sensor.record.used, plan);
  std::vector<EdgeFigures> edges;
  for (const bool near_vertical : {true, false})
    edges.push_back(measure_edge(bench, field, cascade, lens, exposure, sensor.record.used,
                                 near_vertical, plan));
  return edges;
}

}  // namespace characterize
