#pragma once

#include <filesystem>
#include <string>

#include "tools/characterize/camera_report.h"

namespace characterize {

/// The report as text, 120 columns wide.
[[nodiscard]] std::string text_of(const CameraReport& report);

/// report.json, report.txt, and what they were made from: ptc.csv, dark.csv, edge.csv, defects.csv.
/// Throws std::runtime_error for what cannot be written.
void write_files(const std::filesystem::path& folder, const CameraReport& report);

}  // namespace characterize
