#include "client_fw/lab/world.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <utility>

#include "server/base/hash.h"
#include "server/core/engine/wire_units.h"

namespace pheromone::lab {
namespace {

// So many robots one thread does at once: some 0.1 ms.
constexpr size_t kSliceRobots = 256;
constexpr size_t kMaxWorldRobots = 1'000'000;

size_t CountOf(std::span<const RobotGroup> groups) {
  size_t count = 0;
  for (const RobotGroup& group : groups) {
    count += group.starts.size();
  }
  return count;
}

size_t MostSlots(std::span<const RobotGroup> groups) {
  size_t most = 0;
  for (const RobotGroup& group : groups) {
    most = std::max(most, group.senses.size());
  }
  return most;
}

bool AnyBelieves(std::span<const RobotGroup> groups) {
  return std::any_of(groups.begin(), groups.end(), [](const RobotGroup& group) {
    return group.odometry.any() || group.fixes.period_ms != 0;
  });
}

double MostRadiusM(std::span<const RobotGroup> groups) {
  double most = 0;
  for (const RobotGroup& group : groups) {
    most = std::max(most, group.radius_m);
  }
  return most;
}

Status CheckGroup(const field::FieldConfig& field, const RobotGroup& group) {
  if (group.starts.empty() || group.senses.size() > kPheromoneSlots) {
    return Error{
        fmt::format("group \"{}\": found {} robots and {} pheromones, expected at least "
                    "one robot, and at most {} pheromones",
                    group.name, group.starts.size(), group.senses.size(), int{kPheromoneSlots})};
  }
  for (const uint8_t type : group.senses) {
    if (field.FindLaw(type) == nullptr) {
      return Error{fmt::format("group \"{}\" senses pheromone {}, which the map does not have",
                               group.name, type)};
    }
  }
  const field::PheromoneLaw* deposits = field.FindLaw(group.deposits);
  if (group.deposits != 0 && (deposits == nullptr || deposits->is_blend())) {
    return Error{
        fmt::format("group \"{}\" deposits pheromone {}, expected one that the map has "
                    "and that is no blend",
                    group.name, group.deposits)};
  }
  return Ok();
}

Status CheckRadio(const RadioModel& model, int64_t step_ms) {
  if (FindMeasured(model.lost_percent, model.robots_per_channel) == nullptr) {
    return Error{
        fmt::format("found {} robots a channel with {} % lost, expected one of the "
                    "measured rounds: 1 to {} robots with 0, 1 or 5 % lost",
                    model.robots_per_channel, model.lost_percent, kMaxMeasuredRobots)};
  }
  if (step_ms > kMaxRadioStepMs) {
    return Error{fmt::format("found a step of {} ms with a modelled radio, expected at most {} ms",
                             step_ms, kMaxRadioStepMs)};
  }
  return Ok();
}

// Slices of equal size, so that the groups' ends are theirs.
std::vector<Slice> SlicesOf(std::span<const RobotGroup> groups) {
  std::vector<Slice> slices;
  size_t first = 0;
  for (const RobotGroup& group : groups) {
    for (size_t begin = 0; begin < group.starts.size(); begin += kSliceRobots) {
      slices.push_back(
          {&group, first, first + begin, std::min(kSliceRobots, group.starts.size() - begin)});
    }
    first += group.starts.size();
  }
  return slices;
}

// The error of the robot with the least number, whoever finds one first.
class FirstError {
 public:
  void Note(size_t robot, const Status& status) {
    if (status.ok()) {
      return;
    }
    const std::lock_guard lock(mutex_);
    if (!error_ || robot < robot_) {
      robot_ = robot;
      error_ = status.error();
    }
  }
  Status status() const { return error_ ? Status(*error_) : Ok(); }

