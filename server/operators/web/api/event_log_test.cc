#include "server/operators/web/api/event_log.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>

#include "server/operators/web/testing/fake_control.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;
using control::Notice;

class EventLogTest : public ::testing::Test {
 protected:
  json::value Read(json::object query = {}) {
    Parameters fields(query);
    const Response answer = log_.Read(&fields);
    EXPECT_EQ(answer.status, 200);
    return json::parse(answer.body);
  }
  void Happen(const std::string& subject) {
    control_.board.Publish({Notice::Topic::kLink, false, subject, "unplugged"});
  }
  static std::vector<int> Numbers(const json::value& answer) {
    std::vector<int> numbers;
    for (const json::value& event : answer.at("events").as_array()) {
      numbers.push_back(event.at("number").to_number<int>());
    }
    return numbers;
  }

  testing::FakeControl control_;
  EventLog log_{&control_, {}};
};

TEST_F(EventLogTest, GivesEachEventANumberAndTellsWhatIsNewer) {
  EXPECT_EQ(Read().at("next").to_number<int>(), 0);
  Happen("radio-a");
  Happen("radio-b");
  const json::value all = Read();
  EXPECT_EQ(Numbers(all), (std::vector<int>{1, 2}));
  const json::object& first = all.at("events").as_array()[0].as_object();
  EXPECT_EQ(first.at("topic"), "link");
  EXPECT_EQ(first.at("on"), false);
  EXPECT_EQ(first.at("subject"), "radio-a");
  EXPECT_EQ(first.at("text"), "unplugged");
  EXPECT_EQ(Numbers(Read({{"since", 1}})), (std::vector<int>{2}));
  EXPECT_EQ(Numbers(Read({{"since", 2}})), (std::vector<int>{}));
  Happen("radio-c");
  EXPECT_EQ(Numbers(Read({{"since", 2}})), (std::vector<int>{3}));
}

TEST_F(EventLogTest, ANumberOfAnEarlierRunMeansAll) {
  Happen("radio-a");
  EXPECT_EQ(Numbers(Read({{"since", 100}})), (std::vector<int>{1}));
}

TEST_F(EventLogTest, KeepsTheLastThousandAndCountsWhatItNeverSaw) {
  for (int i = 0; i < 600; ++i) {
    Happen("radio-a");
  }
  Read();
  for (int i = 0; i < 1100; ++i) {  // 100 more than its queue has room for
    Happen("radio-b");
  }
  const json::value answer = Read();
  EXPECT_EQ(answer.at("dropped").to_number<int>(), 100);
  EXPECT_EQ(answer.at("next").to_number<int>(), 1600);
  EXPECT_EQ(Numbers(answer).size(), 1000u);
  EXPECT_EQ(Numbers(answer).front(), 601);
}

TEST(EventLog, IsWokenInItsLaneWithoutALock) {
  testing::FakeControl control;
  std::vector<Work> posted;
  EventLog log(&control, [&](Work work) {
    posted.push_back(std::move(work));
    return true;
  });
  control.board.Publish({Notice::Topic::kHealth, true, "", ""});
  control.board.Publish({Notice::Topic::kHealth, false, "", ""});
  ASSERT_EQ(posted.size(), 1u);  // not once more before it has looked
  posted.front()();
  control.board.Publish({Notice::Topic::kHealth, true, "", ""});
  EXPECT_EQ(posted.size(), 2u);
}

}  // namespace
}  // namespace pheromone::web
