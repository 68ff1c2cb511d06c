#include "server/cluster/peer_wire.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace pheromone::cluster {
namespace {

using namespace std::string_literals;  // texts with zeros in them

Greeting GreetingOf(const std::string& node) {
  return {.versions = {.program = "0.1.0"},
          .cluster = "lab",
          .node = node,
          .id = "",
          .links_hash = 7,
          .instance = 9};
}

// One of each, with values that differ from the defaults, in the order of their types.
std::vector<PeerMessage> OneOfEach() {
  protocol::Message trace;
  trace.id = 5;
  trace.opcode = 0x31;
  trace.length = 2;
  trace.data[0] = 0x11;
  trace.data[1] = 0x22;
  return {
      GreetingOf("a"),
      Heartbeat{.term = 3,
                .leads = true,
                .is_healthy = false,
                .next = 0x0102030405060708,
                .successor = "b",
                .hashed = 5,
                .hash = 6},
      ForwardedRequest{.link = 2, .message = trace},
      DirectAnswer{.link = 2, .message = trace},
      ForwardedEvent{engine::GoalEnded{1, 2, true, {-3, 4}}},
      OperatorChange{.number = 6, .change = TauChange{.type = 1, .tau_ms = -1}},
      OperatorResult{.number = 6, .ok = true, .notes = {"x"}},
      HaltAll{},
      PosesHeard{{{.link = 1, .id = 2, .pose = {-5, 6, 7}, .age_ms = 8}}},
      StateRequest{.number = 1, .offset = 65536},
      StatePortion{.number = 1, .offset = 3, .is_last = true, .bytes = "\0\1"s},
  };
}

std::string Encoded(const PeerMessage& message) {
  return EncodePeerMessage(message).value();
}

// Without its length.
std::string FrameOf(const PeerMessage& message) {
  return Encoded(message).substr(4);
}

std::string ErrorOfFrame(const std::string& frame) {
  return DecodePeerMessage(frame).ErrorOr("");
}

TEST(PeerWire, HasTheBytesOfTheDescription) {
  EXPECT_EQ(
      Encoded(Heartbeat{
          .term = 0x0A0B, .leads = true, .is_healthy = false, .next = 1, .hashed = 3, .hash = 4}),
      "\x27\0\0\0"s
      "\x01"
      "\x0B\x0A\0\0\0\0\0\0"s
      "\x01"
      "\0"s
      "\x01\0\0\0\0\0\0\0"s
      "\0\0\0\0"s
      "\x03\0\0\0\0\0\0\0"s
      "\x04\0\0\0\0\0\0\0"s);
  EXPECT_EQ(Encoded(GreetingOf("a")),
            "\x2C\0\0\0"s
            "\0\x03\x04"s
            "\x05\0\0\0"s
            "0.1.0"
            "\x03\0\0\0"s
            "lab"
            "\x01\0\0\0"s
            "a"
            "\0\0\0\0"s
            "\x07\0\0\0\0\0\0\0"s
            "\x09\0\0\0\0\0\0\0"s);
}

TEST(PeerWire, EachMessageComesBackAsItself) {
  uint8_t type = 0;
  for (const PeerMessage& message : OneOfEach()) {
    const std::string frame = FrameOf(message);
    EXPECT_EQ(frame.front(), type);
    const Result<PeerMessage> same = DecodePeerMessage(frame);
    ASSERT_TRUE(same.ok()) << same.error();
    EXPECT_EQ(same.value().index(), type);
    EXPECT_EQ(FrameOf(same.value()), frame);
    ++type;
  }
  EXPECT_EQ(type, std::variant_size_v<PeerMessage>);
  const auto poses = DecodePeerMessage(FrameOf(OneOfEach()[8]));
  const PoseHeard& heard = std::get<PosesHeard>(poses.value()).poses.at(0);
  EXPECT_EQ(heard.pose.x, -5);
  EXPECT_EQ(heard.pose.heading, 7);
}

TEST(PeerWire, WhatIsCutOrLongerIsRefused) {
  for (const PeerMessage& message : OneOfEach()) {
    const std::string frame = FrameOf(message);
    for (size_t length = 0; length < frame.size(); ++length) {
      EXPECT_NE(ErrorOfFrame(frame.substr(0, length)), "") << message.index() << ": " << length;
    }
    EXPECT_EQ(ErrorOfFrame(frame + '\0'), "found a message of type " +
                                              std::to_string(message.index()) +
                                              " that is invalid: trailing bytes");
  }
}

TEST(PeerWire, TellsWhatIsWrong) {
  EXPECT_EQ(ErrorOfFrame(""), "found an empty message");
  EXPECT_EQ(ErrorOfFrame("\x0B"), "found a message of type 11, expected 0 to 10");
  EXPECT_EQ(ErrorOfFrame("\xFF"), "found a message of type 255, expected 0 to 10");
  std::string beat = FrameOf(Heartbeat{});
  beat[9] = 2;  // leads
  EXPECT_EQ(ErrorOfFrame(beat),
            "found a message of type 1 that is invalid: a flag is 2, expected at most 1");
}

// A list that says it has 2^32 - 1 items takes no more memory than what was received.
TEST(PeerWire, ALengthIsNotTrusted) {
  EXPECT_NE(ErrorOfFrame("\x08\xFF\xFF\xFF\xFF"), "");
  EXPECT_NE(ErrorOfFrame("\x06"s + std::string(57, '\0') + "\xFF\xFF\xFF\xFF"), "");
}

TEST(PeerWire, AMessageHasAtMostSomeBytes) {
  const size_t others = FrameOf(StatePortion{}).size();
  StatePortion portion{.bytes = std::string(kMaxPeerBytes - others, 'x')};
  EXPECT_EQ(Encoded(portion).size(), kMaxPeerBytes + 4);
  portion.bytes += 'x';
  EXPECT_EQ(EncodePeerMessage(portion).ErrorOr(""),
            "a message of type 10 has 131073 bytes, expected at most 131072");
  portion.bytes.resize(kMaxPortionBytes);
  EXPECT_TRUE(EncodePeerMessage(portion).ok());
  EXPECT_TRUE(EncodePeerMessage(PosesHeard{std::vector<PoseHeard>(kMaxPosesAtOnce)}).ok());
}

std::string Stream() {
  std::string stream;
  for (const PeerMessage& message : OneOfEach()) {
    stream += Encoded(message);
  }
  return stream;
}

TEST(PeerFrames, FindsMessagesHoweverTheirBytesArrive) {
  const std::string stream = Stream();
  for (const size_t step : {size_t{1}, size_t{3}, size_t{50}, stream.size()}) {
    PeerFrames frames;
    std::string found;
    for (size_t at = 0; at < stream.size(); at += step) {
      frames.Add(std::string_view(stream).substr(at, step));
      for (auto next = frames.Next(); next.ok() && next.value(); next = frames.Next()) {
        found += Encoded(*next.value());
      }
    }
    EXPECT_EQ(found, stream) << step;
    const auto none = frames.Next();
    EXPECT_TRUE(none.ok() && !none.value());
  }
}

TEST(PeerFrames, ALengthThatNoMessageHasIsRefusedBeforeItsBytesCome) {
  PeerFrames none;
  none.Add("\0\0\0\0"s);
  EXPECT_EQ(none.Next().ErrorOr(""), "found a message of 0 bytes, expected 1 to 131072");
  PeerFrames long_one;
  long_one.Add("\x01\0\x02\0"s);
  EXPECT_EQ(long_one.Next().ErrorOr(""), "found a message of 131073 bytes, expected 1 to 131072");
  PeerFrames longest;
  longest.Add("\0\0\x02\0"s);
  EXPECT_TRUE(longest.Next().ok());
}

TEST(CheckGreeting, NodesOfOneClusterTalk) {
  EXPECT_TRUE(CheckGreeting(GreetingOf("a"), GreetingOf("b")).ok());
  Greeting knows_the_id = GreetingOf("b");
  knows_the_id.id = "x";
  EXPECT_TRUE(CheckGreeting(GreetingOf("a"), knows_the_id).ok());
  EXPECT_TRUE(CheckGreeting(knows_the_id, GreetingOf("a")).ok());
  Greeting other_program = GreetingOf("b");
  other_program.versions.program = "0.2.0";
  EXPECT_TRUE(CheckGreeting(GreetingOf("a"), other_program).ok());
}

TEST(CheckGreeting, OtherVersionsAreToldWithTheOrderOfUpgrading) {
  const Greeting own = GreetingOf("a");
  Greeting newer = GreetingOf("b");
  newer.versions.program = "0.2.0";
  newer.versions.events = 5;
  EXPECT_EQ(CheckGreeting(own, newer).ErrorOr(""),
            "node b runs pheromoned 0.2.0 with event version 5, this node a pheromoned 0.1.0 with "
            "event version 4, expected the same; upgrade this node: followers first, the leader "
            "last");
  EXPECT_EQ(CheckGreeting(newer, own).ErrorOr(""),
            "node a runs pheromoned 0.1.0 with event version 4, this node b pheromoned 0.2.0 with "
            "event version 5, expected the same; upgrade node a: followers first, the leader last");
}

// Of a later version, only what all versions have in common is read.
TEST(CheckGreeting, AGreetingOfAnotherPeerVersionIsUnderstoodSoFar) {
  const Result<PeerMessage> later = DecodePeerMessage(
      "\0\x04\x04\x05\0\0\0"s
      "0.3.0"
      "and what is not known yet");
  ASSERT_TRUE(later.ok()) << later.error();
  EXPECT_EQ(CheckGreeting(GreetingOf("a"), std::get<Greeting>(later.value())).ErrorOr(""),
            "the other node runs pheromoned 0.3.0 with peer version 4, this node a pheromoned "
            "0.1.0 with peer version 3, expected the same; upgrade this node: followers first, the "
            "leader last");
  EXPECT_FALSE(DecodePeerMessage("\0\x04\x04\x05\0\0\0"s
                                 "0.3")
                   .ok());
}

TEST(CheckGreeting, OthersAreRefusedWithTheReason) {
  const Greeting own = GreetingOf("a");
  const auto with = [](auto change) {
    Greeting greeting = GreetingOf("b");
    change(&greeting);
    return greeting;
  };
  EXPECT_EQ(CheckGreeting(own, with([](Greeting* it) { it->cluster = "hall"; })).ErrorOr(""),
            "node b has the cluster hall, expected lab");
  EXPECT_EQ(CheckGreeting(own, GreetingOf("a")).ErrorOr(""),
            "another machine is node a as well, expected one of each name");
  EXPECT_EQ(CheckGreeting(own, with([](Greeting* it) { it->links_hash = 8; })).ErrorOr(""),
            "node b has other links, expected the same [[link]] sections on all machines");
  Greeting old = own;
  old.id = "1f";
  EXPECT_EQ(CheckGreeting(old, with([](Greeting* it) { it->id = "2e"; })).ErrorOr(""),
            "node b has the log of cluster ID 2e, expected 1f");
}

}  // namespace
}  // namespace pheromone::cluster
