#include "tools/chart/chart_table.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace chart {
namespace {

std::string number(double x) {
  if (!std::isfinite(x)) return {};
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", x);
  return text;
}

/// Commas and quotes inside.
std::string quoted(const std::string& text) {
  std::string out(1, '"');
  for (const char c : text) out.append(c == '"' ? 2 : 1, c);
  return out.append(1, '"');
}

std::string columns_of(const std::string& name) {
  return ",px_" + name + ",rho_" + name + ",bias_" + name + ",noise_" + name + ",reference_" + name;
}

void write(std::ostream& out, const ClassError& e) {
  out << ',' << e.px << ',' << number(e.rho) << ',' << number(e.bias) << ',' << number(e.noise)
      << ',' << number(e.reference);
}

}  // namespace

Point make_point(const std::string& kind, const Setting& setting, int threads, const Probe& probe,
                 const PixelSorter& sorter) {
  return {.kind = kind,
          .setting = setting,
          .threads = threads,
          .cpu_ms = quantile(probe.cpu_ms, 0.5),
          .cpu_ms_p99 = quantile(probe.cpu_ms, 0.99),
          .wall_ms = quantile(probe.wall_ms, 0.5),
          .wall_ms_p99 = quantile(probe.wall_ms, 0.99),
          .frames = static_cast<int>(probe.cpu_ms.size()),
          .set_up_s = probe.set_up_s,
          .error = sorter.compare(probe.light),
          .rungs = probe.rungs};
}

ChartTable::ChartTable(const std::filesystem::path& path, const starloop::Provenance& made_with)
    : path_(path),
      file_(path),
      made_with_(quoted(made_with.version) + ',' + quoted(made_with.commit) + ',' +
                 quoted(made_with.processor) + ',' + std::to_string(made_with.processors)) {
  file_ << "scene,title,corner,period_ms,kind,setting,knob,threads,cpu_ms,cpu_ms_p99,wall_ms,"
           "wall_ms_p99,frames,set_up_s"
        << columns_of("lit") << columns_of("edge") << columns_of("sky")
        << ",flux_share,centroid_px,rungs,command";
  for (const Knob& knob : all_knobs()) {
    std::string name = knob.name;
    std::replace(name.begin(), name.end(), ' ', '_');
    file_ << ",knob_" << name;
  }
  file_ << ",version,commit,processor,processors\n";
  if (!file_) throw std::runtime_error(path_.string() + ": cannot be written");
}

void ChartTable::add(const ChartScene& scene, double period_ms, const Point& p) {
  std::string command = scene.command();
  for (const std::string& set : p.setting.sets) command += " --set '" + set + "'";
  file_ << scene.name << ',' << quoted(scene.title) << ',' << (scene.corner ? 1 : 0) << ','
        << number(period_ms) << ',' << p.kind << ',' << quoted(p.setting.name) << ','
        << quoted(p.setting.knob) << ',' << p.threads << ',' << number(p.cpu_ms) << ','
        << number(p.cpu_ms_p99) << ',' << number(p.wall_ms) << ',' << number(p.wall_ms_p99) << ','
        << p.frames << ',' << number(p.set_up_s);
  for (const ClassError* e : {&p.error.lit, &p.error.edge, &p.error.sky}) write(file_, *e);
  file_ << ',' << number(p.error.flux_share) << ',' << number(p.error.centroid_px) << ','
        << quoted(p.rungs) << ',' << quoted(command);
  const std::vector<Knob>& knobs = all_knobs();
  for (std::size_t k = 0; k < knobs.size(); ++k)
    file_ << ',' << knobs[k].rungs[p.setting.rungs[k]].name;
  file_ << ',' << made_with_ << std::endl;  // a chart takes hours: what is done stays
}

void ChartTable::close() {
  file_.close();
  if (!file_) throw std::runtime_error(path_.string() + ": cannot be written");
}

}  // namespace chart
