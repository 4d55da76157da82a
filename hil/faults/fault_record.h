#pragma once

#include <cstdint>
#include <limits>
#include <ostream>
#include <span>
#include <string>

#include "hil/faults/fault_spec.h"
#include "hil/spsc_ring.h"

namespace hil {

/// One fault that happened: a row of the truth log. What the last three fields say, by kind; they
/// are 0 where nothing stands.
///                    place                  count                    amount
///   late                                    frames it is held back
///   slow                                                             ms
///   rays (each track) pixel it starts in    pixels it touches        DN added in all
///   blooming          pixels at full scale  pixels it bled into
///   hot, stuck (each) column                pixels changed           DN, as in the scenario
///   torn              first row from before rows
///   frozen                                                           the frame that is shown
///   flipped           pixel of the first    bits
///   clock                                                            ns off
///   command_corrupted                       bits
///   command_delayed                         commands it is held back
/// Pixels are counted row by row from the upper left.
struct FaultRecord {
  static constexpr std::uint64_t kNoCommand = std::numeric_limits<std::uint64_t>::max();

  std::uint64_t frame = 0;             ///< of commands: the last frame before it
  std::uint64_t command = kNoCommand;  ///< how many came before it
  engine::Duration since_start{};      ///< of that frame's shutter, by the true clock
  std::size_t fault = 0;               ///< in FaultSpec::faults
  FaultKind kind = FaultKind::kDropped;
  std::int64_t place = 0;
  std::int64_t count = 0;
  double amount = 0;
};

using FaultRing = SpscRing<FaultRecord, 4096>;

/// A row for each record, with a header line.
void write_faults_csv(std::ostream& out, const FaultSpec& spec,
                      std::span<const FaultRecord> records);
/// One JSON object on one line, for a log of JSON lines.
[[nodiscard]] std::string fault_json(const FaultSpec& spec, const FaultRecord& record);

}  // namespace hil
