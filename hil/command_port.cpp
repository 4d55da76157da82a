#include "hil/command_port.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <asio/ip/address.hpp>
#include <asio/posix/stream_descriptor.hpp>
#include <asio/steady_timer.hpp>
#include <thread>

#include "hil/steady_clock.h"
#include "hil/tcp_port.h"
#include "hil/udp_port.h"

namespace hil {

using engine::ConfigError;
using engine::Duration;

namespace {

constexpr std::uint64_t kFramesPerHousekeeping = 10;
constexpr Duration kLongestTick = std::chrono::seconds(1);

/// What send() passes to the io thread.
struct News {
  FrameNews frame;
  AttitudeNews attitude;
  Duration monotonic{};
};

asio::ip::address checked_address(const CommandPortSpec& spec) {
  asio::error_code error;
  asio::ip::address address = asio::ip::make_address(spec.address, error);
  if (error)
    throw ConfigError(spec.address_where + " must be an IP address, got \"" + spec.address + "\"");
  if (!address.is_loopback() && spec.key_file.empty())
    throw ConfigError(spec.address_where +
                      " must be a loopback address unless key_file is given, got " + spec.address);
  return address;
}

std::optional<PacketKey> read_key(const CommandPortSpec& spec) {
  if (spec.key_file.empty()) return std::nullopt;
  return PacketKey::from_file(spec.key_file, spec.key_file_where);
}

int new_eventfd() {
  const int fd = ::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (fd < 0) throw ConfigError("the command port gets no descriptor from the system");
  return fd;
}

}  // namespace

/// All that the io thread owns, and the queue that leads to it.
class CommandPort::Io {
 public:
  explicit Io(const CommandPortSpec& spec);
  ~Io();

  engine::Status announce(const Frame& frame) noexcept;

  [[nodiscard]] PacketIntake& intake() noexcept { return intake_; }
  [[nodiscard]] std::uint16_t udp_port() const noexcept { return udp_port_; }
  [[nodiscard]] std::uint16_t tcp_port() const noexcept { return tcp_port_; }

 private:
  void listen(const CommandPortSpec& spec, const asio::ip::address& address);
  void run() noexcept;
  void wait_for_frames();
  void tick();
  void tell(const News& news);
  void send(const Telemetry& news);

