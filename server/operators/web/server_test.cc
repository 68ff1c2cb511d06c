// The server on real sockets: many at once, and strangers who break the rules.

#include "server/operators/web/server.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/operators/web/testing/listening_server.h"
#include "server/operators/web/testing/raw_client.h"

namespace pheromone::web {
namespace {

using testing::RawClient;

class ServerTest : public testing::ListeningServer {
 protected:
  // Answers with method, target, whether it is local, and the body: at once, but for what
  // `is_held_` says; that is answered by AnswerHeld.
  void Start(int threads = 3) {
    Make([this](Request request, Respond respond) {
      ++handled_;
      if (is_held_ && is_held_(request)) {
        const std::lock_guard lock(mutex_);
        held_.emplace_back(std::move(request), std::move(respond));
        wake_.notify_one();
        return;
      }
      respond(ResponseTo(request));
    });
    Listen(threads);
  }

  static Response ResponseTo(const Request& request) {
    return Response{.content_type = "text/plain",
                    .body = request.method + " " + request.target +
                            (request.local ? " local " : " remote ") + request.body + "."};
  }

  void AwaitHeld(size_t count) {
    std::unique_lock lock(mutex_);
    wake_.wait(lock, [&] { return held_.size() >= count; });
  }

  // In the test's thread, which is none of the server's.
  void AnswerHeld() {
    std::vector<std::pair<Request, Respond>> held;
    {
      const std::lock_guard lock(mutex_);
      held.swap(held_);
    }
    for (const auto& [request, respond] : held) {
      respond(ResponseTo(request));
    }
  }

  std::string Once(const std::string& request) {
    const RawClient client(server_->port());
    client.Send(request);
    return client.ReadAll();
  }

  static std::string StatusOf(const std::string& answer) {
    return answer.starts_with("HTTP/1.1 ") ? answer.substr(9, 3) : "no answer: " + answer;
  }

