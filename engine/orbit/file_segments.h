#pragma once

#include <algorithm>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "engine/orbit/kvn.h"
#include "engine/orbit/propagator.h"

// What the CCSDS' files of orbits and of attitudes have in common: segments, each with its own
// metadata, used one after the other and never together.

namespace engine {

/// What a segment says of itself in either kind of file.
struct SegmentMeta {
  std::string where;  ///< "file:line" of its META_START
  TimeScale scale = TimeScale::kUtc;
  EpochSpan usable;
};

/// Reads a file's header until its first META_START; the first line is `version_key` = one of
/// `versions`, and that is returned. Throws ConfigError.
[[nodiscard]] std::string read_header(KvnLines& lines, const std::string& version_key,
                                      const std::vector<std::string_view>& versions);

/// Reads from META_START, the line, to META_STOP. Beside the keys that both files have there may be
/// `keys`, which `take` gets, and there must be `needed`. Throws ConfigError.
[[nodiscard]] SegmentMeta read_meta(KvnLines& lines, const std::set<std::string_view>& keys,
                                    const std::vector<std::string_view>& needed,
                                    const std::function<void(const KvnLines::Entry&)>& take);

/// Throws ConfigError unless the rows cover what may be used, and the segment comes after the one
/// that ends at `before`.
void check_rows(const SegmentMeta& meta, const std::vector<Epoch>& times,
                const std::optional<Epoch>& before);

/// Throws ConfigError: the file that `where` names has nothing for `gap`, a part of `wanted`.
[[noreturn]] void fail_for_gap(const std::string& where, const EpochSpan& wanted,
                               const EpochSpan& gap);

/// The first part of `wanted` for which no segment is to be used. In order of time, each with a
/// `meta`.
template <class Segment>
[[nodiscard]] std::optional<EpochSpan> gap_in(const std::vector<Segment>& segments,
                                              const EpochSpan& wanted) noexcept {
  Epoch known = wanted.begin;  // until here there is something
  for (const Segment& segment : segments) {
    const EpochSpan& usable = segment.meta.usable;
    if (usable.begin > known) return EpochSpan{known, std::min(usable.begin, wanted.end)};
    known = std::max(known, usable.end);
    if (known >= wanted.end) return std::nullopt;
  }
  return EpochSpan{known, wanted.end};
}

/// The one to be used at `t`; between two the first, before all the first. Pre: not empty.
template <class Segment>
[[nodiscard]] const Segment& segment_at(const std::vector<Segment>& segments, Epoch t) noexcept {
  const auto next =
      std::upper_bound(segments.begin(), segments.end(), t,
                       [](Epoch when, const Segment& s) { return when < s.meta.usable.begin; });
  return next == segments.begin() ? *next : *(next - 1);
}

/// Of the last row that is not after `t`, or 0.
[[nodiscard]] inline std::size_t row_before(const std::vector<Epoch>& times, Epoch t) noexcept {
  const auto after = std::upper_bound(times.begin(), times.end(), t);
  return static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - times.begin(), 1) - 1);
}

}  // namespace engine
