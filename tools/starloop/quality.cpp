#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "engine/core/fits.h"
#include "tools/starloop/picture.h"
#include "tools/starloop/plot_script.h"
#include "tools/starloop/quality_files.h"
#include "tools/starloop/quality_ladders.h"
#include "tools/starloop/subcommands.h"

namespace starloop {
namespace {

namespace fs = std::filesystem;

/// Grey, of 8 or 16 bits; of 16 as write_png() makes them, the largest DN being white.
engine::DnImage read_picture(const std::string& path, int bits) {
  if (!fs::is_regular_file(path)) throw std::runtime_error(path + ": no such file");
  const cv::Mat picture = cv::imread(path, cv::IMREAD_UNCHANGED);
  if (picture.empty()) throw std::runtime_error(path + ": no picture that can be read");
  if (picture.channels() != 1 || (picture.depth() != CV_8U && picture.depth() != CV_16U))
    throw std::runtime_error(path + ": expected a grey picture of 8 or 16 bits a pixel");
  if (picture.depth() == CV_8U && bits != 8)
    throw std::runtime_error(path + ": has 8 bits a pixel: --bits 8");
  engine::DnImage image(picture.cols, picture.rows);
  for (int v = 0; v < picture.rows; ++v) {
    for (int u = 0; u < picture.cols; ++u) {
      const int value = picture.depth() == CV_8U ? picture.at<std::uint8_t>(v, u)
                                                 : picture.at<std::uint16_t>(v, u) >> (16 - bits);
      image.at(u, v) = static_cast<std::uint16_t>(value);
    }
  }
  return image;
}

engine::DnImage read_frame(const std::string& path, int bits) {
  const std::string extension = fs::path(path).extension().string();
  const bool fits = extension == ".fits" || extension == ".fit" || extension == ".fts";
  return fits ? engine::read_fits(path) : read_picture(path, bits);
}

void write_csv(const fs::path& path, const std::vector<QualityLadder>& ladders) {
  std::ofstream csv(path);
  csv << "ladder,unit,value,score_db,sharpness,edge_px,contrast_sigma,noise_dn,frame,verdict\n";
  const auto cell = [](const std::optional<double>& figure) {
    return figure ? std::to_string(*figure) : std::string();
  };
  for (const QualityLadder& ladder : ladders) {
    for (std::size_t i = 0; i < ladder.steps.size(); ++i) {
      const quality::ImageQuality& q = ladder.steps[i].quality;
      csv << ladder.name << ',' << ladder.unit << ',' << ladder.steps[i].value << ','
          << cell(q.score_db) << ',' << cell(q.sharpness) << ',' << cell(q.edge_px) << ','
          << q.contrast_sigma << ',' << cell(q.noise_dn) << ',' << ladder.frame_name(i) << ','
          << name_of(q.verdict) << '\n';
    }
  }
  csv.close();
  if (!csv) throw std::runtime_error(path.string() + ": cannot be written");
}

void print_ladder(const QualityLadder& ladder) {
  for (const QualityLadder::Step& step : ladder.steps)
    std::printf("%s %g %s: %s\n", ladder.name.c_str(), step.value, ladder.unit.c_str(),
                text_of(step.quality).c_str());
}

}  // namespace

int score_pictures(const QualityOptions& options) {
  const quality::CameraFigures camera{(1 << options.bits) - 1, options.e_per_dn};
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  int code = kGood;
  for (const std::string& path : options.files) {
    try {
      const engine::DnImage frame = read_frame(path, options.bits);
      const auto q = quality::Meter(frame.width(), frame.height()).measure(frame, camera);
      nlohmann::ordered_json object = {{"file", path}};
      object.update(json_of(q));
      list.push_back(std::move(object));
      if (!options.as_json) std::printf("%s: %s\n", path.c_str(), text_of(q).c_str());
    } catch (const std::exception& e) {
      std::fprintf(stderr, "starloop: %s\n", e.what());
      code = kBadInput;
    }
  }
  using Json = nlohmann::ordered_json;
  // A file's name need not be text that JSON knows.
  if (options.as_json)
    std::printf("%s\n", list.dump(2, ' ', false, Json::error_handler_t::replace).c_str());
  return code;
}

int climb_quality_ladders(const CommonOptions& options,
                          const QualityLadderOptions& ladder_options) {
  const auto ladders = quality_ladders(options, ladder_options.time_s);
  const fs::path folder = ladder_options.out;
  fs::create_directories(folder);
  const int bits = load_scenario(options).detector.bits;
  for (const QualityLadder& ladder : ladders) {
    for (std::size_t i = 0; i < ladder.steps.size(); ++i)
      write_png((folder / ladder.frame_name(i)).string(), ladder.steps[i].frame, bits);
    if (!options.quiet) print_ladder(ladder);
  }
  write_csv(folder / "ladders.csv", ladders);
  const bool drawn = run_plot_script("quality_ladders.py", folder.string());
  if (!options.quiet)
    std::printf("%s: ladders.csv, the frames%s\n", folder.c_str(),
                drawn ? ", and ladders.png of all"
                      : "; no picture: /usr/bin/python3 with matplotlib did not draw it");
  return kGood;
}

}  // namespace starloop
