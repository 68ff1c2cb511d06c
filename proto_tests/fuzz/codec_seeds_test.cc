// The seeds of events, configurations and states that make_corpus.py writes, without any of the
// code that they are for, are read by that code: what is meant to be good is, and what has one
// fault is refused for this fault, and not for the version of a format that has changed.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <variant>

#include "server/base/bytes.h"
#include "server/base/testing/temporary_folder.h"
#include "server/cluster/peer_wire.h"
#include "server/core/engine/config_codec.h"
#include "server/core/engine/engine.h"
#include "server/core/engine/event_codec.h"

namespace pheromone::engine {
namespace {

std::map<std::string, std::string> SeedsIn(const std::filesystem::path& folder) {
  std::map<std::string, std::string> seeds;
  for (const auto& it : std::filesystem::directory_iterator(folder)) {
    std::ifstream file(it.path(), std::ios::binary);
    seeds[it.path().filename().string()] = {std::istreambuf_iterator<char>(file), {}};
  }
  return seeds;
}

void ReadState(ByteReader* reader) {
  static_cast<void>(Engine::Restore(reader));
}

// What a reader says of all the bytes; empty: they are good.
template <typename Read>
std::string Verdict(std::string_view bytes, Read&& read) {
  ByteReader reader(bytes);
  read(&reader);
  reader.ExpectEnd();
  return reader.error();
}

class CodecSeeds : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    const std::string command =
        "python3 " PHEROMONE_SOURCE_DIR "/proto_tests/fuzz/make_corpus.py " + folder_->string();
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
  }
  static void TearDownTestSuite() { folder_.reset(); }

  // Of the seeds of one kind, without those that are cut: by name, which follows the prefix.
  template <typename Read>
  static std::map<std::string, std::string> Verdicts(std::string_view prefix, Read&& read) {
    std::map<std::string, std::string> verdicts;
    for (const auto& [name, seed] : SeedsIn(*folder_ / "codec")) {
      if (name.starts_with(prefix) && !name.ends_with("_cut")) {
        verdicts[name.substr(prefix.size())] = Verdict(std::string_view(seed).substr(1), read);
      }
    }
    return verdicts;
  }

  static inline std::unique_ptr<TemporaryFolder> folder_;
};

std::set<std::string> With(const std::map<std::string, std::string>& verdicts,
                           std::string_view verdict) {
  std::set<std::string> names;
  for (const auto& [name, its] : verdicts) {
    if (its.substr(0, its.find(':')) == verdict) {
      names.insert(name);
    }
  }
  return names;
}

TEST_F(CodecSeeds, AreEventsOfEachKind) {
  std::set<EventKind> kinds;
  const auto verdicts = Verdicts("event_", [&](ByteReader* reader) {
    const Event event = DecodeEvent(reader);
    if (reader->ok() && reader->AtEnd()) {
      kinds.insert(KindOf(event));
    }
  });
  EXPECT_EQ(kinds.size(), std::variant_size_v<Event>);
  EXPECT_EQ(With(verdicts, "").size(), verdicts.size() - 4);
  EXPECT_EQ(verdicts.at("kind_0"), "unknown event kind 0");
  EXPECT_EQ(verdicts.at("of_no_kind"), "unknown event kind 15");
  EXPECT_EQ(verdicts.at("longer"), "trailing bytes");
  EXPECT_TRUE(verdicts.at("version").starts_with("an event of version 7"));
}

TEST_F(CodecSeeds, AreConfigurations) {
  const auto verdicts = Verdicts("config_", DecodeConfig);
  EXPECT_EQ(With(verdicts, ""),
            (std::set<std::string>{"no_links", "plain", "rich", "tag", "walls_everywhere"}));
  EXPECT_EQ(With(verdicts, "trailing bytes"), std::set<std::string>());
}

// All but the hash.
TEST_F(CodecSeeds, AreStates) {
  const auto verdicts = Verdicts("state_", ReadState);
  EXPECT_EQ(With(verdicts, "state hash mismatch"),
            (std::set<std::string>{"broadcast", "edit", "no_pheromone", "node", "revoked", "robots",
                                   "undoing"}));
  const std::map<std::string, std::string> faults = {
      {"answer", "a message's length is 255"},
      {"broadcast_ended", "a broadcast that has ended"},
      {"command", "unknown command 77"},
      {"links_out_of_order", "links out of order"},
      {"no_sweep", "the sweep is not on the map"},
      {"revoked_of_nobody", "keys[0].id is 0"},
      {"revoked_out_of_order", "revoked keys that are not in ascending order"},
      {"robots_out_of_order", "robots out of order"},
      {"undoing_of_nothing", "an undoing under way of an edit that is not there"},
      {"version", "a state of version 7"},
  };
  EXPECT_EQ(verdicts.size(), faults.size() + 7);
  for (const auto& [name, fault] : faults) {
    EXPECT_TRUE(verdicts.at(name).starts_with(fault)) << name << ": " << verdicts.at(name);
  }
}

// With their hash.
TEST_F(CodecSeeds, AreStatesOfCaptures) {
  size_t captures = 0;
  for (const auto& it :
       std::filesystem::directory_iterator(PHEROMONE_SOURCE_DIR "/proto_tests/replay")) {
    if (it.path().extension() == ".pcapng") {
      const std::string name = it.path().stem().string();
      EXPECT_EQ(Verdicts(name, ReadState).at(""), "") << name;
      ++captures;
    }
  }
  EXPECT_GE(captures, 1u);
}

// Streams of the form that peer_wire_fuzzer.cc describes.
TEST_F(CodecSeeds, AreMessagesOfPeers) {
  std::set<size_t> types;
  for (const auto& [name, seed] : SeedsIn(*folder_ / "peer_wire")) {
    cluster::PeerFrames frames;
    frames.Add(std::string_view(seed).substr(1));
    auto next = frames.Next();
    for (; next.ok() && next.value(); next = frames.Next()) {
      types.insert(next.value()->index());
    }
    EXPECT_EQ(next.ok(), !name.starts_with("bad_")) << name << ": " << next.ErrorOr("");
  }
  EXPECT_EQ(types.size(), std::variant_size_v<cluster::PeerMessage>);
}

// Records of the form that journal_fuzzer.cc describes.
TEST_F(CodecSeeds, AreEventsOfAJournal) {
  const auto seeds = SeedsIn(*folder_ / "journal");
  EXPECT_GE(seeds.size(), 1u);
  for (const auto& [name, seed] : seeds) {
    size_t records = 0;
    for (std::string_view rest = std::string_view(seed).substr(1); rest.size() > 2; ++records) {
      const auto length = static_cast<uint8_t>(rest[0]);
      EXPECT_EQ(Verdict(rest.substr(2, length), DecodeEvent), "") << name;
      rest.remove_prefix(std::min<size_t>(rest.size(), 2 + size_t{length}));
    }
    EXPECT_EQ(records, 4u) << name;
  }
}

}  // namespace
}  // namespace pheromone::engine
