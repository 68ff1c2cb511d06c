// What survives a loss of power, at every moment of every write.
#include "client_fw/boards/nonvolatile.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <random>
#include <set>
#include <vector>

namespace pheromone {
namespace client {
namespace {

constexpr uint8_t kSize = 16;
using Payload = std::array<uint8_t, kSize>;

// An EEPROM whose power may fail: from then on nothing is written.
struct FakeEeprom {
  static bool Ready() { return busy == 0 || --busy == 0; }
  static uint8_t Read(uint8_t at) {
    EXPECT_LT(at, 252);
    EXPECT_EQ(busy, 0) << "waits for a write";
    return cells[at];
  }
  static void Write(uint8_t at, uint8_t value) {
    EXPECT_EQ(busy, 0);
    EXPECT_NE(cells[at], value) << "wears a cell for nothing";
    busy = kBusyTurns;
    if (writes_until_power_fails != 0) {
      --writes_until_power_fails;
      cells[at] = value;
      ++wear[at];
    }
  }
  static void Erase(uint8_t value) {
    cells.fill(value);
    wear.fill(0);
    writes_until_power_fails = kForever;
    busy = 0;
  }

  static constexpr int kBusyTurns = 3;
  static constexpr int kForever = 1 << 30;
  static std::array<uint8_t, 256> cells;
  static std::array<int, 256> wear;
  static int writes_until_power_fails;
  static int busy;  // turns until the last write has ended
};
std::array<uint8_t, 256> FakeEeprom::cells;
std::array<int, 256> FakeEeprom::wear;
int FakeEeprom::writes_until_power_fails;
int FakeEeprom::busy;

using Memory = Nonvolatile<FakeEeprom, kSize>;

void Finish(Memory* memory) {
  for (int turn = 0; turn < 1000 && !memory->saved(); ++turn) {
    memory->Step();
  }
  ASSERT_TRUE(memory->saved());
}

// As firmware does: the settings found, if any, and the number of this start.
struct Boot {
  explicit Boot(const Payload& defaults) : payload(defaults) {
    found = memory.Load(payload.data());
    memory.Save(payload.data());
    Finish(&memory);
    number = memory.version();
  }

  Memory memory;
  Payload payload;
  bool found;
  uint16_t number;
};

// While power is off, writes end one way or the other.
void SwitchOn() {
  FakeEeprom::writes_until_power_fails = FakeEeprom::kForever;
  FakeEeprom::busy = 0;
}

Payload Filled(uint8_t value) {
  Payload payload;
  payload.fill(value);
  return payload;
}

class NonvolatileTest : public testing::Test {
 protected:
  NonvolatileTest() { FakeEeprom::Erase(0xFF); }

  Payload AnyPayload() {
    Payload payload;
    for (uint8_t& byte : payload) {
      byte = static_cast<uint8_t>(generator_() % 4 == 0 ? 0xFF : generator_() & 0xFFu);
    }
    return payload;
  }

