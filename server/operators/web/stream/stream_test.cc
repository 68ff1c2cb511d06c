// The stream over real sockets: who may connect, what they get, and what a viewer that does not
// read costs.

#include "server/operators/web/stream/stream.h"

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>

#include "server/formats/foxglove/testing/tiles_viewer.h"
#include "server/operators/web/api/ticket.h"
#include "server/operators/web/stream/conversation.h"
#include "server/operators/web/stream/testing/client.h"
#include "server/operators/web/stream/viewer.h"
#include "server/operators/web/testing/fake_control.h"
#include "server/operators/web/testing/listening_server.h"
#include "server/operators/web/testing/raw_client.h"

namespace pheromone::web {
namespace {

namespace asio = boost::asio;
namespace json = boost::json;
using std::string_literals::operator""s;

constexpr char kToken[] = "0123456789abcdef";

using testing::Client;
using testing::Knock;

class StreamTest : public testing::ListeningServer {
 protected:
  void Start(StreamOptions options = {}, std::string token = kToken) {
    control_.links.emplace_back().name = "radio-a";
    api_ = std::make_unique<Api>(
        &control_, ApiOptions{.token = std::move(token), .origins = {"https://viewer.example"}});
    stream_ = std::make_unique<Stream>(&control_, api_.get(), options, [this](Work work) {
      asio::post(io_, std::move(work));
      return true;
    });
    Make([this](Request request, Respond respond) {
      api_->Handle(std::move(request), std::move(respond));
    });
    server_->OnUpgrade("/", stream_->Handler());
    Listen(1);  // the control that the tests use is not thread-safe
    thread_ = std::thread([this] { stream_->Run(); });
  }

  void TearDown() override {
    if (server_ != nullptr) {
      server_->Stop();
      stream_->Stop();
      thread_.join();
    }
    ListeningServer::TearDown();
    stream_.reset();
  }

  std::unique_ptr<Client> Connect(const Knock& knock = {}, int expected = 101) {
    Client::Socket socket(client_io_);
    if (knock.local) {
      socket.connect(asio::local::stream_protocol::endpoint(options_.socket_path));
    } else {
      socket.connect(asio::ip::tcp::endpoint(asio::ip::address_v4::loopback(), server_->port()));
    }
    auto client = std::make_unique<Client>(std::move(socket));
    EXPECT_EQ(client->Shake(knock), expected);
    return client;
  }

  // On the thread on which the control is used.
  void With(const std::function<void()>& change) {
    std::mutex mutex;
    std::condition_variable done;
    bool is_done = false;
    asio::post(io_, [&] {
      const std::lock_guard lock(mutex);
      change();
      is_done = true;
      done.notify_all();
    });
    std::unique_lock lock(mutex);
    done.wait(lock, [&] { return is_done; });
  }

