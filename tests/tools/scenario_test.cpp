#include "tools/starloop/scenario.h"

#include <cmath>
#include <cstdio>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <starloop_test_paths.h>

#include "engine/core/constants.h"
#include "engine/orbit/kepler.h"
#include "engine/orbit/utc.h"
#include "tools/starloop/rig.h"

namespace {

using engine::ConfigError;
using engine::ConfigReader;
using starloop::CommonOptions;
using starloop::Scenario;

const std::string kFlyby = STARLOOP_SOURCE_DIR "/config/flyby.toml";

std::string flyby_text() {
  std::ostringstream text;
  text << std::ifstream(kFlyby).rdbuf();
  return text.str();
}

Scenario load(const std::vector<std::string>& overrides = {}) {
  CommonOptions options;
  options.file = kFlyby;
  options.overrides = overrides;
  return starloop::load_scenario(options);
}

/// What the ConfigError says; nothing when there is none.
template <class Work>
std::optional<std::string> complaint(const Work& work) {
  try {
    work();
  } catch (const ConfigError& e) {
    return e.what();
  }
  return std::nullopt;
}

bool starts_with(const std::string& text, const std::string& start) {
  return text.rfind(start, 0) == 0;
}

/// The line, from 1, that starts with `start` in the table `table`.
int line_of(const std::string& text, const std::string& table, const std::string& start) {
  std::istringstream in(text);
  bool inside = false;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    if (starts_with(line, "[")) inside = starts_with(line, "[" + table + "]");
    if (inside && starts_with(line, start)) return number;
  }
  return 0;
}

/// The text with one line of a table replaced.
std::string with_line(const std::string& text, int number, const std::string& replacement) {
  std::istringstream in(text);
  std::string out;
  int at = 0;
  for (std::string line; std::getline(in, line);)
    out.append(++at == number ? replacement : line).append("\n");
  return out;
}

TEST(Scenario, ThePapersPassLoads) {
  const Scenario s = load();
  EXPECT_EQ(s.name, "flyby");
  EXPECT_EQ(s.run.pass, 3U);
  EXPECT_EQ(s.run.exposure, engine::Duration(1'000'000));
  EXPECT_EQ(s.run.period, engine::Duration(100'000'000));
  EXPECT_EQ(s.run.command_lead, engine::Duration(10'000'000));
  EXPECT_DOUBLE_EQ(s.camera_orbit.elements.semi_major_axis_m, 6868.8546e3);
  EXPECT_DOUBLE_EQ(s.scene.camera.pixel_pitch_m, 6.5e-6);
  EXPECT_EQ(s.scene.camera.width_px, 1024);
  EXPECT_EQ(s.detector.bits, 11);
  EXPECT_DOUBLE_EQ(s.guidance.offset_rad[0], 200e-6);
  EXPECT_DOUBLE_EQ(s.guidance.growth_rad_s[0], 50e-6);
  EXPECT_DOUBLE_EQ(s.actuator.rate_limit_rad_s, 2e-3);
  EXPECT_DOUBLE_EQ(s.actuator.acceleration_limit_rad_s2, 10e-3);
  EXPECT_DOUBLE_EQ(s.criteria.pointing_rms_px, 0.5);
}

TEST(Scenario, ItsEpochCanBeSetLikeAnyOtherValue) {
  for (const char* date : {"2022-03-01T12:00:00", "2022-060T12:00:00", "2022-03-01T12:00:00Z"})
    EXPECT_EQ(load({"scenario.epoch=" + std::string(date)}).scene.epoch,
              engine::epoch_from_utc("2022-03-01T12:00:00").value());
  EXPECT_EQ(load({"scenario.epoch=2016-12-31T23:59:60.5"}).scene.epoch,
            engine::epoch_from_utc("2016-12-31T23:59:60.5").value());
}

TEST(Scenario, BothBodiesMayMoveOverAnOblateEarth) {
  const Scenario s = load({"orbit.camera.propagator=j2", "orbit.target.propagator=j2"});
  const auto camera = starloop::propagator_of(s, s.camera_orbit);
  const auto target = starloop::propagator_of(s, s.target_orbit);
  const std::vector<engine::Pass> passes = starloop::passes_of(s);
  ASSERT_FALSE(passes.empty());
  for (const engine::Pass& pass : passes) {
    const engine::Epoch t = s.scene.epoch + pass.closest.time_since_epoch();
    EXPECT_EQ((target->at(t).position.m - camera->at(t).position.m).norm(), pass.min_range_m);
  }
  // No two-body pass is at its time.
  const std::vector<engine::Pass> others = starloop::passes_of(load());
  for (const engine::Pass& pass : passes)
    for (const engine::Pass& other : others)
      EXPECT_GT(std::abs(engine::seconds(pass.closest - other.closest)), 60.0);
}

