// The messages in flight: given by the engine and not yet seen on the wire. The recorder uses it to
// record, at the end of a file, what is left; replay uses it to know what to expect.
//
//   in_flight.Add(link, answer);
//   if (!in_flight.Take(link, written)) ...   // the engine did not give that
//
// The link decides the order in which messages are sent: a message that waits for a durable change
// may be overtaken, and so may a command that waits for a free line. So messages can be taken in
// any order, each once. A broadcast may be written once per connection or not at all, and therefore
// stays.
//
// At most kMax messages are kept for a robot; then the oldest is forgotten. Not thread-safe.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <utility>
#include <vector>

#include "protocol/messages.h"
#include "server/store/capture/record.h"

namespace pheromone::capture {

bool Same(const protocol::Message& a, const protocol::Message& b);

class InFlight {
 public:
  static constexpr size_t kMax = 256;

  void Add(const Sent& sent);

  /// False if the message is not in flight, signed or not. The answer to a first HELLO never is:
  /// the link gives it.
  bool Take(const Sent& sent);

  /// Takes the oldest answer to robot `id` for which `answer` in a ROUND can stand: to SENSE or
  /// TRACE with these intensities, or an ERROR with this reason. `id` 0: to any robot, the lowest
  /// ID first. False if there is none.
  bool TakeFor(engine::LinkIndex link, uint8_t id, const protocol::RoundAnswer& answer);

  /// Whether it is what was taken last of this robot's messages. In bad air the link sends such a
  /// message once more (protocol/README.md, section 9).
  bool WasLast(const Sent& sent) const;

  /// The number of copies in flight.
  size_t Count(const Sent& sent) const;

  /// The oldest message in flight for this robot; null if there is none.
  const protocol::Message* First(engine::LinkIndex link, uint8_t id) const;

  /// All messages, sorted by link, robot and age.
  std::vector<Sent> All() const;

  /// Without broadcasts.
  size_t size() const;

 private:
  bool TakeExactly(const Sent& sent);

  std::map<std::pair<engine::LinkIndex, uint8_t>, std::deque<protocol::Message>> waiting_;
  std::map<std::pair<engine::LinkIndex, uint8_t>, protocol::Message> last_;  // that were taken
};

}  // namespace pheromone::capture