  std::atomic<int> handled_{0};
  std::function<bool(const Request&)> is_held_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<std::pair<Request, Respond>> held_;
};

constexpr char kGetAndClose[] = "GET /a HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n";
constexpr char kGetA[] = "GET /a HTTP/1.1\r\nHost: x\r\n\r\n";

TEST_F(ServerTest, OneConnectionServesRequestAfterRequestAlsoSentAtOnce) {
  Start();
  const RawClient client(server_->port());
  client.Send(
      "GET /a HTTP/1.1\r\nHost: x\r\n\r\nPOST /b HTTP/1.1\r\nHost: x\r\n"
      "Content-Length: 3\r\n\r\nxyz");
  EXPECT_TRUE(client.ReadUntil("GET /a remote .").ends_with("GET /a remote ."));
  EXPECT_TRUE(client.ReadUntil("POST /b remote xyz.").ends_with("POST /b remote xyz."));
  client.Send("HEAD /c HTTP/1.1\r\nHost: x\r\n\r\n");
  const std::string head = client.ReadUntil("\r\n\r\n");
  EXPECT_NE(head.find("Content-Length: 16\r\n"), std::string::npos) << head;  // "HEAD /c remote ."
  client.Send("GET /d HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
  EXPECT_TRUE(client.ReadAll().ends_with("GET /d remote ."));
}

TEST_F(ServerTest, TheUnixSocketIsLocalAndForItsUserAndGroupAlone) {
  Start();
  const RawClient client(options_.socket_path);
  client.Send("GET / HTTP/1.0\r\n\r\n");
  EXPECT_TRUE(client.ReadAll().ends_with("GET / local ."));
  struct stat found {};
  ASSERT_EQ(stat(options_.socket_path.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777u, 0660u);
  Stop();
  EXPECT_FALSE(std::filesystem::exists(options_.socket_path));
}

TEST_F(ServerTest, ManyClientsAtOnceGetTheirOwnAnswers) {
  Start();
  constexpr int kClients = 8;
  constexpr int kRequests = 50;
  std::vector<std::thread> clients;
  std::atomic<int> wrong{0};
  clients.reserve(kClients);
  for (int i = 0; i < kClients; ++i) {
    clients.emplace_back([&, i] {
      const bool local = i % 2 == 0;
      const auto client = local ? std::make_unique<RawClient>(options_.socket_path)
                                : std::make_unique<RawClient>(server_->port());
      for (int n = 0; n < kRequests; ++n) {
        const std::string target = "/" + std::to_string(i) + "/" + std::to_string(n);
        client->Send("GET " + target + " HTTP/1.1\r\nHost: x\r\n\r\n");
        const std::string expected = "GET " + target + (local ? " local ." : " remote .");
        wrong += client->ReadUntil(expected).ends_with(expected) ? 0 : 1;
      }
    });
  }
  for (std::thread& client : clients) {
    client.join();
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(handled_, kClients * kRequests);
}

TEST_F(ServerTest, WhoeverBreaksTheRulesIsToldAndHungUpOn) {
  Start();
  EXPECT_EQ(StatusOf(Once("what is this\r\n\r\n")), "400");
  EXPECT_EQ(StatusOf(Once("GET / HTTP/9.9\r\n\r\n")), "400");
  EXPECT_EQ(StatusOf(Once("GET / HTTP/1.1\r\nX: " + std::string(9000, 'a') + "\r\n\r\n")), "431");
  EXPECT_EQ(StatusOf(Once("GET /" + std::string(9000, 'a') + " HTTP/1.1\r\n\r\n")), "431");
  EXPECT_EQ(StatusOf(Once("POST / HTTP/1.1\r\nContent-Length: 1048577\r\n\r\n" +
                          std::string(1'048'577, 'a'))),
            "413");
  EXPECT_EQ(StatusOf(Once("POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n200000\r\n" +
                          std::string(0x200000, 'a') + "\r\n0\r\n\r\n")),
            "413");
  EXPECT_EQ(handled_, 0);
}

TEST_F(ServerTest, ABodyOfTheGreatestSizeIsTakenAndWaitedFor) {
  Start();
  const RawClient client(server_->port());
  client.Send(
      "POST / HTTP/1.1\r\nContent-Length: 1048576\r\nExpect: 100-continue\r\n"
      "Connection: close\r\n\r\n");
  EXPECT_TRUE(client.ReadUntil("\r\n\r\n").starts_with("HTTP/1.1 100"));
  client.Send(std::string(1 << 20, 'a'));
  EXPECT_TRUE(client.ReadAll().ends_with("aaa."));
}

TEST_F(ServerTest, WhoeverIsSlowIsHungUpOn) {
  options_.patience = std::chrono::milliseconds(50);
  Start();
  for (const char* beginning :
       {"", "GET / HT", "POST / HTTP/1.1\r\nContent-Length: 9\r\n\r\nabc"}) {
    EXPECT_EQ(Once(beginning), "") << beginning;  // returns at all
  }
  EXPECT_EQ(handled_, 0);
}

TEST_F(ServerTest, AnAnswerThatComesLaterFromAnotherThreadIsSentInTheOrderOfTheRequests) {
  is_held_ = [](const Request& request) { return request.target == "/held"; };
  Start();
  const RawClient client(server_->port());
  client.Send("GET /held HTTP/1.1\r\n\r\nGET /b HTTP/1.1\r\nConnection: close\r\n\r\n");
  AwaitHeld(1);
  EXPECT_EQ(handled_, 1);  // the second waits for the first
  AnswerHeld();
  const std::string all = client.ReadAll();
  EXPECT_LT(all.find("GET /held remote ."), all.find("GET /b remote ."));
  EXPECT_TRUE(all.ends_with("GET /b remote ."));
}

TEST_F(ServerTest, ARequestWhoseAnswerDoesNotComeIs504AndTheNextOneIsServed) {
  options_.patience = std::chrono::milliseconds(50);
  is_held_ = [](const Request& request) { return request.target == "/held"; };
  Start();
  const RawClient client(server_->port());
  client.Send("GET /held HTTP/1.1\r\n\r\nGET /b HTTP/1.1\r\nConnection: close\r\n\r\n");
  const std::string all = client.ReadAll();
  EXPECT_EQ(StatusOf(all), "504");
  EXPECT_TRUE(all.ends_with("GET /b remote ."));
  AnswerHeld();  // far too late: nobody listens
}

TEST_F(ServerTest, ARequestThatIsDroppedIs503AtOnce) {
  options_.patience = std::chrono::minutes(1);
  is_held_ = [](const Request&) { return true; };
  Start();
  const RawClient client(server_->port());
  client.Send("GET /a HTTP/1.1\r\nConnection: close\r\n\r\n");
  AwaitHeld(1);
  {
    const std::lock_guard lock(mutex_);
    held_.clear();
  }
  EXPECT_EQ(StatusOf(client.ReadAll()), "503");
}

TEST_F(ServerTest, AnAnswerMayOutliveTheServer) {
  options_.patience = std::chrono::milliseconds(20);
  is_held_ = [](const Request&) { return true; };
  Start();
  const RawClient client(server_->port());
  client.Send(kGetA);
  AwaitHeld(1);
  Stop();
  server_.reset();
  AnswerHeld();
}

TEST_F(ServerTest, WhatWasHandedOverWhenTheServerStopsIsAnswered) {
  is_held_ = [](const Request&) { return true; };
  Start();
  const RawClient client(server_->port());
  client.Send(kGetA);
  AwaitHeld(1);
  server_->Stop();
  AnswerHeld();
  EXPECT_TRUE(client.ReadAll().ends_with("GET /a remote ."));
  server_.reset();
}

TEST_F(ServerTest, ALongAnswerToWhatWasHandedOverIsSentWhenTheServerStops) {
  is_held_ = [](const Request&) { return true; };
  Start();
  const RawClient client(server_->port());
  client.Send("POST /a HTTP/1.1\r\nHost: x\r\nContent-Length: 300000\r\n\r\n" +
              std::string(300'000, 'a'));
  AwaitHeld(1);
  server_->Stop();
  AnswerHeld();
  EXPECT_TRUE(client.ReadAll().ends_with(std::string(300'000, 'a') + '.'));
}

// More than the system's buffers hold.
constexpr size_t kVeryLong = 32 << 20;

TEST_F(ServerTest, ALongAnswerThatIsBeingSentIsSentWhenTheServerStops) {
  Make([](const Request& /*request*/, const Respond& respond) {
    respond(Response{.body = std::string(kVeryLong, 'a')});
  });
  Listen(3);
  const RawClient client(server_->port());
  client.Send(kGetA);
  client.ReadUntil("\r\n\r\naaaa");
  server_->Stop();
  EXPECT_EQ(client.ReadAll().size() + 4, kVeryLong);
}

TEST_F(ServerTest, AClientThatDoesNotReadDoesNotHoldUpTheEnd) {
  options_.patience = std::chrono::minutes(10);
  Make([](const Request& /*request*/, const Respond& respond) {
    respond(Response{.body = std::string(kVeryLong, 'a')});
  });
  Listen(3);
  const RawClient client(server_->port());
  client.Send(kGetA);
  client.ReadUntil("\r\n\r\naaaa");
  Stop();  // returns when no session is left
}

TEST_F(ServerTest, TheConnectionThatWasIdleForLongestGivesWayToANewOne) {
  options_.max_connections = 2;
  // Of two threads one may be late to note that its connection waits, although its client has the
  // answer.
  Start(1);
  const auto serve = [](const RawClient& client) {
    client.Send(kGetA);
    EXPECT_TRUE(client.ReadUntil("remote .").ends_with("GET /a remote ."));
  };
  const RawClient first(server_->port());
  serve(first);
  const RawClient second(server_->port());
  serve(second);
  serve(first);  // now the second is the idlest
  const RawClient third(server_->port());
  serve(third);
  EXPECT_EQ(second.ReadAll(), "");
  serve(first);
  serve(third);
}

// Whoever sends half of a request keeps nobody from being served.
TEST_F(ServerTest, AnIncompleteRequestGivesWayLikeAnIdleConnection) {
  options_.max_connections = 2;
  Start(1);
  std::vector<std::unique_ptr<RawClient>> halfway;
  for (int i = 0; i < 4; ++i) {
    halfway.push_back(std::make_unique<RawClient>(server_->port()));
    halfway.back()->Send(
        "POST /a HTTP/1.1\r\nHost: x\r\nExpect: 100-continue\r\nContent-Length: 9\r\n\r\n");
    EXPECT_TRUE(halfway.back()->ReadUntil("\r\n\r\n").starts_with("HTTP/1.1 100"));
    halfway.back()->Send("abc");
  }
  EXPECT_TRUE(Once("GET /a HTTP/1.0\r\n\r\n").ends_with("GET /a remote ."));
  EXPECT_EQ(halfway[0]->ReadAll(), "");
  halfway.back()->Send("defghi");  // the youngest goes on
  EXPECT_TRUE(halfway.back()->ReadUntil("ghi.").ends_with("POST /a remote abcdefghi."));
}

TEST_F(ServerTest, SocketAndPortDoNotFillEachOther) {
  options_.max_connections = 1;
  is_held_ = [](const Request& request) { return request.target == "/held"; };
  Start();
  const RawClient remote(server_->port());
  remote.Send("GET /held HTTP/1.1\r\n\r\n");
  AwaitHeld(1);
  const RawClient local(options_.socket_path);
  local.Send(kGetA);
  EXPECT_TRUE(local.ReadUntil("local .").ends_with("GET /a local ."));
  AnswerHeld();
  EXPECT_TRUE(remote.ReadUntil("remote .").ends_with("GET /held remote ."));
}

TEST_F(ServerTest, AClientOfThePortThatConnectsTooOftenIsClosedAndTheSocketIsServed) {
  options_.pace = {.interval = std::chrono::hours(1), .burst = 2, .longest_wait = {}};
  std::atomic<int> complaints{0};
  options_.tell = [&](const std::string& text) {
    EXPECT_NE(text.find("127.0.0.1 connects too often"), std::string::npos) << text;
    ++complaints;
  };
  Start();
  const RawClient first(server_->port());
  EXPECT_EQ(StatusOf(Once(kGetAndClose)), "200");
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(RawClient(server_->port()).ReadAll(), "");
  }
  first.Send(kGetAndClose);
  EXPECT_EQ(StatusOf(first.ReadAll()), "200") << "it has its connection";
  const RawClient local(options_.socket_path);
  local.Send(kGetAndClose);
  EXPECT_EQ(StatusOf(local.ReadAll()), "200");
  EXPECT_EQ(complaints, 1);
}

TEST_F(ServerTest, AClientOfThePortThatConnectsSomewhatTooOftenIsServedInTurn) {
  options_.pace = {
      .interval = std::chrono::milliseconds(1), .burst = 1, .longest_wait = std::chrono::hours(1)};
  Start();
  std::vector<std::unique_ptr<RawClient>> clients;
  for (int i = 0; i < 30; ++i) {
    clients.push_back(std::make_unique<RawClient>(server_->port()));
    clients.back()->Send(kGetAndClose);
  }
  for (const auto& client : clients) {
    EXPECT_EQ(StatusOf(client->ReadAll()), "200");
  }
}

TEST_F(ServerTest, WhereAllAreBusyNewOnesAreToldSoButForWhatIsUrgent) {
  options_.max_connections = 2;
  options_.is_urgent = [](const Request& request) { return request.target == "/urgent"; };
  is_held_ = [](const Request& request) { return request.target == "/held"; };
  Start();
  const RawClient first(server_->port());
  const RawClient second(server_->port());
  first.Send("GET /held HTTP/1.1\r\n\r\n");
  second.Send("GET /held HTTP/1.1\r\n\r\n");
  AwaitHeld(2);
  EXPECT_EQ(StatusOf(Once(kGetA)), "503");
  EXPECT_TRUE(Once("GET /urgent HTTP/1.1\r\n\r\n").ends_with("GET /urgent remote ."));
  // Those that only wait beyond the limit do not fill it either.
  std::vector<std::unique_ptr<RawClient>> idle;
  for (int i = 0; i < 20; ++i) {
    idle.push_back(std::make_unique<RawClient>(server_->port()));
  }
  EXPECT_TRUE(Once("GET /urgent HTTP/1.1\r\n\r\n").ends_with("GET /urgent remote ."));
  AnswerHeld();
  EXPECT_TRUE(first.ReadUntil("remote .").ends_with("GET /held remote ."));
  EXPECT_TRUE(second.ReadUntil("remote .").ends_with("GET /held remote ."));
}

TEST_F(ServerTest, ClientsThatKeepAnAnsweredConnectionOpenDoNotFillThePlaceOfTheUrgent) {
  options_.max_connections = 2;
  options_.is_urgent = [](const Request& request) { return request.target == "/urgent"; };
  is_held_ = [](const Request& request) { return request.target == "/held"; };
  Start();
  std::vector<std::unique_ptr<RawClient>> busy;
  std::vector<std::unique_ptr<RawClient>> refused;
  for (int i = 0; i < 2; ++i) {
    busy.push_back(std::make_unique<RawClient>(server_->port()));
    busy.back()->Send("GET /held HTTP/1.1\r\nConnection: close\r\n\r\n");
  }
  AwaitHeld(2);
  for (int i = 0; i < 2; ++i) {
    refused.push_back(std::make_unique<RawClient>(server_->port()));
    refused.back()->Send(kGetA);
    EXPECT_EQ(StatusOf(refused.back()->ReadAll()), "503");
  }
  EXPECT_TRUE(Once("GET /urgent HTTP/1.1\r\n\r\n").ends_with("GET /urgent remote ."));
  AnswerHeld();
  for (const auto& client : busy) {
    EXPECT_TRUE(client->ReadAll().ends_with("GET /held remote ."));
  }
  // The answered ones give way, too.
  EXPECT_TRUE(Once("GET /a HTTP/1.0\r\n\r\n").ends_with("GET /a remote ."));
}

double CpuSeconds() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto seconds = [](const timeval& it) {
    return static_cast<double>(it.tv_sec) + static_cast<double>(it.tv_usec) / 1e6;
  };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

TEST_F(ServerTest, WithoutDescriptorsItWaitsInsteadOfAskingAgainAndAgain) {
  Start();
  const RawClient from_network(RawClient::Family{AF_INET});
  const RawClient local(RawClient::Family{AF_UNIX});
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  const rlimit no_more{3, before.rlim_max};  // what is open stays open
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &no_more), 0);
  from_network.ConnectTo(server_->port());
  local.ConnectTo(options_.socket_path);
  const double begin_s = CpuSeconds();
  std::this_thread::sleep_for(std::chrono::seconds(1));
  const double spent_s = CpuSeconds() - begin_s;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_LT(spent_s, 0.2);  // of one second; asking all the time takes all of it
  for (const RawClient* client : {&from_network, &local}) {
    client->Send("GET /late HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
    EXPECT_NE(client->ReadAll().find("GET /late"), std::string::npos);
  }
}

// Bytes that depend on their place; beyond `end` there are none.
class Places final : public Content {
 public:
  explicit Places(uint64_t end) : end_(end) {}

  void Read(uint64_t offset, size_t count, Respond respond) override {
    EXPECT_LE(count, size_t{64} << 10);
    EXPECT_FALSE(reading_.exchange(true)) << "more than one portion at a time";
    std::string portion = Between(offset, std::min<uint64_t>(offset + count, end_));
    // From a thread that is none of the server's.
    reader_ = std::jthread([this, portion = std::move(portion), respond = std::move(respond)] {
      reading_ = false;
      respond({.body = portion});
    });
  }

  static std::string Between(uint64_t first, uint64_t end) {
    std::string bytes;
    for (uint64_t i = first; i < end; ++i) {
      bytes += static_cast<char>('a' + i % 23);
    }
    return bytes;
  }

 private:
  const uint64_t end_;
  std::atomic<bool> reading_{false};
  std::jthread reader_;
};

// 300 000 bytes of which there are `end`.
Server::Handle LongAnswer(uint64_t end) {
  return [end](const Request& request, const Respond& respond) {
    if (request.target == "/short") {
      respond({.body = "short"});
      return;
    }
    Response answer;
    answer.content = std::make_shared<Places>(end);
    answer.content_offset = 7;
    answer.content_bytes = 300'000;
    respond(std::move(answer));
  };
}

TEST_F(ServerTest, AContentIsSentInPortionsAndThenTheNextRequestIsServed) {
  Make(LongAnswer(1'000'000));
  Listen(2);
  const RawClient client(server_->port());
  client.Send("HEAD /long HTTP/1.1\r\nHost: x\r\n\r\nGET /long HTTP/1.1\r\nHost: x\r\n\r\n");
  const std::string head = client.ReadUntil("\r\n\r\n");
  EXPECT_NE(head.find("Content-Length: 300000\r\n"), std::string::npos) << head;
  EXPECT_TRUE(client.ReadUntil("\r\n\r\n").starts_with("HTTP/1.1 200 OK\r\n"));
  client.Send("GET /short HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
  const std::string rest = client.ReadAll();
  EXPECT_EQ(rest.substr(0, 300'000), Places::Between(7, 300'007));
  EXPECT_TRUE(rest.ends_with("\r\n\r\nshort")) << rest.substr(300'000);
}

TEST_F(ServerTest, AContentThatIsShorterThanAnnouncedEndsTheConnection) {
  Make(LongAnswer(200'000));
  Listen(2);
  const RawClient client(server_->port());
  client.Send("GET /long HTTP/1.1\r\nHost: x\r\n\r\nGET /short HTTP/1.1\r\nHost: x\r\n\r\n");
  client.ReadUntil("\r\n\r\n");
  EXPECT_EQ(client.ReadAll(), Places::Between(7, 200'000));
}

TEST_F(ServerTest, WhoeverDoesNotReadAContentIsHungUpOn) {
  options_.patience = std::chrono::milliseconds(50);
  std::atomic<bool> gone{false};
  Make([&](const Request&, const Respond& respond) {
    struct Endless final : Content {
      explicit Endless(std::atomic<bool>* flag) : gone(flag) {}
      ~Endless() override {
        *gone = true;
        gone->notify_all();
      }
      void Read(uint64_t, size_t count, Respond respond) override {
        respond({.body = std::string(count, 'x')});
      }
      std::atomic<bool>* const gone;
    };
    Response answer;
    answer.content = std::make_shared<Endless>(&gone);
    answer.content_bytes = uint64_t{1} << 40;
    respond(std::move(answer));
  });
  Listen(1);
  const RawClient client(server_->port());
  client.Send(kGetA);
  gone.wait(false);
}

TEST_F(ServerTest, OneClientGetsOnlySoManyLongAnswersAtATime) {
  options_.long_answers = {.least = 1, .each_client = {1 << 30, 2}, .all = {1 << 30, 8}};
  Make([](const Request& request, const Respond& respond) {
    respond({.body = std::string(request.target == "/short" ? 5 : 16 << 20, 'a')});
  });
  Listen(1);
  constexpr char kGetLong[] = "GET /long HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n";
  std::vector<std::unique_ptr<RawClient>> slow;
  for (int i = 0; i < 2; ++i) {
    slow.push_back(std::make_unique<RawClient>(server_->port()));
    slow.back()->Send(kGetLong);
    EXPECT_TRUE(slow.back()->ReadUntil("\r\n\r\n").starts_with("HTTP/1.1 200"));
  }
  EXPECT_EQ(StatusOf(Once(kGetLong)), "503");
  // Others, and what is short, have their turn between the portions.
  EXPECT_TRUE(Once("GET /short HTTP/1.0\r\n\r\n").ends_with("aaaaa"));
  const RawClient local(options_.socket_path);
  local.Send(kGetLong);
  EXPECT_TRUE(local.ReadUntil("\r\n\r\n").starts_with("HTTP/1.1 200"));
  EXPECT_EQ(slow[0]->ReadAll().size(), size_t{16} << 20);
  std::string status;
  do {  // once the server knows that it has been sent
    status = StatusOf(Once(kGetLong));
  } while (status == "503");
  EXPECT_EQ(status, "200");
}

TEST_F(ServerTest, AHeaderThatDecidesAboutAccessMayComeOnlyOnce) {
  Start();
  for (const std::string name : {"Host", "Authorization", "Origin"}) {
    const std::string answer = Once("GET / HTTP/1.1\r\n" + name + ": a\r\n" + name + ": b\r\n\r\n");
    EXPECT_EQ(StatusOf(answer), "400");
    EXPECT_NE(answer.find(R"("what":"found twice","where":")" + name + '"'), std::string::npos)
        << answer;
  }
  EXPECT_EQ(handled_, 0);
}

TEST_F(ServerTest, StopEndsConversationsThatAreUnderWay) {
  Start();
  const RawClient idle(server_->port());
  const RawClient halfway(options_.socket_path);
  halfway.Send("POST / HTTP/1.1\r\nContent-Length: 9\r\n\r\nabc");
  const RawClient served(server_->port());
  served.Send("GET /a HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_TRUE(served.ReadUntil("/a remote .").ends_with("."));
  Stop();
  EXPECT_EQ(idle.ReadAll(), "");
  EXPECT_EQ(halfway.ReadAll(), "");
}

}  // namespace
}  // namespace pheromone::web
