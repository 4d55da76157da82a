#!/usr/bin/env bash
# Installs what is missing, builds, and flies the paper's pass twice: with commands, and without.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

tools/setup.sh
cmake --preset release -DSTARLOOP_TESTS=OFF
cmake --build --preset release

starloop=build/release/starloop
echo "== The pass without commands, as fast as it renders"
"$starloop" run config/flyby.toml --open-loop --set run.clock=lockstep --quiet
open_loop="$(readlink -f out/latest)"
echo "== The pass as a closed loop, in real time: 40 s"
status=0
"$starloop" run config/flyby.toml --compare "$open_loop" "$@" || status=$?
echo
echo "Look at: out/latest/contact_sheet.png  out/latest/pointing_error.png  out/latest/report.json"
exit "$status"
