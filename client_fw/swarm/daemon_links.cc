#include "client_fw/swarm/daemon_links.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "client_fw/boards/host/real_time.h"
#include "client_fw/lab/scenario/tree.h"
#include "protocol/decoder.h"
#include "protocol/signing.h"
#include "server/core/field/geometry.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kNsOfMs = 1'000'000;
constexpr std::string_view kTables[] = {"map",       "antennas", "pheromone",
                                        "obstacles", "path",     "print"};

constexpr char kDashboard[] = "\n[web]\nlisten = \"127.0.0.1:8377\"\n";

std::optional<uint16_t> PortOf(std::string_view text) {
  uint16_t port = 0;
  const char* const end = text.data() + text.size();
  const auto [read, error] = std::from_chars(text.data(), end, port);
  return error == std::errc() && read == end && port != 0 ? std::optional(port) : std::nullopt;
}

Result<std::pair<links::PeerAddress, Descriptor>> Connect(const DaemonAddress& address) {
  addrinfo wanted = {};
  wanted.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  if (const int error =
          getaddrinfo(address.host.c_str(), std::to_string(address.port).c_str(), &wanted, &found);
      error != 0) {
    return Error{ToText(address) + ": " + gai_strerror(error)};
  }
  links::PeerAddress peer;
  std::memcpy(&peer.socket_address, found->ai_addr,
              std::min<size_t>(found->ai_addrlen, sizeof peer.socket_address));
  peer.size = found->ai_addrlen;
  const int family = found->ai_family;
  freeaddrinfo(found);
  Descriptor made(socket(family, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!made.valid() || connect(made.get(), reinterpret_cast<const sockaddr*>(&peer.socket_address),
                               peer.size) != 0) {
    return SystemError(ToText(address));
  }
  return std::pair(peer, std::move(made));
}

size_t RobotsOf(const lab::LabScenario& scenario) {
  size_t robots = 0;
  for (const lab::RobotGroup& group : scenario.world.groups) {
    robots += group.starts.size();
  }
  return robots;
}

}  // namespace

std::string ToText(const DaemonAddress& address) {
  const bool is_v6 = address.host.find(':') != std::string::npos;
  return fmt::format("{}:{}", is_v6 ? '[' + address.host + ']' : address.host, address.port);
}

Result<std::vector<DaemonAddress>> ParseAddresses(std::span<const std::string> texts) {
  std::vector<DaemonAddress> addresses;
  for (const std::string& text : texts) {
    const size_t colon = text.rfind(':');
    std::string host = text.substr(0, colon);
    const bool bracketed = host.size() > 2 && host.front() == '[' && host.back() == ']';
    if (colon == std::string::npos || host.empty() ||
        (!bracketed && host.find_first_of(":/") != std::string::npos)) {
      return Error{"--daemon " + text +
                   ": expected HOST:PORT or HOST:FIRST-LAST, an IPv6 address in brackets"};
    }
    const std::string_view ports = std::string_view(text).substr(colon + 1);
    const size_t dash = ports.find('-');
    const auto first = PortOf(ports.substr(0, dash));
    const auto last = dash == std::string_view::npos ? first : PortOf(ports.substr(dash + 1));
    if (!first || !last || *last < *first) {
      return Error{fmt::format(
          "--daemon {}: found ports \"{}\", expected one from 1 to 65535, or two as 5001-5040",
          text, ports)};
    }
    if (bracketed) {
      host = host.substr(1, host.size() - 2);
    }
    for (uint32_t port = *first; port <= *last; ++port) {
      addresses.push_back({host, static_cast<uint16_t>(port)});
    }
  }
  return addresses;
}

std::string DaemonConfig(const config::Value& tree, std::span<const DaemonAddress> addresses,
                         const std::string& keys_file) {
  config::Value keys;
  keys.kind = config::Value::Kind::kString;
  keys.text = keys_file;
  std::string text = lab::TomlOfTables(tree, kTables) + kDashboard;
  for (size_t i = 0; i < addresses.size(); ++i) {
    text += fmt::format("\n[[link]]\nname = \"lab-{}\"\nkind = \"udp\"\nlisten = \"{}\"\n", i + 1,
                        ToText(addresses[i]));
    if (!keys_file.empty()) {
      text += fmt::format("security = \"require\"\nkeys = {}\n", lab::TomlOf(keys));
    }
  }
  return text;
}

