#!/usr/bin/env bash
# Installs what is missing, builds and tests. Two tiers:
#   tools/test.sh         release, then the quick tests under AddressSanitizer and UBSan
#   tools/test.sh --full  also formatting, debug with clang-tidy and warnings as errors, all of asan,
#                         and tsan
# The last line is ctest's own summary of the last preset.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

full=no
if [[ "${1:-}" == "--full" ]]; then full=yes; fi
jobs="$(nproc)"

build() {
  cmake --preset "$1" -DSTARLOOP_TESTS=ON
  cmake --build --preset "$1"
}
# What halts on the first finding; leaks of libraries that never free their tables are not ours.
export ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=print_stacktrace=1
export TSAN_OPTIONS="suppressions=$PWD/tests/tsan_suppressions.txt"
# Whatever has threads; the rest would only take longer.
threaded='FrameLoop|Lockstep|LoopGate|TriggeredLoop|LateFrames|LoopLatency|SpscRing|WorkerPool'
threaded+='|MockLink|Shm|Usb|Function|HandOver|CommandPort|MergedCommands|Recorder|HiccupMeter'
threaded+='|RunTimeMeter|Faults|FaultyLoop|ImagingChain|Tracker|ForeignProcess|StarloopSoak'

if [[ "$full" == yes ]]; then
  tools/setup.sh --full
  git ls-files '*.h' '*.c' '*.cpp' | xargs clang-format --dry-run --Werror
  build debug
  ctest --preset debug -j "$jobs" -LE long
  build tsan
  ctest --preset tsan -j "$jobs" -R "$threaded"
  build asan
  ctest --preset asan -j "$jobs"
else
  tools/setup.sh
  build asan
  # Statistics of many pictures: minutes under a sanitizer, and the same code as in the others.
  ctest --preset asan -j "$jobs" -LE 'long|slow' -E '^(PathTracerNoise|NoiseStatistics)'
fi
# Without these the checks against a real kernel are skipped, and each says so.
tools/setup.sh --guest ||
  echo "tools/test.sh: no guest here (tools/setup.sh --guest); what needs a real kernel is skipped"
build release
ctest --preset release -j "$jobs"
