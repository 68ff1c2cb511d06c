// The operator's changes against a naive model: the results of edits and of commands. A test that
// compares a replay with the live run cannot see a fault of both; the model shares no code with
// either. Its nodes are a plain list, its shapes are tested node by node, and its commands follow
// the rules of protocol/README.md literally.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "server/core/engine/engine.h"
#include "server/core/engine/testing/bench.h"

namespace pheromone::engine {
namespace {

using field::FieldEdit;
using field::NodeIndex;
using field::PointUm;
using protocol::CommandCode;
using testing::Bench;

constexpr int32_t kColumns = 24;
constexpr int32_t kRows = 18;
constexpr int64_t kCellUm = 250'000;
constexpr PointUm kOrigin{-1'000'000, -2'000'000};
constexpr uint8_t kPermanent = 1;
constexpr uint8_t kLinear = 2;
constexpr uint8_t kBlend = 3;
constexpr uint64_t kTauMs = 4'000;
constexpr int64_t kMaxLevel = 8 * 64;

bool IsWall(NodeIndex node) {
  return (node.row == 6 && node.column >= 4 && node.column <= 15) || node == NodeIndex{20, 12};
}

EngineConfig ModelConfig() {
  EngineConfig config = testing::SmallConfig();
  config.field.map = {kOrigin, (kColumns - 1) * kCellUm + 7, (kRows - 1) * kCellUm, kCellUm};
  config.field.pheromones = {testing::Law(kPermanent, 0), testing::Law(kLinear, kTauMs)};
  config.field.pheromones[1].evaporation = field::Evaporation::kLinear;
  field::PheromoneLaw blend;
  blend.type = kBlend;
  blend.name = "both";
  blend.blend = {{kPermanent, 1000}, {kLinear, 1000}};
  config.field.pheromones.push_back(blend);
  field::ObstacleMask walls(kColumns, kRows);
  for (int32_t row = 0; row < kRows; ++row) {
    for (int32_t column = 0; column < kColumns; ++column) {
      if (IsWall({column, row})) {
        walls.Set({column, row});
      }
    }
  }
  config.field.obstacles = field::Shared(std::move(walls));
  return config;
}

// --- The map

__extension__ using Wide = __int128;

Wide Squared(PointUm a, PointUm b) {
  return Wide{a.x - b.x} * (a.x - b.x) + Wide{a.y - b.y} * (a.y - b.y);
}

// To the nearer end, or, if the foot of the perpendicular lies between them, by Heron's formula.
bool IsWithin(PointUm p, PointUm a, PointUm b, int64_t radius) {
  const Wide limit = Wide{radius} * radius;
  const Wide to_a = Squared(p, a);
  const Wide to_b = Squared(p, b);
  const Wide length = Squared(a, b);
  if (to_a <= limit || to_b <= limit) {
    return true;
  }
  if (to_a >= to_b + length || to_b >= to_a + length) {
    return false;
  }
  const Wide area16 = 4 * to_a * length - (to_a + length - to_b) * (to_a + length - to_b);
  return area16 <= 4 * limit * length;
}

bool IsIn(const FieldEdit& edit, PointUm at) {
  const std::vector<PointUm>& points = edit.points;
  switch (edit.shape) {
    case FieldEdit::Shape::kAll:
      return true;
    case FieldEdit::Shape::kRectangle:
      return (at.x - points[0].x) * (at.x - points[1].x) <= 0 &&
             (at.y - points[0].y) * (at.y - points[1].y) <= 0;
    case FieldEdit::Shape::kStroke:
      break;
  }
  bool is_in = false;
  for (size_t i = 0; i < points.size(); ++i) {
    is_in |= IsWithin(at, points[i == 0 ? 0 : i - 1], points[i], edit.radius_um);
  }
  return is_in;
}

class MapModel {
 public:
  // A linear law loses a level every tau / 64, beginning with the last change.
  int64_t LevelOf(uint8_t type, NodeIndex at, uint64_t now_ms) const {
    const auto node = nodes_.find({type, at});
    if (node == nodes_.end()) {
      return 0;
    }
    int64_t level = node->second.level;
    if (type == kLinear) {
      const uint64_t passed_ms = now_ms - node->second.since_ms;
      for (uint64_t lost = 1; level > 0 && lost * kTauMs <= passed_ms * 64; ++lost) {
        --level;
      }
    }
    return level;
  }

