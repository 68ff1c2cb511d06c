#include "server/daemon/make_link.h"

#include <algorithm>
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

// A link whose port is at another server of the cluster.
class LinkElsewhere final : public links::Link {
 public:
  LinkElsewhere(links::LinkConfig config, links::LinkContext context)
      : Link(std::move(config), std::move(context)) {}

  links::LinkRole role() const override { return links::LinkRole::kElsewhere; }
  Status Start() override {
    std::string nodes;
    for (const std::string& node : this->config().on) {
      nodes += (nodes.empty() ? "" : " or ") + node;
    }
    record()->SetDown("at node " + nodes);
    return Ok();
  }
  void Stop() override {}
  void Send(std::vector<engine::Outgoing> /*messages*/) override {}  // its own server does
  void SetKeys(signing::Keys /*keys*/) override {}
};

}  // namespace

std::unique_ptr<links::Link> MakeLink(boost::asio::io_context& io, links::LinkConfig config,
                                      links::LinkContext context, const std::string& node) {
  const std::vector<std::string>& on = config.on;
  if (!on.empty() && std::find(on.begin(), on.end(), node) == on.end()) {
    return std::make_unique<LinkElsewhere>(std::move(config), std::move(context));
  }
  switch (config.kind) {
    case links::LinkKind::kPty:
      config.path = config::AbsolutePath(config.path);
      return links::MakePtyLink(io, config, std::move(context));
    case links::LinkKind::kSerial:
      return links::MakeSerialLink(io, config, std::move(context));
    case links::LinkKind::kTcp:
      return links::MakeTcpLink(io, config, std::move(context));
    case links::LinkKind::kUdp:
      break;
  }
  return links::MakeUdpLink(io, config, std::move(context));
}

std::unique_ptr<links::TrackerLink> MakeTracker(boost::asio::io_context& io,
                                                const links::TrackerConfig& config,
                                                const std::optional<maps::Wgs84>& datum,
                                                engine::Service* service, links::LinkLog log,
                                                const links::BackoffOptions& backoff) {
  return std::make_unique<links::TrackerLink>(io, config, service, GpsToMapAround(datum),
                                              std::move(log), backoff);
}

}  // namespace pheromone::daemon
