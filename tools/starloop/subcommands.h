#pragma once

#include <string>
#include <vector>

#include "tools/starloop/scenario.h"

namespace starloop {

/// What the shell is told.
enum ExitCode : int { kGood = 0, kCriterionFailed = 1, kBadInput = 2, kDeviceFault = 3 };

struct PassesOptions {
  bool as_json = false;
  std::string csv;         ///< file that gets the table; empty: none
  std::string out;         ///< folder that gets tables and pictures; empty: none
  std::size_t number = 0;  ///< of the pass that is drawn, from 1; 0: the scenario's
};
/// Lists the passes of a scenario, writes and draws them.
int list_passes(const CommonOptions& options, const PassesOptions& passes);

/// Says which links this machine can do, and what the others need.
int list_links();

struct RenderOptions {
  std::vector<double> times_s;
  std::string out = "frame.fits";
  int tile_px = 256;
};
/// Writes one frame for each time as FITS and PNG, the camera looking at the target; of several,
/// a picture of all of them besides.
int render_frames(const CommonOptions& options, const RenderOptions& render);

struct MeshOptions {
  std::string file;         ///< or the name of a built-in mesh
  std::string units = "m";  ///< of the file
  std::string axes;         ///< empty: the body's
  bool as_json = false;
  std::string out = "mesh.png";  ///< empty: no picture
};
/// Prints what a mesh is like, what was mended and what is wrong with it, and draws it.
int report_mesh(const MeshOptions& options);

struct StagesOptions {
  double time_s = 0;  ///< shutter opens
  std::string out = "stages.png";
};
/// Writes one radiance as the camera would see it with and without vibration, with and without
/// photon noise: a FITS of each, and one picture.
int render_stages(const CommonOptions& options, const StagesOptions& stages);

struct OrbitsOptions {
  std::string reference;  ///< a table of places; empty: the models against each other
  std::string out = "orbits";
};
/// Writes how far each model of motion is from a reference over the scenario's span, or from the
/// model that the scenario chooses, and draws it. `out` is a folder.
int compare_orbits(const CommonOptions& options, const OrbitsOptions& orbits);

struct MtfOptions {
  double time_s = -1;  ///< shutter opens; below 0: at the chosen pass' closest
  std::string out = "mtf.csv";
};
/// Writes every term of the optics' transfer function and their product, in four directions and
/// over the plane, and draws them.
int export_mtf(const CommonOptions& options, const MtfOptions& mtf);

/// Says of every material of a scenario what it does with light, and draws it; `out` is a folder,
/// empty for none.
int show_materials(const CommonOptions& options, const std::string& out);

struct FitBrdfOptions {
  std::string samples;  ///< CSV of measured points: engine/scene/brdf_points.h
  std::string variant = "physical";
  std::vector<std::string> fixed;  ///< "kd=0.05"
  std::string name = "measured";   ///< of the material
  std::string out;                 ///< folder that gets table and picture; empty: none
  bool quiet = false;
};
/// Fits the five-parameter model to measured points and says how well they know it.
int fit_brdf(const FitBrdfOptions& options);

struct ShapesOptions {
  double edge_m = 0.16;  ///< of bodies two metres across
  std::string out = "shapes";
};
/// Meshes a square, a sphere, a ring and a cube from their signed distances, as in figure 4 of Li
/// et al. 2023, and the cube by the method that is not for it: an OBJ of each, their figures, one
/// picture. `out` is a folder.
int mesh_shapes(const ShapesOptions& shapes);

/// Measures the scenario's camera on a bench, beside what the scenario says; `out` is a folder.
int characterize_camera(const CommonOptions& options, const std::string& out);

struct ChartOptions {
  std::vector<std::string> scenes;  ///< files, and folders of them: tools/chart/chart_scene.h
  bool full = false;
  std::vector<std::string> tried;  ///< settings of the user's own: "a.b=c d.e=f"
  bool tried_alone = false;        ///< and no sweep
  bool quiet = false;
  std::string out = "chart";
};
/// Tries settings on scenes, how long a frame takes against how far its light is from a reference,
/// and draws them; `out` is a folder.
int chart_settings(const ChartOptions& options);

struct BudgetOptions {
  std::vector<double> times_s;  ///< shutter opens; empty: five of the chosen pass
  bool without_errors = false;  ///< they need a reference, which takes seconds
  bool as_json = false;
};
/// Says before a run what its frames will cost on this machine, what limits the frame rate, and how
/// far off they will be.
int plan_budget(const CommonOptions& options, const BudgetOptions& budget);

struct QualityOptions {
  std::vector<std::string> files;  ///< FITS, or grey pictures
  int bits = 11;                   ///< of a pixel
  double e_per_dn = 0;             ///< 0: not known
  bool as_json = false;
};
/// Says how good pictures are without knowing what they show.
int score_pictures(const QualityOptions& options);

struct QualityLadderOptions {
  double time_s = 0;  ///< shutter opens
  std::string out = "quality_ladders";
};
/// Turns up smear, defocus and read noise and turns down the light of one frame, and writes, tells
/// and draws what that does to its score. `out` is a folder.
int climb_quality_ladders(const CommonOptions& options, const QualityLadderOptions& ladders);

struct RunOptions {
  bool open_loop = false;
  std::string out = "out";
  std::string compare;  ///< the folder of another run, for the plot
  bool no_pictures = false;
  bool pattern = false;  ///< a test pattern instead of the scene; nothing is judged
};
/// Runs a pass as a loop.
int run_pass(const CommonOptions& options, RunOptions run);

struct SelftestOptions {
  bool as_json = false;
  bool explain = false;  ///< where each bound comes from
  double bounds = 1;     ///< times each bound
};
/// Tries methods where they fail, the plain ones and ours, and prints both errors and the bound
/// that ours must keep. All there is to test.
int test_corners(const SelftestOptions& options);

struct SoakOptions {
  double minutes = 10;
  std::string out = "out";
};
/// Flies the pass again and again, each time from set-up to closed logs, and looks for what slips,
/// grows or gets lost.
int soak(const CommonOptions& options, const SoakOptions& spec);

struct ReplayOptions {
  std::string log;  ///< record.slog, or the folder it is in
  int threads = 0;  ///< 0: one for each processor
  std::string out;  ///< the folder that gets the frames again; empty: none
  std::string frames = "png";
  bool quiet = false;
};
/// Runs what a log recorded again and compares every frame.
int replay_log(const ReplayOptions& options);

}  // namespace starloop
