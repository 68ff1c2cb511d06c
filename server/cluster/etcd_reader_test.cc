#include "server/cluster/etcd_reader.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace pheromone::cluster {
namespace {

// Keys and values in Base64, made by Python: groups of term 4 with the records "r5", "r7".
constexpr char kKey5[] = "L3BoZXJvbW9uZS9sYWIvbG9nLzAwMDAwMDAwMDAwMDAwMDU=";
constexpr char kKey7[] = "L3BoZXJvbW9uZS9sYWIvbG9nLzAwMDAwMDAwMDAwMDAwMDc=";
constexpr char kGroup5[] = "AQIAAAAEAAAAAAAAAAAAAAA6opqqcjU=";  // events 5 and 6
constexpr char kGroup7[] = "AQEAAAAEAAAAAAAAAAAAAADw8Wfmcjc=";
constexpr char kLeaderKey[] = "L3BoZXJvbW9uZS9sYWIvbGVhZGVy";
constexpr char kFloorKey[] = "L3BoZXJvbW9uZS9sYWIvZmxvb3I=";
constexpr char kFive[] = "MDAwMDAwMDAwMDAwMDAwNQ==";

std::string Kv(const char* key, const char* value, int revision = 3) {
  return R"({"key":")" + std::string(key) + R"(","value":")" + value + R"(","mod_revision":")" +
         std::to_string(revision) + R"("})";
}

// Leader "a" since revision 4, id "ID".
std::string ReadAnswer(const std::string& kvs, int revision = 20, const std::string& floor = "",
                       bool more = false) {
  const auto range = [](const std::string& inside) {
    return R"({"response_range":{"kvs":[)" + inside + "]";
  };
  return R"({"header":{"revision":")" + std::to_string(revision) +
         R"("},"succeeded":true,"responses":[)" + range(Kv(kLeaderKey, "YQ==", 4)) + "}}," +
         range(Kv("L3BoZXJvbW9uZS9sYWIvaWQ=", "SUQ=")) + "}}," +
         range(floor.empty() ? "" : Kv(kFloorKey, floor.c_str())) + "}}," + range(kvs) +
         (more ? R"(,"more":true)" : "") + "}}]}";
}

std::string WatchLine(const std::string& kvs) {
  return R"({"result":{"events":[{"kv":)" + kvs + "}]}}";
}

std::vector<Sequence> Firsts(const Result<EtcdReader::News>& news) {
  std::vector<Sequence> firsts;
  if (!news.ok()) {
    ADD_FAILURE() << news.error();
    return firsts;
  }
  for (const StoredGroup& stored : news.value().groups) {
    firsts.push_back(stored.group.first);
  }
  return firsts;
}

using Sequences = std::vector<Sequence>;

class EtcdReaderTest : public testing::Test {
 protected:
  // Found: the log ends before 5.
  EtcdReaderTest() : reader_(EtcdKeys("lab"), 5, &id_) {
    EXPECT_EQ(Firsts(reader_.OnRead(ReadAnswer(""))), Sequences{});
    EXPECT_TRUE(reader_.found());
  }
  std::string id_;
  EtcdReader reader_;
};

TEST_F(EtcdReaderTest, ReturnsGroupsInOrder) {
  const Result<EtcdReader::News> news =
      reader_.OnRead(ReadAnswer(Kv(kKey5, kGroup5) + "," + Kv(kKey7, kGroup7)));
  EXPECT_EQ(Firsts(news), (Sequences{5, 7}));
  EXPECT_EQ(news.value().groups[0].group, (Group{5, 2, 4, "r5"}));
  EXPECT_EQ(news.value().leader, (Leader{4, "a"}));
  EXPECT_EQ(news.value().id, "ID");
  EXPECT_EQ(news.value().log_end, 8u);
  EXPECT_EQ(news.value().revision, 20u);
  EXPECT_FALSE(news.value().more);
  EXPECT_EQ(reader_.next(), 8u);
}

TEST_F(EtcdReaderTest, APortionAsksForTheNext) {
  const Result<EtcdReader::News> news =
      reader_.OnRead(ReadAnswer(Kv(kKey5, kGroup5), 20, "", true));
  EXPECT_EQ(Firsts(news), Sequences{5});
  EXPECT_TRUE(news.value().more);
  EXPECT_EQ(Firsts(reader_.OnRead(ReadAnswer(Kv(kKey7, kGroup7)))), Sequences{7});
}

TEST_F(EtcdReaderTest, AWatchShowsNothingTwice) {
  EXPECT_EQ(Firsts(reader_.OnRead(ReadAnswer(Kv(kKey5, kGroup5)))), Sequences{5});
  EXPECT_EQ(Firsts(reader_.OnWatch(WatchLine(Kv(kKey5, kGroup5)))), Sequences{});
  EXPECT_EQ(Firsts(reader_.OnWatch(WatchLine(Kv(kKey7, kGroup7)))), Sequences{7});
  EXPECT_EQ(Firsts(reader_.OnWatch(WatchLine(Kv(kKey7, kGroup7)))), Sequences{});
}

