#include "drivers/open_link.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <stdexcept>

#include "drivers/client/shm_layout.h"
#include "hil/frame_store.h"
#include "hil/merged_commands.h"

namespace drivers {
namespace {

using engine::ConfigTable;
using engine::Duration;
using engine::Status;

/// The slash in front that shm_open(3) asks for is welcome, and no other.
bool is_shm_name(const std::string& name) {
  const std::string bare = name.starts_with('/') ? name.substr(1) : name;
  return !bare.empty() && bare.size() <= 200 && !bare.starts_with('.') &&
         bare.find('/') == std::string::npos && bare.find('\0') == std::string::npos;
}

bool hexadecimal(const std::string& text, std::uint16_t& value) {
  const char* end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, value, 16);
  return error == std::errc() && at == end;
}

bool read_usb(const std::string& place, UsbSpec& usb) {
  if (place.empty()) return true;
  const std::size_t first = place.find(':');
  if (first == std::string::npos) return false;
  const std::size_t second = place.find(':', first + 1);
  if (second != std::string::npos) usb.serial = place.substr(second + 1);
  return hexadecimal(place.substr(0, first), usb.vendor) &&
         hexadecimal(
             place.substr(first + 1, second == std::string::npos ? second : second - first - 1),
             usb.product);
}

/// False: it is no name of a link.
bool read_target(const std::string& name, LinkTarget& target) {
  target.name = name;
  const std::size_t colon = name.find(':');
  const std::string kind = name.substr(0, colon);
  const bool has_place = colon != std::string::npos;
  target.place = has_place ? name.substr(colon + 1) : "";
  if (kind == "mock") {
    target.kind = LinkKind::kMock;
    return !has_place;
  }
  if (kind == "usb") {
    target.kind = LinkKind::kUsb;
    return has_place == !target.place.empty() && read_usb(target.place, target.usb);
  }
  if (kind == "shm") {
    target.kind = LinkKind::kShm;
    return is_shm_name(target.place);
  }
  target.kind = kind == "v4l2" ? LinkKind::kV4l2 : LinkKind::kFile;
  return (kind == "v4l2" || kind == "file") && !target.place.empty() &&
         target.place.find('\0') == std::string::npos;
}

/// A folder as a link: a FITS file for each frame, with what the frame knows of itself.
class FileLink final : public hil::FrameSink {
 public:
  explicit FileLink(const std::string& folder) : store_(folder, {}) {
    std::filesystem::create_directories(folder);
  }
  Status send(const hil::Frame& frame, Duration /*timeout*/) noexcept override {
    try {
      store_.put(frame);
    } catch (const std::exception&) {
      return engine::Error{engine::Fault::kSystem, 0, "file: not written"};
    }
    return engine::Done{};
  }

 private:
  hil::FitsStore store_;
};

}  // namespace

bool LinkSpec::has(LinkKind kind) const noexcept {
  return std::any_of(to.begin(), to.end(), [kind](const LinkTarget& t) { return t.kind == kind; });
}

LinkSpec read_link(const ConfigTable& table) {
  LinkSpec spec;
  const std::vector<std::string> names = table.texts("to");
  if (table.has("to")) {
    if (names.empty() || names.size() > hil::MergedCommands::kMost - 1)
      table.fail("to", "must name 1 to 7 links, got " + std::to_string(names.size()));
    spec.to.assign(names.size(), LinkTarget{});
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!read_target(names[i], spec.to[i]))
      table.fail("to",
                 "must be \"mock\", \"shm:NAME\", \"v4l2:NODE or LABEL\", \"usb\", "
                 "\"usb:VID:PID[:SERIAL]\" or \"file:FOLDER\", got \"" +
                     names[i] + "\"");
    for (std::size_t k = 0; k < i; ++k)
      if (names[k] == names[i]) table.fail("to", "names \"" + names[i] + "\" twice");
  }
  spec.slots = static_cast<int>(
      table.integer_or("slots", spec.slots, engine::between(2, STARLOOP_SHM_MOST_SLOTS)));
  spec.telemetry_row = table.flag_or("telemetry_row", spec.telemetry_row);
  spec.v4l2_format = table.choice_or<V4l2Format>(
      "v4l2_format", "y16", {{"y16", V4l2Format::kY16}, {"grey", V4l2Format::kGrey}});
  spec.v4l2_method = table.choice_or<V4l2Method>("v4l2_method", "auto",
                                                 {{"auto", V4l2Method::kAuto},
                                                  {"write", V4l2Method::kWrite},
                                                  {"mapped", V4l2Method::kMapped}});
  spec.v4l2_to_top = table.flag_or("v4l2_to_top", spec.v4l2_to_top);
  spec.usb_packed = table.flag_or("usb_packed", spec.usb_packed);
  return spec;
}

