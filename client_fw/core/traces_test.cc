// The timed traces of protocol/vectors/traces.txt, played to a conversation.
#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "client_fw/core/testing/conversation_harness.h"
#include "protocol/testing/vectors.h"

namespace pheromone {
namespace client {
namespace {

constexpr double kByteMs = 10'000.0 / 9600;
constexpr uint32_t kClockMs = 1;  // the step of ours

struct Expected {
  std::string what;  // of the names below, with /seq if it has one; or "nothing"
  uint32_t from_ms = 0;
  uint32_t to_ms = 0;
  bool is_relative = false;  // to the end of the last frame
};

struct Trace {
  std::string name;
  std::multimap<uint32_t, uint8_t> heard;  // by the time at which it is read
  std::vector<Expected> expected;
};

std::vector<Trace> LoadTraces() {
  std::vector<Trace> traces;
  testing::internal::ForEachLine("traces.txt", 3, [&](const std::vector<std::string>& columns) {
    Trace trace;
    trace.name = columns[0];
    for (const std::string& piece : testing::internal::Split(columns[1], ';')) {
      std::istringstream words(piece);
      double at_ms = 0;
      char colon = 0;
      if (!(words >> at_ms >> colon)) {
        continue;  // "-"
      }
      std::vector<uint8_t> bytes;
      for (std::string byte; words >> byte;) {
        bytes.push_back(static_cast<uint8_t>(std::stoul(byte, nullptr, 16)));
      }
      for (size_t i = 0; i < bytes.size(); ++i) {
        const double before = static_cast<double>(bytes.size() - 1 - i) * kByteMs;
        trace.heard.emplace(static_cast<uint32_t>(at_ms - before), bytes[i]);
      }
    }
    for (const std::string& one : testing::internal::Split(columns[2], ';')) {
      Expected expected;
      std::istringstream words(one);
      words >> expected.what >> std::ws;
      expected.is_relative = words.peek() == '+';
      words >> expected.from_ms;
      words >> expected.to_ms;
      trace.expected.push_back(expected);
    }
    traces.push_back(trace);
  });
  return traces;
}

uint8_t OpcodeOf(const std::string& message) {
  static const std::map<std::string, uint8_t> opcodes = {
      {"SENSE", 0x02}, {"TRACE", 0x32}, {"COMMAND_ACK", 0x51}, {"HELLO", 0x71}};
  return opcodes.at(message.substr(0, message.find('/')));
}

bool Has(const Trace& trace, const std::string& word) {
  return trace.name.find(word) != std::string::npos;
}

Parameters ParametersOf(const Trace& trace, uint16_t seed) {
  Parameters parameters = TestParameters();
  parameters.boot_counter = seed;
  parameters.rounds = !Has(trace, "simple_");
  parameters.adapter_ms = Has(trace, "adapter_") ? uint8_t{16} : uint8_t{0};
  for (const Expected& expected : trace.expected) {
    parameters.lay_trail = parameters.lay_trail || expected.what.rfind("TRACE", 0) == 0;
  }
  return parameters;
}

class Player {
 public:
  Player(const Trace& trace, uint16_t seed) : trace_(trace), harness_(ParametersOf(trace, seed)) {
    harness_.hello.last_seq = 4;
    if (Has(trace, "slow_")) {
      harness_.hello.slot_ms = 12;
      harness_.hello.response_window_ms = 60;
    }
    harness_.Greet();
    begin_ms_ = harness_.now_ms;
  }

  void Play() {
    for (Expected expected : trace_.expected) {
      SCOPED_TRACE(expected.what);
      bool begun = false;  // with the end of the frame before
      if (expected.is_relative) {
        const int before = harness_.frames_sent;
        while (harness_.leaving && harness_.frames_sent == before) {
          begun = Begins();
        }
        expected.from_ms += harness_.sent_ms - begin_ms_;
        expected.to_ms += harness_.sent_ms - begin_ms_;
      }
      if (expected.what == "nothing") {
        ASSERT_FALSE(begun) << Now() << " ms";
        while (Now() < expected.from_ms) {
          ASSERT_FALSE(Begins()) << Now() << " ms";
        }
      } else {
        while (!begun && !Begins()) {
          ASSERT_LE(Now(), expected.to_ms + kClockMs);
        }
        sent_ms_ = Now();
        EXPECT_GE(Now() + kClockMs, expected.from_ms);
        EXPECT_LE(Now(), expected.to_ms + kClockMs);
        EXPECT_EQ(harness_.sent.opcode, OpcodeOf(expected.what));
        if (const size_t slash = expected.what.find('/'); slash != std::string::npos) {
          EXPECT_EQ(std::to_string(harness_.sent.data[0]), expected.what.substr(slash + 1));
        }
      }
    }
  }

  /// When the last of what it expected was sent.
  uint32_t sent_ms() const { return sent_ms_; }

 private:
  uint32_t Now() const { return harness_.now_ms - begin_ms_; }

  // A millisecond; whether a frame begins in it.
  bool Begins() {
    const auto [first, last] = trace_.heard.equal_range(Now());
    for (auto it = first; it != last; ++it) {
      harness_.FeedByte(it->second);
    }
    harness_.Step();
    return harness_.began_ms == harness_.now_ms;
  }

  const Trace& trace_;
  Harness harness_;
  uint32_t begin_ms_ = 0;
  uint32_t sent_ms_ = 0;
};

// In which each of eight slots has to be drawn by some robot.
const std::set<std::string> kRandom = {"asks_within_its_window", "request_of_another",
                                       "its_answer_ends_the_window", "hello_after_the_rounds",
                                       "simple_draws_among_the_slots"};

TEST(Traces, AreFollowed) {
  const std::vector<Trace> traces = LoadTraces();
  EXPECT_GE(traces.size(), 86u);
  size_t randomly = 0;
  for (const Trace& trace : traces) {
    std::set<uint32_t> moments;
    for (uint16_t seed = 1; seed <= 64 && !HasFailure(); ++seed) {
      SCOPED_TRACE(trace.name + ", seed " + std::to_string(seed));
      Player player(trace, seed);
      player.Play();
      moments.insert(player.sent_ms());
    }
    if (kRandom.count(trace.name) != 0) {
      EXPECT_EQ(moments.size(), 8u) << trace.name;
      ++randomly;
    }
  }
  EXPECT_EQ(randomly, kRandom.size());
}

}  // namespace
}  // namespace client
}  // namespace pheromone
