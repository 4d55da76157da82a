#include <cstdio>
#include <exception>

#include <CLI/CLI.hpp>

#include "tools/starloop/subcommands.h"

namespace {

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

  bool json = false;
  CLI::App* passes_app = app.add_subcommand("passes", "List when the camera can see the target");
  add_common(*passes_app, common);
  passes_app->add_flag("--json", json, "print an array of objects");

  starloop::RenderOptions render;
  CLI::App* render_app = app.add_subcommand("render", "Write one frame as FITS and PNG");
  add_common(*render_app, common);
  render_app->add_option("--time", render.time_s, "shutter opens, seconds after the epoch")
      ->required()
      ->check(CLI::Range(0.0, 9e9));
  render_app->add_option("--out", render.out, "FITS file; the PNG goes beside it")
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
  if (run_app->parsed()) return starloop::run_pass(common, run);
  if (replay_app->parsed()) return starloop::replay_log(replay);
  if (passes_app->parsed()) return starloop::list_passes(common, json);
  return starloop::render_frame(common, render);
}

}  // namespace

int main(int argc, char** argv) {
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
