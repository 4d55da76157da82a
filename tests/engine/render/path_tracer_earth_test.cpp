#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "engine/render/path_tracer.h"
#include "engine/scene/telescope.h"
#include "tests/support/csv.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace engine {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using test_support::add_plate;
using test_support::lambert_material;
using test_support::look_at_origin;
using test_support::Moments;
using test_support::small_camera;

constexpr double kPaperSun_w_m2 = 634.64;
constexpr double kRange_m = 100e3;

/// As the reference has it, the body turned by `turn`: before, the nadir is along z and the Sun
/// above the x axis.
EarthDisc<BodyFrame> disc_at_420_km(double zenith_deg, const Matrix3d& turn) {
  EarthDisc<BodyFrame> disc;
  disc.to_centre.unit = turn * Vector3d(0, 0, 1);
  disc.to_sun.unit =
      turn * Vector3d(std::sin(zenith_deg * kDegree), 0.0, -std::cos(zenith_deg * kDegree));
  disc.north.unit = turn * Vector3d(0.3, 0.5, -0.7).normalized();
  disc.distance_radii = 1.0 + 420e3 / kEarthRadius_m;
  disc.sun_irradiance_w_m2 = kPaperSun_w_m2;
  return disc;
}

/// The cap of zenith_deg as the only light.
void light_by_cap(Snapshot& snapshot, double zenith_deg,
                  const Matrix3d& turn = Matrix3d::Identity()) {
  snapshot.earth = EarthLight(disc_at_420_km(zenith_deg, turn));
  snapshot.earthshine_rung = {EarthshineModel::kCap, 0.0};
  // What a renderer must leave alone that has the cap.
  snapshot.earthshine = {direction_of<BodyFrame>(snapshot.earth.vector_irradiance_w_m2()),
                         snapshot.earth.vector_irradiance_w_m2().norm()};
}

/// Calls visit(direction, light) for directions of the cap, nadir along z: midpoints, and the light
/// that each stands for.
template <class Visit>
void over_cap(const EarthLight& light, int side, const Visit& visit) {
  const double r = light.disc().distance_radii;
  const double cos_limb = std::sqrt(1.0 - 1.0 / (r * r));
  for (int i = 0; i < side; ++i) {
    const double s = (i + 0.5) / side;
    const double c = 1.0 - (1.0 - cos_limb) * s * (2.0 - s);
    const double sr = (1.0 - cos_limb) * 2.0 * (1.0 - s) / side * 2.0 * kPi / side;
    for (int j = 0; j < side; ++j) {
      const double a = 2.0 * kPi * (j + 0.5) / side;
      const double sine = std::sqrt(1.0 - c * c);
      const Vector3d direction(sine * std::cos(a), sine * std::sin(a), c);
      visit(direction, light.radiance_w_m2_sr(direction) * sr);
    }
  }
}

RenderSpec spec_of(int side_px, int samples, int bounces = 0) {
  RenderSpec spec;
  spec.bounces = bounces;
  spec.samples_per_pixel = samples;
  spec.camera = small_camera(side_px);
  spec.grid.beyond_frame_px = 0;
  return spec;
}

/// A renderer and what it renders, made once.
class Scene {
 public:
  Scene(const RenderSpec& spec, const Mesh& mesh, const std::vector<Material>& materials,
        int threads = 2)
      : camera_(spec.camera),
        pool_(threads),
        tracer_(spec, std::make_shared<TracedTarget>(mesh, materials), pool_) {}

  RenderReport render(const Snapshot& snapshot) { return tracer_.render(snapshot, {}, light_); }
  [[nodiscard]] const Radiance& light() const { return light_; }
  /// Over pixels, of the mean of each.
  [[nodiscard]] Moments pixels() const {
    Moments m;
    const int side = light_.oversampling;
    for (int v = 0; v < light_.region.height(); ++v) {
      for (int u = 0; u < light_.region.width(); ++u) {
        double sum = 0;
        for (int i = 0; i < side * side; ++i)
          sum += static_cast<double>(light_.grid.at(u * side + i % side, v * side + i / side));
        m.add(sum / (side * side));
      }
    }
    return m;
  }
  /// W/sr, of images of several seeds.
  Moments intensity(Snapshot snapshot, int seeds) {
    Moments m;
    for (int seed = 1; seed <= seeds; ++seed) {
      snapshot.seed = static_cast<std::uint64_t>(seed);
      render(snapshot);
      m.add(intensity(snapshot.range_m));
    }
    return m;
  }
  [[nodiscard]] double intensity(double range_m) const {
    double sum = 0;
    for (const float x : light_.grid.pixels()) sum += static_cast<double>(x);
    const double cell_m = range_m * camera_.ifov_rad() / light_.oversampling;
    return sum * cell_m * cell_m;
  }