  void Deposit(uint8_t type, NodeIndex at, int64_t quanta, uint64_t now_ms) {
    if (!IsWall(at)) {
      Put(type, at, LevelOf(type, at, now_ms) + 64 * quanta, now_ms);
    }
  }

  void Edit(const FieldEdit& edit, uint64_t now_ms) {
    for (int32_t row = 0; row < kRows; ++row) {
      for (int32_t column = 0; column < kColumns; ++column) {
        const NodeIndex at{column, row};
        if (!IsIn(edit, {kOrigin.x + column * kCellUm, kOrigin.y + row * kCellUm})) {
          continue;
        }
        if (edit.action == FieldEdit::Action::kErase) {
          nodes_.erase({edit.type, at});
        } else if (!IsWall(at)) {
          const bool is_added = edit.action == FieldEdit::Action::kAdd;
          Put(edit.type, at, (is_added ? LevelOf(edit.type, at, now_ms) : 0) + edit.level, now_ms);
        }
      }
    }
  }

 private:
  struct Node {
    int64_t level = 0;
    uint64_t since_ms = 0;
  };

  void Put(uint8_t type, NodeIndex at, int64_t level, uint64_t now_ms) {
    nodes_[{type, at}] = {std::min(level, kMaxLevel), now_ms};
  }

  std::map<std::pair<uint8_t, NodeIndex>, Node> nodes_;
};

// --- Commands

using Key = std::pair<LinkIndex, uint8_t>;

// Link, robot ID, seq, code and arguments, as they are on the wire.
using Sent = std::tuple<LinkIndex, uint8_t, std::vector<uint8_t>>;

size_t ArgumentsOf(CommandCode code) {
  const std::map<CommandCode, size_t> counts = {
      {CommandCode::kSpeed, 2},        {CommandCode::kGoTo, 4},
      {CommandCode::kFollowType, 1},   {CommandCode::kSetParameter, 5},
      {CommandCode::kGetParameter, 1}, {CommandCode::kHalt, 0}};
  return counts.contains(code) ? counts.at(code) : 0;
}

class CommandModel {
 public:
  struct Command {
    CommandOutcome outcome = CommandOutcome::kNone;
    CommandCode code = CommandCode::kHalt;
    uint8_t seq = 0;
    int16_t result = 0;
    int sent = 0;
    uint64_t due_ms = 0;
    std::vector<uint8_t> arguments;
  };
  struct Robot {
    uint16_t nonce = 0;
    uint8_t next_seq = 0;
    Command command;
  };

  void Hello(Key key, uint16_t nonce) {
    Robot& robot = robots_[key];
    if (robot.nonce != nonce && robot.command.outcome == CommandOutcome::kPending) {
      robot.command.outcome = CommandOutcome::kUnknown;
      ++unknown;
    }
    robot.nonce = nonce;
  }

  void Issue(const CommandIssued& issued, uint64_t now_ms, std::vector<Sent>* sent) {
    if (issued.id == protocol::kBroadcastId) {
      for (auto& [key, robot] : robots_) {
        Command& command = robot.command;
        if (key.first == issued.link && command.outcome == CommandOutcome::kPending &&
            command.code == CommandCode::kResume) {
          GiveUp(&command);
        }
      }
      halts_.push_back({issued.link, next_halt_seq_++, 3, now_ms});
      SendHalt(&halts_.back(), now_ms, sent);
      return;
    }
    Robot& robot = robots_.at({issued.link, issued.id});
    robot.command = {};
    robot.command.outcome = CommandOutcome::kPending;
    robot.command.code = issued.code;
    robot.command.seq = robot.next_seq++;
    robot.command.arguments.assign(
        issued.arguments.begin(),
        issued.arguments.begin() + static_cast<std::ptrdiff_t>(ArgumentsOf(issued.code)));
    Send({issued.link, issued.id}, &robot.command, now_ms, sent);
  }

  void Advance(uint64_t now_ms, std::vector<Sent>* sent) {
    for (Halt& halt : halts_) {
      if (halt.due_ms <= now_ms) {
        SendHalt(&halt, now_ms, sent);
      }
    }
    std::erase_if(halts_, [](const Halt& halt) { return halt.left == 0; });
    for (auto& [key, robot] : robots_) {
      if (robot.command.outcome == CommandOutcome::kPending && robot.command.due_ms <= now_ms) {
        Send(key, &robot.command, now_ms, sent);
      }
    }
  }

