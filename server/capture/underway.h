// The messages that the engine gave and that were not yet seen on the wire. The recorder keeps one
// to be able to say, at the end of a file, what was left; replay keeps one to know what to expect.
//
//   underway.Add(link, answer);
//   if (!underway.Take(link, written)) ...   // nobody gave that
//
// The order in which messages leave is the link's business: what waits for a durable change is
// overtaken, and so is a command that waits for silence. So a message may be taken whenever it is
// there, and each once. A message to all robots may be written once per connection, or not at all;
// it stays.
//
// At most kMost messages are kept for a robot; then the oldest is forgotten. Not thread-safe.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <utility>
#include <vector>

#include "server/capture/record.h"

namespace pheromone::capture {

bool Same(const protocol::Message& a, const protocol::Message& b);

class Underway {
 public:
  static constexpr size_t kMost = 256;

  void Add(const Sent& sent);

  /// False if it is not there.
  bool Take(const Sent& sent);

  /// How many of them are there.
  size_t Count(const Sent& sent) const;

  /// What has waited for longest, of what is for this robot; null if nothing is.
  const protocol::Message* First(engine::LinkIndex link, uint8_t id) const;

  /// All of it, by link, robot and age.
  std::vector<Sent> All() const;

  /// Without the messages to all robots.
  size_t size() const;

 private:
  std::map<std::pair<engine::LinkIndex, uint8_t>, std::deque<protocol::Message>> waiting_;
};

}  // namespace pheromone::capture
