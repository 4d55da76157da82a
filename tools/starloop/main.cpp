#include <csignal>
#include <cstdio>
#include <exception>
#include <memory>
#include <mutex>

#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <CLI/CLI.hpp>

#include "tools/starloop/subcommands.h"

namespace {

/// Results to stdout, complaints to stderr.
class TwoStreams final : public spdlog::sinks::base_sink<std::mutex> {
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::memory_buf_t text;
    formatter_->format(message, text);
    std::FILE* stream = message.level >= spdlog::level::warn ? stderr : stdout;
    std::fwrite(text.data(), 1, text.size(), stream);
  }
  void flush_() override { std::fflush(stdout); }
};

void set_up_messages(bool quiet) {
  auto logger = std::make_shared<spdlog::logger>("", std::make_shared<TwoStreams>());
  logger->set_pattern("%v");
  logger->set_level(quiet ? spdlog::level::warn : spdlog::level::info);
  logger->flush_on(spdlog::level::info);
  spdlog::set_default_logger(logger);
}

void add_common(CLI::App& command, starloop::CommonOptions& options) {
  command.add_option("scenario", options.file, "scenario file, TOML (see config/flyby.toml)")
      ->required();
  command
      .add_option("--set", options.overrides,
                  "override a scenario value: table.key=value; may be given many times")
      ->allow_extra_args(false);
  command.add_option_function<std::uint64_t>(
      "--seed",
      [&options](const std::uint64_t& seed) {
        options.seed = seed;
        options.seed_given = true;
      },
      "of all random numbers; overrides scenario.seed");
  command.add_option("--threads", options.threads, "that render; default: one a processor")
      ->check(CLI::Range(1, 256));
  command.add_flag("-q,--quiet", options.quiet, "print results and complaints only");
}

