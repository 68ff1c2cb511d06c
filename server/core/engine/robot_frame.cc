#include "server/core/engine/robot_frame.h"

#include <cmath>
#include <cstdlib>
#include <numbers>
#include <set>
#include <utility>

#include "server/core/field/heading.h"

namespace pheromone::engine {
namespace {

__extension__ using Int128 = __int128;

constexpr int kRotationBits = 30;
constexpr int64_t kOneQ30 = int64_t{1} << kRotationBits;

int64_t RoundQ30(Int128 value) {
  const Int128 half = kOneQ30 / 2;
  return static_cast<int64_t>(value < 0 ? -((-value + half) >> kRotationBits)
                                        : (value + half) >> kRotationBits);
}

// Rounding each of the two numbers moves the square of the length by less than 2 units of 2^-30.
bool HasUnitLength(const RobotFrame& frame) {
  const Int128 cos = frame.cos_q30;
  const Int128 sin = frame.sin_q30;
  const Int128 excess = cos * cos + sin * sin - Int128{kOneQ30} * kOneQ30;
  constexpr int64_t kSlack = 2 * kOneQ30;
  return excess > -kSlack && excess < kSlack;
}

// Within the rounding of a binary angle and of its direction in 1/16 384.
bool AgreesWithItsHeading(const RobotFrame& frame) {
  constexpr int64_t kQ14ToQ30 = 1 << 16;
  const field::DirectionQ14 direction = field::DirectionOf(frame.heading);
  return std::abs(frame.cos_q30 - direction.cos * kQ14ToQ30) < 2 * kQ14ToQ30 &&
         std::abs(frame.sin_q30 - direction.sin * kQ14ToQ30) < 2 * kQ14ToQ30;
}

}  // namespace

RobotFrame MakeFrame(std::string link, uint8_t id, field::PointUm origin, double heading_deg) {
  // Whole turns are removed first: the remainder then keeps its digits, and the axes stay exact.
  const double turn = std::remainder(heading_deg, 360.0) / 360.0;
  const double angle = turn * 2 * std::numbers::pi;
  const auto one = static_cast<double>(kOneQ30);
  RobotFrame frame;
  frame.link = std::move(link);
  frame.id = id;
  frame.x_um = origin.x;
  frame.y_um = origin.y;
  frame.heading = static_cast<uint16_t>(std::llround(turn * 65536));
  frame.cos_q30 = static_cast<int32_t>(std::llround(std::cos(angle) * one));
  frame.sin_q30 = static_cast<int32_t>(std::llround(std::sin(angle) * one));
  return frame;
}

Status CheckFrames(const std::vector<RobotFrame>& frames) {
  std::set<std::pair<std::string, uint8_t>> seen;
  for (const RobotFrame& frame : frames) {
    const std::string who =
        "the frame of robot " + std::to_string(frame.id) + " on link \"" + frame.link + "\" ";
    if (frame.id == 0 || frame.id == 255) {
      return Error{who + "has an invalid robot ID, expected 1 to 254"};
    }
    if (!seen.emplace(frame.link, frame.id).second) {
      return Error{who + "is defined twice"};
    }
    // Two comparisons, since the smallest integer has no absolute value.
    const auto in_range = [](int64_t um) { return um >= -kMaxOffsetUm && um <= kMaxOffsetUm; };
    if (!in_range(frame.x_um) || !in_range(frame.y_um)) {
      return Error{who + "has its origin at (" + std::to_string(frame.x_um) + ", " +
                   std::to_string(frame.y_um) + ") um, expected no more than 10^15"};
    }
    if (!HasUnitLength(frame) || !AgreesWithItsHeading(frame)) {
      return Error{who + "is turned by cos " + std::to_string(frame.cos_q30) + ", sin " +
                   std::to_string(frame.sin_q30) + " (in 2^-30), expected those of its heading " +
                   std::to_string(frame.heading) + " (65536 a turn)"};
    }
  }
  return Ok();
}

field::PoseUm ToMap(const RobotFrame& frame, const field::PoseUm& reported) {
  const Int128 x = reported.position.x;
  const Int128 y = reported.position.y;
  return {{RoundQ30(frame.cos_q30 * x - frame.sin_q30 * y) + frame.x_um,
           RoundQ30(frame.sin_q30 * x + frame.cos_q30 * y) + frame.y_um},
          static_cast<uint16_t>(reported.heading + frame.heading)};
}

field::PointUm DifferenceFromMap(const RobotFrame& frame, const field::PointUm& difference) {
  const Int128 x = difference.x;
  const Int128 y = difference.y;
  return {RoundQ30(frame.cos_q30 * x + frame.sin_q30 * y),
          RoundQ30(frame.cos_q30 * y - frame.sin_q30 * x)};
}

}  // namespace pheromone::engine
