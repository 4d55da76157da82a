#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "engine/core/constants.h"
#include "engine/scene/brdf_check.h"
#include "tools/starloop/plot_script.h"
#include "tools/starloop/subcommands.h"

namespace starloop {
namespace {

namespace fs = std::filesystem;
using engine::Brdf;
using engine::BrdfCheck;
using engine::kDegree;

struct Shown {
  std::string name;
  Brdf brdf;
  BrdfCheck check;
};

std::string model_of(const engine::Material& m) {
  if (m.table != nullptr)
    return "table of " + std::to_string(m.table->incidences()) + " incidences";
  if (!m.shines()) return "Lambert";
  return m.variant == Brdf::Variant::kPaper ? "eq 7, paper" : "eq 7, physical";
}

std::string from_deg(double deg) {
  char text[32] = "never";
  if (deg < BrdfCheck::kNever) std::snprintf(text, sizeof text, "from %.1f deg on", deg);
  return text;
}

void tell(const engine::Material& material, const Shown& s) {
  const auto albedo = [&](double deg) { return s.brdf.albedo(std::cos(deg * kDegree)); };
  const BrdfCheck& c = s.check;
  std::printf("%s: %s\n", s.name.c_str(), model_of(material).c_str());
  std::printf("  albedo %.3f head-on, %.3f at 45 deg, %.3f at 75 deg; %.3f of it even\n", albedo(0),
              albedo(45), albedo(75), s.brdf.diffuse_albedo());
  if (std::isfinite(c.at_mirror))
    std::printf(
        "  lobe %.2f deg of the half vector wide, %.1f %% of it within 15 deg of the mirror, its "
        "middle %.1f deg off\n",
        s.brdf.lobe_half_width_rad() / kDegree, 100.0 * c.at_mirror, c.middle_off_mirror_deg);
  if (std::isfinite(c.aside_at_deg))
    std::printf(
        "  brightest reading that is not at the mirror: at %g deg of incidence, %.1f deg off\n",
        c.aside_at_deg, c.aside_off_mirror_deg);
  if (material.shines()) {
    const char* as = c.measured ? "measured" : "printed";
    std::printf("  albedo above 1 as %s: %s, %.3g at most\n", as,
                from_deg(c.makes_light_from_deg).c_str(), c.largest_albedo);
    std::printf("  limited in use: %s", from_deg(c.limited_from_deg).c_str());
    if (c.most_taken > 0.0) std::printf(", by %.0f %% of the light at most", 100.0 * c.most_taken);
    std::printf("\n");
    std::printf("  both ways differ by %.2g %% rms; as %s by %.2g %%\n", 100.0 * c.one_way_rms, as,
                100.0 * c.one_way_before_rms);
  }
  if (!c.measured) return;
  std::printf(
      "  measured from %g to %g deg of incidence, %g deg apart at most; over %.0f %% of the "
      "hemisphere; left and right differ by %.2g %% rms\n",
      c.first_in_deg, c.last_in_deg, c.widest_step_deg, 100.0 * c.least_coverage,
      100.0 * c.left_right_rms);
}

/// A field of CSV: names may hold anything.
std::string field(const std::string& name) {
  std::string quoted = "\"";
  for (const char c : name) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  quoted += '"';
  return name.find_first_of(",\"\r\n") == std::string::npos ? name : quoted;
}

void write_albedos(const std::string& path, const std::vector<Shown>& all) {
  std::ofstream csv(path);
  csv << "material,theta_in_deg,albedo,as_it_came\n";
  for (const Shown& s : all) {
    for (int i = 0; i <= 179; ++i) {
      const double deg = 0.5 * i;
      const double cos_in = std::cos(deg * kDegree);
      csv << field(s.name) << ',' << deg << ',' << s.brdf.albedo(cos_in) << ','
          << engine::albedo_as_it_came(s.brdf, cos_in) << '\n';
    }
  }
  csv.close();
  if (!csv) throw std::runtime_error(path + ": cannot be written");
}

void write_lobes(const std::string& path, const std::vector<Shown>& all) {
  std::ofstream csv(path);
  csv << "material,theta_in_deg,in_plane_deg,brdf_per_sr\n";
  for (const Shown& s : all) {
    for (const double theta_deg : {5.0, 30.0, 50.0, 70.0}) {
      std::set<double> angles_deg;
      for (int i = -178; i <= 178; ++i) angles_deg.insert(0.5 * i);
      for (int i = -100; i <= 100; ++i) angles_deg.insert(theta_deg + 0.05 * i);
      for (const double deg : angles_deg)
        csv << field(s.name) << ',' << theta_deg << ',' << deg << ','
            << s.brdf.eval(
                   engine::incident_direction(theta_deg * kDegree),
                   engine::scatter_direction(engine::ScatterAngles::kPlanes, deg * kDegree, 0.0))
            << '\n';
    }
  }
  csv.close();
  if (!csv) throw std::runtime_error(path + ": cannot be written");
}

}  // namespace

int show_materials(const CommonOptions& options, const std::string& out) {
  const Scenario scenario = load_scenario(options);
  std::vector<Shown> all;
  for (const engine::Material& m : scenario.materials) {
    const Brdf brdf = m.brdf();
    all.push_back({m.name, brdf, engine::check_brdf(brdf)});
    tell(m, all.back());
  }
  if (out.empty()) return kGood;
  fs::create_directories(out);
  write_albedos((fs::path(out) / "albedo.csv").string(), all);
  write_lobes((fs::path(out) / "lobes.csv").string(), all);
  const bool drawn = run_plot_script("materials.py", out);
  if (options.quiet) return kGood;
  std::printf(
      "%s: albedo.csv, lobes.csv%s\n", out.c_str(),
      drawn ? ", materials.png" : "; no picture: /usr/bin/python3 with matplotlib did not draw it");
  return kGood;
}

}  // namespace starloop
