// An operator sends a robot to a point: from the order to its arrival.

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "server/core/engine/testing/service_bench.h"

namespace pheromone::engine {
namespace {

using field::PointUm;
using testing::Hello;
using testing::ReasonOf;
using testing::SameMessage;
using testing::Sense;
using testing::Trace;

struct Told {
  int left = 0;
  int right = 0;
  bool operator==(const Told&) const = default;
};

Told ToldBy(const protocol::Message& message) {
  protocol::SenseAnswer sense;
  protocol::TraceAnswer trace;
  if (protocol::Decode(message, &sense)) {
    return {sense.left, sense.right};
  }
  return protocol::Decode(message, &trace) ? Told{trace.left, trace.right} : Told{-9, -9};
}

class GoalTest : public testing::ServiceTest {
 protected:
  GoalTest() {
    service_.OnArrival([this](const GoalEnded& it) { arrived_.push_back(it); });
    Handle({Hello(3, 1)});
    Handle({Sense(3, 1'000, 5'000)});
  }

  bool HasGoal() const {
    return service_.Inspect(
        [](const Engine& engine) { return engine.robots().Find(0, 3)->goal.has_value(); });
  }

  Status GoTo(PointUm point, uint8_t id = 3) { return service_.SetGoal(0, id, point, 100'000); }

  std::vector<GoalEnded> arrived_;
};

TEST_F(GoalTest, ARobotIsLedToItsGoalAndHaltedThere) {
  const auto field_only = ToldBy(Handle({Sense(3, 1'000, 5'000)}).at(0).message);
  EXPECT_EQ(field_only, (Told{0, 0}));
  ASSERT_TRUE(GoTo({5'000'000, 5'000'000}).ok());
  EXPECT_EQ(ToldBy(Handle({Sense(3, 1'000, 5'000)}).at(0).message), (Told{4096, 4096}));
  EXPECT_EQ(ToldBy(Handle({Sense(3, 1'000, 5'000, 0x4000)}).at(0).message), (Told{0, 4096}));
  EXPECT_EQ(ToldBy(Handle({Sense(4, 1'000, 5'000)}).at(0).message), (Told{0, 0}))
      << "another robot";
  EXPECT_EQ(ToldBy(Handle({Trace(3, 2, 4'500, 5'000)}).at(0).message), (Told{522, 522}))
      << "u (0.5 m / 1.4 m)^2";
  EXPECT_GT(service_.Inspect([](const Engine& engine) { return engine.field().node_count(); }), 0u)
      << "TRACE deposits as without a goal";

  const std::vector<Outgoing> last = Handle({Sense(3, 4'950, 5'000)});
  ASSERT_EQ(last.size(), 2u);
  EXPECT_EQ(ToldBy(last[0].message), (Told{0, 0}));
  protocol::Command command;
  ASSERT_TRUE(protocol::Decode(last[1].message, &command));
  EXPECT_EQ(command.id, 3);
  EXPECT_EQ(command.code, protocol::CommandCode::kHalt);
  EXPECT_FALSE(HasGoal());
  ASSERT_EQ(arrived_.size(), 1u);
  EXPECT_EQ(arrived_[0].link, 0);
  EXPECT_EQ(arrived_[0].id, 3);
  EXPECT_EQ(arrived_[0].position, (PointUm{4'950'000, 5'000'000}));
  EXPECT_EQ(Handle({Sense(3, 4'950, 5'000)}).size(), 1u) << "only once";
  Engine replayed;
  EXPECT_EQ(testing::HashOfReplay(log_, &replayed), service_.StateHash());
}

TEST_F(GoalTest, ARobotThatTracesArrivesToo) {
  ASSERT_TRUE(GoTo({5'000'000, 5'000'000}).ok());
  const std::vector<Outgoing> last = Handle({Trace(3, 2, 5'000, 5'100)});
  ASSERT_EQ(last.size(), 2u);
  EXPECT_EQ(ToldBy(last[0].message), (Told{0, 0}));
  EXPECT_FALSE(HasGoal());
}

TEST_F(GoalTest, TheTrackersPoseDecides) {
  ASSERT_TRUE(GoTo({5'000'000, 5'000'000}).ok());
  const PoseObserved seen{0, 3, {{5'000'000, 5'050'000}, 0}, 1'000};
  service_.Observe({&seen, 1});
  Handle({Sense(3, 1'000, 1'000)});
  EXPECT_FALSE(HasGoal());
}

TEST_F(GoalTest, CancellingReturnsTheRobotToTheField) {
  ASSERT_TRUE(GoTo({5'000'000, 5'000'000}).ok());
  ASSERT_TRUE(service_.CancelGoal(0, 3).ok());
  const std::vector<Outgoing> out = Handle({Sense(3, 5'000, 5'000)});
  ASSERT_EQ(out.size(), 1u) << "no halt";
  EXPECT_EQ(ToldBy(out[0].message), (Told{0, 0}));
  EXPECT_EQ(service_.CancelGoal(0, 3).error(), "robot 3 has no goal");
  EXPECT_TRUE(arrived_.empty());
}

TEST_F(GoalTest, AGoalReplacesTheOneBefore) {
  ASSERT_TRUE(GoTo({5'000'000, 5'000'000}).ok());
  ASSERT_TRUE(GoTo({1'000'000, 9'000'000}).ok());
  EXPECT_EQ(ToldBy(Handle({Sense(3, 1'000, 5'000, 0x4000)}).at(0).message), (Told{4096, 4096}));
}

TEST_F(GoalTest, ErrorsNameRobotAndPlace) {
  EXPECT_EQ(GoTo({5'000'000, 5'000'000}, 9).error(),
            "no robot 9 has said HELLO on link \"radio-a\", expected one of 3");
  Handle({Hello(5, 1)});
  EXPECT_EQ(GoTo({5'000'000, 5'000'000}, 5).error(), "robot 5 has not reported its position yet");
  EXPECT_EQ(GoTo({5'000'000, 10'000'001}).error(),
            "(5, 10.000001) m is off the map: x from 0 to 10 m, y from 0 to 10 m");
  EXPECT_EQ(service_.CancelGoal(0, 9).error(), "robot 9 has no goal");
  EXPECT_EQ(service_.CancelGoal(7, 9).error(), "robot 9 has no goal");
  EXPECT_EQ(service_.SetGoal(7, 3, {0, 0}, 100'000).error(),
            "no robot 3 has said HELLO on link \"7\", nor has any other");
  EXPECT_FALSE(HasGoal());
}

TEST_F(GoalTest, WhileTheLogRefusesChangesTheGoalStays) {
  ASSERT_TRUE(GoTo({5'000'000, 5'000'000}).ok());
  log_.admit = protocol::Reason::kReadOnly;
  EXPECT_EQ(Handle({Sense(3, 5'000, 5'000)}).size(), 1u);
  EXPECT_TRUE(HasGoal());
  EXPECT_FALSE(GoTo({1'000'000, 1'000'000}).ok());
  EXPECT_FALSE(service_.CancelGoal(0, 3).ok());
  log_.admit = protocol::Reason::kNone;
  EXPECT_EQ(Handle({Sense(3, 5'000, 5'000)}).size(), 2u);
  EXPECT_FALSE(HasGoal());
}

TEST_F(GoalTest, IsPartOfTheStateWhileThereIsOne) {
  const uint64_t before = service_.StateHash();
  ASSERT_TRUE(GoTo({5'000'000, 5'000'000}).ok());
  EXPECT_NE(service_.StateHash(), before);
  const std::string saved = service_.Inspect([](const Engine& engine) {
    ByteWriter writer;
    engine.Save(&writer);
    return writer.Take();
  });
  ByteReader reader(saved);
  const auto restored = Engine::Restore(&reader);
  ASSERT_TRUE(restored.ok()) << restored.error();
  EXPECT_EQ(restored.value().StateHash(), service_.StateHash());
  EXPECT_EQ(restored.value().robots().Find(0, 3)->goal->point(), (PointUm{5'000'000, 5'000'000}));
  ASSERT_TRUE(service_.CancelGoal(0, 3).ok());
  EXPECT_EQ(service_.StateHash(), before);
}

}  // namespace
}  // namespace pheromone::engine