TEST(Scenario, AnOrbitMayBeAState) {
  const Scenario of_elements = load();
  const engine::OrbitState state =
      starloop::propagator_of(of_elements, of_elements.camera_orbit)->at(of_elements.scene.epoch);
  std::string text = flyby_text();
  const std::size_t from = text.find("[orbit.camera]");
  const std::size_t to = text.find("[orbit.target]");
  char orbit[400];
  std::snprintf(orbit, sizeof orbit,
                "[orbit.camera]\nposition_km = [%.12f, %.12f, %.12f]\nvelocity_km_s = [%.15f, "
                "%.15f, %.15f]\n",
                state.position.m.x() * 1e-3, state.position.m.y() * 1e-3,
                state.position.m.z() * 1e-3, state.velocity.m_s.x() * 1e-3,
                state.velocity.m_s.y() * 1e-3, state.velocity.m_s.z() * 1e-3);
  text.replace(from, to - from, orbit);
  const Scenario s = starloop::read_scenario(ConfigReader::from_text(text, "x.toml"));
  // The state's last digits, 1e-9 m and 1e-12 m/s, after three and a half days.
  EXPECT_NEAR(engine::seconds(starloop::chosen_pass(s).closest),
              engine::seconds(starloop::chosen_pass(of_elements).closest), 1e-6);
}

TEST(Scenario, FramesAreWantedWithinWhatIsIntegrated) {
  Scenario s = load({"orbit.camera.propagator=j2", "visibility.span_days=0.1"});
  starloop::want_frames(s, engine::sim_time(86400.0), engine::sim_time(2 * 86400.0));
  const auto camera = starloop::propagator_of(s, s.camera_orbit);
  EXPECT_GE(camera->span().end, s.scene.epoch + engine::from_seconds(2 * 86400.0));
  const auto late =
      complaint([&] { starloop::want_frames(s, engine::sim_time(0.0), engine::sim_time(9e9)); });
  ASSERT_TRUE(late.has_value());
}

TEST(Scenario, PointingIsWithoutFlawsUnlessItSaysOtherwise) {
  const Scenario s = load();
  EXPECT_EQ(s.mode, hil::GuidanceMode::kPredictedTarget);
  EXPECT_EQ(s.target_knowledge.ahead_s, 0.0);
  EXPECT_EQ(s.actuator.delay, engine::Duration{});
  EXPECT_TRUE(s.jitter.lines.empty());
  EXPECT_EQ(s.sensors.across_rad, 0.0);
}

TEST(Scenario, PointingTakesItsModeItsErrorsItsJitterAndItsSensors) {
  const Scenario s =
      load({"guidance.mode=nadir", "guidance.target_error_along_m=12", "actuator.delay_ms=40",
            "jitter.lines.wheel.frequency_hz=40", "jitter.lines.wheel.amplitude_urad=2",
            "sensors.star_tracker_roll_arcsec=3600"});
  EXPECT_EQ(s.mode, hil::GuidanceMode::kNadir);
  EXPECT_EQ(s.target_knowledge.along_m, 12.0);
  EXPECT_EQ(s.actuator.delay, engine::Duration(40'000'000));
  ASSERT_EQ(s.jitter.lines.size(), 1U);
  EXPECT_EQ(s.jitter.lines[0].frequency_hz, 40.0);
  EXPECT_NEAR(s.sensors.roll_rad, 0.0174532925, 1e-9);
}

TEST(Scenario, OverridesAndTheSeedReplaceWhatTheFileSays) {
  const Scenario s = load({"detector.read_noise_e=4", "run.clock=lockstep", "scenario.name=other"});
  EXPECT_EQ(s.run.clock, starloop::ClockMode::kLockstep);
  EXPECT_EQ(s.name, "other");
  CommonOptions options;
  options.file = kFlyby;
  options.seed_given = true;
  options.seed = 99;
  EXPECT_EQ(starloop::load_scenario(options).scene.seed, 99U);
}

