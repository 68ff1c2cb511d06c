// How robots, operators and programs reach the server, in words.
#include <fmt/format.h>

#include <string>
#include <string_view>

#include "server/config/describe.h"
#include "server/config/folders.h"

namespace pheromone::config {
namespace {

std::string DescribeEndpoint(const std::string& address, uint16_t port) {
  const bool v6 = address.find(':') != std::string::npos;
  return fmt::format("{}:{}", v6 ? "[" + address + "]" : address, port);
}

std::string DescribePort(const LinkConfig& link) {
  std::string text = link.path;
  if (link.usb) {
    text = fmt::format("usb {:04x}:{:04x}{}{}", link.usb->vendor, link.usb->product,
                       link.usb->serial.empty() ? "" : ":", link.usb->serial);
  }
  return fmt::format("{}, {} baud", text, link.baud);
}

std::string DescribeLink(const LinkConfig& link) {
  switch (link.kind) {
    case LinkKind::kPty:
      return "pty " + AbsolutePath(link.path);
    case LinkKind::kSerial:
      return "serial " + DescribePort(link);
    case LinkKind::kTcp:
      return "tcp " + DescribeEndpoint(link.listen_address, link.listen_port);
    case LinkKind::kUdp:
      break;
  }
  return "udp " + DescribeEndpoint(link.listen_address, link.listen_port);
}

std::string DescribeWeb(const WebSettings& web) {
  if (web.listen_address.empty()) {
    return "none";
  }
  return "http://" + DescribeEndpoint(web.listen_address, web.listen_port) +
         (web.token.empty() ? ", read-only" : ", changes require the token");
}

}  // namespace

std::vector<std::string> DescribeReach(const Config& config, const char* runtime_directory) {
  std::vector<std::string> lines;
  for (const LinkConfig& link : config.links) {
    lines.push_back("link " + link.name + ": " + DescribeLink(link) +
                    (link.required ? ", required" : ""));
  }
  for (const TrackerConfig& tracker : config.trackers) {
    lines.push_back("tracker " + tracker.name + ": udp " +
                    DescribeEndpoint(tracker.listen_address, tracker.listen_port));
  }
  const std::string socket = ControlSocket(config.control, runtime_directory);
  lines.push_back("control: " + (socket.empty() ? "none" : AbsolutePath(socket)));
  lines.push_back("web: " + DescribeWeb(config.web));
  return lines;
}

}  // namespace pheromone::config
