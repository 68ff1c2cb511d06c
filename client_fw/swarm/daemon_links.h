// A running pheromoned as the server of the lab's robots: their messages go over UDP to its links
// of kind "udp", in real time. Robots of one link share a socket; the CLIENT_ID tells whose an
// answer is.
//
//   Result<std::vector<DaemonAddress>> addresses = ParseAddresses({"127.0.0.1:5001-5040"});
//   auto daemon = DaemonLinks::Open(addresses.value(), scenario);    // level "firmware"
//   RunLab(scenario, 1, {}, daemon.value());
//   daemon.value()->lag_s();
//
// A step ends when its time is over: Exchange receives until then. If steps take longer, the
// robots' time lags. None is left out, and none is shorter than half its time, in which the daemon
// has to answer. One thread.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "client_fw/keys/robots_keys.h"
#include "client_fw/lab/firmware/server.h"
#include "client_fw/lab/scenario/scenario.h"
#include "server/base/descriptor.h"
#include "server/base/result.h"
#include "server/robots/links/datagrams.h"

namespace pheromone::swarm {

struct DaemonAddress {
  std::string host;  ///< a name or an address, without brackets
  uint16_t port = 0;
};
/// HOST:PORT; an IPv6 address in brackets.
std::string ToText(const DaemonAddress& address);

/// Of texts HOST:PORT and HOST:FIRST-LAST, an address for each port. Errors name the text.
Result<std::vector<DaemonAddress>> ParseAddresses(std::span<const std::string> texts);

/// A configuration of pheromoned for a scenario: the tables that it has in common with it, the
/// dashboard, and its links at these addresses. `tree` is the scenario's. The links require signing
/// with the keys in `keys_file`, unless that is empty.
std::string DaemonConfig(const config::Value& tree, std::span<const DaemonAddress> addresses,
                         const std::string& keys_file = "");

/// Errors: links for fewer robots.
Status CheckRoom(const lab::LabScenario& scenario, size_t links);

class DaemonLinks final : public lab::Server {
 public:
  /// Robots are spread evenly over the links. They sign with the keys of their IDs in `keys_file`,
  /// unless that is empty; a start is counted for each link, since all use the same keys. Errors:
  /// too few links, an unknown host, those of keys::TakeKeys.
  static Result<std::shared_ptr<DaemonLinks>> Open(std::span<const DaemonAddress> addresses,
                                                   const lab::LabScenario& scenario,
                                                   const std::string& keys_file = "");

  size_t robots_of_link() const override { return robots_of_link_; }
  lab::RobotSigning signing(size_t robot) const override;
  /// Errors: nothing listens there; of the daemon's configuration, what HELLO's answers or a
  /// refusal show to be another one than the scenario's.
  Status Exchange(int64_t now_ms, std::span<const lab::RobotMessage> sent,
                  std::vector<lab::RobotMessage>* received) override;

  /// By how much the robots' time is behind real time.
  double lag_s() const;
  /// Errors: a robot that was sent nothing.
  Status CheckAnswers() const;

 private:
  struct Link {
    std::string address;
    links::PeerAddress peer;
    Descriptor socket;
    bool heard = false;
  };

  explicit DaemonLinks(const lab::LabScenario& scenario);
  Status Send(size_t link, std::span<const lab::RobotMessage> messages);
  Status Flush(Link* link);
  Status Receive(size_t link, std::vector<lab::RobotMessage>* received);
  Status Check(const Link& link, const protocol::Message& received) const;
  bool is_signed() const { return !keys_.keys.empty(); }

  const field::FieldConfig& field_;
  const uint16_t pose_unit_10um_;
  const int64_t step_ns_;
  uint16_t types_ = 0;  // that robots follow, bit by bit
  size_t robots_of_link_ = 1;
  std::vector<Link> links_;
  keys::RobotsKeys keys_;
  std::vector<uint8_t> heard_;  // a robot: something was sent to it
  links::DatagramReader reader_;
  links::DatagramWriter writer_;
  int64_t start_ns_ = -1;
  int64_t begin_ns_ = 0;   // of the step
  int64_t robots_ns_ = 0;  // the robots' time at its end
};

}  // namespace pheromone::swarm
