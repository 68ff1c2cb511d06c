// A scripted server on a radio medium: answers HELLO, PING, EVENT and SENSE. The intensities are
// a function of the pose, by default the same everywhere. There is one pheromone, type 1.
//
//   FakeServer server(&medium);
//   server.smell = [](const protocol::WirePose& pose) { return std::pair<int16_t, int16_t>{1, 2};
//   }; medium.AdvanceTo(...); server.Step();  // every millisecond
#pragma once

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "client_fw/core/testing/frames.h"
#include "client_fw/sim/radio_medium.h"
#include "protocol/decoder.h"
#include "protocol/messages.h"

namespace pheromone::sim {

/// The response window that it tells, ms.
constexpr uint8_t kFakeWindowMs = 15;
/// At both antennas: robots drive straight on.
constexpr std::pair<int16_t, int16_t> kSameEverywhere = {2048, 2048};

class FakeServer : public Station {
 public:
  explicit FakeServer(RadioMedium* medium) : medium_(medium), station_(medium->AddStation(this)) {}

  void OnByte(uint8_t byte, int64_t time_ns) override {
    if (decoder_.Push(byte, static_cast<uint32_t>(time_ns / 1'000'000))) {
      ++requests;
      if (!silent) {
        Answer(decoder_.message());
      }
    }
  }

  void OnTransmitted(int64_t /*time_ns*/) override {}

  /// Everything that is due by now. Call once per millisecond.
  void Step() {
    while (!due_.empty() && due_.front().time_ns <= medium_->now_ns()) {
      medium_->Transmit(station_, due_.front().frame);
      due_.erase(due_.begin());
    }
  }

  bool silent = false;
  int64_t delay_ns = 0;
  uint64_t requests = 0;
  protocol::WirePose last_pose;
  std::function<std::pair<int16_t, int16_t>(const protocol::WirePose&)> smell =
      [](const protocol::WirePose&) { return kSameEverywhere; };

 private:
  struct Due {
    int64_t time_ns;
    std::vector<uint8_t> frame;
  };

  void Answer(const protocol::Message& request) {
    protocol::Message answer;
    protocol::HelloRequest hello;
    protocol::SenseRequest sense;
    protocol::EventReport event;
    if (Decode(request, &hello)) {
      protocol::HelloAnswer greeting = client::GreetingOf(hello.id, hello.nonce, 1);
      greeting.slot_ms = 2;
      greeting.response_window_ms = kFakeWindowMs;
      Encode(greeting, &answer);
    } else if (request.opcode == protocol::kPing) {
      answer = request;
      answer.opcode = protocol::kPingAnswer;
    } else if (Decode(request, &event)) {
      Encode(protocol::EventAck{event.id, event.seq}, &answer);
    } else if (Decode(request, &sense)) {
      last_pose = sense.pose;
      const auto [left, right] = smell(sense.pose);
      Encode(protocol::SenseAnswer{sense.id, sense.type, sense.wide, left, right}, &answer);
    } else {
      return;
    }
    due_.push_back({medium_->now_ns() + delay_ns, client::FrameOf(answer)});
  }

  RadioMedium* medium_;
  int station_;
  protocol::FrameDecoder decoder_{20};
  std::vector<Due> due_;
};

}  // namespace pheromone::sim
