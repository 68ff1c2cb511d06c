// Rounds: the server tells the robots of a half-duplex channel whose turn it is, and answers a
// whole round with one frame (protocol/README.md, "Rounds").
//
//   Rounds rounds(options);
//   rounds.OnHeard(message, at, since);                // everything that was received
//   if (!rounds.TakeAnswer(answer, asked_at)) ...      // it goes out by itself
//   if (rounds.NextRound() <= now) Send(rounds.Compose(now)), rounds.OnSent(end);
//
// A robot joins by a HELLO that tells how often it wants a turn. Robots are given turns in the
// order in which they are due, so that a parked robot does not cost what a fast one does. One that
// misses more turns than the air explains is asked less and less often, after half a minute no
// more. In bad air ROUNDs are coded (air_quality.h); an answer whose ROUND its robot seems to have
// missed is said again.
//
// After its turns, a round may be open, for those who have none (openings.h).
//
// No I/O, no clock. Not thread-safe.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "protocol/messages.h"
#include "server/robots/radio/air_quality.h"
#include "server/robots/radio/channel_options.h"
#include "server/robots/radio/openings.h"
#include "server/robots/radio/timing.h"

namespace pheromone::radio {

constexpr Time kNever = Time::max();

/// The unit of the period in HELLO.
constexpr std::chrono::milliseconds kPeriodUnit{protocol::kRoundPeriodMs};

/// For how long a robot awaits a ROUND.
constexpr std::chrono::milliseconds kAwaitedRound{2000};

struct RoundCounters {
  uint64_t rounds = 0;      ///< ROUNDs composed
  uint64_t coded = 0;       ///< of these: against damaged bytes
  uint64_t turns = 0;       ///< given
  uint64_t missed = 0;      ///< of these: nothing was heard
  uint64_t unanswered = 0;  ///< of these: heard, but the answer came too late for the ROUND

  bool operator==(const RoundCounters&) const = default;
};

/// How a ROUND has an answer: the intensities for SENSE or TRACE, the reason of an ERROR; nothing
/// for others, which are frames of their own.
std::optional<protocol::RoundAnswer> InRound(const protocol::Message& answer);

class Rounds {
 public:
  explicit Rounds(const ChannelOptions& options)
      : options_(options),
        signed_(options.signing != nullptr),
        openings_(options_, ExchangeTime()) {}

  /// Goes on with the rounds of a server that has fallen silent, before anything was heard here:
  /// the first ROUND, without answers, is due at once. For as long as a robot may still await one
  /// of the other server, whose numbers may be the same, answers are frames of their own.
  void Resume(const std::vector<RoundMember>& members, Time now);

  /// A message was read whole at `at`; its last byte arrived after `since`.
  void OnHeard(const protocol::Message& message, Time at, Time since);
  /// Something was heard, whole or not; `damaged`: a frame that was not whole ended.
  void OnBytes(Time at, bool damaged);
  /// An answer to a request outside of turns leaves until `end`.
  void OnAnswered(Time end);

  /// True if `answer`, to what was heard at `asked_at`, goes out with the next ROUND.
  bool TakeAnswer(const protocol::Message& answer, Time asked_at);

  /// Forgets the answers that it has taken and not composed; returns them.
  std::vector<protocol::Message> DropAnswers();

  /// Whether robots are given turns: from when there are two until there is none.
  bool active() const { return active_; }
  bool serves(uint8_t id) const { return robots_.contains(id); }

