#include "tools/characterize/report_files.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <stdexcept>

#include <nlohmann/json.hpp>

namespace characterize {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kSigmasAreTold = 1e4;  // more are of a figure that noise does not limit

/// As many places as two digits of the error take.
int places_of(double error) {
  if (!(error > 0.0) || !std::isfinite(error)) return 3;
  return std::clamp(1 - static_cast<int>(std::floor(std::log10(error))), 0, 6);
}

std::string fixed(double value, int places) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*f", places, value);
  return std::isnan(value) ? "-" : text;
}

struct Words {
  const char* sign;
  const char* standing;
};
constexpr std::array<Words, 4> kWords{
    {{"", "measured"}, {"<", "upper limit"}, {">", "lower limit"}, {"", "not measurable"}}};
const Words& words_of(Standing standing) { return kWords[static_cast<std::size_t>(standing)]; }

std::string deviation_of(const Figure& figure) {
  if (figure.standing != Standing::kMeasured || figure.truth == 0.0) return "";
  char text[40];
  std::snprintf(text, sizeof text, "%+.3f %%",
                100.0 * (figure.measured.value / figure.truth - 1.0));
  return text;
}

std::string sigmas_of(const Figure& figure) {
  // A mean of sizes is never 0.
  const bool told = figure.standing == Standing::kMeasured && figure.measured.error > 0.0 &&
                    figure.key != "linearity_error" && std::abs(figure.sigmas()) < kSigmasAreTold;
  return told ? fixed(figure.sigmas(), 1) : "";
}

std::string line_of(const Figure& figure) {
  const int places = places_of(figure.measured.error);
  const std::string measured =
      figure.standing == Standing::kNotMeasurable
          ? "hidden"
          : std::string(words_of(figure.standing).sign) + fixed(figure.measured.value, places);
  char text[200];
  std::snprintf(text, sizeof text, "  %-31s %-10s %12s %11s %12s %11s %7s\n", figure.name.c_str(),
                figure.unit.c_str(), measured.c_str(), fixed(figure.measured.error, places).c_str(),
                fixed(figure.truth, std::max(places, 2)).c_str(), deviation_of(figure).c_str(),
                sigmas_of(figure).c_str());
  return text;
}

std::string text_of(const SensorReport& sensor) {
  char head[200];
  std::snprintf(head, sizeof head, "%d bits, pedestal %g DN, quantiser %s\n", sensor.spec.bits,
                sensor.spec.pedestal_dn,
                sensor.spec.quantiser == engine::Quantiser::kFloor ? "floor" : "round");
  std::string text = head;
  std::snprintf(head, sizeof head, "  %-31s %-10s %12s %11s %12s %11s %7s\n", "EMVA 1288 release 4",
                "unit", "measured", "std error", "true", "deviation", "sigmas");
  text += head;
  for (const Figure& figure : sensor.figures) text += line_of(figure);
  for (const std::string& note : sensor.notes) text += "  - " + note + "\n";
  // One line for a note that several share.
  std::vector<std::string> told;
  for (const Figure& figure : sensor.figures) {
    if (figure.note.empty() || std::ranges::count(told, figure.note) > 0) continue;
    told.push_back(figure.note);
    std::string names;
    for (const Figure& other : sensor.figures)
      if (other.note == figure.note) names += (names.empty() ? "" : ", ") + other.name;
    text += "  - " + names + ": " + figure.note + "\n";
  }
  return text + "\n";
}

std::string text_of(const EdgeFigures& edge) {
  char text[200];
  const auto& r = edge.response;
  std::snprintf(text, sizeof text,
                "edge %.3f deg off the %s: MTF at Nyquist %.4f +- %.4f, analytic product %.4f; "
                "furthest apart by %+.4f, at %.3f cycles/px\n",
                edge.angle_deg, edge.near_vertical ? "columns" : "rows", r.mtf.back(),
                edge.mtf_error, edge.analytic.back(), edge.worst, edge.worst_cycles_per_px);
  return text;
}

/// What is no number is null.
Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json json_of(const Figure& figure) {
  return {{"key", figure.key},
          {"name", figure.name},
          {"unit", figure.unit},
          {"measured", number(figure.measured.value)},
          {"standard_error", number(figure.measured.error)},
          {"true", number(figure.truth)},
          {"deviation", number(figure.measured.value - figure.truth)},
          {"standing", words_of(figure.standing).standing},
          {"note", figure.note}};
}

Json json_of(const SensorReport& sensor) {
  Json figures = Json::array();
  for (const Figure& figure : sensor.figures) figures.push_back(json_of(figure));
  const PhotonTransfer& transfer = sensor.transfer;
  return {{"bits", sensor.spec.bits},
          {"pedestal_dn", sensor.spec.pedestal_dn},
          {"quantiser", sensor.spec.quantiser == engine::Quantiser::kFloor ? "floor" : "round"},
          {"exposure_s", sensor.record.exposure_s},
          {"defect_pixels", sensor.record.defects.size()},
          {"saturation_level", transfer.saturation},
          {"saturation_mean_dn", sensor.record.light[transfer.saturation].mean_dn.value},
          {"transfer_intercept_dn2", transfer.transfer.intercept.value},
          {"response_intercept_dn", transfer.response.intercept.value},
          {"figures", figures},
          {"notes", sensor.notes}};
}

