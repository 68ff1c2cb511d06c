// A server with the tags of a naive bench, message by message. For tests only.
//
//   NaiveServer server;
//   if (const auto answer = server.AnswerTo(request)) ...
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "client_fw/core/testing/naive_bench.h"
#include "protocol/messages.h"
#include "protocol/opcodes.h"

namespace pheromone {
namespace client {

/// A server that has the bench: it answers every request, senses the same left and right, and
/// executes each change once.
class NaiveServer {
 public:
  /// None to an ACK.
  std::optional<protocol::Message> AnswerTo(const protocol::Message& request) {
    if (request.opcode == protocol::kCommandAck) {
      return std::nullopt;
    }
    const bool changes = protocol::IsMutating(request.opcode);
    if (changes && Same(request, last_)) {
      return last_answer_;
    }
    EXPECT_TRUE(!changes || last_.length == 0 || request.data[0] != last_.data[0]) << "a used seq";
    const protocol::Message answer = Execute(request);
    if (changes) {
      last_ = request;
      last_answer_ = answer;
    }
    return answer;
  }

  NaiveBench bench;
  protocol::HelloAnswer hello;
  int16_t intensity = 4096;
  std::vector<protocol::EventReport> events;
  std::set<int> sensed_types;

 private:
  static bool Same(const protocol::Message& a, const protocol::Message& b) {
    return a.id == b.id && a.opcode == b.opcode && a.length == b.length &&
           std::equal(a.data, a.data + a.length, b.data);
  }

  protocol::Message Execute(const protocol::Message& request) {
    protocol::Message answer;
    protocol::HelloRequest greeting;
    protocol::EventReport event;
    protocol::SenseRequest sense;
    if (Decode(request, &greeting)) {
      hello.id = request.id;
      hello.nonce = greeting.nonce;
      hello.last_seq = last_.length == 0 ? uint8_t{0} : last_.data[0];
      Encode(hello, &answer);
    } else if (Decode(request, &event)) {
      events.push_back(event);
      Encode(protocol::EventAck{event.id, event.seq}, &answer);
    } else if (Decode(request, &sense)) {
      sensed_types.insert(sense.type);
      Encode(protocol::SenseAnswer{sense.id, sense.type, sense.wide, intensity, intensity},
             &answer);
    } else if (request.opcode == protocol::kPing) {
      answer = request;
      answer.opcode = protocol::kPingAnswer;
    } else {
      const protocol::Reason reason = bench.Execute(request, &answer);
      if (reason != protocol::Reason::kNone) {
        const uint8_t seq = protocol::IsMutating(request.opcode) ? request.data[0] : uint8_t{0};
        Encode(protocol::ErrorAnswer{request.id, request.opcode, reason, seq}, &answer);
      }
    }
    return answer;
  }

  protocol::Message last_;  // of the changes
  protocol::Message last_answer_;
};

}  // namespace client
}  // namespace pheromone
