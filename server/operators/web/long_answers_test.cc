#include "server/operators/web/long_answers.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

namespace pheromone::web {
namespace {

std::shared_ptr<Content> ContentOf(size_t bytes) {
  Response response{.body = std::string(bytes, 'a')};
  ShareLongBody(&response);
  return response.content;
}

class FromFile final : public Content {
 public:
  void Read(uint64_t /*offset*/, size_t /*count*/, Respond respond) override { respond({}); }
};

constexpr size_t kBytes = 100'000;

TEST(ShareLongBody, LeavesAShortOneAndGivesTheSameBytesOfALongOne) {
  Response response{.body = std::string(kPortionBytes, 'a')};
  ShareLongBody(&response);
  EXPECT_EQ(response.content, nullptr);
  EXPECT_EQ(response.body.size(), kPortionBytes);

  std::string text;
  for (int i = 0; i < 30'000; ++i) {
    text += std::to_string(i) + ' ';
  }
  response.body = text;
  ShareLongBody(&response);
  ASSERT_NE(response.content, nullptr);
  EXPECT_EQ(response.body, "");
  EXPECT_EQ(response.content_bytes, text.size());
  const Response copy = response;
  EXPECT_EQ(copy.content, response.content);
  std::string read;
  while (read.size() < text.size()) {
    copy.content->Read(read.size(), 1'000, [&](const Response& portion) { read += portion.body; });
  }
  EXPECT_EQ(read, text);
  copy.content->Read(text.size(), 1'000,
                     [](const Response& portion) { EXPECT_EQ(portion.body, ""); });
}

TEST(LongAnswers, AreAFewForEachClient) {
  LongAnswers answers(
      {.least = kBytes, .each_client = {2 * kBytes, 3}, .all = {100 * kBytes, 100}});
  auto first = answers.Enter("192.0.2.1", ContentOf(kBytes));
  const std::shared_ptr<Content> content = ContentOf(kBytes);
  const auto second = answers.Enter("192.0.2.1", content);
  ASSERT_NE(first, nullptr);
  ASSERT_NE(second, nullptr);
  EXPECT_EQ(answers.Enter("192.0.2.1", ContentOf(kBytes)), nullptr);
  EXPECT_NE(answers.Enter("192.0.2.2", ContentOf(kBytes)), nullptr);
  const auto shared = answers.Enter("192.0.2.1", content);  // takes no more memory
  EXPECT_NE(shared, nullptr);
  EXPECT_EQ(answers.Enter("192.0.2.1", content), nullptr);  // but its turns
  EXPECT_NE(answers.Enter("192.0.2.1", ContentOf(kBytes - 1)), nullptr);
  EXPECT_NE(answers.Enter("192.0.2.1", std::make_shared<FromFile>()), nullptr);
  first.reset();
  EXPECT_NE(answers.Enter("192.0.2.1", ContentOf(kBytes)), nullptr);
}

TEST(LongAnswers, HoldOnlySoManyBytesEachCountedOnce) {
  LongAnswers answers({.least = 1, .each_client = {100 * kBytes, 100}, .all = {3 * kBytes, 5}});
  const std::shared_ptr<Content> shared = ContentOf(2 * kBytes);
  std::vector<std::shared_ptr<void>> places;
  for (const char* const client : {"a", "b", "c", "d"}) {
    places.push_back(answers.Enter(client, shared));
    EXPECT_NE(places.back(), nullptr);
  }
  EXPECT_EQ(answers.Enter("e", ContentOf(2 * kBytes)), nullptr);
  EXPECT_NE(answers.Enter("e", ContentOf(kBytes)), nullptr);
  places.push_back(answers.Enter("e", shared));
  EXPECT_EQ(answers.Enter("f", shared), nullptr);  // the sixth answer
  places.pop_back();
  EXPECT_EQ(answers.Enter("e", ContentOf(2 * kBytes)), nullptr);
  places.clear();
  EXPECT_NE(answers.Enter("e", ContentOf(2 * kBytes)), nullptr);
}

// Otherwise nobody would ever get it.
TEST(LongAnswers, LetInOneThatIsLargerThanAllMayBe) {
  LongAnswers answers({.least = 1, .each_client = {kBytes, 8}, .all = {kBytes, 8}});
  const auto large = answers.Enter("a", ContentOf(2 * kBytes));
  EXPECT_NE(large, nullptr);
  EXPECT_EQ(answers.Enter("b", ContentOf(kBytes)), nullptr);
}

}  // namespace
}  // namespace pheromone::web
