#include "engine/detector/sensor_maps.h"

#include <cmath>
#include <cstdio>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "engine/core/contract.h"
#include "engine/core/fits.h"
#include "engine/core/random.h"

namespace engine {
namespace {

Draws draws_of(const DetectorSpec& spec, Stream stream, std::size_t place) {
  return {spec.sensor, stream, 0, static_cast<std::uint32_t>(place)};
}

std::vector<double> read_map(const MapFile& file, int width, int height, double largest) {
  std::vector<double> map;
  try {
    map = read_fits_map(file.path, width, height);
  } catch (const std::runtime_error& e) {
    throw ConfigError(file.where + ": " + e.what());
  }
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (map[i] >= 0.0 && map[i] <= largest) continue;
    char text[160];
    std::snprintf(text, sizeof text, ": pixel (%zu, %zu), from 0, must be >= 0 and <= %g, got %g",
                  i % static_cast<std::size_t>(width), i / static_cast<std::size_t>(width), largest,
                  map[i]);
    throw ConfigError(file.where + ": " + file.path + text);
  }
  return map;
}

/// Mean 1 and this rms, never negative.
double log_normal(Draws draws, double rms) {
  const double variance = std::log1p(rms * rms);
  return std::exp(std::sqrt(variance) * static_cast<double>(draws.normal()) - 0.5 * variance);
}

double exponential(Draws& draws, double mean) { return -mean * std::log(draws.uniform_double()); }

}  // namespace

SensorMaps::SensorMaps(const DetectorSpec& spec, int width, int height)
    : width_(width), height_(height) {
  if (spec.hot_columns + spec.dead_columns > width)
    throw ConfigError(spec.columns_where + " must leave hot and dead columns within the " +
                      std::to_string(width) + " of the camera, got " +
                      std::to_string(spec.hot_columns + spec.dead_columns));
  const bool dead = spec.dead_pixels > 0.0 || spec.dead_columns > 0;
  const bool hot = spec.hot_pixels > 0.0 || spec.hot_columns > 0;
  if (dead || spec.prnu_rms > 0.0 || !spec.prnu_map.path.empty()) fill_response(spec);
  if (dead || hot || spec.dsnu_rms > 0.0 || !spec.dsnu_map.path.empty()) fill_dark(spec);
  if (dead || hot) {
    spoil_pixels(spec);
    spoil_columns(spec);
  }
}

void SensorMaps::fill_response(const DetectorSpec& spec) {
  response_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), 1.0F);
  if (!spec.prnu_map.path.empty()) {
    const auto map = read_map(spec.prnu_map, width_, height_, DetectorSpec::kLargestResponse);
    for (std::size_t i = 0; i < map.size(); ++i) response_[i] = static_cast<float>(map[i]);
  } else if (spec.prnu_rms > 0.0) {
    for (std::size_t i = 0; i < response_.size(); ++i) {
      const double deviation =
          spec.prnu_rms * static_cast<double>(draws_of(spec, Stream::kPrnu, i).normal());
      response_[i] = static_cast<float>(std::max(0.0, 1.0 + deviation));
    }
  }
}

void SensorMaps::fill_dark(const DetectorSpec& spec) {
  const double even_e_s = spec.dark_e_s * spec.dark_factor();
  dark_e_s_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_),
                   static_cast<float>(even_e_s + spec.background_e_s));
  if (!spec.dsnu_map.path.empty()) {
    const auto map = read_map(spec.dsnu_map, width_, height_, DetectorSpec::kLargestDark);
    for (std::size_t i = 0; i < map.size(); ++i)
      dark_e_s_[i] = static_cast<float>(even_e_s * map[i] + spec.background_e_s);
  } else if (spec.dsnu_rms > 0.0) {
    for (std::size_t i = 0; i < dark_e_s_.size(); ++i) {
      const double factor = log_normal(draws_of(spec, Stream::kDsnu, i), spec.dsnu_rms);
      dark_e_s_[i] = static_cast<float>(even_e_s * factor + spec.background_e_s);
    }
  }
}

void SensorMaps::kill(std::size_t pixel) noexcept {
  response_[pixel] = 0.0F;
  dark_e_s_[pixel] = 0.0F;
}

void SensorMaps::spoil_pixels(const DetectorSpec& spec) {
  const double hot_e_s = spec.hot_dark_e_s * spec.dark_factor();
  for (std::size_t i = 0; i < dark_e_s_.size(); ++i) {
    Draws hot = draws_of(spec, Stream::kHotPixels, i);
    if (hot.uniform_double() < spec.hot_pixels)
      dark_e_s_[i] += static_cast<float>(exponential(hot, hot_e_s));
    if (draws_of(spec, Stream::kDeadPixels, i).uniform_double() < spec.dead_pixels) kill(i);
  }
}

void SensorMaps::spoil_columns(const DetectorSpec& spec) {
  const auto width = static_cast<std::size_t>(width_);
  std::vector<std::size_t> columns(width);
  std::iota(columns.begin(), columns.end(), std::size_t{0});
  Draws draws = draws_of(spec, Stream::kColumns, 0);
  const auto dead = static_cast<std::size_t>(spec.dead_columns);
  const auto spoiled = dead + static_cast<std::size_t>(spec.hot_columns);
  for (std::size_t i = 0; i < spoiled; ++i) {
    // Fisher and Yates: no column twice.
    const auto left = static_cast<double>(width - i);
    std::swap(columns[i], columns[i + static_cast<std::size_t>(draws.uniform_double() * left)]);
    const double more_e_s = exponential(draws, spec.hot_dark_e_s * spec.dark_factor());
    for (std::size_t at = columns[i]; at < dark_e_s_.size(); at += width) {
      if (i < dead) {
        kill(at);
      } else if (response_.empty() || response_[at] > 0.0F) {
        dark_e_s_[at] += static_cast<float>(more_e_s);
      }
    }
  }
}

SensorMaps SensorMaps::binned(int binning) const {
  ENSURE(binning > 0 && width_ % binning == 0 && height_ % binning == 0);
  SensorMaps coarse;
  coarse.width_ = width_ / binning;
  coarse.height_ = height_ / binning;
  const auto add_up = [&](const std::vector<float>& from, float share, std::vector<float>& to) {
    if (from.empty()) return;
    to.assign(static_cast<std::size_t>(coarse.width_) * static_cast<std::size_t>(coarse.height_),
              0.0F);
    for (std::size_t i = 0; i < from.size(); ++i) {
      const auto fine = static_cast<int>(i);
      const int pixel = fine / width_ / binning * coarse.width_ + fine % width_ / binning;
      to[static_cast<std::size_t>(pixel)] += share * from[i];
    }
  };
  add_up(response_, 1.0F / static_cast<float>(binning * binning), coarse.response_);
  add_up(dark_e_s_, 1.0F, coarse.dark_e_s_);
  return coarse;
}

SensorMaps SensorMaps::cut(const PixelRect& window) const {
  ENSURE(window.left >= 0 && window.top >= 0 && window.right <= width_ &&
         window.bottom <= height_ && !window.empty());
  SensorMaps part;
  part.width_ = window.width();
  part.height_ = window.height();
  for (int v = window.top; v < window.bottom; ++v) {
    const long begin = static_cast<long>(v) * width_ + window.left;
    const long end = begin + window.width();
    const auto add = [&](const std::vector<float>& from, std::vector<float>& to) {
      if (!from.empty()) to.insert(to.end(), from.begin() + begin, from.begin() + end);
    };
    add(response_, part.response_);
    add(dark_e_s_, part.dark_e_s_);
  }
  return part;
}

}  // namespace engine