OpenLink::OpenLink(const LinkSpec& spec, const LinkCamera& camera, hil::WhenBusy when_busy)
    : targets_(spec.to) {
  first_ = open(spec, spec.to.front(), camera, when_busy);
  frames_ = first_.get();
  for (std::size_t i = 1; i < spec.to.size(); ++i) {
    beside_.push_back(std::make_unique<SideLink>(open(spec, spec.to[i], camera, when_busy),
                                                 camera.width_px, camera.height_px, when_busy));
    fans_.push_back(std::make_unique<hil::FanOut>(*frames_, *beside_.back()));
    frames_ = fans_.back().get();
  }
  if (sources_.empty()) sources_.push_back(&nobody_);
}

OpenLink::~OpenLink() = default;

std::unique_ptr<hil::FrameSink> OpenLink::open(const LinkSpec& spec, const LinkTarget& target,
                                               const LinkCamera& camera, hil::WhenBusy when_busy) {
  const int rows = camera.height_px + (spec.telemetry_row ? 1 : 0);
  usb_.push_back(nullptr);
  switch (target.kind) {
    case LinkKind::kMock: {
      auto link = std::make_unique<MockLink>(camera.width_px, camera.height_px);
      mock_ = link.get();
      sources_.push_back(link.get());
      return link;
    }
    case LinkKind::kShm: {
      const WhenFull when_full =
          when_busy == hil::WhenBusy::kWait ? WhenFull::kWait : WhenFull::kDropOldest;
      auto link = std::make_unique<ShmLink>(
          ShmSpec{.name = target.place, .slots = spec.slots, .when_full = when_full},
          camera.width_px, camera.height_px);
      sources_.push_back(link.get());
      return link;
    }
    case LinkKind::kUsb: {
      UsbSpec usb = target.usb;
      usb.packed = spec.usb_packed;
      auto link = std::make_unique<UsbLink>(usb, camera.width_px, rows, camera.bits);
      sources_.push_back(link.get());
      usb_.back() = link.get();
      return link;
    }
    case LinkKind::kV4l2:
      return std::make_unique<V4l2Link>(V4l2Spec{.device = target.place,
                                                 .format = spec.v4l2_format,
                                                 .to_top = spec.v4l2_to_top,
                                                 .method = spec.v4l2_method,
                                                 .period = camera.period},
                                        camera.width_px, rows, camera.bits);
    case LinkKind::kFile:
      break;
  }
  return std::make_unique<FileLink>(target.place);
}

std::string OpenLink::text() const {
  std::string text = "frames go to ";
  for (std::size_t i = 0; i < targets_.size(); ++i) {
    if (i > 0) text += ", ";
    text += targets_[i].kind == LinkKind::kMock ? "the built-in tracker" : targets_[i].name;
  }
  return text;
}

void OpenLink::finish() noexcept {
  for (const auto& link : beside_) link->finish();
}

std::vector<LinkOutcome> OpenLink::outcomes() const {
  std::vector<LinkOutcome> all;
  for (std::size_t i = 0; i < targets_.size(); ++i) {
    LinkOutcome o;
    o.name = targets_[i].name;
    o.first = i == 0;
    if (i > 0) {
      const hil::FrameWriter& w = beside_[i - 1]->writer();
      o.sent = w.written();
      o.left_out = w.left_out();
      o.failed = w.failed();
      o.failure = w.failure();
    }
    if (usb_[i] != nullptr) o.usb = usb_[i]->counts();
    all.push_back(std::move(o));
  }
  return all;
}

}  // namespace drivers
