#!/usr/bin/env bash
# Installs what Starloop needs from Debian 12's own packages; only what is missing, and says so.
#   tools/setup.sh [--full | --guest]
set -euo pipefail

packages=(
  # build
  g++ cmake ninja-build ccache pkg-config git
  # libraries that the program links
  libembree-dev libopencv-dev libeigen3-dev libtomlplusplus-dev libcli11-dev libspdlog-dev
  liberfa-dev libcfitsio-dev libhwy-dev librandom123-dev libtinyobjloader-dev libmeshoptimizer-dev
  nlohmann-json3-dev libasio-dev libssl-dev libusb-1.0-0-dev
  # tests, benchmarks, pictures
  libgtest-dev libumockdev-dev umockdev libbenchmark-dev python3 python3-matplotlib python3-numpy
  python3-erfa python3-sgp4 valgrind
)
# The slow checks of tools/test.sh --full only.
if [[ "${1:-}" == "--full" ]]; then packages+=(clang-format clang-tidy); fi
# --guest: what tests/guest boots, and the readers that it has there. The kernel itself is not installed.
guest=(
  qemu-system-x86 seabios busybox-static kmod cpio make gcc-12
  v4l-utils usbip ffmpeg gstreamer1.0-tools gstreamer1.0-plugins-good
)
if [[ "${1:-}" == "--guest" ]]; then packages=("${guest[@]}"); fi

missing=()
for package in "${packages[@]}"; do
  if [[ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null || true)" != installed ]]; then
    missing+=("$package")
  fi
done
if (( ${#missing[@]} == 0 )); then exit 0; fi

as_root=()
if (( EUID != 0 )); then
  if ! command -v sudo >/dev/null; then
    echo "tools/setup.sh: these packages are missing, and installing them needs root or sudo:" >&2
    echo "  ${missing[*]}" >&2
    exit 3
  fi
  as_root=(sudo)
fi
echo "installing ${#missing[@]} packages: ${missing[*]}"
"${as_root[@]}" apt-get update -q
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends \
  "${missing[@]}"
