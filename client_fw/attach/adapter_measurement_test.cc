// Against a model of adapters, and of a computer that reads late.
#include "client_fw/attach/adapter_measurement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "client_fw/attach/adapter.h"
#include "protocol/frame.h"

namespace pheromone::attach {
namespace {

constexpr double kNsInMs = 1e6;
constexpr size_t kPacketBytes = 62;  // more bytes are not held back
constexpr int kJudged = 40;          // frames at a time

struct PortConditions {
  double timer_ms = 0;        // 0: a UART, which passes each byte on
  bool free_running = false;  // the timer runs all the time, instead of from the first byte held
  unsigned baud = 9600;
  double jitter_ms = 0.3;  // of each read
  double pause_ms = 3;     // between frames, at least
  double hiccups = 0;      // the share of reads that are up to 40 ms late
};

class SlowPort {
 public:
  SlowPort(AdapterMeasurement* measurement, const PortConditions& conditions)
      : measurement_(measurement), conditions_(conditions) {}

  // A frame with so many bytes of DATA, behind a pause.
  void SendOne(uint8_t data, bool damaged = false) {
    protocol::Message message;
    message.id = 7;
    message.opcode = 0x81;
    message.length = data;
    std::generate_n(message.data, data, [&] { return static_cast<uint8_t>(random_()); });
    std::array<uint8_t, protocol::kMaxFrame> wire{};
    const size_t size = EncodeFrame(message, wire.data(), wire.size());
    wire[3] ^= damaged ? uint8_t{0x40} : uint8_t{0};
    now_ms_ += conditions_.pause_ms + Uniform(0, 27);
    for (size_t i = 0; i < size; ++i) {
      now_ms_ += 10'000.0 / conditions_.baud;
      Arrive(wire[i]);
    }
  }

  void Send(int frames, const std::vector<uint8_t>& sizes) {
    for (int i = 0; i < frames; ++i) {
      SendOne(sizes[static_cast<size_t>(i) % sizes.size()]);
    }
    if (!held_.empty()) {
      Pass(due_ms_);
    }
  }

 private:
  double Uniform(double from, double to) {
    return std::uniform_real_distribution<>(from, to)(random_);
  }

  // At now_ms_.
  void Arrive(uint8_t byte) {
    if (!held_.empty() && due_ms_ <= now_ms_) {
      Pass(due_ms_);
    }
    if (held_.empty()) {
      const double timer_ms = conditions_.timer_ms;
      due_ms_ = now_ms_ + timer_ms;
      if (conditions_.free_running) {
        due_ms_ = std::ceil(now_ms_ / timer_ms) * timer_ms;
      }
    }
    held_.push_back(byte);
    if (conditions_.timer_ms == 0 || held_.size() == kPacketBytes) {
      Pass(now_ms_);
    }
  }

  void Pass(double at_ms) {
    at_ms += Uniform(0, conditions_.jitter_ms);
    if (Uniform(0, 1) < conditions_.hiccups) {
      at_ms += Uniform(0, 40);
    }
    read_ms_ = std::max(read_ms_, at_ms);
    measurement_->OnBytes(held_, static_cast<int64_t>(read_ms_ * kNsInMs));
    held_.clear();
  }

