// Undo and redo of edits, against a map that is worked out anew from all that happened to each
// node, without what is undone.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "server/core/engine/engine.h"
#include "server/core/engine/event_codec.h"
#include "server/core/engine/testing/bench.h"
#include "server/core/field/testing/naive_law.h"

namespace pheromone::engine {
namespace {

using field::EditHistory;
using field::FieldEdit;
using field::NodeIndex;
using field::PheromoneLaw;
using testing::Bench;
using testing::Law;

constexpr int32_t kSide = 14;  // of the square in which everything happens, in nodes

EngineConfig ConfigOfFourLaws() {
  EngineConfig config = testing::SmallConfig();
  config.field.pheromones = {Law(1, 3'000), Law(2, 0), Law(3, 5'000), Law(4, 4'000)};
  config.field.pheromones[2].evaporation = field::Evaporation::kLinear;
  config.field.pheromones[3].evaporation = field::Evaporation::kExponential;
  return config;
}

// The map as a list of what happened to each node. Knows nothing of states that are kept.
class NaiveHistory {
 public:
  struct State {
    int64_t level = 0;
    uint64_t time_ms = 0;
  };

  explicit NaiveHistory(const EngineConfig& config) : config_(config) {}

  void Deposit(uint8_t type, NodeIndex node, int64_t quanta, uint64_t now_ms) {
    happened_[{type, node}].push_back({0, FieldEdit::Action::kAdd, 64 * quanta, now_ms});
  }

  // Nothing is listed of an edit that changes no node.
  void Edit(uint64_t id, const FieldEdit& edit, const std::vector<NodeIndex>& nodes,
            uint64_t now_ms) {
    const bool joins =
        edit.continues != 0 && undone_.empty() && !made_.empty() && made_.back() == edit.continues;
    const uint64_t group = joins ? edit.continues : id;
    bool changes = false;
    for (const NodeIndex node : nodes) {
      const PheromoneLaw& law = LawOf(edit.type);
      const State before = StateOf(edit.type, node, now_ms);
      auto& list = happened_[{edit.type, node}];
      list.push_back({group, edit.action, edit.level, now_ms});
      const State after = StateOf(edit.type, node, now_ms);
      const bool same = before.level == after.level &&
                        (law.tau_ms == 0 || before.level == 0 || before.time_ms == after.time_ms);
      if (same) {
        list.pop_back();
      }
      changes = changes || !same;
    }
    if (changes && !joins) {
      made_.push_back(id);
      undone_.clear();
      if (made_.size() > EditHistory::kMaxEdits) {
        made_.erase(made_.begin());
      }
    }
  }

  bool CanReverse(bool redo) const { return !(redo ? undone_ : made_).empty(); }
  uint64_t Reverse(bool redo) {
    std::vector<uint64_t>& from = redo ? undone_ : made_;
    const uint64_t id = from.back();
    from.pop_back();
    (redo ? made_ : undone_).push_back(id);
    if (redo) {
      without_.erase(id);
    } else {
      without_.insert(id);
    }
    return id;
  }

  // A state whose level is that at `now_ms`; its time is that of the last change.
  State StateOf(uint8_t type, NodeIndex node, uint64_t now_ms) const {
    const PheromoneLaw& law = LawOf(type);
    const int64_t most = 64 * int64_t{law.max_count};
    State state;
    const auto found = happened_.find({type, node});
    if (found == happened_.end()) {
      return state;
    }
    for (const Happened& it : found->second) {
      if (without_.contains(it.edit)) {
        continue;
      }
      const int64_t present = Remaining(law, state, it.at_ms);
      switch (it.action) {
        case FieldEdit::Action::kSet:
          state = {std::min(most, it.level), it.at_ms};
          break;
        case FieldEdit::Action::kAdd:
          state = {std::min(most, present + it.level), it.at_ms};
          break;
        case FieldEdit::Action::kErase:
          state = {};
          break;
      }
    }
    return {Remaining(law, state, now_ms), state.time_ms};
  }

 private:
  struct Happened {
    uint64_t edit = 0;  // 0: a robot's deposit
    FieldEdit::Action action = FieldEdit::Action::kAdd;
    int64_t level = 0;
    uint64_t at_ms = 0;
  };

  const PheromoneLaw& LawOf(uint8_t type) const { return *config_.field.FindLaw(type); }

  // The exponential law has its own oracle (law_test.cc); sums of it need the same rounding.
  static int64_t Remaining(const PheromoneLaw& law, State state, uint64_t now_ms) {
    return law.evaporation == field::Evaporation::kExponential
               ? field::LevelAt(law, {static_cast<uint32_t>(state.level), state.time_ms}, now_ms)
               : field::testing::NaiveLevel(law, state.level, now_ms - state.time_ms);
  }

  EngineConfig config_;
  std::map<std::pair<uint8_t, NodeIndex>, std::vector<Happened>> happened_;
  std::vector<uint64_t> made_;  // that can be undone
  std::vector<uint64_t> undone_;
  std::set<uint64_t> without_;
};

std::string BytesOfEngine(const Engine& engine) {
  ByteWriter writer;
  engine.Save(&writer);
  return writer.Take();
}

// An engine and the naive map, to which the same happens.
class Twins {
 public:
  explicit Twins(uint64_t seed) : random_(seed), bench_(ConfigOfFourLaws()), naive_(Config()) {
    for (uint8_t id = 1; id <= 3; ++id) {
      bench_.Handle(testing::Hello(id, 1));
    }
    Snapshot();
  }

  // One thing happens.
  void Step() {
    bench_.now_ms += Below(12) == 0 ? Below(4'000) : Below(120);
    switch (Below(20)) {
      case 0:
      case 1:
      case 2:
        Edit();
        break;
      case 3:
      case 4:
      case 5:
        Reverse(false);
        break;
      case 6:
      case 7:
        Reverse(true);
        break;
      case 8:
        if (Below(4) == 0) {
          Restart();
        } else {
          bench_.Apply(Advance{});
        }
        break;
      default:
        Deposit();
    }
  }

  void ExpectSame() {
    const field::Field& field = bench_.engine.field();
    // Much later, too: the times of the last deposits are the same.
    for (const uint64_t later : {uint64_t{0}, Below(3'000), 3'000 + Below(9'000)}) {
      const uint64_t at_ms = bench_.now_ms + later;
      for (uint8_t type = 1; type <= 4; ++type) {
        for (int32_t column = 0; column < kSide; ++column) {
          for (int32_t row = 0; row < kSide; ++row) {
            const NodeIndex node{column, row};
            ASSERT_EQ(field.LevelOf(type, node, at_ms), naive_.StateOf(type, node, at_ms).level)
                << "type " << int{type} << " node " << column << ", " << row << " later " << later;
          }
        }
      }
    }
  }

  uint64_t forgotten() const { return bench_.engine.field().history().forgotten(); }

  int undone = 0;
  int redone = 0;
  int refused = 0;
  int restarts = 0;
  int joined = 0;

 private:
  const EngineConfig& Config() const { return bench_.engine.config(); }
  uint64_t Below(uint64_t limit) { return random_() % limit; }
  int16_t Place() { return static_cast<int16_t>(Below(100 * (kSide - 1))); }

  void Deposit() {
    const auto id = static_cast<uint8_t>(1 + Below(3));
    const auto type = static_cast<uint8_t>(1 + Below(4));
    const auto quanta = static_cast<uint8_t>(1 + Below(3));
    const int16_t x = Place();
    const int16_t y = Place();
    const auto answer = bench_.Handle(testing::Deposit(id, ++seqs_[id], x, y, quanta, type));
    ASSERT_TRUE(answer);
    ASSERT_EQ(testing::ReasonOf(*answer), protocol::Reason::kNone);
    naive_.Deposit(type, {(x + 50) / 100, (y + 50) / 100}, quanta, bench_.now_ms);
  }

  void Edit() {
    FieldEdit edit;
    edit.type = static_cast<uint8_t>(1 + Below(4));
    edit.shape = static_cast<FieldEdit::Shape>(Below(12) == 0 ? 2 : Below(2));
    edit.action = static_cast<FieldEdit::Action>(Below(3));
    edit.level = static_cast<uint32_t>(Below(513));
    edit.radius_um = static_cast<int64_t>(Below(250'000));
    edit.points = {{Place() * int64_t{1'000}, Place() * int64_t{1'000}},
                   {Place() * int64_t{1'000}, Place() * int64_t{1'000}}};
    std::vector<NodeIndex> nodes = field::NodesOf(edit, Config().field.map).value();
    if (edit.shape == FieldEdit::Shape::kAll) {
      edit.action = FieldEdit::Action::kErase;
    }
    std::erase_if(nodes, [](NodeIndex it) { return it.column >= kSide || it.row >= kSide; });
    edit.continues = Below(3) == 0 ? last_edit_ : 0;
    joined += edit.continues != 0 ? 1 : 0;
    ASSERT_TRUE(bench_.engine.Check(FieldEdited{edit}).ok());
    bench_.Apply(FieldEdited{edit});
    ASSERT_EQ(bench_.engine.finished().size(), 1u);
    ASSERT_TRUE(bench_.engine.finished()[0].outcome.ok());
    last_edit_ = bench_.engine.finished()[0].edit;
    naive_.Edit(bench_.sequence, edit, nodes, bench_.now_ms);
  }

  void Reverse(bool redo) {
    const Status possible = bench_.engine.Check(EditReversed{redo});
    ASSERT_EQ(possible.ok(), naive_.CanReverse(redo)) << possible.ErrorOr("ok");
    if (!possible.ok()) {
      ++refused;
      return;
    }
    const uint64_t id = bench_.engine.field().history().Next(redo)->info.id;
    bench_.Apply(EditReversed{redo});
    ASSERT_EQ(bench_.engine.finished().size(), 1u);
    ASSERT_TRUE(bench_.engine.finished()[0].outcome.ok());
    ASSERT_EQ(id, naive_.Reverse(redo));
    ++(redo ? redone : undone);
    ASSERT_NO_FATAL_FAILURE(ExpectSame());
  }

  void Snapshot() {
    snapshot_ = BytesOfEngine(bench_.engine);
    bench_.log.clear();
  }

  // As after a crash: the last snapshot, and what the journal has after it.
  void Restart() {
    ByteReader reader(snapshot_);
    Result<Engine> restored = Engine::Restore(&reader);
    ASSERT_TRUE(restored.ok()) << restored.error();
    Engine engine = std::move(restored).value();
    std::vector<Outgoing> out;
    uint64_t sequence = engine.sequence();
    for (const auto& [at_ms, event] : bench_.log) {
      ByteWriter writer;
      EncodeEvent(event, &writer);
      ByteReader bytes(writer.bytes());
      engine.Apply(++sequence, {at_ms, 0}, DecodeEvent(&bytes), &out);
      ASSERT_TRUE(bytes.ok()) << bytes.error();
    }
    ASSERT_EQ(BytesOfEngine(engine), BytesOfEngine(bench_.engine));
    ASSERT_EQ(engine.StateHash(), bench_.engine.StateHash());
    bench_.engine = std::move(engine);
    ++restarts;
    if (Below(2) == 0) {
      Snapshot();
    }
    ASSERT_NO_FATAL_FAILURE(ExpectSame());
  }

  std::mt19937_64 random_;
  Bench bench_;
  NaiveHistory naive_;
  std::map<uint8_t, uint8_t> seqs_;
  std::string snapshot_;
  uint64_t last_edit_ = 0;
};

TEST(Undo, LeavesTheMapAsIfTheEditHadNeverBeenMade) {
  Twins twins(31);
  for (int step = 0; step < 10'000; ++step) {
    ASSERT_NO_FATAL_FAILURE(twins.Step()) << "step " << step;
    if (step % 100 == 0) {
      ASSERT_NO_FATAL_FAILURE(twins.ExpectSame()) << "step " << step;
    }
  }
  EXPECT_GT(twins.undone, 700);
  EXPECT_GT(twins.redone, 200);
  EXPECT_GT(twins.refused, 50);
  EXPECT_GT(twins.restarts, 50);
  EXPECT_GT(twins.joined, 200);
  EXPECT_GT(twins.forgotten(), 10u);
}

}  // namespace
}  // namespace pheromone::engine