 private:
  CameraGeometry camera_;
  WorkerPool pool_;
  Radiance light_;
  PathTracer tracer_;
};

Mesh square(float side_m, const std::string& material = "white") {
  Mesh mesh;
  add_plate(mesh, material, {-side_m / 2, -side_m / 2, 0}, {side_m, 0, 0}, {0, side_m, 0});
  return mesh;
}

/// Two plates at a right angle.
Mesh corner(const std::string& material = "white") {
  Mesh mesh;
  add_plate(mesh, material, {0, -3, 0}, {4, 0, 0}, {0, 6, 0});
  add_plate(mesh, material, {0, -3, 0}, {0, 6, 0}, {0, 0, 4});
  return mesh;
}

/// Apart by three sigma of their difference at most.
void expect_same(const Moments& a, const Moments& b) {
  const double sigma = std::hypot(a.sigma_of_mean(), b.sigma_of_mean());
  EXPECT_NEAR(a.mean(), b.mean(), 3.0 * sigma);
  EXPECT_LT(sigma, 0.01 * a.mean());
}

TEST(PathTracerEarth, LambertPlateOfAnyTiltSendsTheReferencesEarthshine) {
  constexpr double kAlbedo = 0.3;
  Scene scene(spec_of(24, 288), square(8.0F), {lambert_material("white", kAlbedo)});
  struct Tilt {
    std::string column;
    double from_nadir_deg;
    double azimuth_deg;
  };
  std::vector<Tilt> tilts{{"E_nadir_facet_W_m2", 0, 0}};
  for (const char* tilt : {"45", "90", "135"}) {
    const std::string name = std::string("E_tilt") + tilt;
    tilts.push_back({name + "_toward_sun", std::stod(tilt), 0});
    tilts.push_back({name + "_side", std::stod(tilt), 90});
    tilts.push_back({name + "_away", std::stod(tilt), 180});
  }
  const test_support::Csv reference("earthshine_alt420.csv");
  for (const test_support::Csv::Row& row : reference.rows()) {
    for (const Tilt& tilt : tilts) {
      SCOPED_TRACE(tilt.column + " " + row.text("solar_zenith_at_subtarget_deg"));
      // The plate's normal stays z: the Earth is turned.
      const Matrix3d turn = (Eigen::AngleAxisd(-tilt.from_nadir_deg * kDegree, Vector3d::UnitY()) *
                             Eigen::AngleAxisd(-tilt.azimuth_deg * kDegree, Vector3d::UnitZ()))
                                .toRotationMatrix();
      Snapshot snapshot = look_at_origin({0, 0, kRange_m}, {0, 1, 0});
      light_by_cap(snapshot, row.number("solar_zenith_at_subtarget_deg"), turn);
      scene.render(snapshot);
      const Moments pixels = scene.pixels();
      const double want = kAlbedo / kPi * row.number(tilt.column);
      const double all = kAlbedo / kPi * row.number("vector_irradiance_W_m2");
      // The model's .2 %; six decimals are printed.
      EXPECT_NEAR(pixels.mean(), want, 3.0 * pixels.sigma_of_mean() + 0.002 * want + 1e-6);
      EXPECT_LE(pixels.sigma_of_mean(), 0.002 * all + 1e-9);
    }
  }
}

TEST(PathTracerEarth, LambertBallSendsWhatEveryDirectionOfTheCapGivesIt) {
  // Each direction is a Sun: 2/3 (sin a + (pi - a) cos a) r^2 times albedo over pi (Lambert 1760).
  constexpr double kAlbedo = 0.6;
  constexpr double kRadius_m = 2.0;
  Scene scene(spec_of(32, 36), test_support::sphere(2.0F, 120, 240, "white"),
              {lambert_material("white", kAlbedo)});
  for (const double zenith_deg : {40.0, 92.0}) {
    for (const Vector3d& from : {Vector3d(0, 0, 1), Vector3d(0, 1, 0), Vector3d(0.6, 0, -0.8)}) {
      Snapshot snapshot = look_at_origin(kRange_m * from, {0.1, 0.2, 1});
      light_by_cap(snapshot, zenith_deg);
      double want = 0;
      over_cap(snapshot.earth, 400, [&](const Vector3d& direction, double light) {
        const double phase = angle_between_rad(direction, from);
        want += 2.0 / 3.0 * (std::sin(phase) + (kPi - phase) * std::cos(phase)) * light;
      });
      want *= kAlbedo / kPi * kRadius_m * kRadius_m;
      const Moments got = scene.intensity(snapshot, 12);
      // Of a polygon of 240 corners, 1e-4 are missing; of the quadrature, 1e-4 (above).
      EXPECT_NEAR(got.mean(), want, 3.0 * got.sigma_of_mean() + 3e-4 * want);
      EXPECT_LT(got.sigma_of_mean(), 0.003 * want);
    }
  }
}

