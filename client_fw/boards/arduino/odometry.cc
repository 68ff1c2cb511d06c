#include "client_fw/boards/arduino/odometry.h"

namespace pheromone {
namespace arduino {
namespace {

// `um` times a cosine in Q14, rounded. um is below 131 072.
int32_t Along(int32_t um, int16_t q14) {
  return (um * q14 + 8192) >> 14;
}

}  // namespace

void WheelOdometry::Add(int16_t left, int16_t right) {
  if (left > max_ticks_ || left < -max_ticks_ || right > max_ticks_ || right < -max_ticks_) {
    const auto left_half = static_cast<int16_t>(left / 2);
    const auto right_half = static_cast<int16_t>(right / 2);
    Add(left_half, right_half);
    Add(static_cast<int16_t>(left - left_half), static_cast<int16_t>(right - right_half));
    return;
  }
  const int32_t way_nm = (int32_t{left} + right) * static_cast<int32_t>(tick_nm_) / 2 + rest_nm_;
  const int32_t way_um = way_nm / 1000;
  rest_nm_ = static_cast<int16_t>(way_nm - way_um * 1000);
  const uint32_t turn = static_cast<uint32_t>(int32_t{right} - left) * heading_per_tick_;
  // The chord of the arc has the heading of its middle.
  const auto middle = static_cast<client::BinaryAngle>(
      (turned_ + static_cast<uint32_t>(static_cast<int32_t>(turn) / 2)) >> 16);
  turned_ += turn;
  x_um_ += Along(way_um, client::CosQ14(middle));
  y_um_ += Along(way_um, client::SinQ14(middle));
}

void WheelOdometry::Set(const client::Odometry& pose) {
  x_um_ = pose.x_mm * 1000;
  y_um_ = pose.y_mm * 1000;
  turned_ = uint32_t{pose.heading} << 16;
}

}  // namespace arduino
}  // namespace pheromone
