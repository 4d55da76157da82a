#include "hil/row_writer.h"

#include <gtest/gtest.h>

#include "tests/support/fakes.h"

namespace {

TEST(RowWriter, EachFrameGoesOnWithARowThatSaysWhichItIs) {
  engine::DnImage pixels(64, 4);
  std::uint64_t link_sequence = 0;
  fakes::Sink sink([&](const hil::Frame& frame, engine::Duration) -> engine::Status {
    EXPECT_EQ(frame.pixels, &pixels) << "nothing is copied";
    const auto row = hil::decode_telemetry_row(frame.telemetry_row);
    EXPECT_TRUE(row.ok());
    EXPECT_EQ(row.value(), hil::telemetry_of(frame, link_sequence++));
    return engine::Done{};
  });
  hil::RowWriter writer(sink, 64);
  for (const std::uint64_t k : {0U, 1U, 5U}) {
    hil::Frame frame;
    frame.sequence = k;
    frame.shutter_open = engine::sim_time(0.1 * static_cast<double>(k));
    frame.exposure = engine::Duration(1000);
    frame.pixels = &pixels;
    EXPECT_TRUE(writer.send(frame, {}).ok());
  }
  EXPECT_EQ(sink.sequences(), (std::vector<std::uint64_t>{0, 1, 5}));
}

}  // namespace
