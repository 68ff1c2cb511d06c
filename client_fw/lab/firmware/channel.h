// The channel on which rounds were measured (link/measured_rounds.h), with carrier detect.
#pragma once

#include <cstdint>

#include "client_fw/core/conversation.h"
#include "server/robots/radio/timing.h"

namespace pheromone::lab {

constexpr uint32_t kBaud = client::Parameters().baud;
constexpr radio::Duration kTwoMs(2'000'000);
constexpr radio::Timing kTiming{
    .byte = radio::ByteTime(kBaud), .turnaround = kTwoMs, .processing = kTwoMs};

constexpr uint8_t WholeMs(radio::Duration time) {
  return static_cast<uint8_t>((time.count() + 999'999) / 1'000'000);
}
constexpr uint8_t kSlotMs = WholeMs(kTiming.turnaround);
constexpr uint8_t kWindowMs = WholeMs(kTiming.ResponseWindow());
constexpr uint8_t kTurnMs = client::BytesMs(client::kMaxClientFrame, kBaud);

}  // namespace pheromone::lab
