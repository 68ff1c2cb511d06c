#include "client_fw/experiments/trails/timetable.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "client_fw/core/requests/tag_data.h"
#include "client_fw/core/tasks/robot_net.h"
#include "protocol/byte_order.h"
#include "protocol/messages.h"
#include "server/core/engine/service/ordered_log.h"
#include "server/core/engine/service/service.h"

namespace pheromone::swarm {
namespace {

using client::NetRobot;
using client::TagExchange;

constexpr int64_t kNever = std::numeric_limits<int64_t>::max();
constexpr int64_t kCarryMs = 1000;  // a robot counts at most so long between two steps
constexpr double kOnLineM = 0.05;
constexpr int kMaxSteps = 100;  // of one robot at one time

struct Tag {
  uint16_t number = 0;
  int32_t x = 0;  // in the pose unit
  int32_t y = 0;
  int robot = -1;  // that stands there
  int64_t free_ms = 0;
};

// From a tag along a line to the next one.
struct Lane {
  size_t to = 0;
  double way_s = 0;
  bool in_nest = false;
  std::deque<size_t> robots{};  // in the order in which they entered it
};

class TimetableRobot {
 public:
  TimetableRobot(const client::NetRobotParameters& parameters, uint8_t id, uint16_t boot_counter)
      : memory_(std::make_unique<client::NetMemory>()),
        core_(client::kRobotNet, parameters, id, boot_counter, memory_.get()) {}

  NetRobot& core() { return core_; }

  Lane* lane = nullptr;  // on which it is; null: it stands at `tag`
  size_t tag = 0;        // or where the lane begins
  int64_t due_ms = 0;    // when it arrives, or is stepped next
  bool stopped = false;  // for good
  uint8_t seq = 0;       // of requests

 private:
  std::unique_ptr<client::NetMemory> memory_;
  NetRobot core_;
};

class Run {
 public:
  Run(const TrailsBench& bench, const Timetable& timetable, const engine::EngineConfig& config,
      uint64_t seed)
      : bench_(bench),
        timetable_(timetable),
        random_(seed),
        service_(&log_,
                 [this] {
                   return engine::ClockReading{static_cast<uint64_t>(now_ms_), now_ms_};
                 }),
        tally_([this](const NetTold& told) { run_.ledger.Add(told); }) {
    const auto configured = service_.Configure(config, 1);
    assert(configured.ok());
    (void)configured;
    run_.robots = timetable.rules.robots;
    run_.duration_ms = timetable.duration_ms;
    run_.ledger = TrailsLedger(timetable.rules.robots);
    service_.Inspect([&](const engine::Engine& engine) {
      const tags::Store& store = engine.tags();
      for (const BenchTag& tag : bench.tags) {
        const auto unit = [&](double m) {
          return static_cast<int32_t>(std::lround(m * 1e5 / config.pose_unit_10um));
        };
        tags_.push_back({.number = store.NumberOf(tag.name).value_or(0),
                         .x = unit(tag.x_m),
                         .y = unit(tag.y_m)});
      }
    });
    const Lane* const nest = LaneFrom(TagNamed("N4"), kNestLine);
    for (int i = 0; i < timetable.rules.robots; ++i) {
      const auto id = static_cast<uint8_t>(i + 1);
      const auto boot_counter = static_cast<uint16_t>(random_());
      TimetableRobot& robot = robots_.emplace_back(timetable.robot, id, boot_counter);
      protocol::Message hello;
      protocol::Encode(protocol::HelloRequest{id, boot_counter, 1, 0}, &hello);
      Ask(hello);
      Settle(&robot);  // its name
      robot.tag = TagNamed("N4");
      robot.due_ms = std::llround(1000 * timetable.headway_s * (i + 1));
      robot.lane = const_cast<Lane*>(nest);
      robot.lane->robots.push_back(static_cast<size_t>(i));
    }
  }

  Result<TrailsRun> Go() {
    while (problem_.empty()) {
      const int64_t next_ms = std::min(NextRobot(), NextDeadline());
      if (next_ms > timetable_.duration_ms) {
        break;
      }
      Sample(next_ms);
      now_ms_ = std::max(now_ms_, next_ms);
      if (NextDeadline() <= now_ms_) {
        std::vector<engine::Outgoing> none;
        service_.AdvanceIfDue(&none);
      }
      for (size_t i = 0; i < robots_.size(); ++i) {
        if (!robots_[i].stopped && robots_[i].due_ms <= now_ms_) {
          robots_[i].lane != nullptr ? Arrive(i) : Stay(i);
        }
      }
    }
    if (!problem_.empty()) {
      return Error{problem_};
    }
    Sample(timetable_.duration_ms);
    service_.Inspect([&](const engine::Engine& engine) { run_.server = NetIn(engine)->counts(); });
    for (TimetableRobot& robot : robots_) {
      run_.CountOwn(robot.core());
    }
    run_.state_hash = service_.StateHash();
    return std::move(run_);
  }

