// What a stranger, a broken modem or a burst of noise can send, from the wire to the engine: never
// a crash, never an answer to a bad frame, and the next good frame is always answered.
//
// "Bad" is what the naive decoder, written a second time from the specification, refuses. A damaged
// frame whose CRC happens to be right (a zero byte more at its end, which this CRC cannot see) is a
// good frame of another length, and is answered ERROR bad length.

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "protocol/decoder.h"
#include "protocol/testing/naive_protocol.h"
#include "protocol/testing/vectors.h"
#include "server/core/engine/service/service.h"
#include "server/core/engine/testing/bench.h"

namespace pheromone {
namespace {

using testing::Bytes;

constexpr uint16_t kGapMs = 20;

// A link's way from bytes to answers, in virtual time.
class Server {
 public:
  static constexpr size_t kRemembered = 10'000;

  Server() : service_(&log_, [this] { return engine::ClockReading{now_ms_, 0}; }) {
    EXPECT_TRUE(service_.Configure(engine::testing::SmallConfig(), 1).ok());
  }

  // Feeds bytes, each `pause_ms` after the one before; returns the answers.
  std::vector<protocol::Message> Feed(const Bytes& bytes, uint32_t pause_ms = 0) {
    std::vector<engine::Outgoing> out;
    for (const uint8_t byte : bytes) {
      now_ms_ += pause_ms;
      if (stream_.size() < kRemembered) {
        stream_.push_back({byte, static_cast<uint32_t>(now_ms_)});
      }
      if (decoder_.Push(byte, static_cast<uint32_t>(now_ms_))) {
        service_.Handle(0, {&decoder_.message(), 1}, &out);
      }
    }
    std::vector<protocol::Message> answers;
    answers.reserve(out.size());
    for (const engine::Outgoing& it : out) {
      answers.push_back(it.message);
    }
    return answers;
  }

  void Wait(uint32_t ms) { now_ms_ += ms; }

  // How many messages a client may expect an answer to, as the naive decoder hears them; at most
  // kRemembered bytes may have been fed.
  size_t AnswerableInAllFed() const {
    EXPECT_LT(stream_.size(), kRemembered);
    size_t count = 0;
    for (const Bytes& body : testing::NaiveDecoder(stream_, kGapMs).Run().bodies) {
      count += body[0] != 0xFF && body[1] < 0x80 ? 1u : 0u;
    }
    return count;
  }

  bool AnswersAPing() {
    const std::vector<protocol::Message> answers =
        Feed(testing::NaiveEncode({0x07, 0x72, 0x10, 0x02, 0x55}));
    return answers.size() == 1 && answers[0].opcode == protocol::kPingAnswer &&
           answers[0].length == 3;
  }