TEST(PathTracerEarth, PlateBetweenTheEarthAndAnotherTakesItsShare) {
  constexpr double kAlbedo = 0.8;
  constexpr float kHeight_m = 2.0F;
  const std::vector<Material> materials{lambert_material("white", kAlbedo),
                                        lambert_material("black", 0.0)};
  const Vector3d from(std::cos(10.0 * kDegree), 0, std::sin(10.0 * kDegree));
  Snapshot snapshot = look_at_origin(20e3 * from, {0, 0, 1});
  light_by_cap(snapshot, 70.0);
  for (const float half_m : {1.0F, 2.5F, 6.0F}) {  // 2 m tan 69.8 deg is 5.4 m: all of the cap
    SCOPED_TRACE(half_m);
    Mesh mesh = square(0.2F);
    add_plate(mesh, "black", {-half_m, -half_m, kHeight_m}, {2 * half_m, 0, 0}, {0, 2 * half_m, 0});
    Scene scene(spec_of(24, 72), mesh, materials);
    const Moments got = scene.intensity(snapshot, 64);
    if (half_m == 6.0F) {
      EXPECT_EQ(got.mean(), 0.0);
      continue;
    }
    double received = 0;
    constexpr int kPlaces = 4;
    over_cap(snapshot.earth, 400, [&](const Vector3d& direction, double light) {
      const Vector3d reach = direction * (static_cast<double>(kHeight_m) / direction.z());
      for (int i = 0; i < kPlaces * kPlaces; ++i) {
        const double x = 0.2 * ((i % kPlaces + 0.5) / kPlaces - 0.5) + reach.x();
        const double y = 0.2 * ((i / kPlaces + 0.5) / kPlaces - 0.5) + reach.y();
        if (std::max(std::abs(x), std::abs(y)) < static_cast<double>(half_m)) continue;
        received += direction.z() * light / (kPlaces * kPlaces);
      }
    });
    const double want = kAlbedo / kPi * received * 0.04 * from.z();
    // Midpoints of directions leave 1/400 of the edge's own: 4e-4 of what is left.
    EXPECT_NEAR(got.mean(), want, 3.0 * got.sigma_of_mean() + 1e-3 * want);
    EXPECT_LT(got.sigma_of_mean(), 0.01 * want);
  }
}

TEST(PathTracerEarth, AskingAndRunningIntoItBringTheSameLight) {
  // A glossy plate, once with a lobe of .4 deg and once as wide as a foil's: what asking brings
  // alone, and what directions of the BRDF bring alone, is what both together do.
  for (const double wrinkle_rad : {0.0, 0.15}) {
    const std::vector<Material> materials{
        {"foil", test_support::polyimide(), Brdf::Variant::kPhysical, wrinkle_rad}};
    const Brdf brdf = materials[0].brdf();
    const Vector3d from = Vector3d(-0.5, 0.2, 1).normalized();
    Snapshot snapshot = look_at_origin(kRange_m * from, {0, 1, 0});
    light_by_cap(snapshot, 60.0);
    const EarthLight& earth = snapshot.earth;
    Moments asked;
    Moments met;
    Draws draws(3, Stream::kLight, 0, 0);
    for (int i = 0; i < 400000; ++i) {
      const double u = draws.uniform_double();
      const double v = draws.uniform_double();
      const EarthLight::Sample s = earth.sample(u, v);
      asked.add(s.radiance_w_m2_sr > 0.0
                    ? s.radiance_w_m2_sr * s.direction.z() * brdf.eval(s.direction, from) / s.pdf
                    : 0.0);
      const Brdf::Sample b =
          brdf.sample(from, BrdfSampler::kMixture, {static_cast<float>(u), static_cast<float>(v)},
                      draws.uniform());
      met.add(b.weight > 0.0 ? b.weight * earth.radiance_w_m2_sr(b.in) : 0.0);
    }
    for (const double share : {0.15, 1.0}) {
      for (const int bounces : {0, 1}) {
        RenderSpec spec = spec_of(24, 288, bounces);
        spec.bounce_share = share;
        Scene scene(spec, square(8.0F, "foil"), materials);
        scene.render(snapshot);
        const Moments both = scene.pixels();
        expect_same(both, met);
        if (wrinkle_rad > 0.0) {
          expect_same(both, asked);
        }
      }
    }
  }
}

