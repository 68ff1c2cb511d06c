// Connections that are handed on when a client asks for a WebSocket.

#include "server/operators/web/upgrade.h"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <array>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket/stream.hpp>

#include "server/operators/web/testing/listening_server.h"

namespace pheromone::web {
namespace {

namespace asio = boost::asio;
namespace websocket = boost::beast::websocket;
using Protocol = asio::generic::stream_protocol;
using WebSocket = websocket::stream<Protocol::socket>;
using boost::system::error_code;

constexpr char kAsks[] =
    "GET /echo HTTP/1.1\r\nHost: x\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
    "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";

// Says what it hears, until the client or the server has enough.
asio::awaitable<void> Echo(std::shared_ptr<Upgrade> upgrade) {
  const auto kept = std::make_shared<WebSocket>(
      upgrade->connection.Release(upgrade->connection.get_executor()).value());
  WebSocket& stream = *kept;
  // The server may stop while the conversation ends by itself.
  upgrade->place.OnStop([weak = std::weak_ptr(kept), executor = stream.get_executor()] {
    asio::post(executor, [weak] {
      if (const auto open = weak.lock()) {
        error_code ignored;
        open->next_layer().close(ignored);
      }
    });
  });
  error_code error;
  const auto into = [&error] { return asio::redirect_error(asio::use_awaitable, error); };
  co_await stream.async_accept(upgrade->message, into());
  while (!error) {
    boost::beast::flat_buffer heard;
    co_await stream.async_read(heard, into());
    if (!error) {
      co_await stream.async_write(heard.data(), into());
    }
  }
}

class UpgradeTest : public testing::ListeningServer {
 protected:
  // `take` gets what asks for /echo and has no Origin; everything else is answered with its path.
  void Start(std::function<void(Upgrade)> take, int threads = 2) {
    Make([](const Request& request, Respond respond) {
      respond({.content_type = "text/plain", .body = request.target + "."});
    });
    server_->OnUpgrade("/echo", {.check = [](const Request& request) -> std::optional<Response> {
                                   if (request.origin.empty()) {
                                     return std::nullopt;
                                   }
                                   return Refuse(403, {"a stranger", "Origin", "none"});
                                 },
                                 .take = std::move(take)});
    Listen(threads);
  }

  void StartEcho() {
    Start([](Upgrade upgrade) {
      const auto kept = std::make_shared<Upgrade>(std::move(upgrade));
      asio::co_spawn(kept->connection.get_executor(), Echo(kept), asio::detached);
    });
  }

  Protocol::socket Connect(bool local) {
    Protocol::socket socket(client_io_);
    if (local) {
      socket.connect(asio::local::stream_protocol::endpoint(options_.socket_path));
    } else {
      socket.connect(asio::ip::tcp::endpoint(asio::ip::address_v4::loopback(), server_->port()));
    }
    return socket;
  }

  // What is answered to a request, up to the end of the connection.
  static std::string Ask(Protocol::socket socket, const std::string& request) {
    asio::write(socket, asio::buffer(request));
    std::string answer;
    error_code error;
    asio::read(socket, asio::dynamic_buffer(answer), error);
    return answer;
  }
  static std::string StatusOf(const std::string& answer) {
    return answer.starts_with("HTTP/1.1 ") ? answer.substr(9, 3) : "no answer: " + answer;
  }

  static void ExpectEcho(WebSocket* client, const std::string& text) {
    client->write(asio::buffer(text));
    boost::beast::flat_buffer heard;
    client->read(heard);
    EXPECT_EQ(boost::beast::buffers_to_string(heard.data()), text);
  }

