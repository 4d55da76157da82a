#pragma once

#include "engine/core/vec.h"
#include "hil/camera_link.h"

namespace hil {

// Turns of the camera as rotation vectors: along the axis, as long as the angle, in camera axes (an
// axis has the same coordinates before and after its own turn). Loop-safe.

/// Takes coordinates in the axes before a turn to those after: the axes turn, so the matrix is that
/// of the opposite turn.
[[nodiscard]] Eigen::Matrix3d axes_turned(const Eigen::Vector3d& turn_rad) noexcept;

/// The turn whose axes_turned() this is, the short way: up to pi.
[[nodiscard]] Eigen::Vector3d turn_of(const Eigen::Matrix3d& matrix) noexcept;

/// The same attitude as a turn that is at most pi away from `near_rad`: a turn by more than pi is
/// one by less, the other way.
[[nodiscard]] Eigen::Vector3d turn_near(const Eigen::Vector3d& turn_rad,
                                        const Eigen::Vector3d& near_rad) noexcept;

/// Coordinates in camera axes are q v q*, v the J2000 ones: the matrix of q is the one of `axes`.
[[nodiscard]] Quaternion quaternion_of(const Eigen::Matrix3d& axes) noexcept;
/// Pre: not zero. Any other length counts as one.
[[nodiscard]] Eigen::Matrix3d axes_of(const Quaternion& q) noexcept;

}  // namespace hil
