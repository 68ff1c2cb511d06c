#include "server/robots/links/tracker_link.h"

#include <cmath>
#include <exception>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "server/base/message.h"
#include "server/net/listen.h"
#include "server/robots/links/keep_running.h"

namespace pheromone::links {
namespace {

namespace asio = boost::asio;
using asio::ip::udp;
using boost::system::error_code;

constexpr char kSource[] = "tracker";
constexpr std::chrono::seconds kBetweenReports{1};
constexpr size_t kMaxDatagram = 65'536;  // more than UDP can carry
constexpr size_t kMostQuoted = 60;       // bytes of a line that is not understood

field::PoseUm ToUm(const PoseFix& fix) {
  return {{std::llround(fix.x_m * 1e6), std::llround(fix.y_m * 1e6)},
          static_cast<uint16_t>(std::llround(fix.heading_deg * 65536 / 360))};
}

}  // namespace

// Everything that is not under the lock belongs to the strand.
class TrackerLink::Impl {
 public:
  Impl(asio::io_context& io, TrackerConfig config, engine::Service* service, GpsToMap gps_to_map,
       LinkLog log, const BackoffOptions& backoff)
      : config_(std::move(config)),
        service_(service),
        gps_to_map_(std::move(gps_to_map)),
        log_(std::move(log)),
        strand_(asio::make_strand(io)),
        socket_(strand_),
        retry_(strand_),
        report_(strand_),
        backoff_(backoff),
        buffer_(kMaxDatagram) {}

  Status Start() {
    Status listening = Listen();
    KeepRunning(
        strand_, [this] { return Receive(); },
        [this](const Error& error) {
          log_({Severity::kWarning, kSource, error, "", "the tracker continues"});
        });
    return listening;
  }

  void Stop() {
    asio::post(strand_, [this] {
      error_code ignored;
      stopping_ = true;
      socket_.close(ignored);
      retry_.cancel();
      report_.cancel();
      record_.SetDown("stopped");
    });
  }

  const std::string& name() const { return config_.name; }

  LinkRecord::State state() const { return record_.state(); }

  TrackerCounters counters() const {
    const std::lock_guard lock(mutex_);
    return counters_;
  }

 private:
  Status Listen() {
    const auto where = pheromone::Listen(config_.listen, &socket_, [] {});
    if (!where.ok()) {
      if (record_.SetDown(where.error(), true)) {
        log_({Severity::kWarning, kSource, "down", where.error(), "retrying"});
      }
      return where.error();
    }
    const std::string how = "udp " + where.value();
    if (record_.SetUp(how, where.value())) {
      log_({Severity::kInfo, kSource, "up", how});
    }
    return Ok();
  }

  asio::awaitable<void> Receive() {
    while (!stopping_) {
      error_code error;
      if (socket_.is_open()) {
        udp::endpoint sender;
        const size_t size = co_await socket_.async_receive_from(
            asio::buffer(buffer_), sender, asio::redirect_error(asio::use_awaitable, error));
        if (!error) {
          backoff_.Reset();
          TryToTake({buffer_.data(), size});
          continue;
        }
      }
      if (!stopping_) {
        retry_.expires_after(backoff_.Next());
        co_await retry_.async_wait(asio::redirect_error(asio::use_awaitable, error));
      }
      if (!stopping_ && !socket_.is_open()) {
        static_cast<void>(Listen());
      }
    }
  }

  // An exception drops the datagram; the tracker continues.
  void TryToTake(std::string_view datagram) {
    try {
      Take(datagram);
    } catch (...) {
      log_({Severity::kWarning, kSource, InternalError(std::current_exception()), "",
            "a datagram was dropped"});
      const std::lock_guard lock(mutex_);
      ++counters_.datagrams;
    }
  }

  // One datagram is one batch for the engine.
  void Take(std::string_view datagram) {
    seen_.clear();
    lines_.clear();
    size_t lines = 0;
    ForEachTrackerLine(datagram, [&](std::string_view line) {
      if (++lines > kMaxTrackerLines) {
        Refuse(TrackerFault::kTooManyLines, line);
        return;
      }
      const auto parsed = ParseTrackerLine(line);
      if (const auto* fault = std::get_if<TrackerFault>(&parsed)) {
        Refuse(*fault, line);
      } else {
        Note(std::get<TrackerLine>(parsed), line);
      }
    });
    const size_t strangers = RefuseStrangers();
    const size_t taken = seen_.empty() ? 0 : service_->Observe(seen_);
    const std::lock_guard lock(mutex_);
    ++counters_.datagrams;
    counters_.poses += taken;
    counters_.not_taken += seen_.size() - taken - strangers;
  }