  std::mt19937 generator_{4};
};

TEST_F(NonvolatileTest, MemoryThatWasNeverWrittenKeepsTheDefaults) {
  for (const int value : {0x00, 0xFF}) {
    FakeEeprom::Erase(static_cast<uint8_t>(value));
    Memory memory;
    Payload payload = Filled(7);
    EXPECT_FALSE(memory.Load(payload.data()));
    EXPECT_EQ(payload, Filled(7));
  }
}

TEST_F(NonvolatileTest, WhatWasSavedIsFoundAfterTheNextStart) {
  Boot first(Filled(7));
  EXPECT_FALSE(first.found);
  first.memory.Save(Filled(9).data());
  Finish(&first.memory);
  Boot second(Filled(7));
  EXPECT_TRUE(second.found);
  EXPECT_EQ(second.payload, Filled(9));
}

TEST_F(NonvolatileTest, NumbersMayBeginAnywhereAndGoOnFromThere) {
  for (const uint16_t behind : {uint16_t{41'000}, uint16_t{65'535}}) {
    FakeEeprom::Erase(0xFF);
    Payload payload{};
    Memory first;
    ASSERT_FALSE(first.Load(payload.data()));
    first.BeginBehind(behind);
    first.Save(payload.data());
    Finish(&first);
    EXPECT_EQ(first.version(), static_cast<uint16_t>(behind + 1));
    EXPECT_EQ(Boot(payload).memory.version(), static_cast<uint16_t>(behind + 2));
  }
}

TEST_F(NonvolatileTest, SavingReturnsBeforeItWritesAndWritesAByteATurn) {
  Boot boot(Filled(7));
  const auto before = FakeEeprom::cells;
  boot.memory.Save(Filled(9).data());
  EXPECT_EQ(FakeEeprom::cells, before);
  for (int turn = 0; !boot.memory.saved(); ++turn) {
    const auto cells = FakeEeprom::cells;
    boot.memory.Step();
    int changed = 0;
    for (size_t i = 0; i < cells.size(); ++i) {
      changed += cells[i] != FakeEeprom::cells[i] ? 1 : 0;
    }
    ASSERT_LE(changed, 1);
    ASSERT_FALSE(changed != 0 && boot.memory.saved()) << "the write has only begun";
    ASSERT_LT(turn, 200);
  }
}

TEST_F(NonvolatileTest, NoTwoStartsHaveTheSameNumberUntilAllWereUsed) {
  std::set<uint16_t> numbers;
  for (int i = 0; i < 65536; ++i) {
    ASSERT_TRUE(numbers.insert(Boot(Filled(7)).number).second) << i;
  }
}

TEST_F(NonvolatileTest, ASettingSurvivesTheWrapOfTheNumbers) {
  Boot first(Filled(7));
  for (int i = 0; i < 65536 + 10; ++i) {
    Boot boot(Filled(0));
    ASSERT_EQ(boot.payload, Filled(7)) << i;
  }
}

// The heart of it: power fails after every possible number of bytes, also while settings are
// replaced before they were written, and again during the start after that.
TEST_F(NonvolatileTest, APowerLossAtAnyMomentLeavesTheOldOrTheNewSettingsAndAFreshNumber) {
  Payload now = AnyPayload();
  Boot(now).memory.version();
  std::set<uint16_t> numbers;
  for (int round = 0; round < 3000; ++round) {
    const int cut = round % 45;
    Boot boot(Filled(0));
    ASSERT_TRUE(boot.found);
    ASSERT_EQ(boot.payload, now);
    ASSERT_TRUE(numbers.insert(boot.number).second);

    const Payload given_up = AnyPayload();
    const Payload next = AnyPayload();
    FakeEeprom::writes_until_power_fails = cut;  // more than the two records take: no cut
    boot.memory.Save(given_up.data());
    const int turns = static_cast<int>(generator_() % 90);
    for (int turn = 0; turn < turns; ++turn) {
      boot.memory.Step();
    }
    boot.memory.Save(next.data());
    Finish(&boot.memory);  // as far as it knows

    SwitchOn();
    FakeEeprom::writes_until_power_fails = static_cast<int>(generator_() % 30);
    Boot interrupted(Filled(0));
    if (FakeEeprom::writes_until_power_fails != 0) {  // else it did not live to use its number
      ASSERT_TRUE(numbers.insert(interrupted.number).second);
    }

    SwitchOn();
    Memory memory;
    Payload found = Filled(0);
    ASSERT_TRUE(memory.Load(found.data()));
    ASSERT_TRUE(found == now || found == given_up || found == next) << round;
    now = found;
  }
}

TEST_F(NonvolatileTest, RecordsOfAnotherSizeAreNotTaken) {
  Boot boot(Filled(7));
  Nonvolatile<FakeEeprom, kSize + 2> other;
  std::array<uint8_t, kSize + 2> payload{};
  EXPECT_FALSE(other.Load(payload.data()));
}

TEST_F(NonvolatileTest, ADamagedCellCostsTheNewestRecordAtMost) {
  Boot first(Filled(1));
  first.memory.Save(Filled(2).data());
  Finish(&first.memory);
  const auto whole = FakeEeprom::cells;
  for (size_t at = 0; at < size_t{4} * (kSize + 4); ++at) {
    for (int bit = 0; bit < 8; ++bit) {
      FakeEeprom::cells = whole;
      FakeEeprom::cells[at] ^= static_cast<uint8_t>(1 << bit);
      Memory memory;
      Payload payload = Filled(0);
      ASSERT_TRUE(memory.Load(payload.data()));
      ASSERT_TRUE(payload == Filled(1) || payload == Filled(2)) << at;
    }
  }
}

TEST_F(NonvolatileTest, NoCellIsWrittenAtMoreThanEveryFourthStart) {
  Boot(Filled(7)).memory.version();
  FakeEeprom::wear.fill(0);
  constexpr int kStarts = 4000;
  for (int i = 0; i < kStarts; ++i) {
    Boot boot(Filled(7));
  }
  for (const int wear : FakeEeprom::wear) {
    EXPECT_LE(wear, kStarts / 4);
  }
}

}  // namespace
}  // namespace client
}  // namespace pheromone
