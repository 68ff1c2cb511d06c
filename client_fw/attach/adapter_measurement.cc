#include "client_fw/attach/adapter_measurement.h"

#include <algorithm>
#include <functional>
#include <utility>

#include "client_fw/attach/adapter.h"

namespace pheromone::attach {
namespace {

using protocol::FrameParser;

// With a timer of 1 ms: USB asks once a millisecond, and this computer takes its time.
constexpr int64_t kQuickNs = 2'500'000;
// Between the two it stays what it was.
constexpr int64_t kLazyNs = 4'000'000;
constexpr int kMaxWanted = 64;

}  // namespace

AdapterMeasurement::AdapterMeasurement(uint32_t baud, uint8_t told_ms)
    : byte_ns_(int64_t{10'000'000'000} / baud),
      quick_ms_(std::min(told_ms, kRoundsLatencyMs)),
      lazy_ms_(told_ms <= kRoundsLatencyMs ? kUsualLatencyMs : told_ms),
      quick_(told_ms <= kRoundsLatencyMs) {}

void AdapterMeasurement::OnBytes(std::span<const uint8_t> bytes, int64_t time_ns) {
  for (const uint8_t byte : bytes) {
    const bool was_open = parser_.open();
    const FrameParser::Result result = parser_.Push(byte);
    if (result == FrameParser::kRestart || (!was_open && parser_.open())) {
      on_air_ns_ = 0;
      least_ns_ = most_ns_ = time_ns;
    } else if (was_open && on_air_ns_ < kMostNs) {
      on_air_ns_ += byte_ns_;
      least_ns_ = std::min(least_ns_, time_ns - on_air_ns_);
      most_ns_ = std::max(most_ns_, time_ns - on_air_ns_);
    }
    if (result == FrameParser::kFrame) {
      OnFrame();
    }
  }
}

void AdapterMeasurement::OnFrame() {
  if (on_air_ns_ < kLeastNs) {
    return;
  }
  held_ns_[frames_++] = most_ns_ - least_ns_;
  if (frames_ == kFrames) {
    frames_ = 0;
    Judge();
  }
}

void AdapterMeasurement::Judge() {
  std::nth_element(held_ns_.begin(), held_ns_.begin() + kLate, held_ns_.end(), std::greater<>());
  news_ |= measured_ns_ == 0;
  measured_ns_ = std::max(held_ns_[kLate], int64_t{1});
  good_ = measured_ns_ <= kQuickNs ? good_ + 1 : 0;
  if (quick_ && measured_ns_ >= kLazyNs) {
    quick_ = false;
    news_ = true;
    wanted_ = std::min(2 * wanted_, kMaxWanted);
  } else if (!quick_ && good_ >= wanted_) {
    quick_ = true;
    news_ = true;
  }
}

bool AdapterMeasurement::TakeNews() {
  return std::exchange(news_, false);
}

}  // namespace pheromone::attach
