#pragma once

#include <complex>
#include <memory>
#include <span>

namespace engine {

/// One-dimensional transforms in single precision, unscaled. Eigen's kissfft: permissive, no plan
/// that a clock chooses, so the same bits every time.
/// Thread: one at a time. Loop-safe for the lengths named in the constructor.
class FourierLines {
 public:
  using Complex = std::complex<float>;

  /// `lengths`: all that will ever be asked for.
  explicit FourierLines(std::span<const int> lengths);
  ~FourierLines();
  FourierLines(FourierLines&&) noexcept;
  FourierLines& operator=(FourierLines&&) noexcept;

  /// n real numbers to n/2 + 1 complex ones.
  void forward(std::span<const float> in, std::span<Complex> out) noexcept;
  void forward(std::span<const Complex> in, std::span<Complex> out) noexcept;
  void inverse(std::span<const Complex> in, std::span<Complex> out) noexcept;
  /// n/2 + 1 complex numbers to n real ones; n is the length of `out`.
  void inverse(std::span<const Complex> in, std::span<float> out) noexcept;

 private:
  struct Plans;
  std::unique_ptr<Plans> plans_;
};

}  // namespace engine
