// A simulated Pioneer's port, for any ARCOS client: a pseudo-terminal that stands in for the serial
// line, or a TCP port as MobileSim's.
//
//   PioneerServer server(&robot);
//   if (const std::string error = server.ServePty("pioneer.pty"); !error.empty()) { ... }
//   while (!stop) {
//     server.Step(now_ns);                  // what has come in, what has become due
//     server.Wait(10);                      // until something comes, at most 10 ms
//   }
//
// A pty's symbolic link is removed at the end. TCP listens on 127.0.0.1 and serves one client; the
// connections of others are closed, and its own by CLOSE, as MobileSim does. A client whose
// connection ends, or who closes the pty, as one that was killed does, has hung up: that ends the
// session. Only if the next one has opened the pty before that is noticed does it find the old
// session, as on a serial line.
//
// Bytes move as fast as the system moves them: no baud rate is modelled. Errors are messages, empty
// if there is none. Blocks only in Wait. One thread.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client_fw/sim/pioneer/pioneer_robot.h"

namespace pheromone::sim {

class PioneerServer {
 public:
  /// `robot` must outlive the server. Its time is that of Step.
  explicit PioneerServer(PioneerRobot* robot) : robot_(robot) {}
  ~PioneerServer();
  PioneerServer(const PioneerServer&) = delete;
  PioneerServer& operator=(const PioneerServer&) = delete;

  /// Serve one of them, once. `link` becomes a symbolic link to the terminal that clients open; it
  /// replaces a link to a terminal and nothing else. Port 0: any that is free.
  std::string ServePty(const std::string& link);
  std::string ServeTcp(uint16_t port);

  void Step(int64_t now_ns);
  void Wait(int timeout_ms) const;

  /// Where clients find the robot: the link, or 127.0.0.1:8101.
  const std::string& address() const { return address_; }
  bool connected() const { return connected_; }

 private:
  void Accept();
  void Read(int64_t now_ns);
  void Write();
  void Disconnect();

  PioneerRobot* robot_;
  std::string address_;
  std::string link_;    // of a pty
  std::string target_;  // of the link
  int listener_ = -1;   // of TCP
  int line_ = -1;       // the pty's master, or the connection
  bool connected_ = false;
  std::vector<uint8_t> unsent_;
};

}  // namespace pheromone::sim