TEST_F(EtcdReaderTest, AGapInAWatchAsksForARead) {
  const Result<EtcdReader::News> news = reader_.OnWatch(WatchLine(Kv(kKey7, kGroup7)));
  EXPECT_EQ(Firsts(news), Sequences{});
  EXPECT_TRUE(news.value().more);
  EXPECT_EQ(reader_.next(), 5u);
}

TEST_F(EtcdReaderTest, AGapInTheLogIsAnErrorAfterASecondLook) {
  const std::string gap = ReadAnswer(Kv(kKey7, kGroup7));
  Result<EtcdReader::News> news = reader_.OnRead(gap);
  EXPECT_EQ(Firsts(news), Sequences{});
  EXPECT_TRUE(news.value().more);
  EXPECT_FALSE(reader_.found());
  EXPECT_EQ(Firsts(reader_.OnRead(ReadAnswer(""))), Sequences{});
  news = reader_.OnRead(gap);
  ASSERT_FALSE(news.ok());
  EXPECT_EQ(news.error(),
            "key /pheromone/lab/log/0000000000000005: expected a group before the one at "
            "/pheromone/lab/log/0000000000000007: the log has a gap");
}

// The reader was beyond the end of a log from a backup, which then grew.
TEST(EtcdReader, TheLogGrowsOverTheReadersPlace) {
  std::string id;
  EtcdReader reader(EtcdKeys("lab"), 6, &id);
  static_cast<void>(reader.OnRead(ReadAnswer("")));
  ASSERT_TRUE(reader.found());
  EXPECT_TRUE(reader.OnRead(ReadAnswer(Kv(kKey7, kGroup7))).value().more);
  ASSERT_FALSE(reader.found());
  static_cast<void>(reader.OnRead(ReadAnswer(Kv(kKey5, kGroup5))));
  ASSERT_TRUE(reader.found());
  EXPECT_EQ(Firsts(reader.OnRead(ReadAnswer(Kv(kKey5, kGroup5) + "," + Kv(kKey7, kGroup7)))),
            (Sequences{5, 7}));
}

TEST(EtcdReader, BeginsWithTheGroupThatContainsItsPlace) {
  std::string id;
  EtcdReader reader(EtcdKeys("lab"), 6, &id);
  const Result<EtcdReader::News> news = reader.OnRead(ReadAnswer(Kv(kKey5, kGroup5)));
  EXPECT_EQ(Firsts(news), Sequences{});
  EXPECT_TRUE(news.value().more);
  EXPECT_EQ(reader.next(), 5u);
}

TEST(EtcdReader, BeginsAfterAGroupThatEndsBeforeItsPlace) {
  std::string id;
  EtcdReader reader(EtcdKeys("lab"), 9, &id);
  const Result<EtcdReader::News> news = reader.OnRead(ReadAnswer(Kv(kKey5, kGroup5)));
  EXPECT_TRUE(news.value().more);
  EXPECT_EQ(reader.next(), 9u);
  EXPECT_EQ(reader.OnRead(ReadAnswer("")).value().log_end, 7u);
}

TEST(EtcdReader, LooksFartherBackUntilTheBeginning) {
  std::string id;
  EtcdReader reader(EtcdKeys("lab"), 1'000'000, &id);
  int reads = 0;
  std::string last;
  for (; !reader.found() && reads < 20; ++reads) {
    EXPECT_NE(reader.ReadRequest(), last);
    last = reader.ReadRequest();
    ASSERT_TRUE(reader.OnRead(ReadAnswer("")).ok());
  }
  EXPECT_TRUE(reader.found());
  EXPECT_EQ(reads, 6);  // 64 * 8^5 > 1 000 000
  EXPECT_EQ(reader.next(), 1'000'000u);
}

TEST(EtcdReader, BeginsAtTheFloorIfItsPlaceIsBefore) {
  std::string id;
  EtcdReader reader(EtcdKeys("lab"), 2, &id);
  static_cast<void>(reader.OnRead(ReadAnswer("", 20, kFive)));
  EXPECT_FALSE(reader.found());
  static_cast<void>(reader.OnRead(ReadAnswer(Kv(kKey5, kGroup5), 20, kFive)));
  EXPECT_TRUE(reader.found());
  const Result<EtcdReader::News> news = reader.OnRead(ReadAnswer(Kv(kKey5, kGroup5), 20, kFive));
  EXPECT_EQ(Firsts(news), Sequences{5});
  EXPECT_EQ(news.value().floor, 5u);
}

TEST(EtcdReader, BeginsAtTheFloorIfThatOvertakesIt) {
  std::string id;
  EtcdReader reader(EtcdKeys("lab"), 2, &id);
  static_cast<void>(reader.OnRead(ReadAnswer("")));
  EXPECT_TRUE(reader.found());
  EXPECT_TRUE(reader.OnRead(ReadAnswer(Kv(kKey5, kGroup5), 21, kFive)).value().more);
  EXPECT_FALSE(reader.found());
  EXPECT_EQ(reader.next(), 5u);
}

