#pragma once

#include <string>
#include <vector>

#include "tools/characterize/edge_bench.h"
#include "tools/characterize/sensor_figures.h"

namespace characterize {

/// One sensor at one depth.
struct SensorReport {
  engine::DetectorSpec spec;
  SensorRecord record;
  PhotonTransfer transfer;
  std::vector<Figure> figures;
  std::vector<std::string> notes;  ///< what a reader has to know besides, a sentence each
};

/// What a camera has been found to be.
struct CameraReport {
  std::string scenario;
  engine::CameraGeometry camera;
  std::vector<SensorReport> sensors;
  std::vector<EdgeFigures> edges;
  std::string refused;  ///< why the scenario's own depth is not among the sensors; empty: it is
  std::vector<std::string> missed;  ///< what is further from the truth than it may be
};

/// Limits: of the gain 1 % and of linearity .2 %, beyond five standard errors, of the edge's
/// MTF .01 beyond three.
[[nodiscard]] std::vector<std::string> missed_limits(const CameraReport& report);

/// The same sensor read out to 16 bits, its pedestal high enough that noise stays above 0 DN.
[[nodiscard]] engine::DetectorSpec at_16_bits(const engine::DetectorSpec& spec);

/// On a bench without cosmic rays. Throws std::runtime_error when the sensor cannot be measured.
[[nodiscard]] SensorReport characterize_sensor(engine::Optics& optics,
                                               const engine::DetectorSpec& spec,
                                               const engine::SensorMaps& maps,
                                               const engine::CameraGeometry& camera,
                                               engine::WorkerPool& pool, std::uint64_t seed,
                                               engine::Duration exposure, const RecordPlan& plan);

/// Along both directions, by a sensor that has been measured: as many frames as its noise asks for.
[[nodiscard]] std::vector<EdgeFigures> characterize_edges(
    engine::Optics& optics, const engine::OpticsSpec& optics_spec, const SensorReport& sensor,
    const engine::SensorMaps& maps, engine::WorkerPool& pool, std::uint64_t seed,
    engine::Duration exposure);

}  // namespace characterize