  /// The time before which only those with a turn may send, the server included.
  Time reserved_until() const { return turns_end_; }
  /// Whether the next ROUND follows the present one, without waiting for a free channel.
  bool follows() const { return !turns_.empty() || openings_.open(); }
  /// When the next ROUND is due; kNever if none is.
  Time NextRound() const;
  /// What is sent as one transmission.
  struct Composed {
    std::vector<protocol::Message> again;     ///< that the last ROUND had; once, before the others
    std::vector<protocol::Message> answers;   ///< that are not two intensities; before the ROUND
    std::vector<protocol::Message> in_round;  ///< that the ROUND has
    protocol::Message round;
  };
  /// `acks`: robots that are sent a COMMAND before it, and need a turn for the ACK; fewer than
  /// kMaxTurns.
  Composed Compose(Time now, const std::vector<uint8_t>& acks);
  /// Whether the ROUND that was composed last is to be coded.
  bool coded() const { return form_ == RoundForm::kCoded; }
  /// The last bit of what was composed leaves at `end`.
  void OnSent(Time end);

  const RoundCounters& counters() const { return counters_; }

 private:
  struct Robot {
    Duration period{};
    Time due{};
    Time heard{};
    int misses = 0;       ///< turns in succession in which nothing was heard
    bool greets = false;  ///< nothing but HELLO was heard: it may have missed the answer
    Reception reception;
    std::array<int, 2> unused{};  ///< turns not used since it was heard, by the ROUNDs' form
    size_t frame_bytes = 0;       ///< its longest frame lately; 0: unknown
    int shorter = 0;              ///< how many since were shorter
    size_t more_bytes = 0;        ///< what it may have lacked in the turns that it missed
    int late = 0;                 ///< requests in time until its answers count as in time
  };
  struct Turn {
    uint8_t id = 0;
    bool for_ack = false;
    std::optional<Time> heard{};
    bool damaged = false;     ///< something was, but not whole
    bool answerable = false;  ///< what was heard gets an answer
    bool told = false;        ///< it was an EVENT: the robot still has nothing to steer by
    std::optional<protocol::Message> answer{};
  };

  void Join(uint8_t id, Time now);
  void OnDamage(Time at);
  void CountUnused(Robot* robot);
  void CountHeard(Robot* robot, bool damaged);
  void CountMissed(Robot* robot, Time now);
  Duration Interval(const Robot& robot) const;
  bool AreOfOnePeriod() const;
  void CountTurns(Time now);
  static void CountLate(const Turn& turn, Robot* robot);
  std::vector<uint8_t> Choose(Time now, size_t most);
  size_t GiveTurns(Time now, std::vector<uint8_t> acks);
  uint8_t NextNumber();
  void Repeat(Composed* composed);
  bool IsForOneThatMisses() const;
  Time FirstDue() const;
  Time EndOf(size_t turns) const;
  Time LastHeard() const;
  bool in_bad_air() const;
  Duration ExchangeTime() const;
  Duration TurnTime(size_t bytes) const;
  size_t MostBytes() const;
  size_t LeastBytes() const;
  size_t MostTurns() const;
  size_t RoundsForAll() const;

  const ChannelOptions options_;
  const bool signed_;
  Openings openings_;
  std::map<uint8_t, Robot> robots_;
  std::array<uint8_t, 256> wished_{};    // periods in the last HELLO of each
  std::vector<Turn> turns_;              // of the round in progress
  std::vector<protocol::Message> told_;  // the answers of intensities in its ROUND
  bool active_ = false;
  Time addressed_until_ = Time::min();  // answers are not in the ROUND
  std::optional<Time> begin_;  // of the first ROUND at the earliest; empty: there was no HELLO
  uint32_t order_ = 1;         // a linear congruential generator
  uint8_t number_ = 0;         // of the last ROUND
  AirQuality air_;
  RoundForm form_ = RoundForm::kPlain;  // of the last ROUND
  double damaged_ = 0;                  // the share of requests, of those that are heard
  Time damaged_at_ = Time::min();       // the last turn in which something was not whole
  size_t turn_bytes_ = 0;               // the longest frame that fits
  Duration turn_{};
  Time begun_at_{};
  Time sent_at_{};
  Time turns_end_ = Time::min();
  RoundCounters counters_;
};

}  // namespace pheromone::radio