Json json_of(const CameraReport& report) {
  Json sensors = Json::array();
  for (const SensorReport& sensor : report.sensors) sensors.push_back(json_of(sensor));
  Json edges = Json::array();
  for (const EdgeFigures& edge : report.edges)
    edges.push_back({{"near", edge.near_vertical ? "columns" : "rows"},
                     {"angle_deg", edge.angle_deg},
                     {"mtf_at_nyquist", edge.response.mtf.back()},
                     {"mtf_error_at_nyquist", edge.mtf_error},
                     {"analytic_at_nyquist", edge.analytic.back()},
                     {"compared_from_cycles_per_px", edge.least_cycles_per_px},
                     {"worst_deviation", edge.worst},
                     {"worst_cycles_per_px", edge.worst_cycles_per_px}});
  return {{"scenario", report.scenario},
          {"width_px", report.camera.width_px},
          {"height_px", report.camera.height_px},
          {"refused", report.refused},
          {"sensors", sensors},
          {"slanted_edge", edges},
          {"missed", report.missed}};
}

void write_file(const std::filesystem::path& path,
                const std::function<void(std::ostream& out)>& write) {
  std::ofstream file(path);
  file.precision(9);
  write(file);
  file.close();
  if (!file) throw std::runtime_error(path.string() + ": cannot be written");
}

void write_levels(std::ostream& csv, const CameraReport& report) {
  csv << "bits,level,irradiance_w_m2,photons,mean_dn,mean_error_dn,temporal_variance_dn2,"
         "temporal_variance_error_dn2,spatial_variance_dn2,fitted_variance_dn2,fitted_mean_dn,"
         "linearity_deviation\n";
  for (const SensorReport& sensor : report.sensors) {
    const PhotonTransfer& transfer = sensor.transfer;
    for (std::size_t i = 0; i < sensor.record.light.size(); ++i) {
      const LightLevel& l = sensor.record.light[i];
      csv << sensor.spec.bits << ',' << i << ',' << l.irradiance_w_m2 << ',' << l.photons << ','
          << l.mean_dn.value << ',' << l.mean_dn.error << ',' << l.variance_dn2.value << ','
          << l.variance_dn2.error << ',' << l.spatial_variance_dn2.value << ','
          << transfer.transfer.at(l.mean_dn.value) << ',' << transfer.response.at(l.photons) << ',';
      if (std::isfinite(transfer.deviation[i])) csv << transfer.deviation[i];
      csv << '\n';
    }
  }
}

void write_dark(std::ostream& csv, const CameraReport& report) {
  csv << "bits,exposure_s,mean_dn,mean_error_dn,temporal_variance_dn2,"
         "temporal_variance_error_dn2,spatial_variance_dn2,share_at_zero,shows_noise\n";
  for (const SensorReport& sensor : report.sensors)
    for (const StackFigures& d : sensor.record.dark)
      csv << sensor.spec.bits << ',' << d.exposure_s << ',' << d.mean_dn.value << ','
          << d.mean_dn.error << ',' << d.variance_dn2.value << ',' << d.variance_dn2.error << ','
          << d.spatial_variance_dn2.value << ',' << d.share_at_zero << ',' << d.shows_noise()
          << '\n';
}

void write_edges(std::ostream& csv, const CameraReport& report) {
  csv << "near,cycles_per_px,mtf,analytic\n";
  for (const EdgeFigures& edge : report.edges)
    for (std::size_t i = 0; i < edge.analytic.size(); ++i)
      csv << (edge.near_vertical ? "columns" : "rows") << ',' << edge.response.cycles_per_px[i]
          << ',' << edge.response.mtf[i] << ',' << edge.analytic[i] << '\n';
}

void write_spread(std::ostream& csv, const CameraReport& report) {
  csv << "near,distance_px,spread\n";
  for (const EdgeFigures& edge : report.edges)
    for (std::size_t i = 0; i < edge.response.spread.size(); ++i)
      csv << (edge.near_vertical ? "columns" : "rows") << ',' << edge.response.distance_px[i] << ','
          << edge.response.spread[i] << '\n';
}

void write_defects(std::ostream& csv, const CameraReport& report) {
  const auto width = static_cast<std::size_t>(report.camera.width_px);
  csv << "bits,u,v,seen\n";
  for (const SensorReport& sensor : report.sensors)
    for (const Defect& defect : sensor.record.defects)
      csv << sensor.spec.bits << ',' << defect.pixel % width << ',' << defect.pixel / width << ','
          << (defect.in_dark ? "in the dark" : "by light") << '\n';
}

}  // namespace

std::string text_of(const CameraReport& report) {
  std::string text = report.refused.empty() ? "" : report.refused + "\n\n";
  for (const SensorReport& sensor : report.sensors) text += text_of(sensor);
  for (const EdgeFigures& edge : report.edges) text += text_of(edge);
  for (const std::string& missed : report.missed) text += "missed: " + missed + "\n";
  return text;
}

void write_files(const std::filesystem::path& folder, const CameraReport& report) {
  const auto table = [&](const char* name, void (*write)(std::ostream&, const CameraReport&)) {
    write_file(folder / name, [&](std::ostream& out) { write(out, report); });
  };
  table("ptc.csv", write_levels);
  table("dark.csv", write_dark);
  table("edge.csv", write_edges);
  table("edge_spread.csv", write_spread);
  table("defects.csv", write_defects);
  write_file(folder / "report.json",
             [&](std::ostream& out) { out << json_of(report).dump(2) << '\n'; });
  write_file(folder / "report.txt", [&](std::ostream& out) { out << text_of(report); });
}

}  // namespace characterize