// Li et al. 2023's orbits: 16 windows nearer than 300 km in 15 days (two-body, both epochs t = 0).
TEST(Scenario, ThePapersOrbitsHaveSixteenPasses) {
  const std::vector<engine::Pass> passes = starloop::passes_of(load());
  EXPECT_EQ(passes.size(), 16U);
  for (const engine::Pass& p : passes) {
    EXPECT_LT(p.start, p.end);
    EXPECT_LE(p.start, p.closest);
    EXPECT_LE(p.closest, p.end);
    EXPECT_LT(p.min_range_m, 300e3);
  }
}

TEST(Scenario, ItsCamerasFieldAndNoiseSayWhatCanBeSeen) {
  // config/flyby.toml: .36 m, .7 through the optics, .55 to electrons, 626.78 nm, 1 ms.
  const Scenario bright = load({"visibility.least_snr=5", "visibility.target_radius_m=2"});
  const engine::SignalLimit signal = bright.visibility.signal.value();
  const double photon_j = engine::kPlanck_j_s * engine::kSpeedOfLight_m_s / 626.78e-9;
  const double pupil_m2 = engine::kPi / 4.0 * 0.36 * 0.36;
  EXPECT_NEAR(signal.electrons_per_w_m2 / (pupil_m2 * 0.7 * 0.55 * 1e-3 / photon_j), 1.0, 1e-6);
  EXPECT_DOUBLE_EQ(signal.ifov_rad, 6.5e-6 / 4.5);
  EXPECT_GT(signal.dark_noise_e, 2.0);  // to read
  EXPECT_EQ(starloop::passes_of(bright).size(), 16U);
  // A ball of 4 cm is too faint at 300 km, and against the light.
  const auto faint =
      starloop::passes_of(load({"visibility.least_snr=5", "visibility.target_radius_m=0.02"}));
  EXPECT_GT(faint.size(), 0U);
  EXPECT_LT(faint.size(), 16U);
  for (const engine::Pass& pass : faint) {
    EXPECT_EQ(pass.start_limited_by, engine::Condition::kSignal);
    EXPECT_LT(pass.min_range_m, 200e3);
  }
  EXPECT_THROW(load({"visibility.least_snr=5"}), engine::ConfigError);  // of what size?

  const std::vector<std::string> place{"guidance.boresight_ra_deg=10",
                                       "guidance.boresight_dec_deg=20"};
  EXPECT_FALSE(load(place).visibility.field.has_value());
  std::vector<std::string> held = place;
  held.push_back("visibility.in_field=true");
  const engine::FieldOfView field = load(held).visibility.field.value();
  EXPECT_NEAR(field.right_tan - field.left_tan, 1024 * 6.5e-6 / 4.5, 1e-12);
  EXPECT_NEAR(field.left_tan, -512.5 * 6.5e-6 / 4.5, 1e-12);
  EXPECT_TRUE(starloop::passes_of(load(held)).empty());
}

struct BadValue {
  std::string assignment;
  std::string key;  ///< the complaint is about this one
  std::string says;
};