int run_command(int argc, char** argv) {
  CLI::App app{
      "Starloop shows a space camera's software what that camera would see, and lets it steer.\n"
      "Times are seconds after the scenario's epoch. Exit codes: 0 good, 1 a criterion failed,\n"
      "2 bad input, 3 a device or the machine."};
  app.require_subcommand(1);
  starloop::CommonOptions common;

  starloop::RunOptions run;
  CLI::App* run_app = app.add_subcommand(
      "run", "Fly a pass: frames out, commands back, a report at the end in out/latest");
  add_common(*run_app, common);
  run_app->add_flag("--open-loop", run.open_loop, "the same pass without commands");
  run_app->add_option("--out", run.out, "folder that gets <scenario>/<UTC time>/; default: out");
  run_app->add_option("--compare", run.compare,
                      "folder of another run, whose pointing error is plotted along");
  run_app->add_flag("--no-pictures", run.no_pictures,
                    "no contact sheet, no plots and no report.html: they take seconds");

  run_app->add_flag(
      "--pattern", run.pattern,
      "a moving ramp instead of the scene, to check a cable (tools/check_pattern.py)");

  CLI::App* links_app = app.add_subcommand(
      "links", "List the links that this machine has, and what others would need");

  starloop::PassesOptions passes;
  CLI::App* passes_app = app.add_subcommand("passes", "List when the camera can see the target");
  add_common(*passes_app, common);
  passes_app->add_flag("--json", passes.as_json, "print an array of objects");
  passes_app->add_option("--csv", passes.csv, "CSV file that gets the table");
  passes_app->add_option("--out", passes.out,
                         "folder that gets passes.csv, passes.json and pictures of the conditions "
                         "and of one pass");
  passes_app->add_option("--pass", passes.number, "the pass that is drawn; default: run.pass")
      ->check(CLI::Range(1, 1'000'000));

  starloop::RenderOptions render;
  CLI::App* render_app = app.add_subcommand("render", "Write frames as FITS and PNG");
  add_common(*render_app, common);
  render_app
      ->add_option("--time", render.times_s,
                   "shutter opens, seconds after the epoch; several, with commas: a numbered frame "
                   "of each, and a contact sheet of all")
      ->required()
      ->delimiter(',')
      ->expected(1, 64)
      ->allow_extra_args(false)  // the scenario may follow
      ->check(CLI::Range(0.0, 9e9));
  render_app->add_option("--out", render.out, "FITS file; the PNG goes beside it")
      ->capture_default_str();
  render_app
      ->add_option("--tile", render.tile_px,
                   "pixels on a side of what the contact sheet shows about the target's centre")
      ->check(CLI::Range(16, 1024))
      ->capture_default_str();

  starloop::StagesOptions stages;
  CLI::App* stages_app = app.add_subcommand(
      "stages", "Write one frame with and without vibration, with and without photon noise");
  add_common(*stages_app, common);
  stages_app->add_option("--time", stages.time_s, "shutter opens, seconds after the epoch")
      ->required()
      ->check(CLI::Range(0.0, 9e9));
  stages_app->add_option("--out", stages.out, "PNG of all four; a FITS of each goes beside it")
      ->capture_default_str();

  starloop::OrbitsOptions orbits;
  CLI::App* orbits_app = app.add_subcommand(
      "orbits", "Write how far the models of motion are from a reference, and draw it");
  add_common(*orbits_app, common);
  orbits_app->add_option("--reference", orbits.reference,
                         "CSV with columns body (camera or target), t_s, x_km, y_km, z_km; "
                         "default: the models against the scenario's own");
  orbits_app->add_option("-o,--out", orbits.out, "folder that gets orbits.csv and orbits.png")
      ->capture_default_str();

  starloop::MtfOptions mtf;
  CLI::App* mtf_app = app.add_subcommand(
      "mtf", "Write the terms of the optics' transfer function and their product, and draw them");
  add_common(*mtf_app, common);
  mtf_app
      ->add_option("--time", mtf.time_s,
                   "shutter opens, seconds after the epoch: range and smear are those of then; "
                   "default: the pass' closest")
      ->check(CLI::Range(0.0, 9e9));
  mtf_app->add_option("--out", mtf.out, "CSV file; the plane's and the PNGs go beside it")
      ->capture_default_str();

  starloop::MeshOptions mesh;
  CLI::App* mesh_app = app.add_subcommand(
      "mesh", "Tell what a mesh file is like, what a scenario would mend in it, and draw it");
  mesh_app
      ->add_option("mesh", mesh.file,
                   "OBJ file, a target's description (.toml), or one built in: telescope")
      ->required();
  mesh_app->add_option("--units", mesh.units, "of the file: m, cm, mm, km, in or ft")
      ->check(CLI::IsMember({"m", "cm", "mm", "km", "in", "ft"}))
      ->capture_default_str();
  mesh_app->add_option("--axes", mesh.axes,
                       "of the file that become x, y and z of the body: --axes=\"z -x -y\"");
  mesh_app->add_flag("--json", mesh.as_json, "print an object");
  mesh_app->add_option("-o,--out", mesh.out, "PNG of five views; \"\": none")
      ->capture_default_str();

  std::string materials_folder;
  CLI::App* materials_app = app.add_subcommand(
      "materials", "Say of every material where it would make light, and where its lobe is");
  add_common(*materials_app, common);
  materials_app->add_option("-o,--out", materials_folder,
                            "folder that gets albedo.csv, lobes.csv and a picture of both");

  starloop::FitBrdfOptions fit;
  CLI::App* fit_app = app.add_subcommand(
      "fit-brdf", "Fit the five-parameter BRDF to measured points, with its uncertainty");
  fit_app->add_option("samples", fit.samples, "CSV of measured points: docs/materials.md")
      ->required();
  fit_app
      ->add_option("--variant", fit.variant,
                   "what the diffuse term is: kd (physical), or kd/cos_i (paper)")
      ->check(CLI::IsMember({"physical", "paper"}))
      ->capture_default_str();
  fit_app
      ->add_option("--fix", fit.fixed,
                   "hold a parameter: kd=0.05; ar, br, kb, kd, kr; may be given many times")
      ->allow_extra_args(false);
  fit_app->add_option("--name", fit.name, "of the material in the block to paste")
      ->capture_default_str();
  fit_app->add_option("-o,--out", fit.out, "folder that gets fit.csv, material.toml and fit.png");
  fit_app->add_flag("-q,--quiet", fit.quiet, "print the block to paste, and complaints");

  starloop::ShapesOptions shapes;
  CLI::App* shapes_app = app.add_subcommand(
      "shapes",
      "Mesh a square, a sphere, a ring and a cube from their signed distances, and draw them");
  shapes_app->add_option("--edge", shapes.edge_m, "length of edges, m, of bodies two metres across")
      ->check(CLI::Range(0.02, 1.0))
      ->capture_default_str();
  shapes_app->add_option("-o,--out", shapes.out, "folder that gets meshes, figures and shapes.png")
      ->capture_default_str();

  std::string bench_folder = "characterize";
  CLI::App* bench_app = app.add_subcommand(
      "characterize",
      "Measure the camera: photon transfer as in EMVA 1288 and a slanted edge, beside the truth");
  add_common(*bench_app, common);
  bench_app->add_option("--out", bench_folder, "folder that gets report, tables and pictures")
      ->capture_default_str();

  starloop::ChartOptions chart;
  CLI::App* chart_app = app.add_subcommand(
      "chart", "Chart speed against accuracy: settings on scenes, against a converged reference");
  chart_app->add_option("scenes", chart.scenes, "files and folders of scenes, as in config/scenes")
      ->required()
      ->check(CLI::ExistingPath);
  bool quick = false;
  chart_app->add_flag("--quick", quick,
                      "the knobs that matter most, 12 mixtures, few frames; the default");
  chart_app->add_flag("--full", chart.full, "all knobs, 64 mixtures, 100 frames each: takes hours")
      ->excludes("--quick");
  chart_app
      ->add_option("--try", chart.tried,
                   "a setting of your own, \"render.bounces=2 optics.grid=4x4\"; may be given many "
                   "times")
      ->allow_extra_args(false);
  chart_app->add_flag("--no-sweep", chart.tried_alone, "only the standard and what --try says");
  chart_app
      ->add_option("-o,--out", chart.out, "folder that gets chart.csv, pictures and chart.html")
      ->capture_default_str();
  chart_app->add_flag("-q,--quiet", chart.quiet, "a line for each scene only");

  starloop::BudgetOptions budget;
  CLI::App* budget_app = app.add_subcommand(
      "budget", "Say before a run what frames will cost here, and how far off they will be");
  add_common(*budget_app, common);
  budget_app
      ->add_option("--time", budget.times_s,
                   "shutter opens, seconds after the epoch; several, with commas; default: five of "
                   "the pass")
      ->delimiter(',')
      ->expected(1, 64)
      ->allow_extra_args(false)
      ->check(CLI::Range(0.0, 9e9));
  budget_app->add_flag("--no-errors", budget.without_errors,
                       "times only: errors need a reference, which takes seconds");
  budget_app->add_flag("--json", budget.as_json, "print an object");

  starloop::QualityOptions quality;
  CLI::App* quality_app = app.add_subcommand(
      "quality", "Score pictures without knowing what they show: docs/image_quality.md");
  quality_app->add_option("files", quality.files, "FITS files or grey PNGs")->required();
  quality_app->add_option("--bits", quality.bits, "of a pixel; a 16-bit PNG has them at its top")
      ->check(CLI::Range(8, 16))
      ->capture_default_str();
  quality_app
      ->add_option("--gain", quality.e_per_dn,
                   "electrons to a DN, so that the photons' noise counts; default: it does not")
      ->check(CLI::PositiveNumber);
  quality_app->add_flag("--json", quality.as_json, "print an array of objects");

  starloop::QualityLadderOptions ladders;
  CLI::App* ladders_app = app.add_subcommand(
      "quality-ladders", "Turn up smear, defocus and noise of one frame, and draw its scores");
  add_common(*ladders_app, common);
  ladders_app->add_option("--time", ladders.time_s, "shutter opens, seconds after the epoch")
      ->required()
      ->check(CLI::Range(0.0, 9e9));
  ladders_app->add_option("-o,--out", ladders.out, "folder that gets table, frames and picture")
      ->capture_default_str();

  starloop::SelftestOptions selftest;
  CLI::App* selftest_app = app.add_subcommand(
      "selftest", "Measure plain methods and ours where methods fail; exit 1 when ours does");
  bool numerical_corners = true;
  selftest_app->add_flag("--corners", numerical_corners,
                         "numerical corners: all there is, and the default");
  selftest_app->add_flag("--explain", selftest.explain,
                         "what is measured, and each bound's source");
  selftest_app->add_flag("--json", selftest.as_json, "print an array of objects");
  selftest_app
      ->add_option("--bounds", selftest.bounds, "times each bound: below 1 something must fail")
      ->check(CLI::NonNegativeNumber);

  starloop::SoakOptions soak;
  CLI::App* soak_app = app.add_subcommand(
      "soak", "Fly a pass over and over; exit 1 when anything slips, grows or gets lost");
  add_common(*soak_app, common);
  soak_app->add_option("--minutes", soak.minutes, "how long; the round in hand is flown to its end")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  soak_app->add_option("--out", soak.out, "folder that gets <scenario>-soak/<UTC time>/")
      ->capture_default_str();

  starloop::ReplayOptions replay;
  CLI::App* replay_app = app.add_subcommand(
      "replay", "Run a recorded pass again from its log alone and compare every frame");
  replay_app->add_option("log", replay.log, "record.slog, or a folder that has one")->required();
  replay_app->add_option("--threads", replay.threads, "that render; default: one a processor")
      ->check(CLI::Range(1, 256));
  replay_app->add_option("--out", replay.out, "folder that gets the frames again");
  replay_app->add_option("--frames", replay.frames, "how --out keeps them; default: png")
      ->check(CLI::IsMember({"png", "fits", "cube", "raw"}));
  replay_app->add_flag("-q,--quiet", replay.quiet, "print results and complaints only");

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? starloop::kGood : starloop::kBadInput;
  }
  set_up_messages(common.quiet || replay.quiet);
  if (materials_app->parsed()) return starloop::show_materials(common, materials_folder);
  if (fit_app->parsed()) return starloop::fit_brdf(fit);
  if (run_app->parsed()) return starloop::run_pass(common, run);
  if (budget_app->parsed()) return starloop::plan_budget(common, budget);
  if (chart_app->parsed()) return starloop::chart_settings(chart);
  if (selftest_app->parsed()) return starloop::test_corners(selftest);
  if (soak_app->parsed()) return starloop::soak(common, soak);
  if (replay_app->parsed()) return starloop::replay_log(replay);
  if (orbits_app->parsed()) return starloop::compare_orbits(common, orbits);
  if (mtf_app->parsed()) return starloop::export_mtf(common, mtf);
  if (stages_app->parsed()) return starloop::render_stages(common, stages);
  if (bench_app->parsed()) return starloop::characterize_camera(common, bench_folder);
  if (mesh_app->parsed()) return starloop::report_mesh(mesh);
  if (shapes_app->parsed()) return starloop::mesh_shapes(shapes);
  if (quality_app->parsed()) return starloop::score_pictures(quality);
  if (ladders_app->parsed()) return starloop::climb_quality_ladders(common, ladders);
  if (links_app->parsed()) return starloop::list_links();
  if (passes_app->parsed()) return starloop::list_passes(common, passes);
  return starloop::render_frames(common, render);
}

}  // namespace

int main(int argc, char** argv) {
  // A reader of our lines who has left, and a disk quota: errors of the write, and no more.
  for (const int s : {SIGPIPE, SIGXFSZ}) std::signal(s, SIG_IGN);
  try {
    return run_command(argc, argv);
  } catch (const engine::ConfigError& e) {
    std::fprintf(stderr, "starloop: %s\n", e.what());
    return starloop::kBadInput;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "starloop: %s\n", e.what());
    return starloop::kDeviceFault;
  }
}
