#pragma once

#include <algorithm>

#include "engine/optics/optics.h"

namespace test_support {

/// What Optics make of a radiance.
struct Projected {
  engine::IrradianceImage image;
  engine::OpticsReport report;

  [[nodiscard]] double at(int u, int v) const { return static_cast<double>(image.at(u, v)); }
  [[nodiscard]] double sum() const {
    double total = 0;
    for (const float x : image.pixels()) total += static_cast<double>(x);
    return total;
  }
  [[nodiscard]] double lowest() const {
    return static_cast<double>(*std::ranges::min_element(image.pixels()));
  }
  [[nodiscard]] double highest() const {
    return static_cast<double>(*std::ranges::max_element(image.pixels()));
  }
};

[[nodiscard]] inline Projected project(const engine::Radiance& in, const engine::OpticsSpec& spec,
                                       double faint_w_m2, int threads = 1) {
  engine::WorkerPool pool(threads);
  engine::Optics optics(spec, faint_w_m2, pool);
  Projected out;
  out.report = optics.project(in, out.image);
  return out;
}

}  // namespace test_support
