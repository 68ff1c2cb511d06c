#include "client_fw/lab/phases.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "client_fw/lab/chance.h"
#include "client_fw/sim/differential_drive.h"
#include "server/core/engine/wire_units.h"

namespace pheromone::lab {
namespace {

constexpr double kStandingM = 0.001;

uint8_t SiteAt(std::span<const PheromoneSite> sites, double x_m, double y_m) {
  for (size_t i = 0; i < sites.size(); ++i) {
    const double dx = x_m - sites[i].x_m;
    const double dy = y_m - sites[i].y_m;
    if (dx * dx + dy * dy <= sites[i].radius_m * sites[i].radius_m) {
      return static_cast<uint8_t>(i + 1);
    }
  }
  return 0;
}

// The server's answer for the pose that the robot reports now.
Answer Ask(const field::Field& field, uint16_t pose_unit_10um, const StepTime& time,
           const std::vector<uint8_t>& senses, size_t i, Robots* robots) {
  const client::Pose pose = sim::ToClientPose(
      {robots->BelievedX()[i], robots->BelievedY()[i], robots->BelievedHeading()[i]});
  protocol::WirePose wire{0, 0, pose.heading};
  bool on_map = client::ToPoseUnits(pose.x_mm, pose_unit_10um, &wire.x) &&
                client::ToPoseUnits(pose.y_mm, pose_unit_10um, &wire.y);
  robots->sensed_x[i] = wire.x;
  robots->sensed_y[i] = wire.y;
  Answer answer;
  answer.heading = wire.heading;
  for (size_t slot = 0; slot < senses.size(); ++slot) {
    if (!on_map || (robots->want_sense[i] >> slot & 1) == 0) {
      continue;
    }
    const std::optional<field::Intensities> p =
        field.Sense(senses[slot], engine::ToField(wire, pose_unit_10um), time.now_ms());
    on_map = p.has_value();
    if (p) {
      const engine::WireIntensities on_wire = engine::ToWire(*p);
      answer.left[slot] = on_wire.left;
      answer.right[slot] = on_wire.right;
    }
  }
  answer.on_map = on_map ? 1 : 0;
  return answer;
}

// 1: yes.
uint64_t HasIntensities(const Answer& answer, size_t slots) {
  return answer.on_map != 0 && slots != 0 ? 1 : 0;
}

// The robot has it.
void Receive(const Answer& answer, size_t slots, size_t i, Robots* robots) {
  robots->sensed_heading[i] = answer.heading;
  robots->on_map[i] = answer.on_map;
  for (size_t slot = 0; slot < slots; ++slot) {
    robots->p_left[slot][i] = answer.left[slot];
    robots->p_right[slot][i] = answer.right[slot];
  }
}

// Exchanges over a radio that are due. `ask` returns the answer for now.
template <typename AskNow>
Heard Hear(const RoundsLink& link, int64_t now_ms, size_t slots, size_t i, AskNow&& ask,
           Radio::State* state, Robots* robots) {
  Heard heard;
  robots->asked[i] = robots->answered[i] = 0;
  for (;;) {
    if (!state->asked && state->next.ask_ms <= now_ms) {
      state->answer = ask();
      state->asked = true;
      robots->asked[i] = 1;
    }
    if (!state->asked || state->next.answer_ms > now_ms) {
      break;
    }
    const bool late = state->heard && state->next.answer_ms - state->heard_ms > kFailSafeMs;
    heard += {HasIntensities(state->answer, slots), late && !state->stopped ? 1u : 0u};
    state->asked = state->stopped = false;
    state->heard = true;
    state->heard_ms = state->next.answer_ms;
    state->next = link.After(i, state->next);
    robots->answered[i] = 1;
    Receive(state->answer, slots, i, robots);
  }
  const bool silent = now_ms - state->heard_ms >= kFailSafeMs;
  if (state->heard && silent && !state->stopped) {
    state->stopped = true;
    ++heard.fail_safe_stops;
  }
  robots->silent[i] = !state->heard || silent ? 1 : 0;
  return heard;
}

// How far a wheel that rolls so far takes the robot.
double TakenM(const OdometryErrors& errors, const StepTime& time, size_t robot, double roll_m,
              Use slip) {
  return errors.slip == 0
             ? roll_m
             : roll_m * (1 - errors.slip * PheromoneUniform(time.seed, robot, time.step, slip));
}

// What the robot's odometry counts of it.
double CountedM(const OdometryErrors& errors, const StepTime& time, size_t robot, double roll_m,
                Use bias, Use noise) {
  return roll_m * (1 + errors.bias * PheromoneNormal(time.seed, robot, 0, bias) +
                   errors.noise * PheromoneNormal(time.seed, robot, time.step, noise));
}

// Where the robot believes to be after it has rolled that.
void Believe(const RobotGroup& group, const StepTime& time, size_t i, double left_m, double right_m,
             Robots* robots) {
  sim::PlanePose pose{robots->believed_x_m[i], robots->believed_y_m[i],
                      robots->believed_heading_rad[i]};
  pose = sim::MoveOnArc(pose, left_m, right_m, group.wheels.wheelbase_m);
  const auto period_ms = static_cast<uint64_t>(group.fixes.period_ms);
  const uint64_t next_ms = time.now_ms() + time.step_ms;
  if (period_ms != 0 && next_ms / period_ms != time.now_ms() / period_ms) {
    pose.x_m =
        robots->x_m[i] + group.fixes.sigma_m * PheromoneNormal(time.seed, i, time.step, kFixX);
    pose.y_m =
        robots->y_m[i] + group.fixes.sigma_m * PheromoneNormal(time.seed, i, time.step, kFixY);
  }
  robots->believed_x_m[i] = pose.x_m;
  robots->believed_y_m[i] = pose.y_m;
  robots->believed_heading_rad[i] = pose.heading_rad;
}

double SquareOf(double a, double b) {
  return a * a + b * b;
}

}  // namespace

Radio::Radio(size_t count, const RadioModel& model, uint64_t seed)
    : link(count, model, seed), robots(count) {
  for (size_t i = 0; i < count; ++i) {
    robots[i].next = link.First(i);
  }
}

Heard Sense(const field::Field& field, uint16_t pose_unit_10um,
            std::span<const PheromoneSite> sites, const StepTime& time, const Slice& slice,
            Radio* radio, Robots* robots) {
  const std::vector<uint8_t>& senses = slice.group->senses;
  Heard heard;
  for (size_t i = slice.first; i < slice.end(); ++i) {
    const auto ask = [&] { return Ask(field, pose_unit_10um, time, senses, i, robots); };
    if (radio == nullptr) {
      const Answer answer = ask();
      Receive(answer, senses.size(), i, robots);
      heard.answers += HasIntensities(answer, senses.size());
    } else {
      heard += Hear(radio->link, static_cast<int64_t>(time.now_ms()), senses.size(), i, ask,
                    &radio->robots[i], robots);
    }
    robots->site[i] = SiteAt(sites, robots->x_m[i], robots->y_m[i]);
  }
  return heard;
}

double Roll(const StepTime& time, const Slice& slice, Robots* robots) {
  const Wheels& wheels = slice.group->wheels;
  const double seconds = time.step_s();
  const auto roll = [&](bool stands, double want_m_s, double* speed_m_s) {
    const double target =
        sim::WheelTarget(stands ? 0 : want_m_s * 1000, wheels.quantum_mm_s, wheels.max_speed_m_s);
    return sim::RollWheel(target, wheels.acceleration_m_s2, seconds, speed_m_s);
  };
  const OdometryErrors& errors = slice.group->odometry;
  double most_way_m = 0;
  for (size_t i = slice.first; i < slice.end(); ++i) {
    const bool stands = robots->failed[i] != 0 || robots->silent[i] != 0;
    const double left_m = roll(stands, robots->want_left_m_s[i], &robots->left_m_s[i]);
    const double right_m = roll(stands, robots->want_right_m_s[i], &robots->right_m_s[i]);
    robots->roll_left_m[i] = left_m;
    robots->roll_right_m[i] = right_m;
    const double true_left_m = TakenM(errors, time, i, left_m, kLeftSlip);
    const double true_right_m = TakenM(errors, time, i, right_m, kRightSlip);
    const sim::PlanePose next =
        sim::MoveOnArc({robots->x_m[i], robots->y_m[i], robots->heading_rad[i]}, true_left_m,
                       true_right_m, wheels.wheelbase_m);
    robots->next_x_m[i] = next.x_m;
    robots->next_y_m[i] = next.y_m;
    robots->next_heading_rad[i] = next.heading_rad;
    robots->roll_way_m[i] = std::abs(true_left_m + true_right_m) / 2;
    most_way_m = std::max(most_way_m, robots->roll_way_m[i]);
  }
  return most_way_m;
}

void Collide(const StepTime& time, const Surroundings& around, const Slice& slice, Robots* robots) {
  const Robots& all = *robots;
  const Walls& walls = around.walls;
  for (size_t i = slice.first; i < slice.end(); ++i) {
    const double x = all.next_x_m[i];
    const double y = all.next_y_m[i];
    const double radius = static_cast<double>(all.radius_m[i]);
    uint8_t blocked = kPheromoneNoContact;
    if (around.most_radius_m > 0 && radius > 0) {
      const auto goes_first = [&](size_t other) {
        const uint64_t mine = PheromoneHash(time.seed, i, time.step, kRightOfWay);
        const uint64_t others = PheromoneHash(time.seed, other, time.step, kRightOfWay);
        return others > mine || (others == mine && other < i);
      };
      // A robot in the way is there now, or comes from no farther than its way.
      const double reach_m = radius + around.most_radius_m + around.most_way_m;
      around.grid.VisitNear(x, y, reach_m, [&](size_t other) {
        const double both = radius + static_cast<double>(all.radius_m[other]);
        if (other == i || all.radius_m[other] == 0) {
          return;
        }
        if (SquareOf(x - all.x_m[other], y - all.y_m[other]) < both * both ||
            (SquareOf(x - all.next_x_m[other], y - all.next_y_m[other]) < both * both &&
             goes_first(other))) {
          blocked = kPheromoneRobotContact;
        }
      });
    }
    if (!walls.IsOnMap(x, y) ||
        (walls.Touches(x, y, radius) && !walls.Touches(all.x_m[i], all.y_m[i], radius))) {
      blocked = kPheromoneWallContact;
    }
    robots->blocked[i] = blocked;
  }
}

Moves Commit(const StepTime& time, const Slice& slice, Robots* robots) {
  const RobotGroup& group = *slice.group;
  const OdometryErrors& errors = group.odometry;
  const bool believes = group.odometry.any() || group.fixes.period_ms != 0;
  Moves moves;
  for (size_t i = slice.first; i < slice.end(); ++i) {
    double left_m = robots->roll_left_m[i];
    double right_m = robots->roll_right_m[i];
    const uint8_t blocked = robots->blocked[i];
    double moved_m = robots->roll_way_m[i];
    robots->heading_rad[i] = robots->next_heading_rad[i];
    if (blocked == kPheromoneNoContact) {
      robots->x_m[i] = robots->next_x_m[i];
      robots->y_m[i] = robots->next_y_m[i];
      robots->way_m[i] += moved_m;
    } else {
      moved_m = 0;
      left_m = (left_m - right_m) / 2;
      right_m = -left_m;
      robots->left_m_s[i] = (robots->left_m_s[i] - robots->right_m_s[i]) / 2;
      robots->right_m_s[i] = -robots->left_m_s[i];
      if (robots->contact[i] != blocked) {
        ++(blocked == kPheromoneRobotContact ? moves.robot_contacts : moves.wall_contacts);
      }
    }
    robots->contact[i] = blocked;
    moves.standing += moved_m < kStandingM ? 1u : 0u;
    if (believes) {
      Believe(group, time, i, CountedM(errors, time, i, left_m, kLeftBias, kLeftNoise),
              CountedM(errors, time, i, right_m, kRightBias, kRightNoise), robots);
    } else if (!robots->believed_x_m.empty()) {
      robots->believed_x_m[i] = robots->x_m[i];
      robots->believed_y_m[i] = robots->y_m[i];
      robots->believed_heading_rad[i] = robots->heading_rad[i];
    }
  }
  return moves;
}

}  // namespace pheromone::lab