Status CheckRoom(const lab::LabScenario& scenario, size_t links) {
  const size_t robots = RobotsOf(scenario);
  if (const size_t needed = (robots - 1) / lab::kMaxRobotsOfLink + 1; links < needed) {
    return Error{
        fmt::format("--daemon: found {} link{}, expected {} or more for {} robots, {} on each",
                    links, links == 1 ? "" : "s", needed, robots, lab::kMaxRobotsOfLink)};
  }
  return Ok();
}

DaemonLinks::DaemonLinks(const lab::LabScenario& scenario)
    : field_(scenario.world.field),
      pose_unit_10um_(scenario.world.pose_unit_10um),
      step_ns_(scenario.world.step_ms * kNsOfMs),
      heard_(RobotsOf(scenario)) {
  for (const lab::RobotGroup& group : scenario.world.groups) {
    types_ = static_cast<uint16_t>(types_ | 1u << group.senses.front());
  }
}

Result<std::shared_ptr<DaemonLinks>> DaemonLinks::Open(std::span<const DaemonAddress> addresses,
                                                       const lab::LabScenario& scenario,
                                                       const std::string& keys_file) {
  std::shared_ptr<DaemonLinks> daemon(new DaemonLinks(scenario));
  const size_t robots = daemon->heard_.size();
  PHEROMONE_TRY_STATUS(CheckRoom(scenario, addresses.size()));
  daemon->robots_of_link_ = (robots - 1) / addresses.size() + 1;
  const size_t used = (robots - 1) / daemon->robots_of_link_ + 1;
  for (const DaemonAddress& address : addresses.first(used)) {
    PHEROMONE_TRY(auto connected, Connect(address));
    daemon->links_.push_back(
        {ToText(address), connected.first, std::move(connected.second), false});
  }
  if (!keys_file.empty()) {
    std::set<uint8_t> ids;
    for (size_t i = 0; i < std::min(robots, daemon->robots_of_link_); ++i) {
      ids.insert(static_cast<uint8_t>(1 + i));
    }
    Result<keys::RobotsKeys> taken = keys::TakeKeys(keys_file, ids, static_cast<uint16_t>(used));
    if (!taken.ok()) {
      return Error{"--keys: " + taken.error()};
    }
    daemon->keys_ = std::move(taken).value();
  }
  return daemon;
}

lab::RobotSigning DaemonLinks::signing(size_t robot) const {
  if (!is_signed()) {
    return {};
  }
  const auto id = static_cast<uint8_t>(1 + robot % robots_of_link_);
  return {keys_.keys.at(id).data(),
          static_cast<uint16_t>(keys_.first_start + robot / robots_of_link_)};
}

Status DaemonLinks::Exchange(int64_t now_ms, std::span<const lab::RobotMessage> sent,
                             std::vector<lab::RobotMessage>* received) {
  if (start_ns_ < 0) {
    begin_ns_ = MonotonicNs();
    start_ns_ = begin_ns_ - now_ms * kNsOfMs;
  }
  robots_ns_ = now_ms * kNsOfMs + step_ns_;
  const int64_t end_ns = begin_ns_ + step_ns_;
  for (size_t i = 0; i < sent.size();) {
    const size_t link = sent[i].robot / robots_of_link_;
    size_t end = i;
    while (end < sent.size() && sent[end].robot / robots_of_link_ == link) {
      ++end;
    }
    PHEROMONE_TRY_STATUS(Send(link, sent.subspan(i, end - i)));
    i = end;
  }
  std::vector<pollfd> sockets;
  for (const Link& link : links_) {
    sockets.push_back({link.socket.get(), POLLIN, 0});
  }
  int64_t left_ns = 0;
  do {
    left_ns = std::max<int64_t>(end_ns - MonotonicNs(), 0);
    const timespec timeout = {left_ns / 1'000'000'000, left_ns % 1'000'000'000};
    if (ppoll(sockets.data(), sockets.size(), &timeout, nullptr) <= 0) {
      continue;
    }
    for (size_t link = 0; link < links_.size(); ++link) {
      if (sockets[link].revents != 0) {
        PHEROMONE_TRY_STATUS(Receive(link, received));
      }
    }
  } while (left_ns > 0);
  begin_ns_ = std::max(end_ns, MonotonicNs() - step_ns_ / 2);
  return Ok();
}