// Unknown keys, wrong types, out of range, not one of the words: each says where and what.
const std::vector<BadValue> kBadValues = {
    {"detector.full_well_e=-30000", "detector.full_well_e", "must be > 0, got -30000"},
    {"detector.quantum_efficiency=1.5", "detector.quantum_efficiency", "got 1.5"},
    {"detector.bits=0", "detector.bits", "got 0"},
    {"detector.bits=17", "detector.bits", "got 17"},
    {"detector.read_noise_e=\"two\"", "detector.read_noise_e", "got \"two\""},
    {"detector.colour=1", "detector.colour", "is not a key"},
    {"gearbox.teeth=12", "gearbox.teeth", "is not a key"},
    {"orbit.moon.raan_deg=0", "orbit.moon.raan_deg", "is not a key"},
    {"run.pass=0", "run.pass", "must be >= 1, got 0"},
    {"run.pass=2.5", "run.pass", "must be a whole number, got 2.5"},
    {"run.pass=third", "run.pass", "got \"third\""},
    {"run.pass=[3]", "run.pass", "got a value of type array"},
    {"run.pass=true", "run.pass", "got true"},
    {"run.frame_rate_hz=0", "run.frame_rate_hz", "got 0"},
    {"run.exposure_ms=nan", "run.exposure_ms", "got nan"},
    {"run.duration_s=-1", "run.duration_s", "got -1"},
    {"run.record_every=0", "run.record_every", "got 0"},
    {"run.clock=sundial", "run.clock",
     "must be one of \"realtime\", \"lockstep\", \"as-fast-as-possible\", \"triggered\", "
     "got \"sundial\""},
    {"run.exposure_ms=90.001", "run.exposure_ms", "must fit into one period"},
    {"scenario.epoch=yesterday", "scenario.epoch", "must be a UTC date"},
    {"scenario.epoch=2022-13-01T00:00:00", "scenario.epoch", "must be a UTC date"},
    {"scenario.name=a/b", "scenario.name", "usable as a folder's name"},
    {"scenario.name=..", "scenario.name", "usable as a folder's name"},
    {"scenario.name=7", "scenario.name", "must be text"},
    {"scenario.seed=-1", "scenario.seed", "got -1"},
    {"scenario.light_path=curved", "scenario.light_path", "must be one of"},
    {"orbit.camera.eccentricity=1.0", "orbit.camera.eccentricity",
     "must not be that of a parabola"},
    {"orbit.target.inclination_deg=181", "orbit.target.inclination_deg", "got 181"},
    {"camera.width_px=8", "camera.width_px", "got 8"},
    {"camera.height_px=4097", "camera.height_px", "got 4097"},
    {"camera.focal_length_m=inf", "camera.focal_length_m", "got inf"},
    {"camera.pixel_pitch_um=0", "camera.pixel_pitch_um", "got 0"},
    {"optics.transmission=1.01", "optics.transmission", "got 1.01"},
    {"optics.obscuration=1", "optics.obscuration", "got 1"},
    {"sun.position=guess", "sun.position", "got \"guess\""},
    {"earth.earthshine=bright", "earth.earthshine", "got \"bright\""},
    {"sky.radiance_w_m2_sr=-1e-9", "sky.radiance_w_m2_sr", "must be >= 0"},
    {"render.samples_per_pixel=0", "render.samples_per_pixel", "got 0"},
    {"render.samples_per_pixel=many", "render.samples_per_pixel", "\"auto\", got \"many\""},
    {"render.deadline_ms=0", "render.deadline_ms", "got 0"},
    {"render.deadline_ms=101", "render.deadline_ms", "must be >= 0.1 and <= 100"},
    {"render.deadline_ms=never", "render.deadline_ms", "\"none\", got \"never\""},
    {"render.bounces=17", "render.bounces", "got 17"},
    {"render.bounces=all", "render.bounces", "\"auto\", got \"all\""},
    {"render.profile=best", "render.profile", "got \"best\""},
    {"render.sampler=cone", "render.sampler", "got \"cone\""},
    {"render.sequence=halton", "render.sequence", "got \"halton\""},
    {"render.caustics=none", "render.caustics", "got \"none\""},
    {"render.sun_disc=half", "render.sun_disc", "got \"half\""},
    {"brdf.variant=shiny", "brdf.variant", "got \"shiny\""},
    {"visibility.shadow=square", "visibility.shadow", "\"oblate-cone\", got \"square\""},
    {"visibility.least_snr=-1", "visibility.least_snr", "got -1"},
    {"visibility.target_radius_m=2", "visibility.target_radius_m", "no use without least_snr"},
    {"visibility.target_albedo=0", "visibility.target_albedo", "got 0"},
    {"visibility.in_field=true", "visibility.in_field", "needs guidance.boresight_ra_deg"},
    {"visibility.in_field=1", "visibility.in_field", "must be true or false"},
    {"actuator.damping=0", "actuator.damping", "got 0"},
    {"actuator.rate_limit_mrad_s=0", "actuator.rate_limit_mrad_s", "must be > 0, got 0"},
    {"tracker.alpha=1.5", "tracker.alpha", "got 1.5"},
    {"visibility.max_range_km=0", "visibility.max_range_km", "got 0"},
    {"visibility.span_days=1e9", "visibility.span_days", "got 1000000000"},
};