  AdapterMeasurement* measurement_;
  PortConditions conditions_;
  std::mt19937 random_{1};
  double now_ms_ = 0;
  double due_ms_ = 0;
  double read_ms_ = 0;
  std::vector<uint8_t> held_;
};

double MeasuredMs(const AdapterMeasurement& measurement) {
  return static_cast<double>(measurement.measured_ns()) / kNsInMs;
}

// Answers, requests, and a ROUND of three.
const std::vector<uint8_t> kTraffic = {4, 6, 21};

TEST(AdapterMeasurement, WhatTheDriverTellsHoldsUntilItIsMeasured) {
  for (const uint8_t told_ms : std::to_array<uint8_t>({0, 1, 2, 16, 40})) {
    AdapterMeasurement measurement(9600, told_ms);
    SlowPort port(&measurement, {.timer_ms = 16});
    port.Send(kJudged - 1, kTraffic);
    EXPECT_EQ(measurement.latency_ms(), told_ms);
    EXPECT_EQ(measurement.rounds(), told_ms <= kRoundsLatencyMs);
    EXPECT_FALSE(measurement.TakeNews());
  }
}

TEST(AdapterMeasurement, AQuickOneIsFoundWhateverItsDriverTells) {
  for (const uint8_t told_ms : std::to_array<uint8_t>({0, 1, 16, 40})) {
    for (const double timer_ms : {0, 1}) {
      AdapterMeasurement measurement(9600, told_ms);
      SlowPort port(&measurement, {.timer_ms = timer_ms});
      port.Send(kJudged, kTraffic);
      EXPECT_TRUE(measurement.TakeNews());
      EXPECT_FALSE(measurement.TakeNews());
      EXPECT_TRUE(measurement.rounds());
      EXPECT_EQ(measurement.latency_ms(), std::min(told_ms, kRoundsLatencyMs));
      EXPECT_LE(MeasuredMs(measurement), timer_ms + 0.3);  // and the jitter
    }
  }
}

TEST(AdapterMeasurement, ALazyOneIsFoundWhateverItsDriverTells) {
  for (const uint8_t told_ms : std::to_array<uint8_t>({0, 1, 16, 40})) {
    for (const bool free_running : {false, true}) {
      AdapterMeasurement measurement(9600, told_ms);
      SlowPort port(&measurement, {.timer_ms = 16, .free_running = free_running});
      port.Send(kJudged, kTraffic);
      EXPECT_TRUE(measurement.TakeNews());
      EXPECT_FALSE(measurement.rounds());
      EXPECT_EQ(measurement.latency_ms(), told_ms > 1 ? told_ms : kUsualLatencyMs);
      EXPECT_GE(MeasuredMs(measurement), 16 - 1.05);  // but for a byte
      EXPECT_LE(MeasuredMs(measurement), 16 + 0.3);
    }
  }
}

// From the first byte held on, 16 bytes come in 16 ms, the last of them 375 us before the end.
TEST(AdapterMeasurement, TellsATimerExactlyButForTheLastByteInIt) {
  AdapterMeasurement measurement(9600, 1);
  SlowPort port(&measurement, {.timer_ms = 16, .jitter_ms = 0, .pause_ms = 17});
  port.Send(kJudged, {30});
  EXPECT_NEAR(MeasuredMs(measurement), 16 - 0.375, 0.001);
}

// Which is not told from 1 ms for sure, but is never taken for more than it is.
TEST(AdapterMeasurement, ATimerOf2Ms) {
  AdapterMeasurement measurement(9600, 16);
  SlowPort port(&measurement, {.timer_ms = 2});
  port.Send(kJudged, kTraffic);
  EXPECT_GE(MeasuredMs(measurement), 0.95);
  EXPECT_LE(MeasuredMs(measurement), 2.3);
}

TEST(AdapterMeasurement, FastBytesAreHeldBackInWholePackets) {
  AdapterMeasurement measurement(115'200, 1);
  SlowPort port(&measurement, {.timer_ms = 16, .baud = 115'200});
  port.Send(2 * kJudged, {60, 64});
  EXPECT_FALSE(measurement.rounds());
}

// They would be over before an adapter passes on their beginning.
TEST(AdapterMeasurement, ShortFramesSayNothing) {
  AdapterMeasurement measurement(38'400, 16);
  SlowPort port(&measurement, {.timer_ms = 0, .baud = 38'400});
  port.Send(1000, {4, 6});
  EXPECT_EQ(measurement.measured_ns(), 0);
  port.Send(kJudged, {21});
  EXPECT_TRUE(measurement.rounds());
}

TEST(AdapterMeasurement, NorDoDamagedOnes) {
  AdapterMeasurement measurement(9600, 16);
  SlowPort port(&measurement, {});
  for (int i = 0; i < 1000; ++i) {
    port.SendOne(21, true);
  }
  EXPECT_EQ(measurement.measured_ns(), 0);
}

// One read in 500 is late: about one frame in 20.
TEST(AdapterMeasurement, AComputerThatIsLateNowAndThenChangesNothing) {
  for (const double timer_ms : {0, 1, 16}) {
    AdapterMeasurement measurement(9600, timer_ms > 1 ? kUsualLatencyMs : uint8_t{1});
    const bool quick = measurement.rounds();
    SlowPort port(&measurement, {.timer_ms = timer_ms, .hiccups = 0.002});
    port.Send(kJudged, kTraffic);
    EXPECT_TRUE(measurement.TakeNews());
    for (int i = 0; i < 20'000; ++i) {
      port.SendOne(kTraffic[static_cast<size_t>(i) % kTraffic.size()]);
      ASSERT_FALSE(measurement.TakeNews()) << "after " << i << " frames";
    }
    EXPECT_EQ(measurement.rounds(), quick);
  }
}

// Whatever a busy computer does, it makes the robot contend.
TEST(AdapterMeasurement, AComputerThatIsLateOftenIsTakenForALazyAdapter) {
  AdapterMeasurement measurement(9600, 1);
  SlowPort port(&measurement, {.hiccups = 0.1});
  port.Send(kJudged, kTraffic);
  EXPECT_FALSE(measurement.rounds());
  EXPECT_EQ(measurement.latency_ms(), kUsualLatencyMs);
}

// Each time it takes twice as long: 1 + 2 + 4 ... judgements, 64 at most.
TEST(AdapterMeasurement, OneThatIsLazyNowAndThenContends) {
  AdapterMeasurement measurement(9600, 1);
  int changes = 0;
  for (const int quick : {0, 1, 2, 3, 4, 7, 8, 15, 16, 31, 32, 63, 64, 63, 64}) {
    SlowPort lazy(&measurement, {.timer_ms = 16});
    lazy.Send(kJudged, {21});
    lazy.Send(kJudged, {21});
    EXPECT_FALSE(measurement.rounds());
    SlowPort port(&measurement, {});
    port.Send(kJudged * quick, {21});
    changes += measurement.rounds() ? 1 : 0;
  }
  EXPECT_EQ(changes, 7);
}

}  // namespace
}  // namespace pheromone::attach
