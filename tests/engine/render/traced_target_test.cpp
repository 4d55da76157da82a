#include "engine/render/traced_target.h"

#include <string>

#include <gtest/gtest.h>

#include "tests/support/scenes.h"

namespace engine {
namespace {

TEST(TracedTarget, RefusesAMeshWithAnUnknownMaterial) {
  Mesh mesh;
  test_support::add_plate(mesh, "white", {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  try {
    const TracedTarget target(mesh, {test_support::lambert_material("black", 0.1)});
    FAIL() << "an unknown material was taken";
  } catch (const ConfigError& e) {
    EXPECT_NE(std::string(e.what()).find("materials.white"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace engine
