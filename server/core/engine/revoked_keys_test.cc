// Revoked keys, as an engine keeps them.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "server/core/engine/testing/bench.h"

namespace pheromone::engine {
namespace {

using testing::Bench;
using testing::Saved;
using Keys = std::vector<RevokedKey>;

constexpr RevokedKey kSeven{7, {1}};
constexpr RevokedKey kSevensNext{7, {2}};
constexpr RevokedKey kEight{8, {1}};

Result<Engine> Restored(const std::string& bytes) {
  ByteReader reader(bytes);
  Result<Engine> engine = Engine::Restore(&reader);
  reader.ExpectEnd();
  return reader.ok() ? std::move(engine) : Error{reader.error()};
}

TEST(RevokedKeys, AreKeptOnceWhateverTheirOrder) {
  Bench one;
  one.Apply(KeysRevoked{{kEight, kSeven, kEight}});
  one.Apply(KeysRevoked{{kSeven}});
  EXPECT_EQ(one.engine.revoked_keys().keys(), (Keys{kSeven, kEight}));
  EXPECT_FALSE(one.engine.revoked_keys().Contains(kSevensNext));
  Bench other;
  other.Apply(KeysRevoked{{kSeven}});
  other.Apply(KeysRevoked{{kEight}});
  EXPECT_EQ(one.engine.StateHash(), other.engine.StateHash());
}

TEST(RevokedKeys, AreInASnapshot) {
  Bench bench;
  bench.Apply(KeysRevoked{{kSevensNext, kEight, kSeven}});
  const Result<Engine> same = Restored(Saved(bench.engine));
  ASSERT_TRUE(same.ok()) << same.error();
  EXPECT_EQ(same.value().revoked_keys().keys(), (Keys{kSeven, kSevensNext, kEight}));
  EXPECT_EQ(Saved(same.value()), Saved(bench.engine));
}

TEST(RevokedKeys, StayWithAnotherConfigurationAndEpoch) {
  Bench bench;
  bench.Apply(KeysRevoked{{kSeven}});
  EngineConfig other = testing::SmallConfig();
  other.links = {{"radio-c", 1, 10}};
  bench.Apply(ConfigChanged{other, 9, true});
  EXPECT_EQ(bench.engine.revoked_keys().keys(), Keys{kSeven});
}

TEST(RevokedKeys, ARevocationThatCannotBeMeantIsRefused) {
  Bench bench;
  EXPECT_EQ(bench.engine.Check(KeysRevoked{}).ErrorOr(""),
            "found no key to revoke, expected at least one");
  EXPECT_EQ(bench.engine.Check(KeysRevoked{{kSeven, {0, {}}}}).ErrorOr(""),
            "keys[1].id is 0, expected 1 to 254");
  EXPECT_EQ(bench.engine.Check(KeysRevoked{{{255, {}}}}).ErrorOr(""),
            "keys[0].id is 255, expected 1 to 254");
  EXPECT_TRUE(bench.engine.Check(KeysRevoked{{kSeven}}).ok());
}

TEST(RevokedKeys, TheirNumberIsLimited) {
  Bench bench;
  Keys many;
  for (size_t i = 0; i < RevokedKeys::kMost; ++i) {
    many.push_back({1, {static_cast<uint8_t>(i >> 8), static_cast<uint8_t>(i)}});
  }
  ASSERT_TRUE(bench.engine.Check(KeysRevoked{many}).ok());
  bench.Apply(KeysRevoked{many});
  EXPECT_EQ(bench.engine.Check(KeysRevoked{{kSeven}}).ErrorOr(""),
            "10000 keys are revoked already, expected at most 10000 with 1 more: take this one out "
            "of the keys files instead");
  EXPECT_TRUE(Restored(Saved(bench.engine)).ok());
}

TEST(RevokedKeys, BytesThatNoEngineSavedAreRefused) {
  Bench bench;
  bench.Apply(KeysRevoked{{kSeven, kEight}});
  const std::string saved = Saved(bench.engine);
  const std::string first = std::string("\x07\x01", 2) + std::string(7, '\0');
  const std::string second = std::string("\x08\x01", 2) + std::string(7, '\0');
  const size_t at = saved.find(first + second);
  ASSERT_NE(at, std::string::npos);
  for (const std::string& other : {second + first, first + first}) {
    std::string bytes = saved;
    bytes.replace(at, other.size(), other);
    const Result<Engine> refused = Restored(bytes);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error(), "revoked keys that are not in ascending order");
  }
  std::string bytes = saved;
  bytes[at] = '\0';
  EXPECT_EQ(Restored(bytes).ErrorOr(""), "keys[0].id is 0, expected 1 to 254");
}

}  // namespace
}  // namespace pheromone::engine
