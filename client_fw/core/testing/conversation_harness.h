// A conversation in virtual time with a scripted server at the other end. For tests only.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "client_fw/core/conversation.h"
#include "client_fw/core/testing/frames.h"
#include "protocol/frame.h"
#include "protocol/messages.h"

namespace pheromone {
namespace client {

constexpr uint8_t kTestWindowMs = 30;
constexpr uint8_t kTestSlotMs = 3;
/// Slot and three bytes at 9600 baud, rounded up: silence after which the channel is idle.
constexpr uint8_t kTestIdleMs = kTestSlotMs + 4;

/// The wheel speeds of a halted robot, and of one that senses the same left and right.
constexpr WheelSpeeds kStill = {0, 0};
constexpr WheelSpeeds kStraight = {200, 200};

inline Parameters TestParameters() {
  Parameters parameters;
  parameters.id = kTestId;
  parameters.type = 2;
  parameters.boot_counter = 0x1234;
  parameters.fail_safe_ms = 500;
  parameters.start_released = true;
  parameters.law = Law::kDifferential;  // the default law, and what a robot does when it senses
  parameters.lost_after_ms = 0;         // nothing, have tests of their own
  return parameters;
}

class Harness {
 public:
  explicit Harness(const Parameters& parameters = TestParameters(), uint32_t start_ms = 5000,
                   const RequestMemory& remembered = RequestMemory())
      : now_ms(start_ms), memory(remembered), conversation(parameters, &memory) {
    hello = GreetingOf(parameters.id, parameters.boot_counter, 9);
    hello.type_mask = 0x0006;  // types 1 and 2
    hello.slot_ms = kTestSlotMs;
    hello.response_window_ms = kTestWindowMs;
  }

  /// One millisecond: Poll, and the end of a transmission when its time has come.
  void Step() {
    ++now_ms;
    if (leaving && now_ms == leaves_ms) {
      leaving = false;
      ++frames_sent;
      sent_ms = now_ms;
      conversation.OnSent(now_ms);
    }
    conversation.Poll(now_ms, pose_known ? &pose : nullptr, busy);
    if (!leaving && conversation.tx_size() != 0) {
      leaving = true;
      began_ms = now_ms;
      leaves_ms = now_ms + airtime_ms;
      wire.assign(conversation.tx(), conversation.tx() + conversation.tx_size());
      protocol::FrameDecoder decoder(protocol::kNoGapTimeout);
      bool complete = false;
      for (const uint8_t byte : wire) {
        complete = decoder.Push(byte, 0);
      }
      EXPECT_TRUE(complete) << "the client sent something that is not a frame";
      sent = decoder.message();
    }
  }

  void Run(uint32_t ms) {
    for (uint32_t i = 0; i < ms; ++i) {
      Step();
    }
  }

  /// Runs until the client has sent a frame (then in `sent`), for at most `limit_ms`.
  bool RunUntilSent(uint32_t limit_ms = 3000) {
    const int before = frames_sent;
    for (uint32_t i = 0; i < limit_ms && frames_sent == before; ++i) {
      Step();
    }
    return frames_sent != before;
  }

  void FeedByte(uint8_t byte) { conversation.OnByte(byte, now_ms); }

  void Feed(const protocol::Message& message) {
    for (const uint8_t byte : FrameOf(message)) {
      FeedByte(byte);
    }
  }

  template <class T>
  void FeedEncoded(const T& what) {
    protocol::Message message;
    Encode(what, &message);
    Feed(message);
  }

  void AnswerHello() { FeedEncoded(hello); }

  /// The answer to `sent`, which is a SENSE or TRACE.
  protocol::Message AnswerToSent(int16_t left, int16_t right) const {
    return AnswerTo(sent, left, right);
  }

  static protocol::Message AnswerTo(const protocol::Message& request, int16_t left, int16_t right) {
    protocol::Message answer;
    protocol::SenseRequest sense;
    protocol::TraceRequest trace;
    if (Decode(request, &sense)) {
      Encode(protocol::SenseAnswer{sense.id, sense.type, sense.wide, left, right}, &answer);
    } else if (Decode(request, &trace)) {
      Encode(protocol::TraceAnswer{trace.id, trace.type, trace.wide, trace.seq, left, right},
             &answer);
    } else {
      ADD_FAILURE() << "not a request for intensities: opcode " << int{request.opcode};
    }
    return answer;
  }

  void Answer(int16_t left, int16_t right) { Feed(AnswerToSent(left, right)); }

  void AnswerError(protocol::Reason reason, uint8_t seq = 0) {
    FeedEncoded(protocol::ErrorAnswer{sent.id, sent.opcode, reason, seq});
  }

  /// HELLO and its answer.
  void Greet() {
    ASSERT_TRUE(RunUntilSent());
    ASSERT_EQ(protocol::kHello, sent.opcode);
    AnswerHello();
    ASSERT_TRUE(conversation.requests().greeted);
  }

  /// HELLO, and answered requests for `ms`.
  void GreetAndServe(uint32_t ms, int16_t left = 0, int16_t right = 0) {
    Greet();
    Serve(ms, left, right);
  }

  /// Answers whatever is asked, at once, for `ms`.
  void Serve(uint32_t ms, int16_t left = 0, int16_t right = 0) {
    const uint32_t end_ms = now_ms + ms;
    while (now_ms != end_ms) {
      const int before = frames_sent;
      Step();
      if (frames_sent == before) {
        continue;
      }
      if (sent.opcode == protocol::kHello) {
        AnswerHello();
      } else if (sent.opcode == protocol::kPing) {
        AnswerPing();
      } else if (sent.opcode == protocol::kEvent) {
        AnswerEvent();
      } else {
        Answer(left, right);
      }
    }
  }

  void AnswerPing() {
    protocol::Message echo = sent;
    echo.opcode = protocol::kPingAnswer;
    Feed(echo);
  }

  /// Takes note of the EVENT in `sent`.
  void AnswerEvent() {
    protocol::EventReport event;
    ASSERT_TRUE(Decode(sent, &event)) << "opcode " << int{sent.opcode};
    events.push_back(event);
    FeedEncoded(protocol::EventAck{event.id, event.seq});
  }

  protocol::SenseRequest SentSense() const {
    protocol::SenseRequest sense;
    EXPECT_TRUE(Decode(sent, &sense)) << "opcode " << int{sent.opcode};
    return sense;
  }

  protocol::TraceRequest SentTrace() const {
    protocol::TraceRequest trace;
    EXPECT_TRUE(Decode(sent, &trace)) << "opcode " << int{sent.opcode};
    return trace;
  }

  Counters counters() const { return conversation.counters(); }

  uint32_t now_ms;
  Pose pose = {1000, -2000, 0x4000};
  bool pose_known = true;
  bool busy = false;
  uint32_t airtime_ms = 15;
  protocol::HelloAnswer hello;

  RequestMemory memory;
  Conversation conversation;

  protocol::Message sent;                     ///< the last frame, from its beginning on
  std::vector<uint8_t> wire;                  ///< the same, as sent
  std::vector<protocol::EventReport> events;  ///< answered so far
  uint32_t began_ms = 0;
  uint32_t sent_ms = 0;
  int frames_sent = 0;
  bool leaving = false;
  uint32_t leaves_ms = 0;
};

}  // namespace client
}  // namespace pheromone
