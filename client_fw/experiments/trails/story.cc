#include "client_fw/experiments/trails/story.h"

#include <fmt/format.h>

#include <array>
#include <cassert>
#include <cmath>
#include <optional>
#include <string_view>

#include "client_fw/core/tasks/robot_name.h"
#include "client_fw/core/tasks/robot_net.h"
#include "protocol/byte_order.h"
#include "protocol/net_record.h"
#include "server/core/engine/service/ordered_log.h"
#include "server/core/engine/service/service.h"

namespace pheromone::swarm {
namespace {

using protocol::NetAction;

constexpr int kStoryRobots = 7;
constexpr int64_t kSampleMs = 200;
constexpr int64_t kEndMs = 260'000;
constexpr uint16_t kLeaseS = 3600;

std::string_view AdviceText(petri::Advice advice) {
  return advice == petri::Advice::kA ? "01" : advice == petri::Advice::kB ? "10" : "00";
}

// Robots that only talk.
class Stage {
 public:
  Stage(const TrailsBench& bench, const engine::EngineConfig& config)
      : bench_(bench), unit_10um_(config.pose_unit_10um), service_(&log_, [this] {
          return engine::ClockReading{static_cast<uint64_t>(now_ms_), now_ms_};
        }) {
    const auto configured = service_.Configure(config, 1);
    assert(configured.ok());
    (void)configured;
    for (uint8_t id = 1; id <= kStoryRobots; ++id) {
      protocol::Message message;
      protocol::Encode(protocol::HelloRequest{id, 1, 1, 0}, &message);
      Ask(message);
      message.id = id;
      message.opcode = protocol::kSymbol;
      message.length = client::PutRobotName("forager-", id, message.data);
      message.data[0] = ++seqs_[id];
      Ask(message);
    }
  }

  // What robot `id` tells at a tag; waits for the outcome.
  void Tell(uint8_t id, std::string_view tag, NetAction action, uint16_t amount = 0) {
    const BenchTag& at = *bench_.FindTag(tag);
    protocol::TagWriteRequest write;
    write.id = id;
    write.seq = ++seqs_[id];
    write.x = Unit(at.x_m);
    write.y = Unit(at.y_m);
    write.tag = NumberOf(tag);
    write.slot = protocol::kNoSlot;
    write.lease_s = kLeaseS;
    std::array<uint8_t, protocol::kNetStatementSize> statement{};
    Encode(protocol::RobotRecord{client::kRobotNet.hash, ++records_[id], action, 0, amount, 0},
           statement.data());
    for (size_t i = 0; i < protocol::kStatementWords; ++i) {
      write.words[i] = protocol::GetI32(statement.data() + 4 * i);
    }
    protocol::Message message;
    protocol::Encode(write, &message);
    Ask(message);
    const auto exceptions = [this] {
      return service_.Inspect([](const engine::Engine& engine) {
        const petri::LiveCounts& counts = NetIn(engine)->counts();
        return std::pair(counts.records, counts.exceptions);
      });
    };
    const auto before = exceptions();
    while (exceptions().first == before.first && now_ms_ < kEndMs) {
      GoOnTo(now_ms_ + kSampleMs);
    }
    if (exceptions().second != before.second && problem_.empty()) {
      problem_ = fmt::format("the net refuses action {} of robot {} at {} at {} ms",
                             static_cast<int>(action), id, tag, now_ms_);
    }
  }

  void GoOnTo(int64_t ms) {
    for (; now_ms_ < ms; ++now_ms_) {
      if (now_ms_ % kSampleMs == 0) {
        story_.samples.push_back(Sample());
        const petri::Advice advice = story_.samples.back().advice;
        if (advice != advice_) {
          advice_ = advice;
          story_.marks.push_back({now_ms_, fmt::format("T{}", ++changes_), true});
        }
      }
      std::vector<engine::Outgoing> none;
      service_.AdvanceIfDue(&none);
    }
  }

  TrailsSample Sample() {
    return service_.Inspect([this](const engine::Engine& engine) {
      return SampleOf(engine, static_cast<uint64_t>(now_ms_));
    });
  }

