#include "hil/faults/fault_record.h"

#include <cstdio>

namespace hil {
namespace {

/// Enough digits for every nanosecond count of a run, none where it is whole.
std::string number_text(double x) {
  char text[40];
  std::snprintf(text, sizeof text, "%.15g", x);
  return text;
}

}  // namespace

void write_faults_csv(std::ostream& out, const FaultSpec& spec,
                      std::span<const FaultRecord> records) {
  out << "frame,since_start_s,fault,kind,command,place,count,amount\n";
  for (const FaultRecord& r : records) {
    out << r.frame << ',' << number_text(engine::seconds(r.since_start)) << ','
        << spec.faults[r.fault].name << ',' << fault_kind_name(r.kind) << ',';
    if (r.command != FaultRecord::kNoCommand) out << r.command;
    out << ',' << r.place << ',' << r.count << ',' << number_text(r.amount) << '\n';
  }
}

std::string fault_json(const FaultSpec& spec, const FaultRecord& r) {
  std::string text = R"({"frame":)" + std::to_string(r.frame) + R"(,"since_start_s":)" +
                     number_text(engine::seconds(r.since_start)) + R"(,"fault":")" +
                     spec.faults[r.fault].name + R"(","kind":")" + fault_kind_name(r.kind) + '"';
  if (r.command != FaultRecord::kNoCommand) text += R"(,"command":)" + std::to_string(r.command);
  return text + R"(,"place":)" + std::to_string(r.place) + R"(,"count":)" +
         std::to_string(r.count) + R"(,"amount":)" + number_text(r.amount) + '}';
}

}  // namespace hil
