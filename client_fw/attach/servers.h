// The way to the server, or to several servers of a cluster: a Connection to one of them at a time,
// and to the next when ServerChoice says so (protocol/README.md, section 8, "Several servers").
//
//   Servers servers(addresses, id);                     // checked by CheckServers
//   for (;;) {
//     servers.Advance(now_ms);
//     for (auto bytes = servers.Read(now_ms); !bytes.empty(); bytes = servers.Read(now_ms)) ...
//     servers.Choose(now_ms);
//     if (servers.TakeNewEpoch()) robot.GreetAgain();
//     servers.Write(frame, now_ms);                     // a whole frame of the client
//     ... poll(servers.connection().descriptor(), servers.connection().poll_events()) ...
//   }
//
// With one address it is that Connection, which tries again by itself. One thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "client_fw/attach/address.h"
#include "client_fw/attach/connection.h"
#include "client_fw/boards/host/server_choice.h"
#include "server/base/result.h"

namespace pheromone::attach {

/// Errors: none at all; of several, one that is neither UDP nor TCP, or UDP beside TCP: a robot is
/// the same one only on links of one name, and so of one kind.
Status CheckServers(const std::vector<Address>& addresses);

class Servers {
 public:
  /// `id`: the client's CLIENT_ID.
  Servers(std::vector<Address> addresses, uint8_t id);

  void Advance(int64_t now_ms);
  /// Valid until the next call; empty if nothing is left.
  std::span<const uint8_t> Read(int64_t now_ms);
  /// Goes on to the next server if that is due. After reading: what has come while this program was
  /// held up is no missing answer.
  void Choose(int64_t now_ms);
  void Write(std::span<const uint8_t> frame, int64_t now_ms);
  /// True, once: the server has another state than the one before, and does not know the robot.
  bool TakeNewEpoch() { return choice_.TakeNewEpoch(); }

  const Connection& connection() const { return connection_; }
  /// Since a server was heard, and in all.
  size_t moves() const { return choice_.moves(); }
  uint64_t all_moves() const { return all_moves_; }
  /// Nothing was heard since each of them has been tried.
  bool all_silent() const { return moves() >= addresses_.size(); }
  /// The server of before the last move, and what was wrong with it.
  const std::string& left() const { return left_; }

 private:
  std::vector<Address> addresses_;
  client::ServerChoice choice_;
  Connection connection_;
  uint64_t refusals_ = 0;
  uint64_t openings_ = 0;
  uint64_t all_moves_ = 0;
  std::string left_;
};

}  // namespace pheromone::attach
