#include "tools/starloop/run_folder.h"

#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <map>
#include <memory>
#include <stdexcept>

#include "engine/core/constants.h"
#include "engine/orbit/utc.h"
#include "tools/starloop/budget_table.h"
#include "tools/starloop/picture.h"
#include "tools/starloop/plot_script.h"

namespace starloop {

namespace fs = std::filesystem;
using engine::seconds;

void PngStore::put(const hil::Frame& frame) {
  write_png((folder_ / hil::frame_name(frame.sequence, "png")).string(), *frame.pixels, frame.bits);
}

std::unique_ptr<hil::FrameStore> make_store(const fs::path& folder, const Scenario& s,
                                            RecordFrames frames) {
  const std::vector<engine::FitsCard> run = {
      {"ORIGIN", "Starloop", "program that made this"},
      {"SCENARIO", s.name, "scenario"},
      {"DATEREF", engine::utc_text(s.scene.epoch), "epoch of all times, UTC"},
      {"SEED", static_cast<long long>(s.scene.seed), "of all random numbers"},
      {"BUNIT", "DN", "digital numbers"},
      {"GAIN", s.detector.gain_e_dn(), "[e-/DN]"},
      {"SATURATE", static_cast<long long>(s.detector.largest_dn()), "[DN] largest value"},
  };
  const engine::CameraGeometry& camera = s.scene.camera;
  switch (frames) {
    case RecordFrames::kPng:
      return std::make_unique<PngStore>(folder);
    case RecordFrames::kFits:
      return std::make_unique<hil::FitsStore>(folder.string(), run);
    case RecordFrames::kCube:
      return std::make_unique<hil::CubeStore>((folder / "frames.fits").string(), camera.width_px,
                                              camera.height_px, run);
    case RecordFrames::kRaw:
      return std::make_unique<hil::RawStore>((folder / "frames.slog").string(), s.run.sync_every);
    case RecordFrames::kNone:
      break;
  }
  return nullptr;
}

hil::LogStart log_start(const ScenarioSource& source, const Scenario& scenario,
                        const hil::LoopSpec& loop, int threads) {
  return {.program = "starloop " STARLOOP_VERSION,
          .scenario_file = source.file,
          .scenario = source.text,
          .overrides = source.overrides,
          .seed = scenario.scene.seed,
          .threads = static_cast<std::uint32_t>(threads),
          .loop = loop};
}

PointingScore score_pointing(const Scenario& scenario, const RunLog& log, double after_s) {
  const engine::PixelPoint boresight = scenario.scene.camera.principal_point();
  const engine::PixelRect frame = scenario.scene.camera.frame();
  PointingScore score;
  double sum2 = 0;
  for (const hil::FrameRecord& r : log.frames) {
    if (!r.handed_over) continue;
    const double since_s = seconds(r.shutter_open - log.frames.front().shutter_open);
    const engine::FrameTruth& t = r.report.truth;
    const bool inside = t.target_px.u > frame.left - 0.5 && t.target_px.u < frame.right - 0.5 &&
                        t.target_px.v > frame.top - 0.5 && t.target_px.v < frame.bottom - 0.5;
    if (!inside && !score.lost_after_s) score.lost_after_s = since_s;
    if (since_s < after_s) continue;
    const double error =
        std::hypot(t.photocentre_px.u - boresight.u, t.photocentre_px.v - boresight.v);
    if (std::isnan(error)) {
      ++score.without_target;
      continue;
    }
    sum2 += error * error;
    score.worst_px = std::max(score.worst_px, error);
    ++score.frames;
  }
  if (score.frames > 0) score.rms_px = std::sqrt(sum2 / static_cast<double>(score.frames));
  return score;
}

fs::path make_run_folder(const std::string& out, const std::string& scenario) {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char stamp[32];
  std::strftime(stamp, sizeof stamp, "%Y-%m-%dT%H-%M-%SZ", &utc);
  std::error_code error;
  fs::path folder = fs::path(out) / scenario / stamp;
  // Two runs in one second get a folder each.
  for (int n = 2; fs::exists(folder, error); ++n)
    folder = fs::path(out) / scenario / (std::string(stamp) + "_" + std::to_string(n));
  fs::create_directories(folder, error);
  if (error) throw std::runtime_error(folder.string() + ": " + error.message());
  const fs::path link = fs::path(out) / "latest";
  fs::remove(link, error);
  fs::create_directory_symlink(fs::path(scenario) / folder.filename(), link, error);
  return folder;
}

namespace {

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

File open_table(const fs::path& path) {
  File file(std::fopen(path.c_str(), "w"), &std::fclose);
  if (!file) throw std::runtime_error(path.string() + ": cannot be written");
  return file;
}

double ms(engine::Duration d) { return seconds(d) * 1e3; }

void write_commands(const fs::path& folder, const RunLog& log) {
  const File file = open_table(folder / "commands.csv");
  std::fprintf(file.get(),
               "frame,sequence,answers_frame,kind,trim_x_rad,trim_y_rad,trim_rate_x_rad_s,"
               "trim_rate_y_rad_s,reference_ns,centroid_u_px,centroid_v_px,confidence\n");
  for (const hil::CommandRecord& r : log.commands) {
    const hil::Command& c = r.command;
    std::fprintf(
        file.get(), "%llu,%llu,%llu,%s,%.17g,%.17g,%.17g,%.17g,%lld,%.9g,%.9g,%.9g\n",
        static_cast<unsigned long long>(r.frame), static_cast<unsigned long long>(c.sequence),
        static_cast<unsigned long long>(c.answers_frame),
        c.kind == hil::CommandKind::kTrim ? "trim" : "report", c.trim_offset_rad[0],
        c.trim_offset_rad[1], c.trim_rate_rad_s[0], c.trim_rate_rad_s[1],
        static_cast<long long>(c.reference.time_since_epoch().count()), c.detection.centroid_px.u,
        c.detection.centroid_px.v, static_cast<double>(c.detection.confidence));
  }
}

}  // namespace

void write_tables(const fs::path& folder, const Scenario& scenario, const RunLog& log) {
  write_commands(folder, log);
  if (!scenario.faults.faults.empty()) {
    std::ofstream faults(folder / "faults.csv");
    hil::write_faults_csv(faults, scenario.faults, log.faults);
    if (!faults.flush())
      throw std::runtime_error((folder / "faults.csv").string() + ": not written");
  }
  std::map<std::uint64_t, hil::Detection> seen;  // by the frame it was seen in
  for (const hil::CommandRecord& r : log.commands)
    if (r.command.detection.confidence > 0.0F) seen[r.command.answers_frame] = r.command.detection;

  const engine::PixelPoint boresight = scenario.scene.camera.principal_point();
  const File file = open_table(folder / "frames.csv");
  std::fprintf(
      file.get(),
      "frame,time_s,range_km,range_rate_km_s,los_rate_rad_s,phase_deg,earth_behind,"
      "target_u_px,target_v_px,photocentre_u_px,photocentre_v_px,tracker_u_px,tracker_v_px,"
      "error_u_px,error_v_px,trim_x_urad,trim_y_urad,smear_px,peak_e,peak_dn,"
      "geometry_ms,render_ms,optics_ms,detector_ms,busy_ms,late_ms,"
      "samples,hits,rays,rejected_rays,wing_px,skipped_before,handed_over,rho_mc,rho_mc_worst,"
      "passes,firefly_px,full_well_px,no_light_px,cosmic_rays,shed");
  for (const std::string& name : companion_names(scenario))
    for (const char* column : {"range_km", "u_px", "v_px", "visible_fraction"})
      std::fprintf(file.get(), ",%s_%s", name.c_str(), column);
  std::fprintf(file.get(), "\n");
  BudgetTable budgets(folder / "budget.csv");
  for (const hil::FrameRecord& r : log.frames) {
    budgets.add(r.sequence, FrameBudget(scenario, r.report.light));
    const engine::FrameReport& p = r.report;
    const engine::FrameTruth& t = p.truth;
    const auto it = seen.find(r.sequence);
    const double nan = std::nan("");
    const engine::PixelPoint tracked =
        it != seen.end() ? it->second.centroid_px : engine::PixelPoint{nan, nan};
    std::fprintf(file.get(), "%llu,%.9f,%.6f,%.6f,%.9f,%.4f,%d,",
                 static_cast<unsigned long long>(r.sequence), seconds(r.shutter_open),
                 t.range_m * 1e-3, t.range_rate_m_s * 1e-3, t.line_of_sight_rate_rad_s,
                 t.phase_angle_rad / engine::kDegree, t.earth_behind ? 1 : 0);
    std::fprintf(file.get(), "%.4f,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f,%.1f,%d,",
                 t.target_px.u, t.target_px.v, t.photocentre_px.u, t.photocentre_px.v, tracked.u,
                 tracked.v, t.photocentre_px.u - boresight.u, t.photocentre_px.v - boresight.v,
                 r.trim_rad[0] * 1e6, r.trim_rad[1] * 1e6, t.smear_px, t.peak_e, p.peak_dn);
    std::fprintf(
        file.get(),
        "%.3f,%.3f,%.3f,%.3f,%.3f,%.3f,%llu,%llu,%llu,%llu,%d,%llu,%d,%.4f,%.4f,%d,%d,%d,%d,%d,"
        "%s",
        ms(p.times.geometry), ms(p.times.render), ms(p.times.optics), ms(p.times.detector),
        ms(r.busy), ms(r.late), static_cast<unsigned long long>(p.render.samples),
        static_cast<unsigned long long>(p.render.hits),
        static_cast<unsigned long long>(p.render.rays),
        static_cast<unsigned long long>(p.render.rejected_rays), p.optics.wing_px,
        static_cast<unsigned long long>(r.skipped_before), r.handed_over ? 1 : 0,
        p.render.rho_mc.rms, p.render.rho_mc.worst, p.render.passes, p.render.rho_mc.firefly_px,
        p.detector.full_well_px, p.detector.no_light_px, p.detector.cosmic_rays,
        name_of(r.shed).data());
    for (std::size_t i = 0; i < t.companions; ++i) {
      const engine::CompanionTruth& c = t.companion[i];
      std::fprintf(file.get(), ",%.6f,%.4f,%.4f,%.4f", c.range_m * 1e-3, c.target_px.u,
                   c.target_px.v, c.visible_fraction);
    }
    std::fprintf(file.get(), "\n");
  }
  budgets.close();
}

bool draw_pictures(const fs::path& folder, const std::string& compare) {
  return run_plot_script("run_report.py", folder.string(), compare);
}

bool write_page(const fs::path& folder) {
  return run_plot_script("report_html.py", folder.string());
}

}  // namespace starloop
