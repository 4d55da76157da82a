#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "engine/core/image.h"
#include "tools/quality/background.h"
#include "tools/quality/lit_blobs.h"

namespace quality {

/// What is known of the camera whose frame it is.
struct CameraFigures {
  int largest_dn = 2047;
  double e_per_dn = 0;  ///< for the photons' noise; 0: not known, and that noise left out
};

/// Whether a frame has a score, and if not, why.
enum class Verdict : std::uint8_t {
  kMeasured,
  kTooSmall,   ///< fewer than 8 pixels on a side
  kFullScale,  ///< the background itself is at the converter's end
  kNothing,    ///< no group of pixels stands out of the background
  kTooFaint,   ///< one does, but no edge of it stands out of the noise
};
inline constexpr std::size_t kVerdicts = 5;
/// For programs, and for people.
[[nodiscard]] std::string_view name_of(Verdict verdict) noexcept;
[[nodiscard]] std::string_view sentence_of(Verdict verdict) noexcept;

/// How good a frame is as a picture of what it shows, without knowing what that is. No value is
/// ever infinite or not a number.
struct ImageQuality {
  Verdict verdict = Verdict::kNothing;
  double background_dn = 0;
  std::optional<double>
      noise_dn;                 ///< rms of the background before rounding; none: it hides in that
  bool even_background = true;  ///< one level everywhere; else one for every 32 x 32 pixels
  engine::PixelRect box;        ///< of the target
  int lit_px = 0;               ///< pixels of it
  int saturated_px = 0;         ///< of these, at full scale
  double contrast_dn = 0;       ///< rms of the target above its background
  double contrast_sigma = 0;    ///< the same over the noise, rounding included
  std::optional<double> sharpness;  ///< in [0, 1]; none: no bend stands out of the noise
  std::optional<double> edge_px;    ///< sigma of the Gaussian that would blur an edge as much
  std::optional<double> place_px;   ///< where the target is, no better than this, rms
  std::optional<double> score_db;   ///< 20 log10(1 px / place): what falls with blur and with noise
};

/// Scores frames by the target in them: the group of connected pixels that stands out of the
/// background and has most light, of those that do not reach the frame's border if there are any.
///
/// The score is the Cramer-Rao bound on where the picture of the target is, from its gradients and
/// the noise: J = sum of grad I grad I^T / noise variance over the target and two pixels about it,
/// what noise alone adds taken out, place^2 = trace J^-1. By Parseval's theorem every blur whose
/// transfer is below 1 takes from J, in all directions; so does all noise. For an edge of length L,
/// height A, and Gaussian blur s it is L A^2 / (2 sqrt(pi) s noise^2): contrast, noise and
/// sharpness in one. Source: Robinson & Milanfar 2004, Fundamental performance limits in image
/// registration, IEEE Trans. Image Process. 13(9), DOI 10.1109/TIP.2004.832923.
/// Sharpness is the share of Nyquist's frequency at which the gradients' power lies on average,
/// from the ratio of the power of the Laplacian to that of the gradient; an edge of no width has
/// 1/2, one of Gaussian blur s > 1 px about 0.225 px / s, and a point twice an edge's. Leaves out:
/// noise that differs between pixels (PRNU, hot pixels), and what a clipped highlight hides: blur
/// that spreads one makes its outline longer, and the score grows. Thread: one. Loop-safe once
/// built for the largest size.
class Meter {
 public:
  Meter(int largest_width_px, int largest_height_px);
  /// Pre: no larger than that.
  [[nodiscard]] ImageQuality measure(const engine::DnImage& frame,
                                     const CameraFigures& camera) noexcept;

 private:
  struct Sums;
  void mark(const engine::DnImage& frame, const Blob& blob, const engine::PixelRect& box) noexcept;
  [[nodiscard]] Sums sum(const engine::DnImage& frame, const engine::PixelRect& box,
                         const CameraFigures& camera) noexcept;
  void fill_variances(const CameraFigures& camera, double background_dn, double dark_dn2) noexcept;

  BackgroundMeter background_;
  BlobFinder blobs_;
  std::vector<std::uint8_t> mask_;   // of the box alone
  std::vector<float> variance_dn2_;  // of each DN
};

}  // namespace quality
