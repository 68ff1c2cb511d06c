// A pheromoned for exchange_bench, and the bare echo with which it is compared.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace pheromone::bench {

/// Variables, beside those of this process.
using Environment = std::map<std::string, std::string>;

/// A running pheromoned; ends with its owner.
class ServerProcess {
 public:
  /// Starts `program` in `folder` and waits until its links are up. Ends this process if it fails.
  ServerProcess(const std::string& program, const std::string& config_file,
                const std::vector<std::string>& arguments, const std::string& folder,
                const Environment& environment = {});
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;
  ~ServerProcess();

  /// The UDP port of the link of this name; 0 if there is none.
  uint16_t PortOf(const std::string& link) const;

  /// Kills it at once, if it does not end by itself.
  void Kill();

  pid_t pid() const { return process_; }
  /// Resident memory.
  long rss_kib() const;

 private:
  void AwaitReady(const std::string& log_file);

  pid_t process_ = -1;
  std::map<std::string, uint16_t> ports_;
};

/// A process that sends every datagram back, with recvmmsg and sendmmsg and nothing in between:
/// what the same sockets carry without an engine. Ends with its owner.
class EchoProcess {
 public:
  EchoProcess();
  EchoProcess(const EchoProcess&) = delete;
  EchoProcess& operator=(const EchoProcess&) = delete;
  ~EchoProcess();

  uint16_t port() const { return port_; }

 private:
  pid_t process_ = -1;
  uint16_t port_ = 0;
};

}  // namespace pheromone::bench