  void Acknowledge(Key key, const protocol::CommandAck& ack) {
    Command& command = robots_.at(key).command;
    if (command.outcome == CommandOutcome::kPending && command.seq == ack.seq &&
        command.code == ack.code) {
      command.outcome = ack.result == 0 ? CommandOutcome::kAccepted : CommandOutcome::kRefused;
      command.result = ack.result;
    }
  }

  std::optional<uint64_t> DueMs() const {
    std::optional<uint64_t> due_ms;
    const auto consider = [&due_ms](uint64_t at_ms) {
      due_ms = std::min(due_ms.value_or(UINT64_MAX), at_ms);
    };
    for (const Halt& halt : halts_) {
      consider(halt.due_ms);
    }
    for (const auto& [key, robot] : robots_) {
      if (robot.command.outcome == CommandOutcome::kPending) {
        consider(robot.command.due_ms);
      }
    }
    return due_ms;
  }

  const std::map<Key, Robot>& robots() const { return robots_; }

  uint64_t unanswered = 0;
  uint64_t unknown = 0;

 private:
  struct Halt {
    LinkIndex link;
    uint8_t seq;
    int left;
    uint64_t due_ms;
  };

  void GiveUp(Command* command) {
    command->outcome = CommandOutcome::kUnanswered;
    ++unanswered;
  }

  static void SendHalt(Halt* halt, uint64_t now_ms, std::vector<Sent>* sent) {
    sent->push_back({halt->link, 0xFF, {halt->seq, static_cast<uint8_t>(CommandCode::kHalt)}});
    --halt->left;
    halt->due_ms = now_ms + 100;
  }

  // Six times, 250 ms after the first, then twice as long each time up to 4 s; a resume not before
  // the last transmission of a halt to all.
  void Send(Key key, Command* command, uint64_t now_ms, std::vector<Sent>* sent) {
    constexpr std::array<uint64_t, 6> kWaitsMs = {250, 500, 1000, 2000, 4000, 4000};
    if (command->sent == 6) {
      GiveUp(command);
      return;
    }
    for (const Halt& halt : halts_) {
      if (halt.link == key.first && command->code == CommandCode::kResume) {
        command->due_ms = halt.due_ms;
        return;
      }
    }
    command->due_ms = now_ms + kWaitsMs[static_cast<size_t>(command->sent)];
    ++command->sent;
    std::vector<uint8_t> data = {command->seq, static_cast<uint8_t>(command->code)};
    data.insert(data.end(), command->arguments.begin(), command->arguments.end());
    sent->push_back({key.first, key.second, data});
  }

  std::map<Key, Robot> robots_;
  std::vector<Halt> halts_;
  uint8_t next_halt_seq_ = 0;
};

// --- Both at once

class OperatorModelTest : public ::testing::TestWithParam<uint64_t> {
 protected:
  uint64_t Below(uint64_t limit) { return random_() % limit; }
  int64_t Between(int64_t low, int64_t high) {
    return low + static_cast<int64_t>(Below(static_cast<uint64_t>(high - low + 1)));
  }

  PointUm AnyPoint() {
    // On nodes, and between them; on the map, and beside it.
    const int64_t column = Between(-4, kColumns + 3);
    const int64_t row = Between(-4, kRows + 3);
    const bool is_on_node = Below(2) == 0;
    return {kOrigin.x + column * kCellUm + (is_on_node ? 0 : Between(-kCellUm, kCellUm)),
            kOrigin.y + row * kCellUm + (is_on_node ? 0 : Between(-kCellUm, kCellUm))};
  }

