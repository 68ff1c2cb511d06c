#include "server/daemon/make_link.h"

#include <chrono>
#include <cmath>
#include <optional>
#include <utility>

#include "server/config/folders.h"
#include "server/robots/links/port_link.h"
#include "server/robots/links/tcp_link.h"
#include "server/robots/links/udp_link.h"

namespace pheromone::daemon {
namespace {

// 1000 km from the datum, the ground lies 80 km below the map's plane, and heights are within 100
// km. Anything deeper is on the other side of the Earth, where x and y are small again.
constexpr double kDeepestM = -300'000;

// Without a height of its own, a robot is on the map's ground.
links::GpsToMap GpsToMapAround(const std::optional<maps::Wgs84>& datum) {
  if (!datum) {
    return nullptr;
  }
  const Result<maps::LocalFrame> frame = maps::LocalFrame::At(*datum);
  if (!frame.ok()) {
    return nullptr;  // the configuration was checked
  }
  return [frame = frame.value()](const links::GpsFix& fix) -> std::optional<field::PoseUm> {
    const maps::EastNorthUp local = frame.ToLocal(
        {fix.latitude_deg, fix.longitude_deg, fix.height_m.value_or(frame.datum().height_m)});
    if (local.up_m < kDeepestM) {
      return std::nullopt;
    }
    return field::PoseUm{{std::llround(local.east_m * 1e6), std::llround(local.north_m * 1e6)},
                         maps::HeadingFromCompass(fix.course_deg)};
  };
}

// The enumerations have the same order.
links::MediumLines LinesOf(const config::LinkConfig& config) {
  static_assert(static_cast<int>(links::CarrierSense::kCts) ==
                static_cast<int>(config::CarrierSense::kCts));
  static_assert(static_cast<int>(links::Keying::kRs485) == static_cast<int>(config::Ptt::kRs485));
  return {static_cast<links::CarrierSense>(config.carrier_sense),
          static_cast<links::Keying>(config.ptt), config.ptt_lead_ms, config.ptt_tail_ms};
}

links::MediumOptions MediumOf(const config::LinkConfig& config) {
  return {config.baud,
          config.turnaround_ms,
          config.slot_ms,
          config.response_window_ms,
          config.adapter_latency_ms,
          config.server_delay_ms};
}

}  // namespace

std::unique_ptr<links::Link> MakeLink(boost::asio::io_context& io, const config::LinkConfig& config,
                                      links::LinkContext context, uint32_t seed) {
  links::BackoffOptions backoff;
  backoff.seed = seed;
  context.admission = {config.clients, config.requests_per_client_s, config.requests_per_link_s};
  switch (config.kind) {
    case config::LinkKind::kPty: {
      links::PtyOptions options;
      options.path = config::AbsolutePath(config.path);
      options.gap_timeout_ms = config.gap_timeout_ms;
      if (config.medium_access) {
        options.medium = MediumOf(config);
      }
      options.backoff = backoff;
      return links::MakePtyLink(io, options, std::move(context));
    }
    case config::LinkKind::kSerial: {
      links::SerialOptions options;
      options.path = config.path;
      if (config.usb) {
        options.usb = {config.usb->vendor, config.usb->product, config.usb->serial};
      }
      options.gap_timeout_ms = config.gap_timeout_ms;
      options.medium_access = config.medium_access;
      options.medium = MediumOf(config);
      options.lines = LinesOf(config);
      options.silence = std::chrono::seconds(config.silence_s);
      options.backoff = backoff;
      return links::MakeSerialLink(io, options, std::move(context));
    }
    case config::LinkKind::kTcp: {
      links::TcpOptions options;
      options.listen_address = config.listen_address;
      options.listen_port = config.listen_port;
      options.gap_timeout_ms = config.gap_timeout_ms;
      options.backoff = backoff;
      return links::MakeTcpLink(io, options, std::move(context));
    }
    case config::LinkKind::kUdp:
      break;
  }
  links::UdpOptions options;
  options.listen_address = config.listen_address;
  options.listen_port = config.listen_port;
  options.backoff = backoff;
  return links::MakeUdpLink(io, options, std::move(context));
}

std::unique_ptr<links::TrackerLink> MakeTracker(boost::asio::io_context& io,
                                                const config::TrackerConfig& config,
                                                const std::optional<maps::Wgs84>& datum,
                                                engine::Service* service, links::LinkLog log,
                                                uint32_t seed) {
  links::TrackerOptions options;
  options.listen_address = config.listen_address;
  options.listen_port = config.listen_port;
  options.valid_ms = config.valid_ms;
  options.backoff.seed = seed;
  return std::make_unique<links::TrackerLink>(io, options, service, GpsToMapAround(datum),
                                              std::move(log));
}

}  // namespace pheromone::daemon