  // How many poses are of robots that have not said HELLO; the engine leaves them out.
  size_t RefuseStrangers() {
    const std::vector<size_t> strangers = service_->Inspect([this](const engine::Engine& engine) {
      std::vector<size_t> found;
      for (size_t i = 0; i < seen_.size(); ++i) {
        if (!engine.SaidHello(seen_[i].link, seen_[i].id)) {
          found.push_back(i);
        }
      }
      return found;
    });
    for (const size_t i : strangers) {
      Refuse(TrackerFault::kNoHello, lines_[i]);
    }
    return strangers.size();
  }

  void Note(const TrackerLine& line, std::string_view text) {
    const auto link = service_->FindLink(line.link);
    const auto* gps = std::get_if<GpsFix>(&line.fix);
    if (!link) {
      Refuse(TrackerFault::kUnknownLink, text);
    } else if (gps != nullptr && !gps_to_map_) {
      Refuse(TrackerFault::kNoDatum, text);
    } else {
      const std::optional<field::PoseUm> pose =
          gps != nullptr ? gps_to_map_(*gps) : ToUm(std::get<PoseFix>(line.fix));
      if (pose) {
        seen_.push_back({*link, line.id, *pose, config_.valid_ms});
        lines_.push_back(text);
      } else {
        Refuse(TrackerFault::kOutOfRange, text);
      }
    }
  }

  // Logged at once if nothing was logged in the last second, otherwise together at the end of that
  // second.
  void Refuse(TrackerFault fault, std::string_view line) {
    ++untold_;
    last_fault_ = std::string(TextOf(fault)) + ": " + Quoted(line, kMostQuoted);
    {
      const std::lock_guard lock(mutex_);
      ++counters_.faults[static_cast<size_t>(fault)];
      counters_.last_fault = last_fault_;
    }
    if (!reporting_) {
      Report();
    }
  }

  void Report() {
    reporting_ = untold_ != 0 && !stopping_;
    if (!reporting_) {
      return;
    }
    log_({Severity::kWarning, kSource, std::to_string(std::exchange(untold_, 0)) + " lines refused",
          "the last one: " + last_fault_});
    report_.expires_after(kBetweenReports);
    report_.async_wait([this](const error_code& error) {
      if (!error) {
        Report();
      }
    });
  }

  const TrackerConfig config_;
  engine::Service* const service_;
  const GpsToMap gps_to_map_;
  const LinkLog log_;
  const asio::strand<asio::io_context::executor_type> strand_;
  udp::socket socket_;
  asio::steady_timer retry_;
  asio::steady_timer report_;
  Backoff backoff_;
  std::vector<char> buffer_;
  std::vector<engine::PoseObserved> seen_;
  std::vector<std::string_view> lines_;  // of the datagram, as many
  uint64_t untold_ = 0;
  std::string last_fault_;
  bool reporting_ = false;
  bool stopping_ = false;
  LinkRecord record_;  // its state only
  mutable std::mutex mutex_;
  TrackerCounters counters_;
};

TrackerLink::TrackerLink(asio::io_context& io, const TrackerConfig& config,
                         engine::Service* service, GpsToMap gps_to_map, LinkLog log,
                         const BackoffOptions& backoff)
    : impl_(std::make_unique<Impl>(io, config, service, std::move(gps_to_map), std::move(log),
                                   backoff)) {}

TrackerLink::~TrackerLink() = default;

Status TrackerLink::Start() {
  return impl_->Start();
}

void TrackerLink::Stop() {
  impl_->Stop();
}

const std::string& TrackerLink::name() const {
  return impl_->name();
}

LinkRecord::State TrackerLink::state() const {
  return impl_->state();
}

TrackerCounters TrackerLink::counters() const {
  return impl_->counters();
}

}  // namespace pheromone::links
