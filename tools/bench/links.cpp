// Frames as bytes, each beside a copy of the frame.
#include <benchmark/benchmark.h>

#include "drivers/frame_packet.h"
#include "drivers/pixel_packing.h"
#include "drivers/usb_packet.h"
#include "tools/bench/beside.h"
#include "tools/bench/bounds.h"

namespace {

using namespace engine;

constexpr std::size_t kPixels = std::size_t{1024} * 1024;

void beside_copy(benchmark::State& state, const std::function<void(int)>& run) {
  bench::FrameCopy copy(kPixels);
  bench::beside(state, {.run = run}, {{"copy", [&] { copy.copy(); }}});
}

void bench_frame_packet(benchmark::State& state) {
  const DnImage image(1024, 1024);
  hil::Frame frame;
  frame.pixels = &image;
  std::vector<std::byte> bytes(drivers::frame_bytes(1024, 1024));
  beside_copy(state, [&](int) {
    benchmark::DoNotOptimize(drivers::encode_frame(frame, bytes));
    if (state.range(0) == 1) benchmark::DoNotOptimize(drivers::decode_frame(bytes));
  });
}
BENCHMARK(bench_frame_packet)->ArgName("and_decode")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

enum class Packing { kPack, kUnpack, kPackPlain, kUnpackPlain };

/// A frame's pixels beside a copy of them.
void bench_packing(benchmark::State& state, Packing how) {
  std::vector<std::uint16_t> pixels(kPixels);
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<std::uint16_t>(i & 2047);
  std::vector<std::uint16_t> unpacked(pixels.size());
  std::vector<std::byte> packed(drivers::packed_bytes(pixels.size()));
  drivers::pack_pixels(pixels, packed);
  const auto pack = [&](int) {
    switch (how) {
      case Packing::kPack:
        drivers::pack_pixels(pixels, packed);
        break;
      case Packing::kUnpack:
        drivers::unpack_pixels(packed, unpacked);
        break;
      case Packing::kPackPlain:
        drivers::detail::pack_plain(pixels, packed);
        break;
      case Packing::kUnpackPlain:
        drivers::detail::unpack_plain(packed, unpacked);
        break;
    }
    benchmark::ClobberMemory();
  };
  beside_copy(state, pack);
}
BENCHMARK_CAPTURE(bench_packing, pack, Packing::kPack);
BENCHMARK_CAPTURE(bench_packing, unpack, Packing::kUnpack);
BENCHMARK_CAPTURE(bench_packing, pack_plain, Packing::kPackPlain);
BENCHMARK_CAPTURE(bench_packing, unpack_plain, Packing::kUnpackPlain);

void bench_usb_frame(benchmark::State& state) {
  const DnImage image(1024, 1024);
  hil::Frame frame;
  frame.pixels = &image;
  const auto format = static_cast<drivers::PixelFormat>(state.range(0));
  std::vector<std::byte> bytes(drivers::kUsbHeaderBytes +
                               drivers::usb_payload_bytes(format, 1024, 1024));
  beside_copy(state, [&](int) {
    benchmark::DoNotOptimize(drivers::encode_usb_frame(frame, format, bytes));
  });
}
BENCHMARK(bench_usb_frame)->ArgName("packed")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

}  // namespace
