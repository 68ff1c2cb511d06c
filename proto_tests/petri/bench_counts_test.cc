// The bench's reachable markings for as many robots as an independent model was counted for
// (deploy/examples/nets/README.md), by a search of its own: no layout, no invariants, no reduction
// of server/core/petri. Transitions that only enable others are fired first, as that model does.
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/hash.h"
#include "server/formats/nets/system_file.h"

namespace pheromone::nets {
namespace {

const std::filesystem::path kNets =
    std::filesystem::path(PHEROMONE_SOURCE_DIR) / "deploy/examples/nets";

using Tokens = std::vector<uint8_t>;

// Markings, each once, in the order in which they were added. Two places share a byte.
class Seen {
 public:
  explicit Seen(size_t places) : size_((places + 1) / 2), table_(size_t{1} << 16, kNone) {}

  size_t count() const { return count_; }

  void Add(const Tokens& tokens) {
    if (count_ * 2 > table_.size()) {
      Grow();
    }
    packed_.resize((count_ + 1) * size_);
    uint8_t* const to = &packed_[count_ * size_];
    for (size_t i = 0; i < tokens.size(); ++i) {
      ASSERT_LT(tokens[i], 16);
      to[i / 2] = static_cast<uint8_t>(to[i / 2] | tokens[i] << (i % 2 * 4));
    }
    uint32_t* const place = Find(View(count_));
    if (*place == kNone) {
      *place = static_cast<uint32_t>(count_++);
    } else {
      packed_.resize(count_ * size_);
    }
  }

  void Get(size_t index, Tokens* tokens) const {
    const uint8_t* const from = &packed_[index * size_];
    for (size_t i = 0; i < tokens->size(); ++i) {
      (*tokens)[i] = static_cast<uint8_t>(from[i / 2] >> (i % 2 * 4) & 15);
    }
  }

 private:
  static constexpr uint32_t kNone = UINT32_MAX;

  std::string_view View(size_t index) const {
    return {reinterpret_cast<const char*>(&packed_[index * size_]), size_};
  }
  uint32_t* Find(std::string_view bytes) {
    size_t at = HashText(bytes) & (table_.size() - 1);
    while (table_[at] != kNone && View(table_[at]) != bytes) {
      at = (at + 1) & (table_.size() - 1);
    }
    return &table_[at];
  }
  void Grow() {
    table_.assign(table_.size() * 2, kNone);
    for (size_t i = 0; i < count_; ++i) {
      *Find(View(i)) = static_cast<uint32_t>(i);
    }
  }

  size_t size_;
  size_t count_ = 0;
  std::vector<uint8_t> packed_;
  std::vector<uint32_t> table_;
};

bool OnlyEnablesOthers(const std::string& id) {
  const bool of_exit = id[0] == 'S' ? id[1] > '2' : id[1] > '3';
  return id.ends_with(".present") || id.ends_with(".WriteRed") ||
         id.find(".release") != std::string::npos || (id.ends_with(".sense") && of_exit);
}

bool CanFire(const petri::Transition& transition, const Tokens& tokens) {
  const auto has = [&](const petri::Arc& arc) { return tokens[arc.place] >= arc.weight; };
  for (const petri::Arc& arc : transition.inhibitors) {
    if (has(arc)) {
      return false;
    }
  }
  for (const std::vector<petri::Arc>* arcs : {&transition.takes, &transition.reads}) {
    for (const petri::Arc& arc : *arcs) {
      if (!has(arc)) {
        return false;
      }
    }
  }
  return true;
}

size_t Count(std::string_view file, int64_t robots) {
  const Result<petri::Net> net = LoadSystem(kNets / file, {{"robots", robots}});
  EXPECT_TRUE(net.ok()) << net.error();
  if (!net.ok()) {
    return 0;
  }
  std::vector<const petri::Transition*> eager;
  std::vector<const petri::Transition*> others;
  for (const petri::Transition& it : net.value().transitions) {
    (OnlyEnablesOthers(it.id) ? eager : others).push_back(&it);
  }
  Tokens tokens;
  for (const petri::Place& place : net.value().places) {
    tokens.push_back(static_cast<uint8_t>(place.tokens));
  }
  Seen seen(tokens.size());
  seen.Add(tokens);
  const auto fire = [&](const petri::Transition& transition) {
    Tokens after = tokens;
    for (const petri::Arc& arc : transition.takes) {
      after[arc.place] = static_cast<uint8_t>(after[arc.place] - arc.weight);
    }
    for (const petri::Arc& arc : transition.gives) {
      after[arc.place] = static_cast<uint8_t>(after[arc.place] + arc.weight);
    }
    seen.Add(after);
  };
  for (size_t i = 0; i < seen.count(); ++i) {
    seen.Get(i, &tokens);
    bool fired = false;
    for (const petri::Transition* it : eager) {
      if (CanFire(*it, tokens)) {
        fire(*it);
        fired = true;
        break;
      }
    }
    for (size_t t = 0; !fired && t < others.size(); ++t) {
      if (CanFire(*others[t], tokens)) {
        fire(*others[t]);
      }
    }
  }
  return seen.count();
}

TEST(BenchCounts, OfMotionAreThoseOfTheIndependentModel) {
  EXPECT_EQ(Count("motion.toml", 4), 51'038u);
  EXPECT_EQ(Count("motion.toml", 5), 184'180u);
  EXPECT_EQ(Count("motion.toml", 6), 519'642u);
  EXPECT_EQ(Count("motion.toml", 7), 1'221'476u);
}

TEST(BenchCounts, OfRobotsWithIdentityAreThoseOfTheIndependentModel) {
  EXPECT_EQ(Count("identity.toml", 3), 42'192u);
  EXPECT_EQ(Count("identity.toml", 4), 745'272u);
  EXPECT_EQ(Count("identity.toml", 5), 11'379'724u);
}

TEST(BenchCounts, WithThePheromoneTagAreThoseOfTheIndependentModel) {
  EXPECT_EQ(Count("pheromone.toml", 3), 526'824u);
  EXPECT_EQ(Count("pheromone.toml", 4), 2'690'348u);
  EXPECT_EQ(Count("pheromone.toml", 5), 9'735'968u);
  EXPECT_EQ(Count("pheromone.toml", 6), 27'474'740u);
}

}  // namespace
}  // namespace pheromone::nets
