// A recording of a radio channel with rounds is replayed to the byte: answers in a ROUND are those
// that the engine gave.
#include "server/store/capture/written_rounds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <optional>
#include <thread>

#include "protocol/coded_frame.h"
#include "server/store/capture/testing/live.h"

namespace pheromone::capture {
namespace {

using engine::testing::Hello;
using engine::testing::Sense;
using engine::testing::SmallConfig;
using engine::testing::Trace;
using protocol::RoundAnswer;
using testing::FileOf;
using testing::FrameOf;
using ::testing::HasSubstr;
using testing::Live;
using testing::RecordsOf;
using testing::ReplayError;

constexpr RoundAnswer kNotHeard{protocol::kNoIntensities, 0};

std::optional<RoundAnswer> InRound(const protocol::Message& message) {
  protocol::SenseAnswer sense;
  protocol::TraceAnswer trace;
  protocol::ErrorAnswer error;
  if (Decode(message, &sense)) {
    return RoundAnswer{sense.left, sense.right};
  }
  if (Decode(message, &trace)) {
    return RoundAnswer{trace.left, trace.right};
  }
  if (Decode(message, &error)) {
    return RoundAnswer{protocol::kNoIntensities, static_cast<int16_t>(error.reason)};
  }
  return std::nullopt;
}

// A server whose link 0 answers by rounds.
class RoundsRecording : public testing::RecordingTest {
 protected:
  RoundsRecording() : live_(folder_, SmallConfig()) { live_.slow = true; }

  /// Writes a ROUND with the answers to the robots of the last one that wait; the other answers
  /// that wait are frames before it, after `block`.
  void WriteRound(const std::vector<uint8_t>& turns, std::string block = "") {
    std::vector<protocol::Message>& queue = live_.conversations[0].queue;
    protocol::Round round;
    round.number = ++number_;
    for (const uint8_t id : turns_) {
      const auto at = std::find_if(queue.begin(), queue.end(), [id](const auto& message) {
        return message.id == id && InRound(message);
      });
      round.answers[round.answer_count++] = at != queue.end() ? *InRound(*at) : kNotHeard;
      if (at != queue.end()) {
        queue.erase(at);
      }
    }
    for (const uint8_t id : turns) {
      round.turns[round.turn_count++] = id;
    }
    turns_ = turns;
    for (const protocol::Message& message : std::exchange(queue, {})) {
      block += FrameOf(message);
    }
    const protocol::Message message = engine::testing::MessageOf(round);
    Write(block + (is_coded_ ? CodedFrameOf(message) : FrameOf(message)));
  }

  static std::string CodedFrameOf(const protocol::Message& message) {
    std::array<uint8_t, protocol::kMaxCoded> frame{};
    return {frame.begin(), frame.begin() + protocol::EncodeCoded(message, frame.data())};
  }

  /// The answer to that robot that waits.
  protocol::Message QueuedFor(uint8_t id) {
    const std::vector<protocol::Message>& queue = live_.conversations[0].queue;
    const auto at = std::find_if(queue.begin(), queue.end(),
                                 [id](const auto& message) { return message.id == id; });
    EXPECT_NE(at, queue.end());
    return at != queue.end() ? *at : protocol::Message();
  }

  void Write(const std::string& block) {
    live_.recorder().Wrote(live_.conversations[0].line,
                           {reinterpret_cast<const uint8_t*>(block.data()), block.size()});
  }

  /// HELLO of two robots, and a ROUND that grants them turns.
  void Join() {
    live_.Hear(0, FrameOf(Hello(1, 1)) + FrameOf(Hello(2, 1)));
    live_.Flush();
    WriteRound({1, 2});
  }

  /// SENSE of two robots, one of which leaves a trail, and of a pheromone that does not exist.
  void Talk() {
    for (uint8_t seq = 1; seq <= 3; ++seq) {
      live_.now_ms += 100;
      live_.Hear(0, FrameOf(Trace(1, seq)));
      live_.Hear(0, FrameOf(Sense(2)));
      WriteRound({2, 1});
      live_.now_ms += 100;
      live_.Hear(0, FrameOf(Sense(2, 0, 0, 0, 15)));  // an ERROR
      WriteRound({1, 2});
    }
  }

