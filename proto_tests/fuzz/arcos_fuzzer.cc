// Any bytes from a Pioneer at any times. What the receiver finds is what the naive reader finds,
// and whatever the link is told, it sends well-formed commands, one at a time and with the gap that
// a Pioneer needs, and no speed but zero while odometry is not known.
//
// The input is a list of pairs: how long after the byte before, and the byte. A time of 255 is not
// followed by a byte's time but by a wheel speed in 20 mm/s.

#include <algorithm>
#include <cstdint>

#include "client_fw/core/pioneer/pioneer.h"
#include "client_fw/core/testing/naive_arcos.h"
#include "proto_tests/fuzz/require.h"

namespace {

using pheromone::client::Bytes;
using pheromone::client::NaiveBodies;
using pheromone::client::NaivePacket;
using pheromone::client::Pioneer;
using pheromone::fuzz::Require;

void CheckReceiver(const Bytes& stream) {
  const std::vector<Bytes> expected = NaiveBodies(stream);
  auto receiver = pheromone::client::PioneerReceiver();
  size_t found = 0;
  for (const uint8_t byte : stream) {
    if (!receiver.Push(byte, 0)) {
      continue;
    }
    Require(found < expected.size());
    const Bytes& body = expected[found++];
    Require(receiver.id() == body[0]);
    const bool is_sip = body[0] >= 0x30 && body[0] <= 0x34 && body.size() >= 7;
    Require(receiver.IsSip() == is_sip);
    Require(!is_sip ||
            (receiver.X() == body[1] + 256 * body[2] && receiver.Y() == body[3] + 256 * body[4] &&
             receiver.Heading() == body[5] + 256 * body[6]));
    Require(receiver.HasStallAndFlags() == (body.size() >= 18));
    Require(body.size() < 18 ||
            (receiver.Stall() == body[12] + 256 * body[13] && receiver.Flags() == body[16]));
  }
  Require(found == expected.size());
}

class Line {
 public:
  void OnByte(uint8_t byte) { pioneer_.OnByte(byte, now_ms_); }

  void set_wheel_speeds(int16_t left_mm_s, int16_t right_mm_s) {
    pioneer_.set_wheel_speeds(left_mm_s, right_mm_s);
  }

  void Wait(int ms) {
    for (int left_ms = ms; left_ms > 0; left_ms -= kStepMs) {
      now_ms_ = static_cast<uint16_t>(now_ms_ + std::min(left_ms, kStepMs));
      Step();
    }
  }

 private:
  static constexpr int kStepMs = 16;  // a step a millisecond would take long

  void Step() {
    pioneer_.Poll(now_ms_);
    if (pioneer_.tx_size() == 0) {
      return;
    }
    Require(static_cast<uint16_t>(now_ms_ - sent_ms_) >= pheromone::client::kCommandGapMs);
    sent_ms_ = now_ms_;
    Bytes sent;
    while (pioneer_.tx_size() != 0) {
      sent.push_back(*pioneer_.tx());
      pioneer_.OnPut(now_ms_);
    }
    const std::vector<Bytes> bodies = NaiveBodies(sent);
    Require(bodies.size() == 1 && NaivePacket(bodies[0]) == sent);
    const Bytes stand_still = {32, 0x3B, 0, 0};
    Require(pioneer_.known() || bodies[0][0] != 32 || bodies[0] == stand_still);
  }

  uint16_t now_ms_ = 65'000;  // the clock wraps soon
  uint16_t sent_ms_ = now_ms_;
  Pioneer pioneer_{now_ms_};
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  Bytes stream;
  Line line;
  for (size_t at = 0; at + 1 < size; at += 2) {
    if (data[at] == 255) {
      const auto speed_mm_s = static_cast<int16_t>((data[at + 1] - 128) * 20);
      line.set_wheel_speeds(speed_mm_s, static_cast<int16_t>(-speed_mm_s));
      continue;
    }
    line.Wait(data[at]);
    line.OnByte(data[at + 1]);
    stream.push_back(data[at + 1]);
  }
  CheckReceiver(stream);
  return 0;
}