  asio::io_context io_{1};
  PacketIntake intake_;
  Duration tick_;
  std::optional<UdpPort> udp_;
  std::optional<TcpPort> tcp_;
  std::uint16_t udp_port_ = 0;
  std::uint16_t tcp_port_ = 0;
  asio::posix::stream_descriptor frames_here_;
  asio::steady_timer timer_;
  std::array<std::uint64_t, kTelemetryKinds> sent_{};
  std::uint64_t told_ = 0;
  SpscRing<News, 64> news_;  // sender -> io
  std::thread thread_;
};

CommandPort::Io::Io(const CommandPortSpec& spec)
    : intake_(read_key(spec)),
      tick_(std::clamp(spec.idle_limit / 4, Duration(1'000'000), kLongestTick)),
      frames_here_(io_, new_eventfd()),
      timer_(io_) {
  const asio::ip::address address = checked_address(spec);
  if (!spec.udp_port && !spec.tcp_port)
    throw ConfigError(spec.udp_port_where + " or tcp_port must be given");
  listen(spec, address);
  wait_for_frames();
  tick();
  thread_ = std::thread([this] { run(); });
}

CommandPort::Io::~Io() {
  io_.stop();
  thread_.join();
}

void CommandPort::Io::listen(const CommandPortSpec& spec, const asio::ip::address& address) {
  const std::string* where = &spec.udp_port_where;
  try {
    if (spec.udp_port) {
      udp_.emplace(io_, asio::ip::udp::endpoint(address, *spec.udp_port), intake_, spec.idle_limit);
      udp_port_ = udp_->port();
    }
    where = &spec.tcp_port_where;
    if (spec.tcp_port) {
      tcp_.emplace(io_, asio::ip::tcp::endpoint(address, *spec.tcp_port), intake_, spec.idle_limit);
      tcp_port_ = tcp_->port();
    }
  } catch (const asio::system_error& e) {
    throw ConfigError(*where + " cannot be had on " + spec.address + ": " + e.code().message());
  }
}

void CommandPort::Io::run() noexcept {
  for (;;) {
    try {
      io_.run();
      return;
    } catch (const std::exception&) {
      // Out of memory, at most: that packet is lost, the next may pass.
      intake_.counts().add(PortCount::kSystem);
    }
  }
}

/// Drops whoever is silent for too long, and looks again later.
void CommandPort::Io::tick() {
  timer_.expires_after(tick_);
  timer_.async_wait([this](const asio::error_code& error) {
    if (error) return;
    const Duration now = SteadyClock::stopwatch();
    if (udp_) udp_->drop_idle(now);
    if (tcp_) tcp_->drop_mute(now);
    tick();
  });
}

engine::Status CommandPort::Io::announce(const Frame& frame) noexcept {
  News news;
  news.frame = {frame.sequence, frame.shutter_open, frame.exposure, frame.counts};
  news.attitude = {frame.sequence, frame.shutter_open + frame.exposure / 2, frame.measured,
                   frame.trim_rad};
  news.monotonic = SteadyClock::stopwatch();
  if (!news_.push(news)) {
    intake_.counts().add(PortCount::kFramesLost);
    return engine::Error{engine::Fault::kBusy, 0, "telemetry of the command port"};
  }
  // A count that cannot grow any more has woken the reader already.
  const std::uint64_t one = 1;
  static_cast<void>(::write(frames_here_.native_handle(), &one, sizeof one));
  return engine::Done{};
}

void CommandPort::Io::wait_for_frames() {
  frames_here_.async_wait(
      asio::posix::stream_descriptor::wait_read, [this](const asio::error_code& error) {
        if (error) return;
        // Before the ring: what is pushed from here on wakes us once more.
        std::uint64_t count = 0;
        static_cast<void>(::read(frames_here_.native_handle(), &count, sizeof count));
        for (News news; news_.pop(news);) tell(news);
        wait_for_frames();
      });
}

void CommandPort::Io::tell(const News& news) {
  const FrameNews& frame = news.frame;
  intake_.announce(frame);
  send(frame);
  send(news.attitude);
  if (told_++ % kFramesPerHousekeeping != 0) return;
  send(TimeNews{frame.frame, frame.shutter_open, news.monotonic});
  send(Housekeeping{frame.frame, frame.shutter_open, frame.counts, intake_.counts().now()});
}

void CommandPort::Io::send(const Telemetry& news) {
  const TelemetryPacket packet = encode_telemetry(news, sent_[news.index()]++);
  if (udp_) udp_->send(packet);
  if (tcp_) tcp_->send(packet);
}

CommandPort::CommandPort(const CommandPortSpec& spec) : io_(std::make_unique<Io>(spec)) {}
CommandPort::~CommandPort() = default;

engine::Expected<Command> CommandPort::receive(Duration timeout) noexcept {
  return io_->intake().receive(timeout);
}

engine::Status CommandPort::send(const Frame& frame, Duration /*timeout*/) noexcept {
  return io_->announce(frame);
}

bool CommandPort::has_reader() const noexcept { return io_->intake().clients() > 0; }
PortCounts CommandPort::counts() const noexcept { return io_->intake().counts().now(); }
std::uint16_t CommandPort::udp_port() const noexcept { return io_->udp_port(); }
std::uint16_t CommandPort::tcp_port() const noexcept { return io_->tcp_port(); }

std::optional<CommandPortSpec> read_command_port(const engine::ConfigTable& table) {
  const auto port = [&table](const std::string& key) -> std::optional<std::uint16_t> {
    if (!table.has(key)) return std::nullopt;
    return static_cast<std::uint16_t>(table.integer(key, engine::between(0, 65535)));
  };
  CommandPortSpec spec;
  const bool any = table.has("address") || table.has("key_file");
  spec.address = table.text_or("address", spec.address);
  spec.key_file = table.text_or("key_file", "");
  spec.udp_port = port("udp_port");
  spec.tcp_port = port("tcp_port");
  spec.address_where = table.where("address");
  spec.udp_port_where = table.where("udp_port");
  spec.tcp_port_where = table.where("tcp_port");
  spec.key_file_where = table.where("key_file");
  if (spec.udp_port || spec.tcp_port) return spec;
  if (any) table.fail(table.has("address") ? "address" : "key_file", "needs udp_port or tcp_port");
  return std::nullopt;
}

}  // namespace hil
