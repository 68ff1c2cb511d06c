#include "client_fw/keys/start_count.h"

#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "server/base/testing/temporary_folder.h"

namespace pheromone::keys {
namespace {

std::string KeyIn(const TemporaryFolder& folder) {
  const std::string path = (folder / "key").string();
  std::ofstream(path) << "a key\n";
  return path;
}

TEST(StartCount, SeveralAreClaimedInSuccession) {
  const TemporaryFolder folder;
  const std::string path = KeyIn(folder);
  EXPECT_EQ(CountStarts(path, 40).value(), 1);
  EXPECT_EQ(CountStarts(path).value(), 41);
  EXPECT_EQ(CountStarts(path, 2).value(), 42);
  EXPECT_EQ(CountStarts(path).value(), 44);
}

TEST(StartCount, TheLastNumberIsUsedAndNoneBeyond) {
  const TemporaryFolder folder;
  const std::string path = KeyIn(folder);
  std::ofstream(path + ".starts") << "65533\n";
  EXPECT_EQ(CountStarts(path, 3).error(),
            path + ".starts: 65533 starts, expected at most 65532: new keys are needed");
  EXPECT_EQ(CountStarts(path, 2).value(), 65534);
  EXPECT_FALSE(CountStarts(path).ok());
}

TEST(StartCount, ProgramsThatStartAtOnceGetDifferentNumbers) {
  const TemporaryFolder folder;
  const std::string path = KeyIn(folder);
  constexpr size_t kThreads = 4;
  constexpr size_t kStarts = 25;
  std::vector<std::vector<uint16_t>> claimed(kThreads);
  std::vector<std::thread> threads;
  for (size_t i = 0; i < kThreads; ++i) {
    threads.emplace_back([&, i] {
      for (size_t start = 0; start < kStarts; ++start) {
        claimed[i].push_back(CountStarts(path).value());
      }
    });
  }
  std::set<uint16_t> all;
  for (size_t i = 0; i < kThreads; ++i) {
    threads[i].join();
    all.insert(claimed[i].begin(), claimed[i].end());
  }
  EXPECT_EQ(all.size(), kThreads * kStarts);
  EXPECT_EQ(*all.rbegin(), kThreads * kStarts);
}

TEST(StartCount, WithoutAKeyThereIsNone) {
  const TemporaryFolder folder;
  const std::string path = (folder / "missing").string();
  EXPECT_NE(CountStarts(path).error().find("missing"), std::string::npos);
  EXPECT_FALSE(std::ifstream(path + ".starts").is_open());
}

}  // namespace
}  // namespace pheromone::keys
