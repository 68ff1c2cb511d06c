// A frozen field is copied as it was, whatever happens to the field meanwhile. The oracle is
// Field::Save at the moment of the freeze.

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <string>

#include "server/core/field/frozen_field.h"

namespace pheromone::field {
namespace {

constexpr uint64_t kMuch = uint64_t{1} << 30;

PheromoneLaw Law(uint8_t type, int64_t tau_ms) {
  PheromoneLaw law;
  law.type = type;
  law.name = "type " + std::to_string(type);
  law.tau_ms = tau_ms;
  return law;
}

// 4 x 3 leaves. Type 1 evaporates, type 2 stays, type 3 diffuses.
FieldConfig Config() {
  FieldConfig config;
  config.map = {.origin = {0, 0}, .width_um = 5'000'000, .height_um = 3'500'000, .cell_um = 10'000};
  config.memory_bytes = 64 << 20;
  config.pheromones = {Law(1, 5'000), Law(2, 0), Law(3, 9'000)};
  config.pheromones[2].evaporation = Evaporation::kExponential;
  config.pheromones[2].diffusion = {8'000, 100, 0xFF00'0000, 512};
  return config;
}

std::string Saved(const Field& field) {
  ByteWriter writer;
  field.Save(&writer);
  return writer.Take();
}

// Everything that changes a field.
class Traffic {
 public:
  explicit Traffic(uint64_t seed) : random_(seed) {}

  void Some(Field* field, uint64_t most) {
    for (uint64_t left = Below(most + 1); left > 0; --left) {
      One(field);
    }
  }

  void One(Field* field) {
    now_ms += Below(100) == 0 ? Below(3'000) : Below(3);
    switch (Below(200)) {
      case 0:
        EXPECT_TRUE(field->Edit(AnyEdit(FieldEdit::Shape::kRectangle), now_ms).ok());
        break;
      case 1:
        if (Below(10) == 0) {
          FieldEdit all = AnyEdit(FieldEdit::Shape::kAll);
          all.action = FieldEdit::Action::kErase;
          EXPECT_TRUE(field->Edit(all, now_ms).ok());
        }
        break;
      case 2:
        if (Below(10) == 0) {
          FieldConfig next = field->config();
          next.pheromones[Below(2)].quantum_micro += 1'000;  // all nodes are written anew
          EXPECT_TRUE(field->CheckReconfigure(next, now_ms).ok());
          field->Reconfigure(next, now_ms);
        }
        break;
      case 3:
      case 4:
      case 5:
        field->Advance(now_ms);
        break;
      default:
        EXPECT_EQ(
            field->Deposit(AnyType(), AnyPoint(), 1 + static_cast<uint16_t>(Below(3)), now_ms),
            DepositResult::kDone);
    }
  }

  uint64_t Below(uint64_t limit) { return random_() % limit; }

  uint64_t now_ms = 0;

 private:
  uint8_t AnyType() { return static_cast<uint8_t>(1 + Below(3)); }
  PointUm AnyPoint() {
    return {static_cast<int64_t>(Below(5'000'000)), static_cast<int64_t>(Below(3'500'000))};
  }
  FieldEdit AnyEdit(FieldEdit::Shape shape) {
    FieldEdit edit;
    edit.type = AnyType();
    edit.shape = shape;
    edit.action = static_cast<FieldEdit::Action>(Below(3));
    edit.level = static_cast<uint32_t>(Below(513));
    edit.points = {AnyPoint()};
    edit.points.push_back({edit.points[0].x + static_cast<int64_t>(Below(900'000)),
                           edit.points[0].y + static_cast<int64_t>(Below(900'000))});
    return edit;
  }

  std::mt19937_64 random_;
};

TEST(FrozenField, IsCopiedAsItWasWhateverHappensMeanwhile) {
  uint64_t kept = 0;
  for (uint64_t seed = 0; seed < 12; ++seed) {
    Traffic traffic(seed);
    Field field(Config());
    traffic.Some(&field, 3'000);
    for (int round = 0; round < 4; ++round) {
      const std::string expected = Saved(field);
      std::unique_ptr<FrozenField> frozen = field.Freeze(kMuch);
      ASSERT_NE(frozen, nullptr);
      EXPECT_EQ(frozen->bytes(), expected.size());
      std::string copied;
      while (frozen->CopySome(&copied, 1)) {
        traffic.Some(&field, 200);
        kept = std::max(kept, frozen->kept_bytes());
      }
      ASSERT_FALSE(frozen->failed());
      ASSERT_TRUE(frozen->done());
      ASSERT_TRUE(copied == expected) << "seed " << seed << ", round " << round;
      EXPECT_EQ(frozen->kept_bytes(), 0u);
    }
  }
  EXPECT_GT(kept, 10'000u);
}

TEST(FrozenField, IsCopiedAtOnceIfItIsSmall) {
  Traffic traffic(1);
  Field field(Config());
  const std::string empty = Saved(field);
  std::unique_ptr<FrozenField> frozen = field.Freeze(0);
  traffic.Some(&field, 0);
  std::string copied;
  EXPECT_TRUE(frozen->CopySome(&copied));
  EXPECT_FALSE(frozen->CopySome(&copied));
  EXPECT_TRUE(frozen->done());
  EXPECT_EQ(copied, empty);
}

TEST(FrozenField, DoesNotChangeWhatTheFieldDoes) {
  Traffic traffic(3);
  Traffic same(3);
  Field field(Config());
  Field other(Config());
  const std::unique_ptr<FrozenField> frozen = field.Freeze(kMuch);
  for (int i = 0; i < 5'000; ++i) {
    traffic.One(&field);
    same.One(&other);
    ASSERT_EQ(field.hash(), other.hash());
  }
  EXPECT_TRUE(Saved(field) == Saved(other));
}

TEST(FrozenField, ThereIsOneAtATimeAndAnotherOneAfterIt) {
  Traffic traffic(4);
  Field field(Config());
  traffic.Some(&field, 500);
  std::unique_ptr<FrozenField> first = field.Freeze(kMuch);
  EXPECT_EQ(field.Freeze(kMuch), nullptr);
  std::string copied;
  EXPECT_TRUE(first->CopySome(&copied, 1));
  first.reset();  // given up in the middle
  traffic.Some(&field, 500);
  const std::string expected = Saved(field);
  first = field.Freeze(kMuch);
  ASSERT_NE(first, nullptr);
  for (copied.clear(); first->CopySome(&copied);) {
  }
  EXPECT_TRUE(copied == expected);
  EXPECT_NE(field.Freeze(kMuch), nullptr) << "a copy that is complete is in nobody's way";
}

// Otherwise operators who edit without a pause would have no snapshot made, and no recovery would
// end.
TEST(FrozenField, AnEditInProgressIsCopiedToo) {
  FieldConfig config = Config();
  config.map = {{0, 0}, 20'000'000, 20'000'000, 100'000};
  Field field(config);
  FieldEdit edit;
  edit.type = config.pheromones.front().type;
  edit.level = kLevelsPerQuantum;
  edit.points = {{0, 0}, {20'000'000, 20'000'000}};
  field.BeginEdit(7, edit, nullptr, 1'000);
  field.BeginEdit(8, edit, nullptr, 1'000);
  ASSERT_TRUE(field.busy());
  const std::string expected = Saved(field);
  const std::unique_ptr<FrozenField> frozen = field.Freeze(kMuch);
  ASSERT_NE(frozen, nullptr);
  std::string copied;
  while (frozen->CopySome(&copied, 1)) {
    field.Advance(1'000);
  }
  EXPECT_FALSE(frozen->failed());
  EXPECT_TRUE(copied == expected);
}

TEST(FrozenField, FailsWhenMoreIsChangedThanMayBeKept) {
  Traffic traffic(5);
  Field field(Config());
  for (int i = 0; i < 2'000; ++i) {
    traffic.One(&field);
  }
  const std::unique_ptr<FrozenField> frozen = field.Freeze(5'000);
  std::string copied;
  EXPECT_TRUE(frozen->CopySome(&copied, 1));
  for (int i = 0; i < 2'000 && !frozen->failed(); ++i) {
    traffic.One(&field);
    EXPECT_LE(frozen->kept_bytes(), 5'000u);
  }
  EXPECT_TRUE(frozen->failed());
  EXPECT_FALSE(frozen->CopySome(&copied));
  EXPECT_FALSE(frozen->done());
  traffic.Some(&field, 100);
}

TEST(FrozenField, FailsWhenItsFieldIsGone) {
  Traffic traffic(6);
  auto field = std::make_unique<Field>(Config());
  traffic.Some(field.get(), 2'000);
  const std::unique_ptr<FrozenField> frozen = field->Freeze(kMuch);
  std::string copied;
  EXPECT_TRUE(frozen->CopySome(&copied, 1));
  field.reset();
  EXPECT_TRUE(frozen->failed());
  EXPECT_FALSE(frozen->CopySome(&copied));
}

}  // namespace
}  // namespace pheromone::field