TEST(PathTracerEarth, EverySamplerOfBouncesFindsTheSameLight) {
  // In a corner of foil, the Sun's disc beside the Earth: caustics followed, by any directions.
  const std::vector<Material> materials{
      {"white", test_support::polyimide(), Brdf::Variant::kPhysical, 0.2}};
  Snapshot snapshot = look_at_origin(kRange_m * Vector3d(2, 0.5, 1.5).normalized(), {0, 0, 1});
  light_by_cap(snapshot, 50.0);
  snapshot.sun = {direction_of<BodyFrame>({0.5, 0.4, 0.8}), 20.0};
  const auto light_by = [&](BrdfSampler sampler, double share) {
    RenderSpec spec = spec_of(48, 72, 2);
    spec.exact_caustics = true;
    spec.sun_disc = SunDisc::kOn;
    spec.sampler = sampler;
    spec.bounce_share = share;
    return Scene(spec, corner(), materials).intensity(snapshot, 12);
  };
  const Moments usual = light_by(BrdfSampler::kMixture, 0.5);
  expect_same(light_by(BrdfSampler::kMixture, 1.0), usual);
  expect_same(light_by(BrdfSampler::kCosine, 1.0), usual);
  expect_same(light_by(BrdfSampler::kUniform, 1.0), usual);
}

TEST(PathTracerEarth, LightOfSunAndEarthAddsUpAlongBounces) {
  // Each place on a path asks for one of them only. In a Lambert corner light leaves evenly: taken
  // to do so and followed exactly are the same.
  Snapshot both = look_at_origin(kRange_m * Vector3d(2, 0.5, 1.5).normalized(), {0, 0, 1});
  light_by_cap(both, 50.0);
  both.sun = {direction_of<BodyFrame>({0.5, 0.4, 0.8}), 60.0};
  Snapshot sun = both;
  sun.earth = EarthLight();
  sun.earthshine = {};
  Snapshot earth = both;
  earth.sun.irradiance_w_m2 = 0;
  RenderSpec spec = spec_of(48, 72, 3);
  spec.bounce_share = 1.0;
  Scene scene(spec, corner(), {lambert_material("white", 0.8)});
  const Moments of_both = scene.intensity(both, 16);
  const Moments of_sun = scene.intensity(sun, 16);
  const Moments of_earth = scene.intensity(earth, 16);
  const double sigma =
      std::hypot(of_both.sigma_of_mean(), of_sun.sigma_of_mean(), of_earth.sigma_of_mean());
  EXPECT_NEAR(of_both.mean(), of_sun.mean() + of_earth.mean(), 3.0 * sigma);
  EXPECT_LT(sigma, 0.005 * of_both.mean());
  spec.exact_caustics = true;
  Scene exact(spec, corner(), {lambert_material("white", 0.8)});
  expect_same(exact.intensity(both, 16), of_both);
}

