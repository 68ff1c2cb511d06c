#include "server/daemon/make_link.h"

#include <utility>

#include "server/links/port_link.h"
#include "server/links/tcp_link.h"

namespace pheromone::daemon {

std::unique_ptr<links::Link> MakeLink(boost::asio::io_context& io, const config::LinkConfig& config,
                                      links::LinkContext context, uint32_t seed) {
  links::BackoffOptions backoff;
  backoff.seed = seed;
  switch (config.kind) {
    case config::LinkKind::kPty: {
      links::PtyOptions options;
      options.path = config.path;
      options.gap_timeout_ms = config.gap_timeout_ms;
      options.backoff = backoff;
      return links::MakePtyLink(io, options, std::move(context));
    }
    case config::LinkKind::kSerial: {
      links::SerialOptions options;
      options.path = config.path;
      options.baud = config.baud;
      options.gap_timeout_ms = config.gap_timeout_ms;
      options.turnaround_ms = config.turnaround_ms;
      options.response_window_ms = config.response_window_ms;
      options.backoff = backoff;
      return links::MakeSerialLink(io, options, std::move(context));
    }
    case config::LinkKind::kTcp:
      break;
  }
  links::TcpOptions options;
  options.listen_address = config.listen_address;
  options.listen_port = config.listen_port;
  options.gap_timeout_ms = config.gap_timeout_ms;
  options.backoff = backoff;
  return links::MakeTcpLink(io, options, std::move(context));
}

}  // namespace pheromone::daemon
