#include "engine/optics/fourier.h"

#include <cmath>
#include <vector>

#include <unsupported/Eigen/FFT>

namespace engine {
namespace {

Eigen::Index length_of(std::size_t n) noexcept { return static_cast<Eigen::Index>(n); }

}  // namespace

// kissfft works its constants out in its own type of number: the same in every lane.
static Lanes acos(const Lanes& x) noexcept { return std::acos(x.v[0]); }
static Lanes exp(const Lanes& x) noexcept { return std::exp(x.v[0]); }
static Lanes cos(const Lanes& x) noexcept { return std::cos(x.v[0]); }
static Lanes sin(const Lanes& x) noexcept { return std::sin(x.v[0]); }
[[maybe_unused]] static bool operator>=(const Lanes& a, const Lanes& b) noexcept {
  return a.v[0] >= b.v[0];
}

struct FourierLines::Plans {
  Plans() {
    fft.SetFlag(Eigen::FFT<Lanes>::Unscaled);
    fft.SetFlag(Eigen::FFT<Lanes>::HalfSpectrum);
  }
  Eigen::FFT<Lanes> fft;
};

FourierLines::FourierLines(std::span<const int> lengths) : plans_(std::make_unique<Plans>()) {
  // A first use of each length makes its tables; after that nothing allocates. Here it may, and
  // fail: not by way of the members, which never throw.
  Eigen::FFT<Lanes>& fft = plans_->fft;
  for (const int n : lengths) {
    std::vector<Lanes> real(static_cast<std::size_t>(n));
    std::vector<Complex> a(static_cast<std::size_t>(n));
    std::vector<Complex> b(static_cast<std::size_t>(n));
    fft.fwd(a.data(), real.data(), n);
    fft.inv(real.data(), a.data(), n);
    fft.fwd(b.data(), a.data(), n);
    fft.inv(a.data(), b.data(), n);
  }
}

FourierLines::~FourierLines() = default;
FourierLines::FourierLines(FourierLines&&) noexcept = default;
FourierLines& FourierLines::operator=(FourierLines&&) noexcept = default;

void FourierLines::forward(std::span<const Lanes> in, std::span<Complex> out) noexcept {
  plans_->fft.fwd(out.data(), in.data(), length_of(in.size()));
}

void FourierLines::forward(std::span<const Complex> in, std::span<Complex> out) noexcept {
  plans_->fft.fwd(out.data(), in.data(), length_of(in.size()));
}

void FourierLines::inverse(std::span<const Complex> in, std::span<Complex> out) noexcept {
  plans_->fft.inv(out.data(), in.data(), length_of(out.size()));
}

void FourierLines::inverse(std::span<const Complex> in, std::span<Lanes> out) noexcept {
  plans_->fft.inv(out.data(), in.data(), length_of(out.size()));
}

}  // namespace engine
