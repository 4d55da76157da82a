#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

#include "engine/detector/pixel_budget.h"
#include "engine/scene_generator.h"
#include "tools/starloop/scenario.h"

namespace starloop {

/// Where a frame's light goes: its brightest pixel and its sky.
struct FrameBudget {
  FrameBudget(const Scenario& scenario, const engine::FieldLight& light);
  engine::PixelPoint brightest_px;
  engine::PixelBudget brightest;
  engine::PixelBudget sky;
};

/// CSV: two rows a frame.
class BudgetTable {
 public:
  /// Throws std::runtime_error.
  explicit BudgetTable(const std::filesystem::path& path);
  void add(std::uint64_t frame, const FrameBudget& budget);
  /// Throws std::runtime_error when something of it is not on the disk.
  void close();

 private:
  void add_row(std::uint64_t frame, const char* pixel, const engine::PixelPoint& place,
               const engine::PixelBudget& budget);

  std::filesystem::path path_;
  std::ofstream file_;
};

/// For a person.
[[nodiscard]] std::string text_of(const FrameBudget& budget);

}  // namespace starloop