TEST(Scenario, RenderReadsWhatItIsToldAndWhatItIsToFindOut) {
  const auto scenario =
      load({"render.samples_per_pixel=auto", "render.bounces=auto", "render.profile=reference",
            "render.sampler=paper-cone", "render.sequence=independent", "render.caustics=exact",
            "render.sun_disc=off"});
  EXPECT_EQ(scenario.render.samples_per_pixel, 0);
  EXPECT_TRUE(scenario.render.bounces_by_need);
  EXPECT_EQ(scenario.render.profile.rho_mc, 0.063);
  EXPECT_EQ(scenario.render.sampler, engine::BrdfSampler::kPaperCone);
  EXPECT_EQ(scenario.render.sequence, engine::SequenceKind::kIndependent);
  EXPECT_TRUE(scenario.render.exact_caustics);
  EXPECT_EQ(scenario.render.sun_disc, engine::SunDisc::kOff);
  const auto plain = load({});
  EXPECT_EQ(plain.render.samples_per_pixel, 50);
  EXPECT_FALSE(plain.render.bounces_by_need);
  EXPECT_EQ(plain.render.profile.rho_mc, 0.19);
}

TEST(Scenario, OnlyARunInRealTimeByPathsHasADeadlineForItsRendering) {
  EXPECT_EQ(load({}).run.render_time, engine::Duration{});
  EXPECT_EQ(load({"render.deadline_ms=none"}).run.render_time, engine::Duration{});
  EXPECT_EQ(load({"render.deadline_ms=12.5"}).run.render_time, engine::Duration(12'500'000));
  for (const char* clock : {"lockstep", "as-fast-as-possible", "triggered"}) {
    const auto said = complaint([&] {
      static_cast<void>(load({std::string("run.clock=") + clock, "render.deadline_ms=20"}));
    });
    EXPECT_EQ(said.value_or(""),
              "--set render.deadline_ms=20: render.deadline_ms needs run.clock = \"realtime\": no "
              "other run asks a clock");
  }
  const auto said = complaint([] {
    static_cast<void>(load({"render.method=lattice", "render.deadline_ms=20"}));
  });
  EXPECT_EQ(said.value_or(""),
            "--set render.deadline_ms=20: render.deadline_ms needs render.method = \"paths\": no "
            "other stops half-way");
}

TEST(Scenario, ABadOverrideIsAConfigErrorThatQuotesItAndNamesTheKey) {
  for (const BadValue& bad : kBadValues) {
    SCOPED_TRACE(bad.assignment);
    const auto said = complaint([&] { static_cast<void>(load({bad.assignment})); });
    ASSERT_TRUE(said.has_value());
    EXPECT_TRUE(starts_with(*said, "--set " + bad.assignment + ": " + bad.key + " ")) << *said;
    EXPECT_NE(said->find(bad.says), std::string::npos) << *said;
  }
}

TEST(Scenario, ABadValueInTheFileIsAConfigErrorThatNamesItsLineAndTheKey) {
  const std::string text = flyby_text();
  int checked = 0;
  for (const BadValue& bad : kBadValues) {
    const auto equals = bad.assignment.find('=');
    const auto dot = bad.assignment.rfind('.', equals);
    const std::string table = bad.assignment.substr(0, dot);
    std::string key = bad.assignment.substr(dot + 1, equals - dot - 1);
    const int line = line_of(text, table, key + " =");
    if (line == 0) continue;  // not in the file
    std::string value = bad.assignment.substr(equals + 1);
    // What is no TOML value is a bare word, as for --set.
    const bool bare = complaint([&] {
                        static_cast<void>(ConfigReader::from_text("v = " + value, "probe"));
                      }).has_value();
    if (bare) value = '"' + value + '"';
    SCOPED_TRACE(bad.assignment);
    key.append(" = ").append(value);
    const std::string broken = with_line(text, line, key);
    const auto said = complaint([&] {
      static_cast<void>(starloop::read_scenario(ConfigReader::from_text(broken, "x.toml")));
    });
    ASSERT_TRUE(said.has_value());
    EXPECT_TRUE(starts_with(*said, "x.toml:" + std::to_string(line) + ": " + bad.key + " "))
        << *said;
    EXPECT_NE(said->find(bad.says), std::string::npos) << *said;
    ++checked;
  }
  EXPECT_GE(checked, 30);
}

