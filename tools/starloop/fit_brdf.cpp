#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>
#include <string>

#include "engine/core/constants.h"
#include "engine/core/contract.h"
#include "engine/scene/brdf.h"
#include "engine/scene/brdf_fit.h"
#include "engine/scene/material.h"
#include "tools/starloop/plot_script.h"
#include "tools/starloop/subcommands.h"

namespace starloop {
namespace {

namespace fs = std::filesystem;
using engine::BrdfFit;
using engine::BrdfPoints;
using engine::FitParameter;
using engine::kDegree;
using engine::kFitNames;
using engine::kFitParameters;
using Variant = engine::Brdf::Variant;

constexpr double kGoTogether = 0.95;
// Points that are off by so much of the model are no scatter about it.
constexpr double kFarOff = 0.3;
constexpr double kTooFar = 1.5;  // chi squared over the degrees of freedom

void hold(const std::string& assignment, engine::BrdfFitSpec& spec) {
  const std::size_t equals = assignment.find('=');
  for (std::size_t i = 0; equals != std::string::npos && i < kFitParameters; ++i) {
    if (assignment.substr(0, equals) != kFitNames[i]) continue;
    const std::string number = assignment.substr(equals + 1);
    char* end = nullptr;
    const double value = std::strtod(number.c_str(), &end);
    const double size = static_cast<FitParameter>(i) == FitParameter::kBr ? -value : value;
    if (number.empty() || *end != '\0' || !(size > 0.0 && size < 1e9)) break;
    spec.fixed[i] = value;
    return;
  }
  throw engine::ConfigError(
      "--fix must be ar, br, kb, kd or kr=NUMBER, positive but for br, got \"" + assignment + "\"");
}

FitParameter parameter(std::size_t i) { return static_cast<FitParameter>(i); }

/// A key of TOML, in quotes where it needs them.
std::string key_of(const std::string& name) {
  const auto bare = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '-'; };
  const auto never = [](unsigned char c) { return c < ' ' || c == 127; };
  // Keys of scenarios are looked up by paths, in which these part names.
  if (name.empty() || name.find_first_of(".[]") != std::string::npos ||
      std::ranges::any_of(name, never))
    throw engine::ConfigError("--name must be a name without . [ ] and control characters, got \"" +
                              name + "\"");
  if (std::ranges::all_of(name, bare)) return name;
  std::string quoted = "\"";
  for (const char c : name) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + "\"";
}

/// Why a scenario would not take it; empty: it does.
const char* refusal_of(FitParameter which, double value) {
  if (which == FitParameter::kKd && value > engine::kMostKd)
    return "; a scenario refuses it: above 1/pi it makes light";
  if (which == FitParameter::kBr && value < engine::kLeastBr)
    return "; a scenario refuses it: below -1e6";
  if (which == FitParameter::kBr && !(value < 0.0)) return "; a scenario refuses it: not below 0";
  return "";
}

/// As many digits as anyone can use, and more where rounding would make a scenario refuse it.
std::string number_of(FitParameter which, double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%-12.6g", value);
  if (*refusal_of(which, value) == '\0' && *refusal_of(which, std::strtod(text, nullptr)) != '\0')
    std::snprintf(text, sizeof text, "%-12.16g", value);
  return text;
}

std::string block(const FitBrdfOptions& options, const BrdfFit& fit,
                  const engine::BrdfFitSpec& spec) {
  std::string text = "[materials." + key_of(options.name) + "]";
  text += "   # by starloop fit-brdf, brdf.variant = \"" + options.variant + "\"\n";
  for (std::size_t i = 0; i < kFitParameters; ++i) {
    char line[100];
    text += std::string(kFitNames[i]) + " = " + number_of(parameter(i), fit.value(parameter(i)));
    if (spec.fixed[i].has_value()) {
      text += "# held";
    } else if (fit.undetermined(parameter(i))) {
      text += "# not determined by these data";
    } else {
      std::snprintf(line, sizeof line, "# +- %.2g", fit.sigma[i]);
      text += line;
    }
    text += refusal_of(parameter(i), fit.value(parameter(i)));
    text += "\n";
  }
  return text;
}

/// Of points that the model in use, limited where it would make light, has otherwise than the fit.
std::size_t limited_points(const BrdfPoints& points, const BrdfFit& fit, Variant variant) {
  const engine::FiveParameterBrdf used(fit.parameters, variant, 0.0);
  std::size_t limited = 0;
  for (std::size_t i = 0; i < points.points.size(); ++i) {
    const double value = used.eval(incident_direction(points.points[i]),
                                   scatter_direction(points.angles, points.points[i]));
    if (fit.model_per_sr[i] > 0.0 && value < 0.99 * fit.model_per_sr[i]) ++limited;
  }
  return limited;
}

/// How far the points are off.
void tell_scatter(const BrdfPoints& points, const BrdfFit& fit, Variant variant) {
  const char* diffuse = variant == Variant::kPaper ? "kd/cos_i" : "kd";
  const double off_percent = 100.0 * fit.relative_rms;
  if (points.have_sigma) {
    std::printf("%s: %zu points, chi squared %.3g of each of %zu degrees of freedom%s\n",
                points.path.c_str(), fit.points, fit.reduced_chi2, fit.degrees,
                fit.reduced_chi2 > kTooFar
                    ? ": stated sigmas are too small, or eq 7 does not describe this surface; "
                      "uncertainties are scaled up by its root"
                    : "");
    std::printf(
        "points are off by %.2g %% rms of the model where it is above three sigmas; eq 7, diffuse "
        "term %s\n",
        off_percent, diffuse);
  } else {
    std::printf("%s: %zu points, off by %.2g %% rms of the model; eq 7, diffuse term %s\n",
                points.path.c_str(), fit.points, off_percent, diffuse);
  }
  if (!points.have_sigma && fit.relative_rms > kFarOff)
    std::printf(
        "that is more than scatter: eq 7 may not describe this surface; the uncertainties "
        "do not know\n");
}

void tell(const BrdfPoints& points, const BrdfFit& fit, const engine::BrdfFitSpec& spec) {
  tell_scatter(points, fit, spec.variant);
  if (!fit.converged) std::printf("the fit did not settle: do not trust it\n");
  for (std::size_t i = 0; i < kFitParameters; ++i) {
    if (spec.fixed[i].has_value()) continue;
    if (fit.undetermined(parameter(i)))
      std::printf("%s: not determined by these data; --fix it\n",
                  std::string(kFitNames[i]).c_str());
    for (std::size_t k = 0; k < i; ++k) {
      const double together =
          fit.correlation(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
      if (std::abs(together) > kGoTogether)
        std::printf(
            "%s and %s go together, correlation %.3f: their uncertainties hold for each "
            "with the other free\n",
            std::string(kFitNames[k]).c_str(), std::string(kFitNames[i]).c_str(), together);
    }
  }
  if (const std::size_t limited = limited_points(points, fit, spec.variant); limited > 0)
    std::printf(
        "at %zu of the points the renderer stays below the fit: there it would send back "
        "more than comes in\n",
        limited);
}

void need_written(std::ofstream& file, const std::string& path) {
  file.close();
  if (!file) throw std::runtime_error(path + ": cannot be written");
}

void write_points(const std::string& path, const BrdfPoints& points, const BrdfFit& fit) {
  std::ofstream csv(path);
  csv.precision(9);
  csv << (points.angles == engine::ScatterAngles::kPlanes
              ? "theta_in_deg,in_plane_deg,out_of_plane_deg,"
              : "theta_in_deg,theta_out_deg,azimuth_deg,")
      << "brdf_per_sr,sigma_per_sr,model_per_sr\n";
  for (std::size_t i = 0; i < points.points.size(); ++i) {
    const engine::BrdfPoint& p = points.points[i];
    const double sigma =
        points.have_sigma ? p.sigma_per_sr : fit.relative_rms * fit.model_per_sr[i];
    csv << p.theta_in_deg << ',' << p.first_deg << ',' << p.second_deg << ',' << p.brdf_per_sr
        << ',' << sigma << ',' << fit.model_per_sr[i] << '\n';
  }
  need_written(csv, path);
}

/// The fit along the plane of incidence, for the picture.
void write_curves(const std::string& path, const BrdfPoints& points, const BrdfFit& fit,
                  const engine::BrdfFitSpec& spec) {
  std::set<double> incidences_deg;
  for (const engine::BrdfPoint& p : points.points) incidences_deg.insert(p.theta_in_deg);
  std::ofstream csv(path);
  csv.precision(9);
  csv << "theta_in_deg,in_plane_deg,model_per_sr\n";
  for (const double theta_in_deg : incidences_deg) {
    std::set<double> angles_deg;
    for (int i = -170; i <= 170; ++i) angles_deg.insert(0.5 * i);
    for (int i = -100; i <= 100; ++i)
      if (std::abs(theta_in_deg + 0.05 * i) < 85.0) angles_deg.insert(theta_in_deg + 0.05 * i);
    for (const double deg : angles_deg)
      csv << theta_in_deg << ',' << deg << ','
          << engine::fitted_per_sr(
                 fit.parameters, spec.variant, engine::incident_direction(theta_in_deg * kDegree),
                 engine::scatter_direction(engine::ScatterAngles::kPlanes, deg * kDegree, 0.0))
          << '\n';
  }
  need_written(csv, path);
}

}  // namespace

int fit_brdf(const FitBrdfOptions& options) {
  engine::BrdfFitSpec spec;
  spec.variant = options.variant == "paper" ? Variant::kPaper : Variant::kPhysical;
  for (const std::string& assignment : options.fixed) hold(assignment, spec);
  static_cast<void>(key_of(options.name));  // complains before the work
  const BrdfPoints points = engine::read_brdf_points(options.samples);
  const BrdfFit fit = engine::fit_brdf(points, spec);
  if (!options.quiet) tell(points, fit, spec);
  std::printf("%s", block(options, fit, spec).c_str());
  if (options.out.empty()) return fit.converged ? kGood : kCriterionFailed;
  fs::create_directories(options.out);
  const fs::path folder = options.out;
  write_points((folder / "fit.csv").string(), points, fit);
  write_curves((folder / "fit_curves.csv").string(), points, fit, spec);
  std::ofstream toml(folder / "material.toml");
  toml << block(options, fit, spec);
  need_written(toml, (folder / "material.toml").string());
  const bool drawn = run_plot_script("fit_brdf.py", options.out);
  if (!options.quiet)
    std::printf(
        "%s: fit.csv, fit_curves.csv, material.toml%s\n", options.out.c_str(),
        drawn ? ", fit.png" : "; no picture: /usr/bin/python3 with matplotlib did not draw it");
  return fit.converged ? kGood : kCriterionFailed;
}

}  // namespace starloop