  // From the nest to the source, and back to the entrance N2 or N3.
  void FetchBy(uint8_t id, bool a) {
    Leave(id, a);
    Tell(id, a ? "S1" : "S2", NetAction::kPresent);
    Tell(id, a ? "S1" : "S2", NetAction::kPass);
    Tell(id, "Src", NetAction::kTake, 40);
    Tell(id, a ? "S3" : "S4", NetAction::kLeave);
  }
  void Leave(uint8_t id, bool a) {
    Tell(id, "N1", NetAction::kPresent);
    Tell(id, "N1", NetAction::kPass);
    Tell(id, "P", a ? NetAction::kChooseA : NetAction::kChooseB);
    Tell(id, a ? "N5" : "N6", NetAction::kLeave);
  }
  void Store(uint8_t id, bool a, uint16_t amount) {
    Note(fmt::format("robot {} stores {}", id, a ? "A" : "B"));
    Tell(id, a ? "N2" : "N3", NetAction::kPresent);
    Tell(id, a ? "N2" : "N3", NetAction::kPass);
    Tell(id, "P", a ? NetAction::kStoreA : NetAction::kStoreB, amount);
    Tell(id, "N4", NetAction::kLeave);
  }
  // By what the tag advises.
  void LeaveAsAdvised(uint8_t id, bool any) {
    const petri::Advice advice = Sample().advice;
    const bool a = advice == petri::Advice::kAny ? any : advice == petri::Advice::kA;
    Note(fmt::format("robot {} reads {}, takes {}", id, AdviceText(advice), a ? "A" : "B"));
    Leave(id, a);
  }

  const std::string& problem() const { return problem_; }
  /// From then on is the story.
  void Begin() { begin_ms_ = now_ms_; }
  TrailsStory Take() {
    std::erase_if(story_.samples,
                  [this](const TrailsSample& sample) { return sample.time_ms < begin_ms_; });
    for (TrailsSample& sample : story_.samples) {
      sample.time_ms -= begin_ms_;
    }
    for (StoryMark& mark : story_.marks) {
      mark.time_ms -= begin_ms_;
    }
    return std::move(story_);
  }
  int64_t begin_ms() const { return begin_ms_; }

 private:
  void Note(const std::string& text) { story_.marks.push_back({now_ms_, text, false}); }
  int32_t Unit(double m) const { return static_cast<int32_t>(std::lround(m * 1e5 / unit_10um_)); }
  uint16_t NumberOf(std::string_view tag) {
    return service_.Inspect(
        [tag](const engine::Engine& engine) { return engine.tags().NumberOf(tag).value_or(0); });
  }
  void Ask(const protocol::Message& message) {
    std::vector<engine::Outgoing> answers;
    service_.Handle(0, {&message, 1}, &answers);
  }

  const TrailsBench& bench_;
  uint16_t unit_10um_;
  int64_t now_ms_ = 0;
  int64_t begin_ms_ = 0;
  engine::VolatileLog log_;
  engine::Service service_;
  TrailsStory story_;
  petri::Advice advice_ = petri::Advice::kAny;
  int changes_ = 0;
  std::array<uint8_t, kStoryRobots + 1> seqs_{};     // of requests
  std::array<uint8_t, kStoryRobots + 1> records_{};  // of records
  std::string problem_;
};

}  // namespace

Result<TrailsStory> TellStory(const TrailsBench& bench) {
  PHEROMONE_TRY(engine::EngineConfig without_lines,
                ConfigWith(bench, {.robots = kStoryRobots,
                                   .law = petri::EvaporationLaw::kE1,
                                   .rate_milli = 10'000}));
  without_lines.field.paths.clear();
  without_lines.links.resize(1);
  Stage stage(bench, without_lines);
  for (const auto& [robot, a] :
       {std::pair<uint8_t, bool>(1, true), {2, false}, {3, false}, {4, true}}) {
    stage.FetchBy(robot, a);
  }
  stage.Begin();
  const auto at = [&](int64_t seconds) { stage.GoOnTo(stage.begin_ms() + 1000 * seconds); };
  at(8);
  stage.LeaveAsAdvised(5, true);
  at(20);
  stage.Store(1, true, 40);
  at(32);
  stage.LeaveAsAdvised(6, true);
  at(46);
  stage.Store(2, false, 25);
  at(60);
  stage.Store(3, false, 25);
  at(72);
  stage.LeaveAsAdvised(7, true);
  at(86);
  stage.Store(4, true, 36);
  at(240);
  if (!stage.problem().empty()) {
    return Error{stage.problem()};
  }
  return stage.Take();
}

}  // namespace pheromone::swarm