TEST(Scenario, AMissingKeyIsAConfigErrorThatNamesTheFileAndTheKey) {
  const std::string text = flyby_text();
  for (const auto& [table, key] :
       std::vector<std::pair<std::string, std::string>>{{"scenario", "name"},
                                                        {"scenario", "epoch"},
                                                        {"run", "pass"},
                                                        {"run", "exposure_ms"},
                                                        {"run", "frame_rate_hz"},
                                                        {"orbit.camera", "semi_major_axis_km"},
                                                        {"orbit.camera", "eccentricity"},
                                                        {"orbit.target", "mean_anomaly_deg"},
                                                        {"camera", "focal_length_m"},
                                                        {"camera", "width_px"},
                                                        {"optics", "aperture_m"},
                                                        {"detector", "quantum_efficiency"},
                                                        {"detector", "full_well_e"},
                                                        {"actuator", "natural_frequency_hz"},
                                                        {"actuator", "damping"}}) {
    SCOPED_TRACE(table + "." + key);
    const int line = line_of(text, table, key + " =");
    ASSERT_GT(line, 0);
    const auto said = complaint([&] {
      static_cast<void>(
          starloop::read_scenario(ConfigReader::from_text(with_line(text, line, ""), "x.toml")));
    });
    ASSERT_TRUE(said.has_value());
    EXPECT_TRUE(starts_with(*said, "x.toml")) << *said;
    EXPECT_NE(said->find(table + "." + key + " is missing"), std::string::npos) << *said;
  }
}

TEST(Scenario, AnUnknownKeyInTheFileIsNamedWithItsLine) {
  const std::string text = flyby_text();
  for (const std::string table : {"scenario", "orbit.camera", "detector", "materials.silicon"}) {
    SCOPED_TRACE(table);
    const int header = line_of(text, table, "[");
    ASSERT_GT(header, 0);
    const std::string broken = with_line(text, header, "[" + table + "]\nmisspelt = 1");
    const auto said = complaint([&] {
      static_cast<void>(starloop::read_scenario(ConfigReader::from_text(broken, "x.toml")));
    });
    ASSERT_TRUE(said.has_value());
    EXPECT_TRUE(
        starts_with(*said, "x.toml:" + std::to_string(header + 1) + ": " + table + ".misspelt "))
        << *said;
  }
}

TEST(Scenario, APerigeeInsideTheEarthIsAConfigErrorAtTheOrbit) {
  const auto said = complaint([] { static_cast<void>(load({"orbit.camera.eccentricity=0.2"})); });
  ASSERT_TRUE(said.has_value());
  const int line = line_of(flyby_text(), "orbit.camera", "semi_major_axis_km");
  EXPECT_TRUE(starts_with(
      *said, kFlyby + ":" + std::to_string(line) + ": orbit.camera.semi_major_axis_km "))
      << *said;
  EXPECT_NE(said->find("perigee inside the Earth"), std::string::npos) << *said;
  EXPECT_NE(said->find("eccentricity"), std::string::npos) << *said;
}

TEST(Scenario, WhatIsNoAssignmentIsQuotedBack) {
  for (const std::string text : {"nonsense", "run", "pass=3", "=3", "run.=3", ".pass=3", ""}) {
    const auto said = complaint([&] { static_cast<void>(load({text})); });
    ASSERT_TRUE(said.has_value()) << text;
    EXPECT_EQ(*said, "--set " + text + ": expected table.key=value");
  }
  const auto table = complaint([] { static_cast<void>(load({"orbit.camera=3"})); });
  ASSERT_TRUE(table.has_value());
  EXPECT_NE(table->find("orbit.camera is a table, not a value"), std::string::npos) << *table;
  const auto value = complaint([] { static_cast<void>(load({"run.pass.number=3"})); });
  ASSERT_TRUE(value.has_value());
  EXPECT_NE(value->find("pass is a value, not a table"), std::string::npos) << *value;
}

