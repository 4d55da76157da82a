#pragma once

#include <span>

#include "engine/core/image.h"
#include "engine/core/worker_pool.h"

namespace engine {

/// Charge over the full well runs along its column, half of it up, half down, fills each next pixel
/// up to its full well, and is lost at the frame's edges. Returns what is lost, in electrons.
/// Charge is conserved but for rounding of wells that are no whole electrons. Where two streams
/// meet, both orders are taken and averaged, so that up and down are alike.
///
/// After the usual picture of a CCD without antiblooming drain (Janesick 2001, Scientific
/// Charge-Coupled Devices, section 4.3.4). Leaves out: drains, and what runs across columns.
/// Pixels of no `response` take nothing and let charge pass; empty: there are none. Each column by
/// itself: the same bits on any number of threads.
/// Pre: at most 8192 rows. Thread: loop. Loop-safe.
[[nodiscard]] double bloom(ElectronImage& electrons, float full_well_e,
                           std::span<const float> response, WorkerPool& pool) noexcept;

}  // namespace engine