 private:
  engine::VolatileLog log_;
  uint64_t now_ms_ = 1'000;
  engine::Service service_;
  protocol::FrameDecoder decoder_{kGapMs};
  std::vector<testing::TimedByte> stream_;
};

// One damaged frame, a gap, a good frame.
void ExpectSurvives(const Bytes& damaged, const std::string& what) {
  Server server;
  const size_t answers = server.Feed(damaged).size();
  ASSERT_LE(answers, server.AnswerableInAllFed()) << what;
  server.Wait(kGapMs + 1);
  ASSERT_TRUE(server.AnswersAPing()) << what;
}

TEST(BadInput, EveryFlipDeletionAndInsertionOfEveryVectorFrame) {
  for (const testing::FrameVector& vector : testing::LoadFrames()) {
    for (size_t at = 0; at < vector.wire.size(); ++at) {
      const std::string where = vector.name + " at " + std::to_string(at);
      Bytes deleted = vector.wire;
      deleted.erase(deleted.begin() + static_cast<std::ptrdiff_t>(at));
      ExpectSurvives(deleted, where + " deleted");
      for (int bit = 0; bit < 8; ++bit) {
        Bytes flipped = vector.wire;
        flipped[at] = static_cast<uint8_t>(flipped[at] ^ (1 << bit));
        ExpectSurvives(flipped, where + " flipped");
      }
      for (const uint8_t extra : Bytes{0x00, 0x02, 0x03, 0x10, 0x55, 0xFF}) {
        Bytes inserted = vector.wire;
        inserted.insert(inserted.begin() + static_cast<std::ptrdiff_t>(at), extra);
        ExpectSurvives(inserted, where + " inserted");
      }
    }
  }
}

TEST(BadInput, RandomBytes) {
  std::mt19937 random(1);
  for (int round = 0; round < 2'000; ++round) {
    Bytes noise(random() % 300);
    for (uint8_t& byte : noise) {
      // Delimiters often, so that frames begin and end.
      static constexpr uint8_t kLikely[] = {0x10, 0x10, 0x10, 0x02, 0x03};
      byte = random() % 2 == 0 ? kLikely[random() % 5] : static_cast<uint8_t>(random());
    }
    ExpectSurvives(noise, "round " + std::to_string(round));
  }
}

// Well-formed frames of random content, one of eight damaged, with nothing but the CRC between them
// and the engine. Each is fed after a gap, so that what it is worth can be told frame by frame: an
// answer to what the naive decoder heard, to that robot, and to nothing else.
TEST(BadInput, AMillionRandomFrames) {
  std::mt19937 random(2);
  constexpr int kFrames = 1'000'000;
  Server server;
  int answered = 0;
  int refused = 0;
  for (int i = 0; i < kFrames; ++i) {
    Bytes body(2 + random() % 20);
    for (uint8_t& byte : body) {
      byte = static_cast<uint8_t>(random());
    }
    body[0] = static_cast<uint8_t>(random() % 4);
    Bytes wire = testing::NaiveEncode(body);
    if (random() % 8 == 0) {
      wire[random() % wire.size()] = static_cast<uint8_t>(random());
    }
    std::vector<testing::TimedByte> stream;
    for (const uint8_t byte : wire) {
      stream.push_back({byte, 0});
    }
    const std::vector<Bytes> heard = testing::NaiveDecoder(stream, kGapMs).Run().bodies;
    server.Wait(kGapMs + 1);
    const std::vector<protocol::Message> answers = server.Feed(wire);
    ASSERT_LE(answers.size(), heard.size()) << i;
    for (const protocol::Message& answer : answers) {
      const uint8_t opcode = answer.opcode == protocol::kError
                                 ? answer.data[0]
                                 : static_cast<uint8_t>(answer.opcode & 0x7F);
      ASSERT_EQ(answer.id, heard[0][0]) << i;
      ASSERT_EQ(opcode, heard[0][1]) << i;
      ASSERT_LT(opcode, 0x80) << i;
    }
    answered += static_cast<int>(answers.size());
    refused += heard.empty() ? 1 : 0;
  }
  EXPECT_GT(answered, kFrames / 8);  // the frames were not all ignored
  EXPECT_GT(refused, kFrames / 16);  // nor all taken
  server.Wait(kGapMs + 1);
  EXPECT_TRUE(server.AnswersAPing());
}

TEST(BadInput, BytesDribbledOneByOneAreOneFrameUntilTheGapIsTooLong) {
  const Bytes ping = testing::NaiveEncode({0x07, 0x72, 0x01});
  Server server;
  EXPECT_EQ(server.Feed(ping, kGapMs).size(), 1u);
  server.Wait(1'000);
  EXPECT_EQ(server.Feed(ping, kGapMs + 1).size(), 0u);
  server.Wait(1'000);
  EXPECT_TRUE(server.AnswersAPing());
}

TEST(BadInput, TwoFramesInOneReadAreBothAnswered) {
  Bytes two = testing::NaiveEncode({0x07, 0x72, 0x01});
  const Bytes second = testing::NaiveEncode({0x08, 0x72, 0x02});
  two.insert(two.end(), second.begin(), second.end());
  Server server;
  const auto answers = server.Feed(two);
  ASSERT_EQ(answers.size(), 2u);
  EXPECT_EQ(answers[0].id, 0x07);
  EXPECT_EQ(answers[1].id, 0x08);
}

TEST(BadInput, AFrameBegunInTheMiddleIsNotAnsweredButTheNextIs) {
  const Bytes sense = testing::NaiveEncode({0x07, 0x01, 0xE8, 0x03, 0xF4, 0x01, 0x10, 0x10});
  for (size_t offset = 1; offset < sense.size(); ++offset) {
    Server server;
    const Bytes rest(sense.begin() + static_cast<std::ptrdiff_t>(offset), sense.end());
    EXPECT_TRUE(server.Feed(rest).empty()) << offset;
    EXPECT_TRUE(server.AnswersAPing()) << offset;  // without any gap
  }
}

// The false frame that the specification warns of: a receiver that joins inside a server's answer.
TEST(BadInput, TheFalseFrameInsideAnAnswerIsRefused) {
  const Bytes false_frame = {0x10, 0x02, 0x05, 0x20, 0x11, 0x22, 0x8D, 0x4F, 0x10, 0x03};
  Server server;
  const auto answers = server.Feed(false_frame);
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_EQ(engine::testing::ReasonOf(answers[0]), protocol::Reason::kUnknownOpcode);
}

}  // namespace
}  // namespace pheromone
