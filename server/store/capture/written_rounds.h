// What the ROUNDs on the wire answer. The engine gives messages, and the link puts the intensities
// or the reason of each into the next ROUND: such an answer names neither robot nor request. This
// class knows the robots by the turns of the ROUND before.
//
//   WrittenRounds rounds;
//   for (const WrittenRounds::Answer& missing : rounds.Take(link, connection, round, &in_flight)) {
//     ...                                   // the engine did not give that
//   }
//
// The recorder and replay each have one, which knows nothing when a file begins: the first ROUND of
// a connection in a file answers robots that are not known. They then take the same message for
// each answer: the first that fits of any robot of the link, in the order of InFlight. Not
// thread-safe.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "protocol/messages.h"
#include "server/store/capture/in_flight.h"

namespace pheromone::capture {

/// Of a ROUND that may be signed.
bool DecodeRound(const protocol::Message& message, protocol::Round* round);

class WrittenRounds {
 public:
  struct Answer {
    uint8_t id = 0;  ///< 0: nobody had that turn
    protocol::RoundAnswer values;
  };

  /// Takes a message from `in_flight` for each answer of `round` that has intensities or a reason.
  /// Returns the others, but not those of unknown robots, which may be from before the recording.
  std::vector<Answer> Take(engine::LinkIndex link, uint32_t connection,
                           const protocol::Round& round, InFlight* in_flight);
  /// Whether there was a ROUND of that connection, so that it is known whom the next one answers.
  bool Knows(engine::LinkIndex link, uint32_t connection) const;
  /// How many messages were taken.
  uint64_t taken() const { return taken_; }

  /// A message to that robot for which `answer` can stand; it need not be the one that was given.
  static protocol::Message MessageOf(const Answer& answer);

 private:
  struct Turns {
    uint32_t connection = 0;
    std::vector<uint8_t> ids;
  };

  std::map<engine::LinkIndex, Turns> turns_;  // of the last ROUND of each
  uint64_t taken_ = 0;
};

}  // namespace pheromone::capture
