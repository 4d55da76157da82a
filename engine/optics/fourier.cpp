#include "engine/optics/fourier.h"

#include <vector>

#include <unsupported/Eigen/FFT>

namespace engine {
namespace {

Eigen::Index length_of(std::size_t n) noexcept { return static_cast<Eigen::Index>(n); }

}  // namespace

struct FourierLines::Plans {
  Plans() {
    fft.SetFlag(Eigen::FFT<float>::Unscaled);
    fft.SetFlag(Eigen::FFT<float>::HalfSpectrum);
  }
  Eigen::FFT<float> fft;
};

FourierLines::FourierLines(std::span<const int> lengths) : plans_(std::make_unique<Plans>()) {
  // A first use of each length makes its tables; after that nothing allocates. Here it may, and
  // fail: not by way of the members, which never throw.
  Eigen::FFT<float>& fft = plans_->fft;
  for (const int n : lengths) {
    std::vector<float> real(static_cast<std::size_t>(n));
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

void FourierLines::forward(std::span<const float> in, std::span<Complex> out) noexcept {
  plans_->fft.fwd(out.data(), in.data(), length_of(in.size()));
}

void FourierLines::forward(std::span<const Complex> in, std::span<Complex> out) noexcept {
  plans_->fft.fwd(out.data(), in.data(), length_of(in.size()));
}

void FourierLines::inverse(std::span<const Complex> in, std::span<Complex> out) noexcept {
  plans_->fft.inv(out.data(), in.data(), length_of(out.size()));
}

void FourierLines::inverse(std::span<const Complex> in, std::span<float> out) noexcept {
  plans_->fft.inv(out.data(), in.data(), length_of(out.size()));
}

}  // namespace engine
