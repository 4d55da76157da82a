// A mesh to measure on: the built-in telescope in as many triangles as asked for, wrinkled.
//   build/release/make_mesh fine.obj [triangles [wrinkles in mm, rms [seed]]]
#include <cstdio>
#include <cstdlib>

#include "engine/scene/telescope.h"
#include "tools/bench/fine_mesh.h"

int main(int argc, char** argv) {
  const double triangles = argc > 2 ? std::atof(argv[2]) : 200e3;
  const double rms_mm = argc > 3 ? std::atof(argv[3]) : 2.0;
  const double seed = argc > 4 ? std::atof(argv[4]) : 1.0;
  if (argc < 2 || argc > 5 || argv[1][0] == '-' || !(triangles >= 1.0 && triangles <= 1e7) ||
      !(rms_mm >= 0.0 && rms_mm <= 1e3) || !(seed >= 0.0 && seed <= 1e15)) {
    std::fputs("usage: make_mesh FILE.obj [TRIANGLES, up to 1e7 [WRINKLES_MM [SEED]]]\n", stderr);
    return 2;
  }
  engine::Mesh mesh =
      bench::subdivided(engine::telescope_mesh(), static_cast<std::size_t>(triangles));
  bench::wrinkle(mesh, rms_mm * 1e-3, static_cast<std::uint64_t>(seed));
  if (!bench::write_obj(mesh, argv[1])) {
    std::fprintf(stderr, "%s: cannot be written\n", argv[1]);
    return 1;
  }
  std::printf("%s: %zu triangles, %zu vertices\n", argv[1], mesh.triangles.size(),
              mesh.vertices.size());
  return 0;
}