 private:
  size_t TagNamed(std::string_view name) const {
    return static_cast<size_t>(bench_.FindTag(name) - bench_.tags.data());
  }

  int64_t NextRobot() const {
    int64_t next_ms = kNever;
    for (const TimetableRobot& robot : robots_) {
      next_ms = robot.stopped ? next_ms : std::min(next_ms, robot.due_ms);
    }
    return next_ms;
  }

  int64_t NextDeadline() {
    const std::optional<uint64_t> left_ms = service_.MillisecondsToDeadline();
    return left_ms ? now_ms_ + static_cast<int64_t>(*left_ms) : kNever;
  }

  int64_t Spread(double seconds) {
    const double even = static_cast<double>(random_() >> 11) * 0x1p-52 - 1;
    return std::llround(1000 * seconds * (1 + timetable_.spread * even));
  }

  // The next tag on that line; null if there is none.
  Lane* LaneFrom(size_t tag, int line) {
    const auto found = lanes_.find({tag, line});
    if (found != lanes_.end()) {
      return &found->second;
    }
    const double from_m = bench_.AlongOf(line, bench_.tags[tag]);
    double nearest_m = std::numeric_limits<double>::infinity();
    Lane lane;
    for (size_t i = 0; i < bench_.tags.size(); ++i) {
      const double along_m = bench_.AlongOf(line, bench_.tags[i]);
      if (i != tag && along_m > from_m && along_m < nearest_m &&
          bench_.DistanceFrom(line, bench_.tags[i]) < kOnLineM) {
        nearest_m = along_m;
        lane.to = i;
      }
    }
    if (std::isinf(nearest_m)) {
      return nullptr;
    }
    const std::string& to = bench_.tags[lane.to].name;
    lane.in_nest = to == "N1";
    lane.way_s = to == "N1"                 ? timetable_.nest_s
                 : to == "S1" || to == "N2" ? timetable_.trail_s[0]
                 : to == "S2" || to == "N3" ? timetable_.trail_s[1]
                                            : timetable_.area_s;
    return &lanes_.emplace(std::pair(tag, line), lane).first->second;
  }

  // At the end of its lane, if it is the first one there, and the tag is free.
  void Arrive(size_t number) {
    TimetableRobot& robot = robots_[number];
    Lane& lane = *robot.lane;
    if (timetable_.stop && lane.in_nest && timetable_.stop->time_ms <= now_ms_ &&
        timetable_.stop->robot == static_cast<int>(number)) {
      robot.stopped = true;
      if (timetable_.parking) {
        std::erase(lane.robots, number);
        Call(&lane);
      }
      return;
    }
    const bool overtakes = timetable_.parking && lane.in_nest;
    Tag& tag = tags_[lane.to];
    if ((!overtakes && lane.robots.front() != number) || tag.robot >= 0) {
      robot.due_ms = kNever;  // until it is called
      return;
    }
    const int64_t free_ms = tag.free_ms + std::llround(1000 * timetable_.headway_s);
    if (free_ms > now_ms_) {
      robot.due_ms = free_ms;
      return;
    }
    for (int64_t ms = robot_since_[number] + kCarryMs; ms <= now_ms_; ms += kCarryMs) {
      robot.core().Step(StepAt(ms, true));  // what it carries meanwhile
    }
    std::erase(lane.robots, number);
    robot.lane = nullptr;
    robot.tag = lane.to;
    tag.robot = static_cast<int>(number);
    Call(&lane);
    Stay(number);
  }

  // Who waits on a lane may look again.
  void Call(Lane* lane) {
    for (const size_t number : lane->robots) {
      TimetableRobot& robot = robots_[number];
      robot.due_ms = robot.due_ms == kNever ? now_ms_ : robot.due_ms;
    }
  }

  // At a tag, until it drives on.
  void Stay(size_t number) {
    TimetableRobot& robot = robots_[number];
    Settle(&robot);
    uint16_t at = 0;
    if (robot.core().TakeException(&at)) {
      robot.stopped = true;  // until somebody comes
      return;
    }
    Tag& tag = tags_[robot.tag];
    robot.due_ms = now_ms_ + timetable_.pace_ms;
    if (!robot.core().drives() || robot.core().state().tag != tag.number) {
      return;
    }
    Lane* const lane = LaneFrom(robot.tag, robot.core().line());
    if (lane == nullptr) {
      problem_ = fmt::format("{}: no tag after {} on the line of pheromone {}", bench_.name,
                             bench_.tags[robot.tag].name, robot.core().line());
      return;
    }
    tag.robot = -1;
    tag.free_ms = now_ms_;
    for (auto& [key, other] : lanes_) {
      if (other.to == robot.tag) {
        Call(&other);
      }
    }
    robot.lane = lane;
    robot.due_ms = now_ms_ + Spread(lane->way_s);
    robot_since_[number] = now_ms_;
    lane->robots.push_back(number);
  }

  client::NetStep StepAt(int64_t ms, bool is_held) const {
    return {static_cast<uint32_t>(ms), static_cast<uint16_t>(timetable_.pace_ms), pose_unit_10um_,
            is_held};
  }

