#include "server/cluster/etcd_messages.h"

#include <gtest/gtest.h>

#include <string>
#include <string_view>

namespace pheromone::cluster {
namespace {

std::string ErrorOfTxn(std::string_view text) {
  const Result<TxnAnswer> answer = ParseTxn(text, 2, 1);
  return answer.ok() ? "parsed" : std::string(answer.error());
}

std::string ErrorOfWatch(std::string_view line) {
  const Result<WatchAnswer> answer = ParseWatch(line);
  return answer.ok() ? "parsed" : std::string(answer.error());
}

// Base64 by coreutils.
TEST(EtcdMessagesTest, ATransactionIsAsTheGatewayReadsIt) {
  TxnRequest request;
  request.IfChangedAt("foo", 42);
  request.IfAbsent("bar");
  request.IfEqual("bar", "x");
  request.IfGreater("foo", "x");
  request.success.Put("bar", std::string_view("\0\xff", 2));
  request.success.Read("foo");
  request.failure.ReadRange("a", "b", 32);
  request.failure.ReadLast("a", "b");
  request.failure.DeleteRange("a", "b");
  EXPECT_EQ(request.Text(),
            R"({"compare":[{"target":"MOD","result":"EQUAL","key":"Zm9v","mod_revision":"42"},)"
            R"({"target":"CREATE","result":"EQUAL","key":"YmFy","create_revision":"0"},)"
            R"({"target":"VALUE","result":"EQUAL","key":"YmFy","value":"eA=="},)"
            R"({"target":"VALUE","result":"GREATER","key":"Zm9v","value":"eA=="}],)"
            R"("success":[{"request_put":{"key":"YmFy","value":"AP8="}},)"
            R"({"request_range":{"key":"Zm9v"}}],)"
            R"("failure":[{"request_range":{"key":"YQ==","range_end":"Yg==","limit":"32"}},)"
            R"({"request_range":{"key":"YQ==","range_end":"Yg==","limit":"1",)"
            R"("sort_order":"DESCEND","sort_target":"KEY"}},)"
            R"({"request_delete_range":{"key":"YQ==","range_end":"Yg=="}}]})");
}

TEST(EtcdMessagesTest, OtherRequestsAreAsTheGatewayReadsThem) {
  EXPECT_EQ(CompactionRequest(7), R"({"revision":"7"})");
  EXPECT_EQ(WatchRequest("a", "b", 8),
            R"({"create_request":{"key":"YQ==","range_end":"Yg==","start_revision":"8",)"
            R"("fragment":true}})");
  EXPECT_EQ(TransferRequest(18446744073709551615u), R"({"targetID":"18446744073709551615"})");
}

// As etcd 3.4.23 sent it.
TEST(EtcdMessagesTest, ReadsAnAnswerWithWhatIsZeroLeftOut) {
  const Result<TxnAnswer> answer =
      ParseTxn(R"({"header":{"cluster_id":"385926575987642974","member_id":"7383792418829112008",)"
               R"("revision":"2","raft_term":"2"},"responses":[{"response_range":{"header":)"
               R"({"revision":"2"},"kvs":[{"key":"Zm9v","create_revision":"2","mod_revision":"2",)"
               R"("version":"1","value":"YmFy"},{"key":"Zm8=","mod_revision":"1"}],"more":true,)"
               R"("count":"3"}},{"response_range":{"header":{"revision":"2"}}}]})",
               0, 2);
  ASSERT_TRUE(answer.ok()) << answer.error();
  EXPECT_EQ(answer.value().revision, 2u);
  EXPECT_FALSE(answer.value().succeeded);
  ASSERT_EQ(answer.value().parts.size(), 2u);
  const TxnAnswer::Part& part = answer.value().parts[0];
  EXPECT_TRUE(part.more);
  ASSERT_EQ(part.entries.size(), 2u);
  EXPECT_EQ(part.entries[0], (Entry{"foo", "bar", 2}));
  EXPECT_EQ(part.entries[1], (Entry{"fo", "", 1}));
  EXPECT_TRUE(answer.value().parts[1].entries.empty());
  EXPECT_FALSE(answer.value().parts[1].more);
}

TEST(EtcdMessagesTest, ReadsTheAnswerToAPut) {
  const Result<TxnAnswer> answer =
      ParseTxn(R"({"header":{"revision":"9"},"succeeded":true,"responses":[{"response_put":)"
               R"({"header":{"revision":"9"}}}]})",
               1, 2);
  ASSERT_TRUE(answer.ok()) << answer.error();
  EXPECT_TRUE(answer.value().succeeded);
}

TEST(EtcdMessagesTest, WrongAnswersAreErrorsThatNameTheField) {
  EXPECT_TRUE(ErrorOfTxn("").starts_with("not JSON: "));
  EXPECT_TRUE(ErrorOfTxn("<html>").starts_with("not JSON: "));
  EXPECT_TRUE(ErrorOfTxn(R"({"header":)").starts_with("not JSON: "));
  EXPECT_TRUE(ErrorOfTxn(std::string(100'000, '[')).starts_with("not JSON: "));
  EXPECT_EQ(ErrorOfTxn("[]"), "expected an object");
  EXPECT_EQ(ErrorOfTxn("{}"), R"(field "header.revision": expected a number in a string)");
  EXPECT_EQ(ErrorOfTxn(R"({"header":5})"), R"(field "header": expected an object)");
  for (const char* const number :
       {R"("-1")", R"("")", R"("1x")", "null", "[]", "1.5", R"("18446744073709551616")"}) {
    EXPECT_EQ(ErrorOfTxn(R"({"header":{"revision":)" + std::string(number) + "}}"),
              R"(field "revision": expected a number in a string)")
        << number;
  }
  EXPECT_EQ(ErrorOfTxn(R"({"header":{"revision":"1"}})"),
            R"(field "responses": expected 1, received 0)");
  EXPECT_EQ(ErrorOfTxn(R"({"header":{"revision":"1"},"succeeded":1})"),
            R"(field "succeeded": expected true or false)");
  const std::string begin = R"({"header":{"revision":"1"},"responses":[{"response_range":{"kvs":)";
  EXPECT_EQ(ErrorOfTxn(begin + R"([{"key":"Zm9v","value":"Zm9"}]}}]})"),
            R"(key foo: field "value": expected Base64: not Base64 at character 4)");
  EXPECT_EQ(ErrorOfTxn(begin + R"([{"key":5}]}}]})"), R"(field "key": expected Base64)");
  EXPECT_EQ(ErrorOfTxn(begin + R"([5]}}]})"), R"(field "kvs": expected a list of objects)");
  EXPECT_EQ(ErrorOfTxn(begin + R"({}}}]})"), R"(field "kvs": expected a list)");
}

TEST(EtcdMessagesTest, AReadThatFailedIsAnError) {
  const Result<TxnAnswer> answer = ParseRead(R"({"header":{"revision":"1"}})", 4);
  ASSERT_FALSE(answer.ok());
  EXPECT_EQ(answer.error(), R"(field "succeeded": expected true)");
}

// As etcd 3.4.23 sent them.
TEST(EtcdMessagesTest, ReadsTheLinesOfAWatch) {
  Result<WatchAnswer> answer =
      ParseWatch(R"({"result":{"header":{"cluster_id":"385926575987642974",)"
                 R"("member_id":"7383792418829112008","revision":"2","raft_term":"2"},)"
                 R"("created":true}})");
  ASSERT_TRUE(answer.ok()) << answer.error();
  EXPECT_TRUE(answer.value().changes.empty());
  EXPECT_FALSE(answer.value().is_compacted);
  answer =
      ParseWatch(R"({"result":{"header":{"revision":"4"},"events":[{"kv":{"key":"Zm9v",)"
                 R"("create_revision":"2","mod_revision":"3","version":"2","value":"YmFyMg=="}},)"
                 R"({"type":"DELETE","kv":{"key":"Zm9v","mod_revision":"4"}}]}})");
  ASSERT_TRUE(answer.ok()) << answer.error();
  ASSERT_EQ(answer.value().changes.size(), 2u);
  EXPECT_EQ(answer.value().changes[0].entry, (Entry{"foo", "bar2", 3}));
  EXPECT_FALSE(answer.value().changes[0].is_deleted);
  EXPECT_EQ(answer.value().changes[1].entry, (Entry{"foo", "", 4}));
  EXPECT_TRUE(answer.value().changes[1].is_deleted);
  answer = ParseWatch(
      R"({"result":{"header":{"raft_term":"2"},"canceled":true,"compact_revision":"4"}})");
  ASSERT_TRUE(answer.ok()) << answer.error();
  EXPECT_TRUE(answer.value().is_compacted);
}

TEST(EtcdMessagesTest, AWatchThatIsCanceledWithoutACompactionIsAnErrorWithItsReason) {
  EXPECT_EQ(ErrorOfWatch(R"({"error":{"grpc_code":14,"http_code":503,"message":"no leader"}})"),
            "etcd canceled the watch: no leader");
  EXPECT_EQ(ErrorOfWatch(R"({"result":{"canceled":true,"cancel_reason":"no leader"}})"),
            "etcd canceled the watch: no leader");
  EXPECT_EQ(ErrorOfWatch(R"({"result":{"canceled":true,"compact_revision":"0"}})"),
            "etcd canceled the watch: no reason given");
}

TEST(EtcdMessagesTest, WrongLinesOfAWatchAreErrors) {
  EXPECT_TRUE(ErrorOfWatch("").starts_with("not JSON: "));
  EXPECT_EQ(ErrorOfWatch("{}"), R"(field "result": expected an object)");
  EXPECT_EQ(ErrorOfWatch(R"({"result":{"events":[{"type":"MOVE"}]}})"),
            R"(field "type": expected PUT or DELETE)");
  EXPECT_EQ(ErrorOfWatch(R"({"result":{"events":7}})"), R"(field "events": expected a list)");
}

TEST(EtcdMessagesTest, ReadsTheStatusOfAMember) {
  const Result<StatusAnswer> answer = ParseStatus(
      R"({"header":{"cluster_id":"385926575987642974","member_id":"7383792418829112008",)"
      R"("revision":"2","raft_term":"2"},"version":"3.4.23","dbSize":"24576",)"
      R"("leader":"38712720341031407","raftIndex":"10"})");
  ASSERT_TRUE(answer.ok()) << answer.error();
  EXPECT_EQ(answer.value().member, 7383792418829112008u);
  EXPECT_EQ(answer.value().leader, 38712720341031407u);
}

TEST(EtcdMessagesTest, AnErrorIsOneLine) {
  EXPECT_EQ(ErrorOf(R"({"error":"etcdserver: not leader","message":"etcdserver: not leader",)"
                    R"("code":9})"),
            "etcdserver: not leader");
  EXPECT_EQ(ErrorOf("Not Found\n"), R"("Not Found\u000a")");
  EXPECT_EQ(ErrorOf(""), R"("")");
}

}  // namespace
}  // namespace pheromone::cluster
