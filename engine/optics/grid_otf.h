#pragma once

#include <algorithm>
#include <array>
#include <complex>
#include <optional>
#include <span>
#include <vector>

#include "engine/core/image.h"
#include "engine/optics/fourier.h"
#include "engine/optics/otf_cascade.h"
#include "engine/scene/image_motion.h"

namespace engine {

/// An OTF that depends on the length of the frequency alone, tabulated from 0 on in even steps.
struct RadialOtf {
  std::span<const float> table;    ///< the last two are 0: beyond is nothing
  double steps_per_frequency = 0;  ///< of the table, to a cycle per pixel

  [[nodiscard]] double cutoff_per_px() const noexcept {
    return static_cast<double>(table.size() - 2) / steps_per_frequency;
  }
  [[nodiscard]] float at(float per_px) const noexcept {
    const float place = std::min(per_px * static_cast<float>(steps_per_frequency),
                                 static_cast<float>(table.size() - 2));
    const auto low = static_cast<std::size_t>(place);
    const float part = place - static_cast<float>(low);
    return (1.0F - part) * table[low] + part * table[low + 1];
  }
};

/// An OTF that depends on the direction, too: a cascade's, less a radial one.
struct DirectedOtf {
  const OtfCascade& cascade;
  const OtfCascade::Focused& lens;
  RadialOtf less;  ///< an empty table: nothing less
};

/// The product of an image's OTFs at the frequencies of a grid: one of the two above, the pixel's
/// square, and motion: a straight smear, or a path of straight steps. A cell of the grid is itself
/// an average; that is taken back out. Thread: loop; fill_column() any. Loop-safe but for the
/// constructor.
class GridOtf {
 public:
  using Complex = FourierLines::Complex;

  /// `cell_px`: a side of the grid's cells. `averages`: 0: a cell is a point; 1: a cell has the
  /// mean over its square; 2: so averaged twice, which makes a pyramid over the cell and half of
  /// its neighbours. `longest`: cells along a side of the grid, at most.
  GridOtf(double cell_px, int averages, int longest);

  /// For grids of this height in cells. What the first argument names is looked at until the next
  /// call.
  void prepare(const RadialOtf& radial, int height, const ImageMotion& motion) noexcept;
  void prepare(const DirectedOtf& directed, int height, const ImageMotion& motion) noexcept;

  /// Cycles per cell beyond which it is 0.
  [[nodiscard]] double cutoff() const noexcept { return cutoff_per_px_ * cell_px_; }
  /// At horizontal frequencies `fx` >= 0, in cycles per cell, the least first, and at the vertical
  /// ones k / height, for k from 0 on; from half the height on, that less 1. Returns for how many
  /// from 0 on, and as many from 0 down, there is anything: the others are not written.
  [[nodiscard]] std::size_t fill_column(const Lanes& fx, std::span<Complex> out) const noexcept;

 private:
  /// What depends on the vertical frequency alone.
  struct Row {
    float per_px = 0;  ///< the frequency
    float pixel = 1;
    float smear = 0;  ///< turns of the smear, and pi times its sine and cosine
    float sine = 0;
    float cosine = 1;
  };
  [[nodiscard]] double pixel_factor(double per_px) const noexcept;
  static constexpr int kKnots = ImagePath::kSteps + 1;
  /// Waves at the knots of a path, for one frequency of an axis.
  using Waves = std::array<std::complex<float>, kKnots>;

  void prepare_rows(int height, const ImageMotion& motion) noexcept;
  [[nodiscard]] std::size_t passed(float per_px, std::size_t height) const noexcept;
  [[nodiscard]] Complex directed(const Lanes& fu, float fv) const noexcept;
  void fill_radial(const Lanes& per_px, const Lanes& pixel, std::span<Complex> out) const noexcept;
  void smear(const Lanes& per_px, std::span<Complex> out, std::size_t from,
             std::size_t to) const noexcept;
  void follow_path(const Lanes& per_px, std::span<Complex> out, std::size_t from,
                   std::size_t to) const noexcept;

  double cell_px_;
  int averages_;
  double cutoff_per_px_ = 0;
  RadialOtf radial_;  ///< or, of a directed one, what it is less
  std::optional<DirectedOtf> directed_;
  ImageMotion motion_;
  bool smears_ = false;
  std::vector<Row> rows_;
  std::vector<Waves> row_waves_;  ///< of a path
};

}  // namespace engine