  std::vector<Found> Finish() {
    live_.Finish();
    return RecordsOf(live_.Files().at(0));
  }

  /// The ROUND at the end of the packet.
  static protocol::Round RoundIn(const Packet& packet) {
    protocol::Round round;
    protocol::FrameDecoder frames(protocol::kNoGapTimeout);
    frames.PushBlock(reinterpret_cast<const uint8_t*>(packet.bytes.data()), packet.bytes.size(), 0,
                     [&round](const auto& message) { Decode(message, &round); });
    return round;
  }

  /// The packets with a ROUND that has intensities.
  static std::vector<Packet*> RoundsIn(std::vector<Found>* records) {
    std::vector<Packet*> all;
    for (Found& found : *records) {
      auto* packet = std::get_if<Packet>(&found.record);
      if (packet != nullptr && packet->direction == Direction::kToRobots &&
          RoundIn(*packet).answer_count != 0) {
        all.push_back(packet);
      }
    }
    return all;
  }

  Live live_;
  bool is_coded_ = false;
  uint8_t number_ = 0;
  std::vector<uint8_t> turns_;
};

TEST_F(RoundsRecording, AnswersInRoundsAreReplayed) {
  ASSERT_TRUE(live_.Record().ok());
  Join();
  Talk();
  const std::vector<Found> records = Finish();
  ReplayReport report;
  EXPECT_EQ(ReplayError(FileOf(records), &report), "");
  EXPECT_EQ(report.answers, 2u + 9u);
  EXPECT_EQ(report.under_way, 0u);
  EXPECT_EQ(report.from_before, 0u);
}

TEST_F(RoundsRecording, AFrameBeforeTheRoundIsTheAnswerThatIsNoIntensities) {
  ASSERT_TRUE(live_.Record().ok());
  Join();
  live_.Hear(0, FrameOf(Hello(1, 1)));
  live_.Hear(0, FrameOf(Sense(2)));
  WriteRound({1});
  ReplayReport report;
  EXPECT_EQ(ReplayError(FileOf(Finish()), &report), "");
  EXPECT_EQ(report.answers, 4u);
  EXPECT_EQ(report.under_way, 0u);
}

TEST_F(RoundsRecording, AChangedIntensityIsFound) {
  ASSERT_TRUE(live_.Record().ok());
  Join();
  Talk();
  std::vector<Found> records = Finish();
  Packet* packet = RoundsIn(&records).at(2);
  protocol::Round round = RoundIn(*packet);
  ASSERT_EQ(round.answer_count, 2);
  round.answers[0] = {4095, -1};
  packet->bytes = FrameOf(engine::testing::MessageOf(round));
  const std::string error = ReplayError(FileOf(records));
  EXPECT_THAT(error, HasSubstr("link radio-a, connection 1: expected 10 02 01 B1"));
  EXPECT_THAT(error, HasSubstr("the answer to robot 1, P_L 4095, P_R -1"));
}

TEST_F(RoundsRecording, AChangedReasonIsFound) {
  ASSERT_TRUE(live_.Record().ok());
  Join();
  Talk();
  std::vector<Found> records = Finish();
  Packet* packet = RoundsIn(&records).at(1);
  protocol::Round round = RoundIn(*packet);
  ASSERT_EQ(round.answers[0].right, static_cast<int16_t>(protocol::Reason::kUnknownPheromone));
  round.answers[0].right = static_cast<int16_t>(protocol::Reason::kBusy);
  packet->bytes = FrameOf(engine::testing::MessageOf(round));
  EXPECT_THAT(ReplayError(FileOf(records)), HasSubstr("the answer to robot 2, the reason 7"));
}

TEST_F(RoundsRecording, AnswersThatChangedPlacesAreFound) {
  ASSERT_TRUE(live_.Record().ok());
  live_.Hear(0, FrameOf(Hello(1, 1)) + FrameOf(Hello(2, 1)) + FrameOf(Trace(1, 1)));
  live_.Flush();
  WriteRound({1, 2});
  live_.Hear(0, FrameOf(Sense(1)));
  live_.Hear(0, FrameOf(Sense(2, 20'000, 20'000)));
  WriteRound({});
  std::vector<Found> records = Finish();
  Packet* packet = RoundsIn(&records).at(0);
  protocol::Round round = RoundIn(*packet);
  std::swap(round.answers[0], round.answers[1]);
  packet->bytes = FrameOf(engine::testing::MessageOf(round));
  EXPECT_THAT(ReplayError(FileOf(records)), HasSubstr("the answer to robot 1"));
}

TEST_F(RoundsRecording, AnAnswerToATurnThatNobodyHadIsFound) {
  ASSERT_TRUE(live_.Record().ok());
  Join();
  Talk();
  std::vector<Found> records = Finish();
  Packet* packet = RoundsIn(&records).at(0);
  protocol::Round round = RoundIn(*packet);
  round.answers[round.answer_count++] = {1, 1};
  packet->bytes = FrameOf(engine::testing::MessageOf(round));
  EXPECT_THAT(ReplayError(FileOf(records)),
              HasSubstr("ROUND 2 has an answer to a turn that nobody"));
}

TEST_F(RoundsRecording, AnAnswerThatNoRoundGaveIsUnderWayAtTheEnd) {
  ASSERT_TRUE(live_.Record().ok());
  Join();
  live_.Hear(0, FrameOf(Sense(1)));
  ReplayReport report;
  EXPECT_EQ(ReplayError(FileOf(Finish()), &report), "");
  EXPECT_EQ(report.under_way, 1u);
}

// The first ROUND of the recording answers robots whose turns nobody has recorded.
TEST_F(RoundsRecording, ARecordingMayBeginBetweenTwoRounds) {
  Join();
  live_.Hear(0, FrameOf(Trace(1, 1)));
  ASSERT_TRUE(live_.Record().ok());
  live_.Hear(0, FrameOf(Sense(2)));
  WriteRound({1, 2});
  Talk();
  ReplayReport report;
  EXPECT_EQ(ReplayError(FileOf(Finish()), &report), "");
  EXPECT_EQ(report.under_way, 0u);
  EXPECT_EQ(report.answers, 1u + 9u);
}

// An answer that waits for the log may have been given before the recording, but its turn was in
// it.
TEST_F(RoundsRecording, AnAnswerFromBeforeMayBeInARoundOfKnownTurns) {
  Join();
  live_.Hear(0, FrameOf(Trace(1, 1)));
  live_.Hear(0, FrameOf(Sense(2, 0, 0, 0, 15)));
  ASSERT_TRUE(live_.Record().ok());
  const std::vector<protocol::Message> slow = std::exchange(live_.conversations[0].queue, {});
  WriteRound({1, 2});
  live_.conversations[0].queue = slow;
  WriteRound({});
  ReplayReport report;
  EXPECT_EQ(ReplayError(FileOf(Finish()), &report), "");
  EXPECT_EQ(report.from_before, 2u);
  EXPECT_EQ(report.under_way, 0u);
}

// Both the recorder and replay forget the turns with each file, and agree all the same.
TEST_F(RoundsRecording, AFileMayEndBetweenTwoRounds) {
  live_.options.file_bytes = 1;
  live_.options.most_files = 0;
  ASSERT_TRUE(live_.Record().ok());
  Join();
  uint64_t answers = 2;
  for (uint8_t seq = 1; live_.recorder().status().files < 4; ++seq) {
    live_.now_ms += 100;
    live_.Hear(0, FrameOf(Trace(1, seq)));
    live_.Hear(0, FrameOf(Sense(2)));
    WriteRound({1, 2});
    answers += 2;
    while (!live_.recorder().status().written) {
      std::this_thread::yield();
    }
  }
  live_.Finish();
  const std::vector<std::string> files = live_.Files();
  EXPECT_GE(files.size(), 4u);
  // A file ends when the recorder has written it, perhaps between a request and its ROUND: the next
  // begins with the answers that are under way.
  uint64_t replayed = 0;
  ReplayReport report;
  for (const std::string& file : files) {
    report = {};
    EXPECT_EQ(ReplayError(file, &report), "");
    EXPECT_EQ(report.from_before, 0u);
    replayed += report.answers;
  }
  EXPECT_EQ(report.under_way, 0u);
  EXPECT_EQ(replayed, answers);
}

// Bad air (protocol/README.md, section 9): ROUNDs are coded, an answer of its own goes out twice
// before them, and one whose ROUND its robot missed once more.
TEST_F(RoundsRecording, WhatIsSaidAgainInBadAirIsReplayed) {
  ASSERT_TRUE(live_.Record().ok());
  Join();
  is_coded_ = true;
  live_.Hear(0, FrameOf(Hello(1, 1)));
  live_.Hear(0, FrameOf(Trace(2, 1)));
  const protocol::Message trace = QueuedFor(2);
  const std::string hello = FrameOf(QueuedFor(1));
  Write(hello);
  WriteRound({1, 2});
  live_.Hear(0, FrameOf(Sense(1)));
  Write(FrameOf(trace));
  WriteRound({1, 2});
  ReplayReport report;
  EXPECT_EQ(ReplayError(FileOf(Finish()), &report), "");
  EXPECT_EQ(report.answers, 2u + 3u);
  EXPECT_EQ(report.said_again, 2u);
  EXPECT_EQ(report.under_way, 0u);
}

TEST_F(RoundsRecording, AnotherAnswerThanTheLastIsNotSaidAgain) {
  ASSERT_TRUE(live_.Record().ok());
  Join();
  std::vector<protocol::Message> told;
  for (uint8_t seq = 1; seq <= 2; ++seq) {
    live_.Hear(0, FrameOf(Trace(1, seq)));
    told.push_back(QueuedFor(1));
    WriteRound({1, 2});
  }
  live_.now_ms += Recorder::kStillFromBeforeNs / 1'000'000;
  Write(FrameOf(told[0]));
  EXPECT_THAT(ReplayError(FileOf(Finish())), HasSubstr("expected nothing for robot 1"));
}

// The next file begins after the ROUND that had the answer.
TEST_F(RoundsRecording, WhatIsSaidAgainInTheNextFileIsReplayed) {
  live_.options.file_bytes = 1;
  live_.options.most_files = 0;
  ASSERT_TRUE(live_.Record().ok());
  Join();
  for (uint8_t seq = 1; live_.recorder().status().files < 4; ++seq) {
    live_.now_ms += 100;
    live_.Hear(0, FrameOf(Trace(1, seq)));
    const std::string trace = FrameOf(QueuedFor(1));
    WriteRound({1, 2});
    while (!live_.recorder().status().written) {
      std::this_thread::yield();
    }
    WriteRound({1, 2}, trace);
  }
  live_.Finish();
  for (const std::string& file : live_.Files()) {
    EXPECT_EQ(ReplayError(file), "");
  }
}

TEST_F(RoundsRecording, ANewConnectionKnowsNothingOfTheTurnsBefore) {
  ASSERT_TRUE(live_.Record().ok());
  Join();
  live_.Hear(0, FrameOf(Sense(1)));
  ++live_.conversations[0].line.connection;
  WriteRound({2});
  live_.Hear(0, FrameOf(Sense(2)));
  WriteRound({});
  ReplayReport report;
  EXPECT_EQ(ReplayError(FileOf(Finish()), &report), "");
  EXPECT_EQ(report.under_way, 0u);
}

}  // namespace
}  // namespace pheromone::capture
