// Viewers of the stream while robots are served.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <string>

namespace pheromone::bench {

/// A process with `count` viewers on the server's Unix socket in `folder`, which subscribe to every
/// channel and read what they are sent, except for the first `deaf` of them, which read nothing
/// after that; who is disconnected connects again. It gets what of the processors nobody else
/// wants, as viewers are on other machines. Ends with its owner.
class StreamViewers {
 public:
  StreamViewers(const std::string& folder, int count, int deaf);
  StreamViewers(const StreamViewers&) = delete;
  StreamViewers& operator=(const StreamViewers&) = delete;
  ~StreamViewers();

  /// Waits until they are connected, and a second more: the first pictures are whole.
  void AwaitFirst() const;

  struct Counts {
    std::atomic<uint64_t> bytes{0};
    std::atomic<uint64_t> connections{0};
  };
  /// Up to now, of all of them.
  const Counts& counts() const { return *counts_; }

 private:
  const int count_;
  Counts* counts_ = nullptr;  // shared with the process
  pid_t process_ = -1;
};

}  // namespace pheromone::bench