 private:
  std::mutex mutex_;
  size_t robot_ = 0;
  std::optional<Error> error_;
};

}  // namespace

std::string NameOf(const RobotGroup& group, size_t robot) {
  return fmt::format("robot {} (index {}) of \"{}\"", robot + 1, robot, group.name);
}

Result<std::unique_ptr<World>> World::Create(WorldConfig config) {
  const size_t count = CountOf(config.groups);
  if (count == 0 || count > kMaxWorldRobots || config.sites.size() > kMaxSites) {
    return Error{
        fmt::format("found {} robots and {} sites, expected 1 to {} robots and at most {} "
                    "sites",
                    count, config.sites.size(), kMaxWorldRobots, kMaxSites)};
  }
  if (config.step_ms < 1 || config.step_ms > 60'000 || config.threads < 1 ||
      config.coverage_cell_um < config.field.map.cell_um) {
    return Error{
        fmt::format("found a step of {} ms, {} threads and places of {} um, expected 1 to "
                    "60000 ms, at least one thread, and places no smaller than a cell of "
                    "the map",
                    config.step_ms, config.threads, config.coverage_cell_um)};
  }
  if (config.radio) {
    PHEROMONE_TRY_STATUS(CheckRadio(*config.radio, config.step_ms));
  }
  for (const RobotGroup& group : config.groups) {
    PHEROMONE_TRY_STATUS(CheckGroup(config.field, group));
  }
  std::unique_ptr<World> world(new World(std::move(config)));
  PHEROMONE_TRY_STATUS(world->Place());
  return world;
}

World::World(WorldConfig config)
    : config_(std::move(config)),
      time_{config_.seed, 0, static_cast<uint64_t>(config_.step_ms)},
      robots_(CountOf(config_.groups), MostSlots(config_.groups), AnyBelieves(config_.groups)),
      slices_(SlicesOf(config_.groups)),
      field_(std::make_unique<field::Field>(config_.field)),
      walls_(config_.field, MostRadiusM(config_.groups) * 1.001),
      // A disc and what it may meet are then in four cells or fewer.
      grid_(config_.field.map, std::max(4 * MostRadiusM(config_.groups), 0.1), robots_.count),
      radio_(config_.radio ? std::make_unique<Radio>(robots_.count, *config_.radio, config_.seed)
                           : nullptr),
      most_radius_m_(static_cast<double>(static_cast<float>(MostRadiusM(config_.groups)))),
      ways_m_(slices_.size()),
      sites_(config_.sites),
      coverage_(config_.field, config_.coverage_cell_um),
      // More threads than slices would wait for nothing.
      pool_(std::min(config_.threads, static_cast<int>(std::min<size_t>(slices_.size(), 256)))) {
  for (const RobotGroup& group : config_.groups) {
    Behaviour* behaviour = group.behaviour.get();
    if (behaviour != nullptr &&
        std::find(behaviours_.begin(), behaviours_.end(), behaviour) == behaviours_.end()) {
      behaviours_.push_back(behaviour);
    }
  }
}

Status World::Place() {
  size_t i = 0;
  for (const RobotGroup& group : config_.groups) {
    for (const sim::PlanePose& start : group.starts) {
      const double radius_m = static_cast<double>(static_cast<float>(group.radius_m));
      if (!walls_.IsOnMap(start.x_m, start.y_m) || walls_.Touches(start.x_m, start.y_m, radius_m)) {
        return Error{
            fmt::format("{} starts at ({:g}, {:g}), expected a place on the map, farther "
                        "than {:g} m from every obstacle",
                        NameOf(group, i), start.x_m, start.y_m, group.radius_m)};
      }
      robots_.x_m[i] = robots_.next_x_m[i] = start.x_m;
      robots_.y_m[i] = robots_.next_y_m[i] = start.y_m;
      robots_.heading_rad[i] = robots_.next_heading_rad[i] = start.heading_rad;
      robots_.radius_m[i] = static_cast<float>(group.radius_m);
      ++i;
    }
    const size_t count = group.starts.size();
    ResetActions({&group, i - count, i - count, count});
  }
  if (!robots_.believed_x_m.empty()) {
    robots_.believed_x_m = robots_.x_m;
    robots_.believed_y_m = robots_.y_m;
    robots_.believed_heading_rad = robots_.heading_rad;
  }
  paths_ = PathWatch(config_.field.paths, robots_);
  BuildGrid();
  std::optional<Error> overlap;
  for (const Slice& slice : slices_) {
    Collide(time_, Around(), slice, &robots_);
    for (i = slice.first; i < slice.end() && !overlap; ++i) {
      if (robots_.blocked[i] == kPheromoneRobotContact) {
        overlap = Error{fmt::format("{} starts at ({:g}, {:g}), where it overlaps another robot",
                                    NameOf(*slice.group, i), robots_.x_m[i], robots_.y_m[i])};
      }
    }
  }
  return overlap ? Status(*overlap) : Ok();
}

Status World::Step() {
  PHEROMONE_TRY_STATUS(Sense());
  return Act();
}

Status World::Sense() {
  sites_.Refill(time_.now_ms());
  Portions portions(slices_.size());
  FirstError error;
  pool_.Run([&](int /*worker*/) {
    portions.Work([&](size_t i) {
      const Slice& slice = slices_[i];
      SenseSlice(slice);
      error.Note(slice.first, Behave(slice));
    });
  });
  return error.status();
}

Status World::Act() {
  for (const Slice& slice : slices_) {
    if (slice.group->behaviour == nullptr) {
      PHEROMONE_TRY_STATUS(CheckActions(slice));
    }
  }
  sites_.HandleLoads(time_.now_ms(), &robots_);
  const size_t count = slices_.size();
  Portions roll(count + 1);
  Portions collide(count);
  Portions commit(count);
  Status deposited = Ok();
  pool_.Run([&](int worker) {
    if (worker == 0) {
      deposited = Deposit();
      field_->Advance(time_.now_ms());
      if (deposited.ok()) {
        deposited = EndBehaviours();
      }
    }
    roll.Work([&](size_t i) {
      if (i == 0) {
        BuildGrid();
      } else {
        RollSlice(i - 1);
      }
    });
    roll.Await();
    const Surroundings around = Around();
    collide.Work([&](size_t i) { Collide(time_, around, slices_[i], &robots_); });
    collide.Await();
    commit.Work([&](size_t i) { CommitSlice(slices_[i]); });
  });
  EndStep();
  return deposited;
}

Status World::Run(Phase phase) {
  const auto each = [&](auto&& work) {
    for (const Slice& slice : slices_) {
      work(slice);
    }
  };
  Status status = Ok();
  switch (phase) {
    case Phase::kSense:
      sites_.Refill(time_.now_ms());
      each([&](const Slice& slice) { SenseSlice(slice); });
      break;
    case Phase::kBehave:
      each([&](const Slice& slice) {
        if (status.ok()) {
          status = Behave(slice);
        }
      });
      break;
    case Phase::kLoads:
      sites_.HandleLoads(time_.now_ms(), &robots_);
      break;
    case Phase::kDeposit:
      return Deposit();
    case Phase::kAdvance:
      field_->Advance(time_.now_ms());
      return EndBehaviours();
    case Phase::kRoll:
      for (size_t i = 0; i < slices_.size(); ++i) {
        RollSlice(i);
      }
      break;
    case Phase::kGrid:
      BuildGrid();
      break;
    case Phase::kCollide:
      each([&, around = Around()](const Slice& slice) { Collide(time_, around, slice, &robots_); });
      break;
    case Phase::kCommit:
      each([&](const Slice& slice) { CommitSlice(slice); });
      EndStep();
      break;
  }
  return status;
}

Surroundings World::Around() const {
  return {grid_, walls_, most_radius_m_, *std::max_element(ways_m_.begin(), ways_m_.end())};
}

PheromoneView World::ViewOf(const Slice& slice) const {
  PheromoneView view{};
  view.bytes = sizeof view;
  view.seed = time_.seed;
  view.step = time_.step;
  view.time_ms = time_.now_ms();
  view.step_s = time_.step_s();
  view.robots = robots_.count;
  view.group_first = slice.group_first;
  view.group_count = slice.group->starts.size();
  view.wheelbase_m = slice.group->wheels.wheelbase_m;
  view.max_speed_m_s = slice.group->wheels.max_speed_m_s;
  view.x_m = robots_.BelievedX();
  view.y_m = robots_.BelievedY();
  view.heading_rad = robots_.BelievedHeading();
  view.heading = robots_.sensed_heading.data();
  view.left_m_s = robots_.left_m_s.data();
  view.right_m_s = robots_.right_m_s.data();
  view.slots = slice.group->senses.size();
  for (size_t slot = 0; slot < view.slots; ++slot) {
    view.p_left[slot] = robots_.p_left[slot].data();
    view.p_right[slot] = robots_.p_right[slot].data();
    view.types[slot] = slice.group->senses[slot];
  }
  view.on_map = robots_.on_map.data();
  view.contact = robots_.contact.data();
  view.site = robots_.site.data();
  view.load = robots_.load.data();
  view.sites = sites_.all().data();
  view.site_count = sites_.all().size();
  view.answered = robots_.answered.data();
  return view;
}

PheromoneActions World::Actions() {
  return {robots_.want_left_m_s.data(), robots_.want_right_m_s.data(), robots_.want_quanta.data(),
          robots_.want_type.data(),     robots_.want_load.data(),      robots_.want_sense.data(),
          robots_.memory.data()};
}

void World::ResetActions(const Slice& slice) {
  const RobotGroup& group = *slice.group;
  for (size_t i = slice.first; i < slice.end(); ++i) {
    robots_.want_left_m_s[i] = 0;
    robots_.want_right_m_s[i] = 0;
    robots_.want_quanta[i] = 0;
    robots_.want_type[i] = group.deposits;
    robots_.want_load[i] = 0;
    robots_.want_sense[i] = static_cast<uint8_t>((1u << group.senses.size()) - 1);
  }
}

void World::SenseSlice(const Slice& slice) {
  const Heard heard = lab::Sense(*field_, config_.pose_unit_10um, sites_.all(), time_, slice,
                                 radio_.get(), &robots_);
  if (Measures()) {
    const std::lock_guard lock(mutex_);
    tally_.heard += heard;
  }
}

Status World::Behave(const Slice& slice) {
  const RobotGroup& group = *slice.group;
  if (group.behaviour == nullptr) {
    return Ok();
  }
  ResetActions(slice);
  PHEROMONE_TRY_STATUS(group.behaviour->Act(ViewOf(slice), Actions(), slice.first, slice.count));
  return CheckActions(slice);
}

Status World::CheckActions(const Slice& slice) const {
  const RobotGroup& group = *slice.group;
  const double most = group.wheels.max_speed_m_s;
  const auto wrong = [&](size_t i, std::string_view field, const auto& value,
                         const std::string& expected) {
    return Error{fmt::format("{}, step {}: {} is {}, expected {}", NameOf(group, i), time_.step,
                             field, value, expected)};
  };
  const auto speed_wrong = [&](size_t i, std::string_view field, double value) {
    return wrong(i, field, value, fmt::format("{:g} to {:g}", -most, most));
  };
  const unsigned slots = 1u << group.senses.size();
  for (size_t i = slice.first; i < slice.end(); ++i) {
    // Written so that NaN is wrong too.
    if (!(robots_.want_left_m_s[i] >= -most && robots_.want_left_m_s[i] <= most)) {
      return speed_wrong(i, "left_m_s", robots_.want_left_m_s[i]);
    }
    if (!(robots_.want_right_m_s[i] >= -most && robots_.want_right_m_s[i] <= most)) {
      return speed_wrong(i, "right_m_s", robots_.want_right_m_s[i]);
    }
    if (robots_.want_quanta[i] != 0) {
      const field::PheromoneLaw* law = field_->FindLaw(robots_.want_type[i]);
      if (law == nullptr || law->is_blend()) {
        return wrong(i, "pheromone", robots_.want_type[i],
                     fmt::format("one of the map that is no blend, since it deposits {} quanta",
                                 robots_.want_quanta[i]));
      }
    }
    if (robots_.want_load[i] < -1 || robots_.want_load[i] > 1) {
      return wrong(i, "load", int{robots_.want_load[i]}, "-1, 0 or 1");
    }
    if (robots_.want_sense[i] >= slots) {
      return wrong(i, "sense", robots_.want_sense[i],
                   fmt::format("0 to {}: a bit for each pheromone that it senses", slots - 1));
    }
  }
  return Ok();
}

Status World::Deposit() {
  for (const Slice& slice : slices_) {
    for (size_t i = slice.first; i < slice.end(); ++i) {
      const uint16_t quanta = robots_.want_quanta[i];
      if (quanta == 0 || robots_.failed[i] != 0 || robots_.asked[i] == 0) {
        continue;
      }
      const field::PointUm point{
          engine::ToMicrometres(robots_.sensed_x[i], config_.pose_unit_10um),
          engine::ToMicrometres(robots_.sensed_y[i], config_.pose_unit_10um)};
      switch (field_->Deposit(robots_.want_type[i], point, quanta, time_.now_ms())) {
        case field::DepositResult::kDone:
          tally_.deposited_quanta += quanta;
          break;
        case field::DepositResult::kMapFull:
          return MapFull();
        default:
          ++tally_.refused_deposits;
      }
    }
  }
  return Ok();
}

Error World::MapFull() const {
  return Error{
      fmt::format("step {}: the pheromone needs more than the {} MiB that the map may use: "
                  "expected a pheromone that evaporates sooner, fewer robots or larger cells",
                  time_.step, config_.field.memory_bytes >> 20)};
}

Status World::EndBehaviours() {
  for (Behaviour* behaviour : behaviours_) {
    PHEROMONE_TRY(const StepOutcome outcome, behaviour->EndStep(time_.now_ms()));
    if (outcome.map_full) {
      return MapFull();
    }
    tally_.deposited_quanta += outcome.deposited_quanta;
    tally_.refused_deposits += outcome.refused_deposits;
    if (Measures()) {
      const std::lock_guard lock(mutex_);
      tally_.heard += {outcome.answers, outcome.fail_safe_stops};
    }
  }
  return Ok();
}

void World::Discharge(double range_m, size_t robot) {
  const uint8_t site = robots_.site[robot];
  if (site != 0 && sites_.all()[site - 1u].is_food == 0) {
    robots_.charged_m[robot] = robots_.way_m[robot];
  } else if (robots_.way_m[robot] - robots_.charged_m[robot] >= range_m) {
    Fail(robot);
  }
}

void World::CommitSlice(const Slice& slice) {
  const Moves moves = Commit(time_, slice, &robots_);
  for (size_t i = slice.first; i < slice.end(); ++i) {
    coverage_.Visit(robots_.x_m[i], robots_.y_m[i], time_.step + 1);
    if (slice.group->range_m > 0) {
      Discharge(slice.group->range_m, i);
    }
  }
  const PathErrors errors = Measures() ? paths_.Look(time_, slice, robots_) : PathErrors{};
  const std::lock_guard lock(mutex_);
  tally_.moves.robot_contacts += moves.robot_contacts;
  tally_.moves.wall_contacts += moves.wall_contacts;
  tally_.moves.standing += moves.standing;
  tally_.path_errors += errors;
}

Status World::ReplaceObstacles(field::Shared<field::ObstacleMask> obstacles) {
  field::FieldConfig next = field_->config();
  next.obstacles = std::move(obstacles);
  PHEROMONE_TRY_STATUS(field_->CheckReconfigure(next, time_.now_ms()));
  field_->Reconfigure(next, time_.now_ms());
  walls_ = Walls(next, MostRadiusM(config_.groups) * 1.001);
  config_.field.obstacles = next.obstacles;
  return Ok();
}

const field::Field& World::field() const {
  for (const Behaviour* behaviour : behaviours_) {
    if (const field::Field* own = behaviour->field(); own != nullptr) {
      return *own;
    }
  }
  return *field_;
}

uint64_t World::Hash() const {
  uint64_t sum = field_->hash() + sites_.Hash() + Hash64({'t', time_.step});
  for (const Behaviour* behaviour : behaviours_) {
    sum += behaviour->Hash();
  }
  for (size_t i = 0; i < robots_.count; ++i) {
    const uint64_t flags = static_cast<uint64_t>(robots_.load[i]) << 16 |
                           static_cast<uint64_t>(robots_.contact[i]) << 8 | robots_.failed[i];
    sum += Hash64({'r', i, std::bit_cast<uint64_t>(robots_.x_m[i]),
                   std::bit_cast<uint64_t>(robots_.y_m[i]),
                   std::bit_cast<uint64_t>(robots_.heading_rad[i]), flags});
  }
  return sum;
}

}  // namespace pheromone::lab