  asio::io_context client_io_;
};

TEST_F(UpgradeTest, AWebSocketIsSpokenOverBothListeners) {
  StartEcho();
  for (const bool local : {false, true}) {
    WebSocket client(Connect(local));
    client.handshake("x", "/echo?colour=red");
    ExpectEcho(&client, "one");
    ExpectEcho(&client, std::string(100'000, 'x'));
    client.close(websocket::close_code::normal);
  }
}

TEST_F(UpgradeTest, RequestsBeforeItOnTheSameConnectionAreAnsweredFirst) {
  StartEcho();
  WebSocket client(Connect(false));
  asio::write(client.next_layer(), asio::buffer(std::string("GET /a HTTP/1.1\r\n\r\n")));
  std::string answer;
  asio::read_until(client.next_layer(), asio::dynamic_buffer(answer), "/a.");
  EXPECT_EQ(StatusOf(answer), "200");
  client.handshake("x", "/echo");
  ExpectEcho(&client, "one");
}

TEST_F(UpgradeTest, WhatWasReadBehindTheRequestIsHandedOnAsItCame) {
  std::promise<std::string> heard;
  std::promise<Request> asked;
  Start([&](Upgrade upgrade) {
    std::string all = upgrade.rest;
    const auto target = upgrade.message.target();
    asked.set_value(
        {.method = {}, .target = {target.data(), target.size()}, .local = upgrade.local});
    auto socket = upgrade.connection.Release(upgrade.connection.get_executor());
    ASSERT_TRUE(socket);
    socket->non_blocking(false);
    error_code error;
    asio::read(*socket, asio::dynamic_buffer(all), error);
    heard.set_value(all);
  });
  Protocol::socket client = Connect(true);
  const std::string behind = std::string("\0\r\n\x81", 4) + std::string(20'000, 'b');
  asio::write(client, asio::buffer(kAsks + behind));
  client.shutdown(Protocol::socket::shutdown_send);
  EXPECT_EQ(heard.get_future().get(), behind);
  const Request request = asked.get_future().get();
  EXPECT_EQ(request.target, "/echo");
  EXPECT_TRUE(request.local);
}

TEST_F(UpgradeTest, WhoeverIsRefusedStaysWithHttp) {
  Start([](const Upgrade& /*upgrade*/) { ADD_FAILURE() << "nobody may be handed on"; });
  const std::string upgrade = "Connection: Upgrade\r\nUpgrade: websocket\r\n";
  const std::string end = "\r\nGET /end HTTP/1.1\r\nConnection: close\r\n\r\n";
  const struct {
    std::string request;
    const char* status;
    const char* body;
  } cases[] = {
      {"GET /echo HTTP/1.1\r\nOrigin: http://evil\r\n" + upgrade, "403", "a stranger"},
      {"GET /else HTTP/1.1\r\n" + upgrade, "200", "/else."},
      {"GET /echo/ HTTP/1.1\r\n" + upgrade, "200", "/echo/."},
      {"GET /echo HTTP/1.1\r\n", "200", "/echo."},
      {"GET /echo HTTP/1.1\r\nConnection: Upgrade\r\nUpgrade: h2c\r\n", "200", "/echo."},
      {"POST /echo HTTP/1.1\r\nContent-Length: 0\r\n" + upgrade, "200", "/echo."},
  };
  for (const auto& it : cases) {
    const std::string answer = Ask(Connect(false), it.request + end);
    EXPECT_EQ(StatusOf(answer), it.status) << it.request;
    EXPECT_NE(answer.find(it.body), std::string::npos) << it.request << answer;
    EXPECT_TRUE(answer.ends_with("/end.")) << answer;  // and the next request is served
  }
  // What decides about access may come only once, here too.
  EXPECT_EQ(StatusOf(Ask(Connect(false),
                         "GET /echo HTTP/1.1\r\nHost: x\r\nHost: y\r\n" + upgrade + "\r\n")),
            "400");
}

// Takes all, and keeps them.
class Keeper {
 public:
  void Take(Upgrade upgrade) {
    const std::lock_guard lock(mutex_);
    taken_.push_back(std::move(upgrade));
    wake_.notify_one();
  }
  void Await(size_t count) {
    std::unique_lock lock(mutex_);
    wake_.wait(lock, [&] { return taken_.size() >= count; });
  }
  std::vector<Upgrade> All() {
    const std::lock_guard lock(mutex_);
    return std::exchange(taken_, {});
  }

 private:
  std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<Upgrade> taken_;
};

// Whatever is wrong with a handshake, HTTP says so.
TEST_F(UpgradeTest, AHandshakeThatIsNoneIsRefusedWithItsReason) {
  Start([](const Upgrade& /*upgrade*/) { ADD_FAILURE() << "nobody may be handed on"; });
  const std::string begin =
      "GET /echo HTTP/1.1\r\nHost: x\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n";
  const std::string end = "\r\nGET /end HTTP/1.1\r\nConnection: close\r\n\r\n";
  const std::string version = "Sec-WebSocket-Version: 13\r\n";
  const std::string key = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
  for (const auto& [headers, status] :
       {std::pair(key, "426"), std::pair(key + "Sec-WebSocket-Version: 12\r\n", "426"),
        std::pair(version, "400"),
        std::pair(version + "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ=\r\n", "400"),
        std::pair(version + "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25j!Q==\r\n", "400")}) {
    const std::string answer = Ask(Connect(false), begin + headers + end);
    EXPECT_EQ(StatusOf(answer), status) << headers << answer;
    EXPECT_EQ(answer.find("Sec-WebSocket-Version: 13") != std::string::npos,
              std::string(status) == "426");
    EXPECT_TRUE(answer.ends_with("/end.")) << answer;
  }
}

TEST_F(UpgradeTest, ItCountsAmongThoseOfItsListenerUntilItsPlaceIsGivenBack) {
  options_.max_connections = 1;
  Keeper keeper;
  // Of two threads one might be late to note that it was handed on.
  Start([&](Upgrade upgrade) { keeper.Take(std::move(upgrade)); }, 1);
  Protocol::socket client = Connect(false);
  asio::write(client, asio::buffer(std::string(kAsks)));
  keeper.Await(1);
  const std::string get = "GET /a HTTP/1.1\r\nConnection: close\r\n\r\n";
  EXPECT_EQ(StatusOf(Ask(Connect(false), get)), "503");  // it gives way to nobody
  EXPECT_EQ(StatusOf(Ask(Connect(false), kAsks)), "503");
  EXPECT_EQ(StatusOf(Ask(Connect(true), get)), "200");
  std::vector<Upgrade> taken = keeper.All();
  taken[0].connection.Close();
  EXPECT_EQ(StatusOf(Ask(Connect(false), get)), "503");  // the place is not given back yet
  taken.clear();
  // Which the server hears of in the order of its strand: before the next one comes in.
  EXPECT_EQ(StatusOf(Ask(Connect(false), get)), "200");
}

TEST_F(UpgradeTest, TheOwnerIsToldWhenTheServerStopsAlsoIfHeAsksLater) {
  Keeper keeper;
  std::promise<void> told;
  Start([&](Upgrade upgrade) { keeper.Take(std::move(upgrade)); });
  std::vector<Protocol::socket> clients;
  for (size_t i = 0; i < 2; ++i) {
    clients.push_back(Connect(i == 0));
    asio::write(clients.back(), asio::buffer(std::string(kAsks)));
    keeper.Await(i + 1);
  }
  std::vector<Upgrade> taken = keeper.All();
  taken[0].place.OnStop([&] { told.set_value(); });
  server_->Stop();
  told.get_future().get();
  std::promise<void> told_late;
  taken[1].place.OnStop([&] { told_late.set_value(); });
  told_late.get_future().get();
  taken.clear();
  Stop();  // the threads end
}

TEST_F(UpgradeTest, StopEndsAConversationThatIsHandedOn) {
  StartEcho();
  WebSocket client(Connect(false));
  client.handshake("x", "/echo");
  ExpectEcho(&client, "one");
  server_->Stop();
  boost::beast::flat_buffer heard;
  error_code error;
  client.read(heard, error);
  EXPECT_TRUE(error);
  Stop();
}

TEST_F(UpgradeTest, AnOwnerWhoFailsLosesTheConnectionAndNobodyElseDoes) {
  std::promise<std::string> told;
  options_.max_connections = 1;
  options_.tell = [&](const std::string& text) { told.set_value(text); };
  Start([](const Upgrade& /*upgrade*/) { throw std::runtime_error("no room"); });
  EXPECT_EQ(Ask(Connect(false), kAsks), "");
  EXPECT_EQ(told.get_future().get(), "web: a connection was dropped: no room");
  EXPECT_EQ(StatusOf(Ask(Connect(false), "GET /a HTTP/1.1\r\nConnection: close\r\n\r\n")), "200");
}

}  // namespace
}  // namespace pheromone::web