  void Edit() {
    FieldEdit edit;
    edit.type = static_cast<uint8_t>(1 + Below(Below(10) == 0 ? 5 : 2));
    edit.shape = static_cast<FieldEdit::Shape>(Below(30) == 0 ? 2 : Below(2));
    edit.action = static_cast<FieldEdit::Action>(Below(3));
    edit.level = static_cast<uint32_t>(Below(Below(10) == 0 ? 600 : 300));
    edit.radius_um = Below(3) == 0 ? 0 : Between(0, 3 * kCellUm);
    edit.points = {AnyPoint(), AnyPoint()};
    if (edit.shape == FieldEdit::Shape::kStroke) {
      while (Below(2) == 0) {
        edit.points.push_back(AnyPoint());
      }
      if (Below(4) == 0) {
        edit.points.resize(1);
      }
    }
    const bool is_acceptable =
        (edit.type == kPermanent || edit.type == kLinear) &&
        (edit.action == FieldEdit::Action::kErase || edit.level <= kMaxLevel);
    ASSERT_EQ(bench_.engine.CheckEdit(edit).ok(), is_acceptable);
    if (is_acceptable) {
      EXPECT_TRUE(bench_.Apply(FieldEdited{edit}).empty());
      ASSERT_EQ(bench_.engine.finished().size(), 1u);  // the map is small: one portion is all
      EXPECT_TRUE(bench_.engine.finished()[0].outcome.ok());
      map_.Edit(edit, bench_.now_ms);
      ++edits_;
    }
  }