  testing::FakeControl control_;
  std::unique_ptr<Api> api_;
  std::unique_ptr<Stream> stream_;
  std::thread thread_;
  asio::io_context client_io_;
};

TEST_F(StreamTest, ServesBothSubprotocols) {
  Start();
  for (const char* name : {"foxglove.websocket.v1", "foxglove.sdk.v1"}) {
    const auto client = Connect({.subprotocol = name});
    EXPECT_EQ(client->subprotocol, name);
    EXPECT_EQ(client->Await("serverInfo").at("name"), "pheromoned");
  }
  Connect({.subprotocol = "chat"}, 400);
  Connect({.subprotocol = ""}, 400);
}

TEST_F(StreamTest, RefusesWhoSpeaksBeforeTheAnswerToItsHandshake) {
  Start();
  const testing::RawClient client(server_->port());
  client.Send(
      "GET / HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
      "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
      "Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n\r\nabc");
  const std::string answer = client.ReadAll();
  EXPECT_TRUE(answer.starts_with("HTTP/1.1 400 ")) << answer;
  EXPECT_NE(answer.find("found bytes behind the handshake"), std::string::npos) << answer;
  Connect()->Await("serverInfo");
}

TEST_F(StreamTest, RefusesPagesOfOthersExceptThoseListed) {
  Start();
  Connect({.origin = "http://127.0.0.1"})->Await("serverInfo");
  Connect({.origin = "https://viewer.example"})->Await("serverInfo");
  Connect({.origin = "https://evil.example"}, 403);
  Connect({.origin = "null"}, 403);
  Connect({.host = "evil.example"}, 421);
}

TEST_F(StreamTest, SendsWhatIsSubscribed) {
  Start();
  const auto client = Connect();
  client->Subscribe({"/status", "/pheromone_delta/trail"});
  EXPECT_TRUE(json::parse(client->AwaitMessage(1)).as_object().contains("health"));
  testing::TilesViewer picture;
  ASSERT_TRUE(picture.Take(client->AwaitMessage(2)));
  EXPECT_TRUE(picture.full);
  EXPECT_EQ(picture.bytes[0], 255);  // the wall
  With([this] { control_.field.Deposit(1, {1'000'000, 500'000}, 2, control_.now_ms); });
  ASSERT_TRUE(picture.Take(client->AwaitMessage(2)));
  EXPECT_NE(picture.bytes[1 * 9 + 2], 0);
}

TEST_F(StreamTest, ChangesOnlyWithTheToken) {
  Start();
  const std::string call =
      "\x02\x03\0\0\0\x09\0\0\0\x04\0\0\0json"s + R"({"pheromone": "trail", "all": true})";
  const auto reader = Connect();
  reader->SendBinary(call);
  EXPECT_NE(reader->Await("serviceCallFailure").at("message").as_string().find("ticket"),
            std::string::npos);
  // The token itself does not belong into an address.
  for (const std::string& target :
       {"/?ticket=1700043200-0123456789abcdef0123456789abcdef"s, "/?ticket="s + kToken}) {
    const auto wrong = Connect({.target = target});
    EXPECT_EQ(wrong->Await("status").at("message"),
              "found an invalid ticket, or an old one: this connection is read-only; pheromonectl "
              "ticket makes another one");
  }
  const auto wrong = Connect({.target = "/?token="s + kToken});
  wrong->SendBinary(call);
  wrong->Await("serviceCallFailure");
  With([this] { EXPECT_TRUE(control_.edits.empty()); });
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const std::string ticket = MakeTicket(
      kToken, static_cast<uint64_t>(std::chrono::duration_cast<std::chrono::seconds>(now).count()));
  const auto right = Connect({.target = "/?ticket=" + ticket});
  right->SendBinary(call);
  EXPECT_NE(right->AwaitBinary(3).find("\"done\":true"), std::string::npos);
  With([this] { EXPECT_EQ(control_.edits.size(), 1u); });
}

TEST_F(StreamTest, AcceptsNoChangesOverTheNetworkWithoutATokenOfItsOwn) {
  Start({}, "");
  const auto client = Connect({.target = "/?ticket="});
  client->SendBinary("\x02\x07\0\0\0\x09\0\0\0\x04\0\0\0json{}"s);
  client->Await("serviceCallFailure");
  const auto local = Connect({.local = true});
  local->SendBinary("\x02\x07\0\0\0\x09\0\0\0\x04\0\0\0json{}"s);
  EXPECT_NE(local->AwaitBinary(3).find("radio-a"), std::string::npos);
}

TEST_F(StreamTest, TakesNoMoreViewersThanConfigured) {
  Start({.max_viewers = 2});
  auto first = Connect();
  const auto second = Connect();
  first->Await("serverInfo");
  second->Await("serverInfo");
  Connect({}, 503);
  EXPECT_EQ(stream_->counters().viewers, 2u);
  EXPECT_EQ(stream_->counters().refused, 1u);
}

TEST_F(StreamTest, DisconnectsWhoSendsTooMuchAtOnce) {
  Start();
  const auto client = Connect();
  client->Await("serverInfo");
  client->SendBinary(std::string(kMaxInboundBytes + 1, 'x'));
  client->AwaitEnd();
}

TEST_F(StreamTest, KeepsServingOthersBesideOneThatDoesNotRead) {
  Start();
  const auto deaf = Connect();
  deaf->Subscribe({"/clients", "/robots", "/status"});
  const auto client = Connect();
  client->Subscribe({"/clients"});
  for (int i = 0; i < 3; ++i) {
    json::parse(client->AwaitMessage(1));
  }
}

TEST_F(StreamTest, DisconnectsOneThatDoesNotReadWithoutKeepingWhatItMissed) {
  control_.clients.resize(100);
  Start({.write_patience = std::chrono::seconds(1)});
  const auto deaf = Connect({.local = true});  // its buffer does not grow, unlike that of TCP
  deaf->Subscribe({"/clients"});
  const auto client = Connect();
  client->Subscribe({"/events", "/tf"});
  while (stream_->counters().stalled == 0) {
    client->AwaitMessage(2);
  }
  EXPECT_GT(stream_->counters().dropped_frames, 0u);
  EXPECT_EQ(stream_->counters().viewers, 1u);
}

TEST_F(StreamTest, AnswersEachMessageOfAFloodAndReadsNoMoreThanItCanAnswer) {
  Start();
  const auto client = Connect();
  client->Await("serverInfo");
  constexpr int kMessages = 130;  // more than may be saved up
  for (int i = 0; i < kMessages; ++i) {
    client->Send("{}");
  }
  for (int i = 0; i < kMessages; ++i) {
    client->Await("status");
  }
}

TEST_F(StreamTest, HearsOneThatWasToldOfDroppedEvents) {
  Start({.write_patience = std::chrono::hours(1)});
  const auto slow = Connect({.local = true});  // its buffer does not grow, unlike that of TCP
  slow->Subscribe({"/events"});
  const auto reader = Connect();
  reader->Subscribe({"/events"});
  const auto publish = [&](size_t count) {
    With([&] {
      for (size_t i = 0; i < count; ++i) {
        control_.board.Publish(
            {.topic = control::Notice::Topic::kCapture, .text = std::string(4000, 'x')});
      }
    });
    for (size_t i = 0; i < count; ++i) {
      reader->AwaitMessage(1);
    }
  };
  publish(1);
  slow->AwaitMessage(1);  // it is subscribed
  while (stream_->counters().dropped_frames == 0) {
    publish(100);
  }
  const json::object status = slow->Await("status");
  EXPECT_NE(status.at("message").as_string().find("events were dropped"), std::string::npos);
  slow->Send("{}");
  EXPECT_EQ(slow->Await("status").at("message"), "unknown op \"\"");
}

TEST_F(StreamTest, EndsConnectionsWhenItStops) {
  Start();
  const auto client = Connect();
  client->Await("serverInfo");
  server_->Stop();
  client->AwaitEnd();
}

}  // namespace
}  // namespace pheromone::web