  // What the robot does now, until it waits.
  void Settle(TimetableRobot* robot) {
    for (int i = 0; i < kMaxSteps && robot->core().Step(StepAt(now_ms_, false)); ++i) {
      Exchange(robot);
    }
  }

  void Exchange(TimetableRobot* robot) {
    TagExchange* const exchange = robot->core().exchange();
    protocol::Message& request = exchange->message;
    request.id = static_cast<uint8_t>(robot - robots_.data() + 1);
    const bool changes = protocol::IsMutating(request.opcode);
    if (changes) {
      request.data[0] = ++robot->seq;
    }
    if (request.opcode != protocol::kSymbol) {
      const Tag& tag = tags_[robot->tag];
      protocol::PutI32(request.data + (changes ? 1 : 0), tag.x);
      protocol::PutI32(request.data + (changes ? 5 : 4), tag.y);
    }
    exchange->state = TagExchange::kAsked;
    const std::optional<protocol::Message> answer = Ask(request);
    protocol::ErrorAnswer error;
    if (!answer) {
      problem_ = fmt::format("request {} of robot {} was not answered", request.opcode, request.id);
      exchange->state = TagExchange::kDropped;
    } else if (Decode(*answer, &error)) {
      exchange->state = TagExchange::kRefused;
      exchange->reason = error.reason;
    } else {
      exchange->message = *answer;
      exchange->state = TagExchange::kAnswered;
    }
  }

  std::optional<protocol::Message> Ask(const protocol::Message& request) {
    tally_.Hear(request, now_ms_);
    out_.clear();
    service_.Handle(0, {&request, 1}, &out_);
    std::optional<protocol::Message> answer;
    for (const engine::Outgoing& outgoing : out_) {
      if (outgoing.message.id == request.id) {
        answer = outgoing.message;
        tally_.Hear(outgoing.message, now_ms_);
      }
    }
    return answer;
  }

  // All that are due before that time.
  void Sample(int64_t before_ms) {
    if (timetable_.sample_ms == 0) {
      return;
    }
    for (; next_sample_ms_ <= before_ms; next_sample_ms_ += timetable_.sample_ms) {
      TrailsSample sample = service_.Inspect([&](const engine::Engine& engine) {
        return SampleOf(engine, static_cast<uint64_t>(next_sample_ms_));
      });
      sample.robots_on = {run_.ledger.robots_on(BenchTrail::kA),
                          run_.ledger.robots_on(BenchTrail::kB)};
      run_.samples.push_back(sample);
    }
  }

  const TrailsBench& bench_;
  const Timetable& timetable_;
  std::mt19937_64 random_;
  int64_t now_ms_ = 0;
  engine::VolatileLog log_;
  engine::Service service_;
  uint16_t pose_unit_10um_ = bench_.config.engine.pose_unit_10um;
  TrailsRun run_;
  NetTally tally_;
  std::vector<Tag> tags_;  // as in the bench
  std::map<std::pair<size_t, int>, Lane> lanes_;
  std::vector<TimetableRobot> robots_;
  std::map<size_t, int64_t> robot_since_;  // when it left its last tag
  std::vector<engine::Outgoing> out_;
  int64_t next_sample_ms_ = 0;
  std::string problem_;
};

}  // namespace

Timetable TimetableOf(const TrailsBench& bench, double speed_m_s) {
  constexpr double kStopS = 1.5;
  constexpr double kSteering = 0.8;
  const auto seconds = [&](int line, const char* from, const char* to) {
    return bench.LengthBetween(line, from, to) / (kSteering * speed_m_s) + kStopS;
  };
  Timetable timetable;
  timetable.trail_s = {(seconds(kTrailAOut, "N5", "S1") + seconds(kTrailABack, "S3", "N2")) / 2,
                       (seconds(kTrailBOut, "N6", "S2") + seconds(kTrailBBack, "S4", "N3")) / 2};
  timetable.nest_s = seconds(kNestLine, "N4", "N1");
  timetable.area_s = (seconds(kNestLine, "N1", "P") + seconds(kTrailAOut, "P", "N5") +
                      seconds(kTrailABack, "N2", "P") + seconds(kHomeLine, "P", "N4") +
                      seconds(kTrailAOut, "S1", "Src") + seconds(kTrailABack, "Src", "S3")) /
                     6;
  timetable.headway_s = 0.7 / speed_m_s + kStopS;  // to move up by a robot's length and distance
  return timetable;
}

Result<TrailsRun> RunTimetable(const TrailsBench& bench, const Timetable& timetable,
                               uint64_t seed) {
  PHEROMONE_TRY(engine::EngineConfig without_lines, ConfigWith(bench, timetable.rules));
  without_lines.field.paths.clear();  // nobody follows them
  without_lines.links.resize(1);
  Run run(bench, timetable, without_lines, seed);
  return run.Go();
}

}  // namespace pheromone::swarm