Status DaemonLinks::Send(size_t link, std::span<const lab::RobotMessage> messages) {
  for (const lab::RobotMessage& message : messages) {
    if (writer_.full()) {
      PHEROMONE_TRY_STATUS(Flush(&links_[link]));
    }
    writer_.Add(message.message, links_[link].peer);
  }
  return Flush(&links_[link]);
}

// What cannot be sent is lost, as on the air; but for who was never there.
Status DaemonLinks::Flush(Link* link) {
  if (writer_.Flush(link->socket.get()).undeliverable != 0 && !link->heard) {
    return Error{link->address +
                 ": nothing listens there, expected a link of kind \"udp\" of pheromoned"};
  }
  return Ok();
}

Status DaemonLinks::Receive(size_t link, std::vector<lab::RobotMessage>* received) {
  Link& from = links_[link];
  const size_t first = link * robots_of_link_;
  const size_t end = std::min(first + robots_of_link_, heard_.size());
  Status status = Ok();
  int count = links::kDatagramBatch;
  while (count == links::kDatagramBatch && status.ok()) {
    count = reader_.Receive(from.socket.get());
    if (count < 0 && errno == ECONNREFUSED && !from.heard) {
      return Error{from.address +
                   ": nothing listens there, expected a link of kind \"udp\" of pheromoned"};
    }
    for (int i = 0; i < count; ++i) {
      const std::span<const uint8_t> bytes = reader_.at(i).bytes;
      protocol::FrameDecoder decoder(protocol::kNoGapTimeout);
      decoder.PushBlock(bytes.data(), bytes.size(), 0, [&](const protocol::Message& message) {
        from.heard = true;
        if (status.ok()) {
          status = Check(from, message);
        }
        if (message.id == 0) {
          return;  // nobody's
        }
        const bool to_all = message.id == protocol::kBroadcastId;
        for (size_t robot = to_all ? first : first + message.id - 1u;
             robot < (to_all ? end : std::min(first + message.id, end)); ++robot) {
          heard_[robot] = 1;
          received->push_back({robot, message});
        }
      });
    }
  }
  return status;
}

Status DaemonLinks::Check(const Link& link, const protocol::Message& received) const {
  const auto differs = [&](const std::string& found, const std::string& expected) {
    return Error{
        fmt::format("{}: the daemon has {}, expected {} as the scenario has: pheromone-swarm "
                    "lab config prints its configuration",
                    link.address, found, expected)};
  };
  protocol::ErrorAnswer error;
  if (is_signed() && Decode(received, &error)) {
    return Error{link.address +
                 ": the daemon does not sign, expected security = \"require\": pheromone-swarm "
                 "lab config --keys prints its configuration"};
  }
  const protocol::Message message = is_signed() ? protocol::WithoutSignature(received) : received;
  if (Decode(message, &error) && error.reason == protocol::Reason::kOffTheMap) {
    return differs("another map, on which a robot is off it", "the map");
  }
  protocol::HelloAnswer hello;
  if (!Decode(message, &hello)) {
    return Ok();
  }
  if (hello.pose_unit_10um != pose_unit_10um_) {
    return differs(fmt::format("a pose unit of {} um", hello.pose_unit_10um * 10),
                   fmt::format("{} um", pose_unit_10um_ * 10));
  }
  if (const auto mm = field::RoundDiv(field_.antennas.distance_um, 1000);
      hello.antenna_distance_mm != mm) {
    return differs(fmt::format("antennas {} mm apart", hello.antenna_distance_mm),
                   fmt::format("{} mm", mm));
  }
  for (unsigned type = 1; type < 16; ++type) {
    if ((types_ >> type & 1) != 0 && (hello.type_mask >> type & 1) == 0) {
      return differs(fmt::format("no pheromone of type {}", type), "one that robots follow,");
    }
  }
  return Ok();
}

double DaemonLinks::lag_s() const {
  return static_cast<double>(std::max<int64_t>(MonotonicNs() - start_ns_ - robots_ns_, 0)) / 1e9;
}

Status DaemonLinks::CheckAnswers() const {
  const auto silent = std::find(heard_.begin(), heard_.end(), 0);
  if (silent == heard_.end()) {
    return Ok();
  }
  const auto robot = static_cast<size_t>(silent - heard_.begin());
  return Error{fmt::format("{} of {} robots received no answer, the first of them robot {} on {}",
                           std::count(heard_.begin(), heard_.end(), 0), heard_.size(), robot + 1,
                           links_[robot / robots_of_link_].address)};
}

}  // namespace pheromone::swarm
