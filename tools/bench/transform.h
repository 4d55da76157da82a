#pragma once

#include <vector>

#include "engine/optics/fourier.h"

namespace bench {

/// One real transform of a picture there, and one back, bare: what the optics are held against. The
/// transforms are the optics' own; what the optics leave out of them (dark rows, waves that no lens
/// passes, samples that no pixel asks for) is all there.
class Transform {
 public:
  /// Cells; multiples of four with no factor above 5.
  Transform(int width, int height);

  void there_and_back();

 private:
  using Complex = engine::FourierLines::Complex;

  void there();
  void back();

  std::size_t width_;
  std::size_t height_;
  engine::FourierLines lines_;
  std::vector<engine::Lanes> row_;
  std::vector<Complex> half_;
  std::vector<Complex> column_;
  std::vector<Complex> spectrum_;  ///< [four columns][row frequency]
};

}  // namespace bench
