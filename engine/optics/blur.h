#pragma once

#include <array>
#include <span>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/worker_pool.h"
#include "engine/optics/fourier.h"
#include "engine/optics/grid_otf.h"

namespace engine {

/// A picture on a grid times a transfer function, by transforms; sampled every so many cells.
///
/// Sampling adds up the aliases of the spectrum before the way back: exact, and a share of its
/// work. Waves that the transfer function does not pass are left out. Same bits whatever the
/// threads. Thread: loop. Loop-safe but for the constructor.
class Blur {
 public:
  struct Grid {
    int width = 0;  ///< cells; step times a fast_length() each
    int height = 0;
    int left = 0;  ///< the cell on which the picture's first one lies
    int top = 0;
  };

  /// `longest`: samples along a side, at most. Every `step`-th cell is sampled.
  Blur(int longest, int step, WorkerPool& pool);

  /// The next number of samples whose transform is short.
  [[nodiscard]] static int fast_length(int at_least) noexcept;

  /// Pre: the picture lies in the grid, with room for three rows below it.
  void transform(const RadianceImage& picture, const Grid& grid, const GridOtf& otf) noexcept;
  /// The blurred picture, moved right and down by so many cells; cell 0 is the first sample.
  /// Callable again for the same transform.
  void sample(double move_x, double move_y) noexcept;
  /// Both, for who wants one sample: what lies between is not kept.
  void transform_and_sample(const RadianceImage& picture, const Grid& grid, const GridOtf& otf,
                            double move_x, double move_y) noexcept;
  /// Of what was last sampled, times the number of cells of the grid.
  [[nodiscard]] std::span<const float> row(int y) const noexcept;
  [[nodiscard]] int samples_x() const noexcept { return grid_.width / step_; }
  [[nodiscard]] int samples_y() const noexcept { return grid_.height / step_; }
  [[nodiscard]] double scale() const noexcept {
    return 1.0 / (static_cast<double>(grid_.width) * static_cast<double>(grid_.height));
  }

 private:
  using Complex = FourierLines::Complex;
  using Square = std::array<Lanes, Lanes::kCount>;

  template <class Work>
  void share(int count, const Work& work) noexcept;
  void load_rows(const RadianceImage& picture, int first, std::span<Lanes> line) noexcept;
  void transform_rows(const RadianceImage& picture, const Grid& grid, const GridOtf& otf) noexcept;
  [[nodiscard]] std::span<const Complex> multiply_columns(std::size_t s, int g,
                                                          const GridOtf& otf) noexcept;
  void prepare_move(double move_x, double move_y) noexcept;
  void fold_columns(std::size_t s, int g, std::span<const Complex> line) noexcept;
  void sample_rows() noexcept;
  [[nodiscard]] int groups() const noexcept {
    return (columns_ + Lanes::kCount - 1) / Lanes::kCount;
  }

  int step_;
  int longest_ = 0;  ///< side of a grid, in cells
  WorkerPool& pool_;
  Grid grid_;
  int filled_ = 0;   ///< rows from grid_.top on that may have light, in fours
  int columns_ = 0;  ///< of the half spectrum, up to the cutoff
  /// Of each group of columns: frequencies from 0 on either way that it has, no more, with 0.
  std::vector<std::size_t> passed_;

  std::vector<FourierLines> lines_;  ///< one a share of the work
  std::vector<std::vector<Complex>> line_in_;
  std::vector<std::vector<Complex>> line_out_;
  std::vector<std::vector<Lanes>> line_real_;
  // The system hands out real memory only for what a frame uses.
  std::vector<Complex> spectrum_;  ///< [group of columns][row frequency]
  std::vector<Complex> folded_;    ///< [group of columns][sampled row]
  bool moves_ = false;             ///< the sample that is being taken
  double move_x_ = 0;
  std::vector<std::complex<float>> turned_;  ///< what a move does to each row frequency
  std::vector<float> samples_;
};

}  // namespace engine
