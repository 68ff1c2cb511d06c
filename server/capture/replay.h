// Lets happen again what a capture recorded, in an engine of its own, and compares: what the
// decoder makes of the bytes, what the engine makes of the messages, and every answer, byte for
// byte, with what was written to the robots; at the end the hash of the state.
//
//   Replay replay;
//   for (each record of the file) {
//     if (!replay.Take(found).ok()) break;
//   }
//   Status same = replay.Finish();
//   replay.report() ...
//
// Each file stands by itself: one Replay a file. Time comes from the file. Not thread-safe.
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
#include "server/capture/reader.h"
#include "server/capture/underway.h"
#include "server/engine/engine.h"

namespace pheromone::capture {

/// What was done, and found the same.
struct ReplayReport {
  uint64_t packets = 0;
  uint64_t messages = 0;  ///< from robots, handed to the engine
  uint64_t events = 0;    ///< from elsewhere
  uint64_t answers = 0;   ///< messages to robots that were written, and found the same
  uint64_t answer_bytes = 0;
  uint64_t not_sent = 0;     ///< given, but never written, as recorded
  uint64_t from_before = 0;  ///< written, but given before the recording began
  uint64_t under_way = 0;    ///< given, and not yet written at the end
  uint64_t field_time_ms = 0;
  std::optional<uint64_t> state_hash;  ///< of the end, once it was compared
};

class Replay {
 public:
  /// Called with each message that the engine gives, in order.
  using OnAnswer = std::function<void(uint64_t field_time_ms, const Sent& sent)>;

  explicit Replay(OnAnswer on_answer = nullptr) : on_answer_(std::move(on_answer)) {}

  /// An error is the first difference, or says why replay cannot go on: record, packet, time, link,
  /// what was expected and what was found. Nothing may follow it.
  Status Take(const Found& found);

  /// After the last record. An error: the file has no end, so that its last state is not known.
  Status Finish() const;

  const ReplayReport& report() const { return report_; }
  const Start& start() const { return start_; }
  uint64_t end_utc_ns() const { return end_utc_ns_; }

 private:
  // Empty if all is well.
  std::string On(const Start& start);
  std::string On(const State& portion);
  std::string On(const Packet& packet);
  std::string On(const Carry& carry);
  std::string On(const Batch& batch);
  std::string On(const EventApplied& applied);
  std::string On(const TurnedAway& turned);
  std::string On(const NotSent& not_sent);
  std::string On(const FromBefore& before);
  std::string On(const Unlogged& unlogged);
  std::string On(const Gap& gap);
  std::string On(const End& end);

  std::string TakeWritten(const Packet& packet);
  std::string TakeDecoded(engine::LinkIndex link, const protocol::Message& message);
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
  Underway underway_;
  std::vector<engine::Outgoing> out_;
  uint64_t time_ns_ = 0;
  uint64_t end_utc_ns_ = 0;
  uint64_t batch_ = 0;
  uint64_t field_time_ms_ = 0;
  bool ended_ = false;
  ReplayReport report_;
};

}  // namespace pheromone::capture