  void Deposit() {
    const Key key = AnyRobot();
    const NodeIndex at{static_cast<int32_t>(Below(kColumns)), static_cast<int32_t>(Below(kRows))};
    const auto type = static_cast<uint8_t>(1 + Below(2));
    const auto quanta = static_cast<uint8_t>(1 + Below(4));
    const auto answer = bench_.Handle(
        testing::Deposit(key.second, ++seqs_[key],
                         static_cast<int16_t>((kOrigin.x + at.column * kCellUm) / 1'000),
                         static_cast<int16_t>((kOrigin.y + at.row * kCellUm) / 1'000), quanta,
                         type),
        key.first);
    ASSERT_TRUE(answer.has_value());
    ASSERT_EQ(testing::ReasonOf(*answer),
              IsWall(at) ? protocol::Reason::kBlockedByObstacle : protocol::Reason::kNone);
    map_.Deposit(type, at, quanta, bench_.now_ms);
  }

  void Issue() {
    CommandIssued issued;
    issued.link = static_cast<LinkIndex>(Below(Below(20) == 0 ? 3 : 2));
    issued.id = static_cast<uint8_t>(Below(10) == 0 ? 9 : 1 + Below(3));
    issued.code = static_cast<CommandCode>(Below(3) == 0 ? 1 + Below(11) : 1 + Below(2));
    for (uint8_t& argument : issued.arguments) {
      argument = static_cast<uint8_t>(Below(256));
    }
    if (Below(5) == 0) {
      issued.id = protocol::kBroadcastId;
      issued.code = Below(5) == 0 ? CommandCode::kResume : CommandCode::kHalt;
    }
    const bool is_to_all = issued.id == protocol::kBroadcastId;
    const bool is_acceptable = issued.link < 2 && issued.code <= CommandCode::kGetParameter &&
                               (is_to_all ? issued.code == CommandCode::kHalt
                                          : commands_.robots().contains({issued.link, issued.id}));
    ASSERT_EQ(bench_.engine.Check(issued).ok(), is_acceptable);
    if (is_acceptable) {
      std::vector<Sent> expected;
      commands_.Issue(issued, bench_.now_ms, &expected);
      ASSERT_EQ(SentIn(bench_.Apply(issued)), expected);
      ++issued_;
    }
  }

  void Acknowledge() {
    const Key key = AnyRobot();
    const CommandModel::Command& command = commands_.robots().at(key).command;
    protocol::CommandAck ack{key.second, command.seq, command.code,
                             static_cast<int16_t>(Below(2) == 0 ? 0 : Below(12))};
    if (Below(5) == 0) {  // of another command, or none
      ack.seq = static_cast<uint8_t>(ack.seq + Below(3));
      ack.code = Below(2) == 0 ? CommandCode::kPickLoad : ack.code;
    }
    EXPECT_FALSE(bench_.Handle(testing::MessageOf(ack), key.first).has_value());
    commands_.Acknowledge(key, ack);
  }

  void SayHello(Key key) {
    const auto nonce = static_cast<uint16_t>(1 + Below(3));
    ASSERT_TRUE(bench_.Handle(testing::Hello(key.second, nonce), key.first).has_value());
    commands_.Hello(key, nonce);
    seqs_[key] = bench_.engine.robots().Find(key.first, key.second)->last_seq;
  }

  // At the time that the engine asks for, or at any other.
  void Advance() {
    const std::optional<uint64_t> due_ms = commands_.DueMs();
    const std::optional<uint64_t> asked_ms = bench_.engine.NextDeadline();
    ASSERT_LE(asked_ms.value_or(UINT64_MAX), due_ms.value_or(UINT64_MAX));
    if (Below(3) != 0 && due_ms) {
      bench_.now_ms = std::max(bench_.now_ms, *due_ms);
    }
    std::vector<Sent> expected;
    commands_.Advance(bench_.now_ms, &expected);
    ASSERT_EQ(SentIn(bench_.Apply(engine::Advance{})), expected);
  }

  void ExpectSame() {
    for (const uint8_t type : {kPermanent, kLinear}) {
      for (int32_t row = 0; row < kRows; ++row) {
        for (int32_t column = 0; column < kColumns; ++column) {
          const NodeIndex at{column, row};
          ASSERT_EQ(bench_.engine.field().LevelOf(type, at, bench_.now_ms),
                    map_.LevelOf(type, at, bench_.now_ms))
              << "type " << int{type} << " at " << column << ", " << row;
        }
      }
    }
    for (const auto& [key, expected] : commands_.robots()) {
      const RobotState* robot = bench_.engine.robots().Find(key.first, key.second);
      ASSERT_NE(robot, nullptr);
      ASSERT_EQ(robot->command.outcome, expected.command.outcome);
      ASSERT_EQ(robot->command.result, expected.command.result);
      ASSERT_EQ(robot->command.sent, expected.command.sent);
      outcomes_[expected.command.outcome] += 1;
    }
    ASSERT_EQ(bench_.engine.counters().commands_unanswered, commands_.unanswered);
    ASSERT_EQ(bench_.engine.counters().commands_unknown, commands_.unknown);
  }

  Key AnyRobot() { return {static_cast<LinkIndex>(Below(2)), static_cast<uint8_t>(1 + Below(3))}; }

  static std::vector<Sent> SentIn(const std::vector<Outgoing>& out) {
    std::vector<Sent> all;
    for (const Outgoing& it : out) {
      const protocol::Message& message = it.message;
      EXPECT_EQ(message.opcode, protocol::kCommand);
      all.push_back({it.link, message.id, {message.data, message.data + message.length}});
    }
    return all;
  }

  std::mt19937_64 random_{GetParam()};
  Bench bench_{ModelConfig()};
  MapModel map_;
  CommandModel commands_;
  std::map<Key, uint8_t> seqs_;  // of each robot's deposits
  int edits_ = 0;
  int issued_ = 0;
  std::map<CommandOutcome, int> outcomes_;
};

TEST_P(OperatorModelTest, EditsAndCommandsDoWhatTheyAreSaidToDo) {
  for (const LinkIndex link : {LinkIndex{0}, LinkIndex{1}}) {
    for (uint8_t id = 1; id <= 3; ++id) {
      SayHello({link, id});
    }
  }
  for (int step = 0; step < 1'500 && !HasFatalFailure(); ++step) {
    bench_.now_ms += Below(12) == 0 ? Below(3'000) : Below(80);
    switch (Below(12)) {
      case 0:
      case 1:
        Edit();
        break;
      case 2:
      case 3:
        Deposit();
        break;
      case 4:
        Issue();
        break;
      case 5:
        if (Below(3) == 0) {
          Acknowledge();
        }
        break;
      case 6:
        if (Below(8) == 0) {
          SayHello(AnyRobot());
        }
        break;
      default:
        Advance();
    }
    if (HasFatalFailure()) {
      break;
    }
    ExpectSame();
  }
  EXPECT_GE(edits_, 100);
  EXPECT_GE(issued_, 50);
  for (const CommandOutcome outcome :
       {CommandOutcome::kPending, CommandOutcome::kAccepted, CommandOutcome::kRefused,
        CommandOutcome::kUnanswered, CommandOutcome::kUnknown}) {
    EXPECT_GE(outcomes_[outcome], 1) << static_cast<int>(outcome);
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, OperatorModelTest, ::testing::Range<uint64_t>(1, 13));

}  // namespace
}  // namespace pheromone::engine