TEST(PathTracerEarth, WhiteBodySendsOnAllEarthshineThatItMeets) {
  // The furnace, with the cap for its fire: over all directions, what leaves a white corner is what
  // it takes out of the beams that meet it.
  const Mesh mesh = corner();
  const std::vector<Material> materials{lambert_material("white", 1.0)};
  const TracedTarget target(mesh, materials);
  const double radius_m = target.bounding_radius_m;
  Snapshot snapshot;
  light_by_cap(snapshot, 50.0);
  Moments in;
  RayCounts counts;
  Draws draws(5, Stream::kLight, 0, 0);
  for (int i = 0; i < 200000; ++i) {
    const EarthLight::Sample s =
        snapshot.earth.sample(draws.uniform_double(), draws.uniform_double());
    if (!(s.radiance_w_m2_sr > 0.0)) continue;
    const double out = radius_m * std::sqrt(draws.uniform_double());
    const double turn = 2.0 * kPi * draws.uniform_double();
    const Vector3d start = basis_round(s.direction).transpose() *
                           Vector3d(out * std::cos(turn), out * std::sin(turn), 1.1 * radius_m);
    const MeshHit hit =
        target.scene.intersect(start.cast<float>(), -s.direction.cast<float>(), counts);
    const double beam_w = s.radiance_w_m2_sr / s.pdf * kPi * radius_m * radius_m;
    in.add(hit.triangle == MeshHit::kNone ? 0.0 : beam_w);
  }
  RenderSpec spec = spec_of(20, 18, 16);
  spec.bounce_share = 1.0;
  Scene scene(spec, mesh, materials);
  Moments out;
  constexpr int kDirections = 96;
  for (int set = 0; set < 6; ++set) {  // each a spiral with another beginning
    double mean_w_sr = 0;
    const double begin = draws.uniform_double();
    const double shift = draws.uniform_double();
    for (int i = 0; i < kDirections; ++i) {
      const double z = 1.0 - 2.0 * (i + shift) / kDirections;
      const double turn = 2.0 * kPi * (begin + 0.6180339887498949 * i);
      const double across = std::sqrt(1.0 - z * z);
      Snapshot view = look_at_origin(
          400e3 * Vector3d(across * std::cos(turn), across * std::sin(turn), z), {0.1, 0.2, 1});
      view.earth = snapshot.earth;
      view.sequence = static_cast<std::uint64_t>(set * kDirections + i);
      scene.render(view);
      mean_w_sr += scene.intensity(view.range_m) / kDirections;
    }
    out.add(4.0 * kPi * mean_w_sr);
  }
  // Student's t for 5 degrees of freedom: 4.8 is what 3 sigma is.
  EXPECT_NEAR(out.mean(), in.mean(),
              std::hypot(4.8 * out.sigma_of_mean(), 3.0 * in.sigma_of_mean()));
  EXPECT_LT(out.sigma_of_mean(), 0.006 * in.mean());
  EXPECT_LT(in.sigma_of_mean(), 0.006 * in.mean());
}

TEST(PathTracerEarth, GivesTheSameBitsOnAnyNumberOfThreads) {
  Snapshot snapshot = look_at_origin({60e3, 70e3, -40e3}, {0, 0, 1});
  light_by_cap(snapshot, 80.0);
  snapshot.sun = {direction_of<BodyFrame>({1, 1, -1}), kPaperSun_w_m2};
  const RenderSpec spec = spec_of(128, 50, 2);
  const auto materials = test_support::telescope_materials();
  Scene one(spec, telescope_mesh(), materials, 1);
  const RenderReport report = one.render(snapshot);
  EXPECT_GT(one.intensity(1.0), 0.0);
  for (const int threads : {2, 3}) {
    Scene again(spec, telescope_mesh(), materials, threads);
    EXPECT_EQ(again.render(snapshot).rays, report.rays);
    EXPECT_TRUE(std::ranges::equal(one.light().grid.pixels(), again.light().grid.pixels()));
  }
  EXPECT_EQ(report.rejected_rays, 0U);
}

TEST(PathTracerEarth, SaysWhichRungItTook) {
  Scene scene(spec_of(24, 18), square(8.0F), {lambert_material("white", 0.3)});
  const auto rung_of = [&](const Snapshot& snapshot) {
    const RenderReport report = scene.render(snapshot);
    const auto* found = std::ranges::find(report.rungs, "earthshine", &Rung::ladder);
    return found == report.rungs.end() ? Rung{} : *found;
  };
  Snapshot snapshot = look_at_origin({0, 0, kRange_m}, {0, 1, 0});
  light_by_cap(snapshot, 30.0);
  snapshot.earthshine_rung = {EarthshineModel::kHarmonics, 7.5};
  // Samples find the cap where harmonics would do.
  EXPECT_EQ(rung_of(snapshot).taken, "cap");
  EXPECT_EQ(rung_of(snapshot).error_e, 0.0);
  snapshot.earth = EarthLight();
  snapshot.earthshine_rung = {EarthshineModel::kVector, 3.5};
  EXPECT_EQ(rung_of(snapshot).taken, "vector");
  EXPECT_EQ(rung_of(snapshot).error_e, 3.5);
  snapshot.earthshine_rung = {EarthshineModel::kNone, 0.25};
  EXPECT_EQ(rung_of(snapshot).taken, "none");
  EXPECT_EQ(rung_of(snapshot).error_e, 0.25);
}

}  // namespace
}  // namespace engine