TEST(Scenario, BrokenTomlIsAConfigErrorWithItsLine) {
  const std::string text = flyby_text();
  const int line = line_of(text, "run", "pass =");
  for (const std::string broken : {"pass = ", "pass 3", "pass = \"3", "[run", "pass = 3 4"}) {
    const auto said = complaint([&] {
      static_cast<void>(ConfigReader::from_text(with_line(text, line, broken), "x.toml"));
    });
    ASSERT_TRUE(said.has_value()) << broken;
    // Some are only seen at the start of the line after.
    EXPECT_TRUE(starts_with(*said, "x.toml:" + std::to_string(line) + ": ") ||
                starts_with(*said, "x.toml:" + std::to_string(line + 1) + ": "))
        << *said;
  }
  EXPECT_TRUE(complaint([] {
                static_cast<void>(ConfigReader::from_text("a.b = 1\na.b = 2\n", "x.toml"));
              }).has_value());
}

TEST(Scenario, ATableWrittenAsAValueIsAConfigError) {
  const auto said = complaint([] {
    static_cast<void>(starloop::read_scenario(ConfigReader::from_text("scenario = 5\n", "x.toml")));
  });
  ASSERT_TRUE(said.has_value());
  EXPECT_EQ(*said, "x.toml:1: scenario must be a table, got 5");
}

TEST(Scenario, AFileThatIsNotThereIsAConfigErrorWithItsName) {
  CommonOptions options;
  options.file = "/nowhere/at_all.toml";
  const auto said = complaint([&] { static_cast<void>(starloop::load_scenario(options)); });
  ASSERT_TRUE(said.has_value());
  EXPECT_TRUE(starts_with(*said, "/nowhere/at_all.toml: ")) << *said;
}

TEST(Scenario, CloseUpsCameraCirclesItsTargetAtOneDistance) {
  CommonOptions options;
  options.file = STARLOOP_SOURCE_DIR "/config/close_up.toml";
  const Scenario scenario = starloop::load_scenario(options);
  const engine::KeplerPropagator camera(scenario.camera_orbit.elements, scenario.scene.epoch);
  const engine::KeplerPropagator target(scenario.target_orbit.elements, scenario.scene.epoch);
  const engine::Pass pass = starloop::chosen_pass(scenario);
  for (int minute = 0; minute < 50; ++minute) {
    const engine::Epoch t =
        scenario.scene.epoch + pass.start.time_since_epoch() + engine::from_seconds(60.0 * minute);
    const double range_m = (camera.at(t).position.m - target.at(t).position.m).norm();
    // The circle is one to first order in eccentricity and inclination: a thousandth of itself.
    EXPECT_NEAR(range_m, 11.8e3, 20.0) << minute;
  }
}

TEST(Scenario, FormationsCourierPassesThroughTheLineOfSightAndThenTheSunlight) {
  CommonOptions options;
  options.file = STARLOOP_SOURCE_DIR "/config/formation.toml";
  const Scenario scenario = starloop::load_scenario(options);
  ASSERT_EQ(starloop::companion_names(scenario), (std::vector<std::string>{"courier", "escort"}));
  const engine::Epoch epoch = scenario.scene.epoch;
  const engine::KeplerPropagator camera(scenario.camera_orbit.elements, epoch);
  const engine::KeplerPropagator target(scenario.target_orbit.elements, epoch);
  const engine::KeplerPropagator courier(scenario.companions[0].orbit.value().elements, epoch);
  EXPECT_LT(starloop::chosen_pass(scenario).start, engine::sim_time(80.0));
  // How far it is from a line that leaves the target towards somewhere.
  const auto beside_m = [&](double t_s, bool sun) {
    const engine::Epoch t = epoch + engine::from_seconds(t_s);
    const Eigen::Vector3d from = target.at(t).position.m;
    const Eigen::Vector3d to =
        sun ? engine::sun_position(scenario.scene.sun.model, t).m : camera.at(t).position.m;
    const Eigen::Vector3d along = (to - from).normalized();
    const Eigen::Vector3d place = courier.at(t).position.m - from;
    EXPECT_GT(place.dot(along), 30.0);
    return place.cross(along).norm();
  };
  EXPECT_LT(beside_m(105.0, false), 2.0);
  EXPECT_GT(beside_m(105.0, true), 8.0);
  EXPECT_LT(beside_m(135.0, true), 2.0);
  EXPECT_GT(beside_m(135.0, false), 8.0);
}

