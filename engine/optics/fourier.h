#pragma once

#include <complex>
#include <memory>
#include <span>

namespace engine {

/// Numbers of kCount lines side by side, one instruction for all: what the transforms count with.
/// Of four floats, for every x86-64 and Arm adds four at once.
struct Lanes {
  static constexpr int kCount = 4;
  using Vector = float __attribute__((vector_size(kCount * sizeof(float))));
  Vector v{};

  Lanes() = default;
  Lanes(float x) noexcept : v(Vector{} + x) {}  // NOLINT(google-explicit-constructor): a number
  Lanes(double x) noexcept : Lanes(static_cast<float>(x)) {}  // NOLINT(google-explicit-constructor)
  Lanes(int x) noexcept : Lanes(static_cast<float>(x)) {}     // NOLINT(google-explicit-constructor)
  explicit Lanes(Vector vector) noexcept : v(vector) {}

  Lanes& operator+=(const Lanes& o) noexcept { return v += o.v, *this; }
  Lanes& operator-=(const Lanes& o) noexcept { return v -= o.v, *this; }
  Lanes& operator*=(const Lanes& o) noexcept { return v *= o.v, *this; }
  Lanes& operator/=(const Lanes& o) noexcept { return v /= o.v, *this; }
  friend Lanes operator+(Lanes a, const Lanes& b) noexcept { return a += b; }
  friend Lanes operator-(Lanes a, const Lanes& b) noexcept { return a -= b; }
  friend Lanes operator*(Lanes a, const Lanes& b) noexcept { return a *= b; }
  friend Lanes operator/(Lanes a, const Lanes& b) noexcept { return a /= b; }
  friend Lanes operator-(const Lanes& a) noexcept { return Lanes(-a.v); }
};

/// A square of numbers turned over: lane i of the k-th becomes lane k of the i-th.
inline void transpose(Lanes& a, Lanes& b, Lanes& c, Lanes& d) noexcept {
  static_assert(Lanes::kCount == 4);
  const Lanes::Vector ab = __builtin_shufflevector(a.v, b.v, 0, 4, 1, 5);
  const Lanes::Vector cd = __builtin_shufflevector(c.v, d.v, 0, 4, 1, 5);
  const Lanes::Vector ab_high = __builtin_shufflevector(a.v, b.v, 2, 6, 3, 7);
  const Lanes::Vector cd_high = __builtin_shufflevector(c.v, d.v, 2, 6, 3, 7);
  a.v = __builtin_shufflevector(ab, cd, 0, 1, 4, 5);
  b.v = __builtin_shufflevector(ab, cd, 2, 3, 6, 7);
  c.v = __builtin_shufflevector(ab_high, cd_high, 0, 1, 4, 5);
  d.v = __builtin_shufflevector(ab_high, cd_high, 2, 3, 6, 7);
}

/// Transforms of kCount lines at once in single precision, unscaled. Eigen's kissfft, which counts
/// with any type of number: permissive, no plan that a clock chooses, so the same bits every time.
/// Thread: one at a time. Loop-safe for the lengths named in the constructor.
class FourierLines {
 public:
  using Complex = std::complex<Lanes>;

  /// `lengths`: all that will ever be asked for; multiples of four.
  explicit FourierLines(std::span<const int> lengths);
  ~FourierLines();
  FourierLines(FourierLines&&) noexcept;
  FourierLines& operator=(FourierLines&&) noexcept;

  /// n real numbers to n/2 + 1 complex ones.
  void forward(std::span<const Lanes> in, std::span<Complex> out) noexcept;
  void forward(std::span<const Complex> in, std::span<Complex> out) noexcept;
  void inverse(std::span<const Complex> in, std::span<Complex> out) noexcept;
  /// n/2 + 1 complex numbers to n real ones; n is the length of `out`.
  void inverse(std::span<const Complex> in, std::span<Lanes> out) noexcept;

 private:
  struct Plans;
  std::unique_ptr<Plans> plans_;
};

}  // namespace engine
