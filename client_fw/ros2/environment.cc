#include "client_fw/ros2/environment.h"

#include <charconv>
#include <sstream>
#include <string_view>
#include <system_error>
#include <vector>

namespace pheromone::ros2 {
namespace {

constexpr uint32_t kMaxDomain = 232;

Result<std::vector<std::string>> ReadPeers(const std::string& text) {
  std::vector<std::string> peers;
  std::istringstream list(text);
  for (std::string peer; std::getline(list, peer, ';');) {
    constexpr std::string_view kAllowed =
        "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ.:-_[]";
    if (peer.find_first_not_of(kAllowed) != std::string::npos) {
      return Error{"ROS_STATIC_PEERS: \"" + peer +
                   "\", expected addresses separated by semicolons"};
    }
    if (!peer.empty()) {
      peers.push_back(peer);
    }
  }
  return peers;
}

}  // namespace

Result<Discovery> ReadEnvironment(const std::function<const char*(const char*)>& get) {
  const auto text = [&](const char* name) {
    const char* value = get(name);
    return std::string(value == nullptr ? "" : value);
  };
  Discovery discovery;
  const std::string domain = text("ROS_DOMAIN_ID");
  const char* end = domain.data() + domain.size();
  const auto [rest, error] = std::from_chars(domain.data(), end, discovery.domain);
  if (!domain.empty() && (error != std::errc{} || rest != end || discovery.domain > kMaxDomain)) {
    return Error{"ROS_DOMAIN_ID: \"" + domain + "\", expected a number from 0 to 232"};
  }
  std::string range = text("ROS_AUTOMATIC_DISCOVERY_RANGE");
  const std::string localhost = text("ROS_LOCALHOST_ONLY");
  if (!localhost.empty() && localhost != "0" && localhost != "1") {
    return Error{"ROS_LOCALHOST_ONLY: \"" + localhost + "\", expected 0 or 1"};
  }
  if (range.empty()) {
    range = localhost == "1" ? "LOCALHOST" : "SUBNET";
  }
  if (range != "SUBNET" && range != "LOCALHOST" && range != "OFF" && range != "SYSTEM_DEFAULT") {
    return Error{"ROS_AUTOMATIC_DISCOVERY_RANGE: \"" + range +
                 "\", expected SUBNET, LOCALHOST, OFF or SYSTEM_DEFAULT"};
  }
  PHEROMONE_TRY(std::vector<std::string> peers, ReadPeers(text("ROS_STATIC_PEERS")));
  if (range == "OFF" || range == "SYSTEM_DEFAULT") {
    peers.clear();  // as ROS does
  }
  if (range == "LOCALHOST") {
    peers.emplace_back("127.0.0.1");
  }
  std::string general;
  if (localhost == "1") {
    general += R"(<Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>)";
  }
  if (range == "LOCALHOST" || range == "OFF") {
    general += "<AllowMulticast>false</AllowMulticast>";
  }
  std::string discovered;
  if (range == "OFF") {  // nobody has this tag
    discovered = "<ParticipantIndex>none</ParticipantIndex><Tag>pheromone_discovery_off</Tag>";
  } else if (!peers.empty()) {
    discovered =
        "<ParticipantIndex>auto</ParticipantIndex>"
        "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex><Peers>";
    for (const std::string& peer : peers) {
      discovered += "<Peer address=\"" + peer + "\"/>";
    }
    discovered += "</Peers>";
  }
  if (!general.empty() || !discovered.empty()) {
    discovery.config = "<CycloneDDS><Domain><General>" + general + "</General><Discovery>" +
                       discovered + "</Discovery></Domain></CycloneDDS>";
  }
  if (const std::string uri = text("CYCLONEDDS_URI"); !uri.empty()) {
    discovery.config += (discovery.config.empty() ? "" : ",") + uri;
  }
  return discovery;
}

}  // namespace pheromone::ros2