TEST(Scenario, CompanionsWantTheRendererThatKnowsThem) {
  const std::string text = flyby_text() + "\n[companions.a]\nalong_m = 9\n";
  const auto load_text = [](const std::string& t) {
    static_cast<void>(starloop::read_scenario(ConfigReader::from_text(t, "x.toml")));
  };
  EXPECT_FALSE(complaint([&] { load_text(text); }).has_value());
  const int line = line_of(text, "render", "method");
  const auto said = complaint([&] { load_text(with_line(text, line, "method = \"lattice\"")); });
  ASSERT_TRUE(said.has_value());
  EXPECT_EQ(*said, "x.toml:" + std::to_string(line) +
                       ": render.method must be \"paths\" where there are companions or parts");
}

TEST(Scenario, ASlowVibrationIsAPathAndAFastOneAnOtf) {
  const std::vector<std::string> shaken = {"run.exposure_ms=5", "optics.vibration_urad=3",
                                           "optics.vibration_direction_deg=90"};
  const auto with = [&](const std::string& frequency) {
    std::vector<std::string> all = shaken;
    all.push_back("optics.vibration_hz=" + frequency);
    return load(all);
  };
  const Scenario slow = with("599");  // 2.995 periods
  EXPECT_EQ(slow.optics.vibration.amplitude_rad, 0.0);
  ASSERT_EQ(slow.jitter.lines.size(), 1U);
  EXPECT_DOUBLE_EQ(slow.jitter.lines[0].amplitude_rad, 3e-6);
  EXPECT_DOUBLE_EQ(slow.jitter.lines[0].direction_rad, engine::kPi / 2.0);
  EXPECT_EQ(slow.slow_vibration.lines.size(), 1U);
  for (const char* frequency : {"601", "0"}) {
    const Scenario fast = with(frequency);
    EXPECT_DOUBLE_EQ(fast.optics.vibration.amplitude_rad, 3e-6);
    EXPECT_TRUE(fast.jitter.lines.empty());
  }
  // A single frame has it, too: half a swing of 100 Hz, from 0 at a whole second.
  const auto shot_of = [](const std::string& amplitude_urad) {
    const Scenario half =
        load({"run.exposure_ms=5", "optics.vibration_urad=" + amplitude_urad,
              "optics.vibration_hz=100", "camera.width_px=64", "camera.height_px=64"});
    const starloop::Rig rig(half, 1);
    return rig.predicted_shot(engine::sim_time(309780.0), half.run.exposure);
  };
  const engine::AttitudeTrack still = shot_of("0").attitude;
  const engine::AttitudeTrack swings = shot_of("3").attitude;
  ASSERT_TRUE(swings.known_between);
  for (const int step : {0, 4, 8, 16}) {
    const Eigen::Vector3d off = swings.after(step).axes.matrix.row(2).transpose() -
                                still.after(step).axes.matrix.row(2).transpose();
    EXPECT_NEAR(off.norm(), 3e-6 * std::sin(engine::kPi * step / 16.0), 1e-10) << step;
  }
}

TEST(Scenario, AWindowOfBinnedPixelsGoesThroughAllRooms) {
  const Scenario s =
      load({"camera.binning=2", "camera.window_left_px=200", "camera.window_width_px=600",
            "camera.window_height_px=400", "detector.dead_columns=3", "optics.vignetting_r2=-0.2"});
  EXPECT_EQ(s.scene.camera.width_px, 300);
  EXPECT_EQ(s.scene.camera.height_px, 200);
  EXPECT_EQ(s.render.camera.width_px, 300);
  EXPECT_EQ(s.optics.camera.window.left_px, 100);
  EXPECT_EQ(s.detector.binning, 2);
  EXPECT_DOUBLE_EQ(s.detector.pixel_pitch_m, 13e-6);
  // Twice the pitch wants more cells than the lattice has: paths by need, and said when not asked.
  EXPECT_EQ(s.optics.oversampling, 5);
  EXPECT_EQ(s.render.method, engine::RenderMethod::kPaths);
  EXPECT_TRUE(complaint([] { (void)load({"camera.binning=2", "render.method=lattice"}); }));
  // The tracker is told where the boresight is: (1024 / 2 + .5) / 2 - .5 - 100 and as much.
  EXPECT_DOUBLE_EQ(150.0 + s.tracker.boresight_off_px.u, 155.75);
  EXPECT_DOUBLE_EQ(100.0 + s.tracker.boresight_off_px.v, 255.75);
  const engine::SensorMaps maps = starloop::sensor_maps(s);
  EXPECT_EQ(maps.response().size(), 300U * 200U);
}

}  // namespace
