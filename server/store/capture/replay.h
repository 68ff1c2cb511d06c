// Replays a capture in an engine of its own and compares the results: the messages decoded from the
// bytes, the engine's changes, and every answer, byte for byte, with the bytes written to the
// robots, or with its place in a ROUND; at the end the state hash.
//
//   Replay replay;
//   for (each record of the file) {
//     if (!replay.Take(found).ok()) break;
//   }
//   Status same = replay.Finish();
//   replay.report() ...
//
// Each file is self-contained: use one Replay per file. All times come from the file. Not
// thread-safe.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocol/decoder.h"
#include "server/base/result.h"
#include "server/core/engine/engine.h"
#include "server/store/capture/in_flight.h"
#include "server/store/capture/reader.h"
#include "server/store/capture/written_rounds.h"

namespace pheromone::capture {

/// What was replayed and found identical.
struct ReplayReport {
  uint64_t packets = 0;
  uint64_t messages = 0;  ///< from robots, passed to the engine
  uint64_t events = 0;    ///< that did not come from robots
  uint64_t answers = 0;   ///< messages written to robots, as frames or in a ROUND
  uint64_t answer_bytes = 0;
  uint64_t said_again = 0;   ///< in bad air; not counted as answers
  uint64_t dropped = 0;      ///< given, but never written, as recorded
  uint64_t from_before = 0;  ///< written, but given before the recording began
  uint64_t under_way = 0;    ///< in flight at the end
  uint64_t field_time_ms = 0;
  std::optional<uint64_t> state_hash;  ///< of the final state, once compared
};

class Replay {
 public:
  /// Called with each message that the engine gives, in order.
  using OnAnswer = std::function<void(uint64_t field_time_ms, const Sent& sent)>;

  explicit Replay(OnAnswer on_answer = nullptr) : on_answer_(std::move(on_answer)) {}

  /// Replays a record. An error is the first difference, or the reason why replay cannot continue,
  /// with record, packet, time, link, and the expected and actual values. Not to be called after an
  /// error.
  Status Take(const Found& found);

  /// Called after the last record. Error: the file has no end record, so its final state is
  /// unknown.
  Status Finish() const;

  const ReplayReport& report() const { return report_; }
  const Start& start() const { return start_; }
  /// Null before the initial state is whole.
  const engine::Engine* engine() const { return engine_ ? &*engine_ : nullptr; }

 private:
  // Empty if all is well.
  std::string On(const Start& start);
  std::string On(const State& portion);
  std::string On(const Packet& packet);
  std::string On(const PartialFrame& partial);
  std::string On(const Batch& batch);
  std::string On(const EventApplied& applied);
  std::string On(const Rejected& turned);
  std::string On(const Dropped& dropped);
  std::string On(const FromBefore& before);
  std::string On(const Unlogged& unlogged);
  std::string On(const Gap& gap);
  std::string On(const End& end);

  std::string TakeWritten(const Packet& packet);
  std::string TakeMessage(const Packet& packet, const protocol::Message& message,
                          bool turns_are_known);
  std::string TakeRound(const Packet& packet, const protocol::Round& round);
  std::string Expected(engine::LinkIndex link, uint8_t id) const;
  std::string TakeOne(const Batch& batch, const Handled& handled);
  void Give(size_t from);
  protocol::FrameDecoder& DecoderOf(engine::LinkIndex link, uint32_t connection);
  std::string LinkName(engine::LinkIndex link) const;

  const OnAnswer on_answer_;
  Start start_;
  std::string state_;  // until it is whole
  std::optional<engine::Engine> engine_;
  std::map<std::pair<engine::LinkIndex, uint32_t>, protocol::FrameDecoder> decoders_;
  std::map<engine::LinkIndex, std::deque<protocol::Message>> decoded_;  // and not yet handed over
  InFlight in_flight_;
  WrittenRounds rounds_;
  std::vector<engine::Outgoing> out_;
  uint64_t time_ns_ = 0;
  uint64_t batch_ = 0;
  uint64_t field_time_ms_ = 0;
  bool ended_ = false;
  ReplayReport report_;
};

}  // namespace pheromone::capture