TEST_F(EtcdReaderTest, LooksAgainIfTheStoreWentBack) {
  EXPECT_EQ(Firsts(reader_.OnRead(ReadAnswer(Kv(kKey5, kGroup5)))), Sequences{5});
  EXPECT_TRUE(reader_.OnRead(ReadAnswer("", 19)).value().more);
  EXPECT_FALSE(reader_.found());
  static_cast<void>(reader_.OnRead(ReadAnswer("", 19)));
  EXPECT_EQ(reader_.OnRead(ReadAnswer("", 19)).value().log_end, 1u);
}

TEST_F(EtcdReaderTest, AWatchTellsTheLeaderAndTheFloor) {
  Result<EtcdReader::News> news = reader_.OnWatch(WatchLine(Kv(kLeaderKey, "YWI=", 30)));
  ASSERT_TRUE(news.ok()) << news.error();
  EXPECT_EQ(news.value().leader, (Leader{30, "ab"}));
  news = reader_.OnWatch(WatchLine(Kv(kFloorKey, kFive)));
  ASSERT_TRUE(news.ok()) << news.error();
  EXPECT_EQ(news.value().floor, 5u);
  EXPECT_EQ(news.value().leader, (Leader{30, "ab"}));
}

TEST_F(EtcdReaderTest, ACompactedWatchAsksForARead) {
  const Result<EtcdReader::News> news =
      reader_.OnWatch(R"({"result":{"canceled":true,"compact_revision":"4"}})");
  ASSERT_TRUE(news.ok()) << news.error();
  EXPECT_TRUE(news.value().more);
}

TEST_F(EtcdReaderTest, AWatchThatIsCanceledOtherwiseIsAnError) {
  EXPECT_FALSE(reader_.OnWatch(R"({"result":{"canceled":true}})").ok());
}

TEST_F(EtcdReaderTest, AnotherLogIsAnErrorOfWhichNothingIsTaken) {
  EXPECT_EQ(id_, "ID");
  const std::string another = "key /pheromone/lab/id: found \"a\", expected \"ID\": ";
  std::string answer = ReadAnswer(Kv(kKey5, kGroup5), 3, kFive);
  answer.replace(answer.find("SUQ="), 4, "YQ==");
  const Result<EtcdReader::News> read = reader_.OnRead(answer);
  ASSERT_FALSE(read.ok());
  EXPECT_TRUE(read.error().starts_with(another)) << read.error();
  const Result<EtcdReader::News> watch =
      reader_.OnWatch(R"({"result":{"events":[{"kv":)" + Kv(kKey5, kGroup5) + R"(},{"kv":)" +
                      Kv("L3BoZXJvbW9uZS9sYWIvaWQ=", "YQ==") + "}]}}");
  ASSERT_FALSE(watch.ok());
  EXPECT_TRUE(watch.error().starts_with(another)) << watch.error();
  EXPECT_TRUE(reader_.found());
  EXPECT_EQ(Firsts(reader_.OnRead(ReadAnswer(Kv(kKey5, kGroup5)))), Sequences{5});
}

TEST_F(EtcdReaderTest, ADamagedGroupIsAnErrorAndReadAgain) {
  const char* const damaged = kGroup5;  // at the place of 7
  Result<EtcdReader::News> news =
      reader_.OnRead(ReadAnswer(Kv(kKey5, kGroup5) + "," + Kv(kKey7, damaged)));
  EXPECT_EQ(Firsts(news), Sequences{5});  // what is before it
  EXPECT_TRUE(news.value().more);
  for (int i = 0; i < 2; ++i) {
    news = reader_.OnRead(ReadAnswer(Kv(kKey7, damaged)));
    ASSERT_FALSE(news.ok());
    EXPECT_TRUE(news.error().starts_with(
        "key /pheromone/lab/log/0000000000000007: the checksum is aa9aa23a, expected "))
        << news.error();
  }
  EXPECT_EQ(Firsts(reader_.OnRead(ReadAnswer(Kv(kKey7, kGroup7)))), Sequences{7});
}

TEST_F(EtcdReaderTest, OfALineWithADamagedGroupNothingIsReturned) {
  const std::string line = R"({"result":{"events":[{"kv":)" + Kv(kKey5, kGroup5) + R"(},{"kv":)" +
                           Kv(kKey7, kGroup5) + "}]}}";
  EXPECT_FALSE(reader_.OnWatch(line).ok());
  EXPECT_EQ(reader_.next(), 5u);
  EXPECT_EQ(Firsts(reader_.OnRead(ReadAnswer(Kv(kKey5, kGroup5)))), Sequences{5});
}

TEST_F(EtcdReaderTest, AFloorThatIsNoNumberIsAnError) {
  const Result<EtcdReader::News> news = reader_.OnRead(ReadAnswer("", 20, "YQ=="));
  ASSERT_FALSE(news.ok());
  EXPECT_EQ(news.error(), "key /pheromone/lab/floor: expected a number of 16 hexadecimal digits");
}

}  // namespace
}  // namespace pheromone::cluster
