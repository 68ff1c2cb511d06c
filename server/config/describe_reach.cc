// How robots, operators and programs reach the server, in words.
#include <fmt/format.h>

#include <string>
#include <string_view>

#include "server/config/describe.h"
#include "server/config/folders.h"

namespace pheromone::config {
namespace {

std::string DescribePort(const links::LinkConfig& link) {
  return (link.usb ? "usb " + links::ToText(*link.usb) : link.path) +
         fmt::format(", {} baud", link.baud);
}

std::string DescribeLink(const links::LinkConfig& link) {
  switch (link.kind) {
    case links::LinkKind::kPty:
      return "pty " + AbsolutePath(link.path);
    case links::LinkKind::kSerial:
      return "serial " + DescribePort(link);
    case links::LinkKind::kTcp:
      return "tcp " + ToText(link.listen);
    case links::LinkKind::kUdp:
      break;
  }
  return "udp " + ToText(link.listen);
}

// "a, b", with what `text` says of each.
template <typename List, typename Text>
std::string Joined(const List& list, const Text& text) {
  std::string all;
  for (const auto& it : list) {
    all += (all.empty() ? "" : ", ") + text(it);
  }
  return all;
}

std::string DescribeSecurity(const links::LinkConfig& link, const Config& config) {
  if (link.security == signing::Security::kOff) {
    return "";
  }
  const auto keys = config.keys.find(link.name);
  return fmt::format(", signed frames {}, keys: {}",
                     link.security == signing::Security::kRequire ? "required" : "accepted",
                     keys != config.keys.end() ? keys->second.size() : 0);
}

std::string DescribeNodes(const links::LinkConfig& link) {
  return link.on.empty() ? "" : ", on " + Joined(link.on, [](const std::string& it) { return it; });
}

std::string DescribeCluster(const ClusterSettings& cluster) {
  return "cluster " + cluster.name + ": " +
         (cluster.node.empty() ? "nodes " : "node " + cluster.node + " of ") +
         Joined(cluster.nodes,
                [](const ClusterSettings::Node& it) {
                  return it.name + " (" + ToText(it.address) + ")";
                }) +
         "; log in etcd at " +
         Joined(cluster.engine, [](const Endpoint& it) { return ToText(it); }) +
         fmt::format("; a leader that is silent for {} ms is replaced", cluster.suspect_ms);
}

std::string DescribeWeb(const WebSettings& web) {
  if (web.listen.address.empty()) {
    return "none";
  }
  return std::string(web.tls ? "https" : "http") + "://" + ToText(web.listen) +
         (web.token_file.empty()
              ? ", read-only"
              : ", changes require the token in " + AbsolutePath(web.token_file) +
                    (web.token.empty() ? ", to be created" : ""));
}

}  // namespace

std::vector<std::string> DescribeReach(const Config& config, const char* runtime_directory) {
  std::vector<std::string> lines;
  for (const links::LinkConfig& link : config.links) {
    lines.push_back("link " + link.name + ": " + DescribeLink(link) +
                    (link.required ? ", required" : "") + DescribeSecurity(link, config) +
                    DescribeNodes(link));
  }
  for (const links::TrackerConfig& tracker : config.trackers) {
    lines.push_back("tracker " + tracker.name + ": udp " + ToText(tracker.listen));
  }
  const std::string socket = ControlSocket(config.control, runtime_directory);
  lines.push_back("control: " + (socket.empty() ? "none" : AbsolutePath(socket)));
  lines.push_back("web: " + DescribeWeb(config.web));
  if (config.cluster) {
    lines.push_back(DescribeCluster(*config.cluster));
  }
  return lines;
}

}  // namespace pheromone::config
