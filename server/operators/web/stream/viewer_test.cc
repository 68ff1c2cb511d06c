// A viewer over a real socket, in a time of the test's own.
#include "server/operators/web/stream/viewer.h"

#include <gtest/gtest.h>

#include <functional>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/connect_pair.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/read.hpp>

#include "server/operators/web/stream/testing/client.h"
#include "server/operators/web/testing/fake_control.h"

namespace pheromone::web {
namespace {

namespace asio = boost::asio;
using Local = asio::local::stream_protocol;

class ViewerTest : public ::testing::Test {
 protected:
  ViewerTest() {
    control_.links.emplace_back().name = "radio-a";
    hub_.Make(TakeViews(control_, hub_.Due(0)), {0, 1});
    Local::socket ours(io_);
    Local::socket theirs(client_io_);
    asio::local::connect_pair(ours, theirs);
    thread_ = std::thread([this, socket = Connection::Protocol::socket(std::move(ours))]() mutable {
      boost::beast::flat_buffer buffer;
      boost::beast::http::request<boost::beast::http::string_body> request;
      boost::beast::http::read(socket, buffer, request);
      viewer_ = std::make_shared<Viewer>(Connection(std::move(socket)),
                                         Place(std::make_shared<PlaceState>()),
                                         Viewer::Parts{.hub = &hub_,
                                                       .counters = &counters_,
                                                       .change = {},
                                                       .leave = [](const auto& /*viewer*/) {}},
                                         "", "", kBeginMs);
      viewer_->Start(request, "foxglove.websocket.v1");
      io_.run();
    });
    client_ = std::make_unique<testing::Client>(testing::Client::Socket(std::move(theirs)));
    EXPECT_EQ(client_->Shake({}), 101);
    for (bool greeted = false; !greeted;) {
      With([&] {
        greeted = viewer_->awaits_greeting();
        if (greeted) {
          viewer_->Greet(hub_.catalogue());
          // Before any of it can have left.
          viewer_->Tick(kBeginMs + 100, 1, false);
        }
      });
    }
    client_->Subscribe({kTopic});
  }

  ~ViewerTest() override {
    With([this] {
      viewer_->Close();
      viewer_.reset();
      work_.reset();
    });
    thread_.join();
  }

  // On the viewer's thread.
  void With(const std::function<void()>& call) {
    // Shared: set_value is still at work when a waiter returns.
    const auto done = std::make_shared<std::promise<void>>();
    asio::post(io_, [&call, done] {
      call();
      done->set_value();
    });
    done->get_future().wait();
  }

  // Its answer comes after all that was sent before has left.
  void SetRate(const std::string& hz) {
    client_->Send(R"({"op": "setParameters", "id": "a", "parameters":
                      [{"name": "stream.grid_hz", "value": )" +
                  hz + "}]}");
    client_->Await("parameterValues");
  }

  void Offer(const std::string& payload, uint64_t now_ms) {
    With([&] {
      for (const Channel& channel : hub_.catalogue()->channels) {
        if (channel.topic == kTopic) {
          viewer_->Offer({channel.id, std::make_shared<const Frame>(Frame{1, payload})}, now_ms);
        }
      }
    });
  }

  uint64_t Sent() {
    uint64_t sent = 0;
    With([&] { sent = counters_.sent_frames; });
    return sent;
  }

  // Longer than the patience for a write after 0.
  static constexpr uint64_t kBeginMs = 100'000;
  static constexpr const char* kTopic = "/pheromone/trail";
  testing::FakeControl control_;
  StreamCounters counters_;
  Hub hub_{{.session = "1",
            .ros_distro = "",
            .click_pheromone = "",
            .now_us = [] { return uint64_t{0}; },
            .between_pieces = [] {}}};
  asio::io_context io_{1};
  asio::executor_work_guard<asio::io_context::executor_type> work_ = asio::make_work_guard(io_);
  asio::io_context client_io_;
  std::shared_ptr<Viewer> viewer_;
  std::unique_ptr<testing::Client> client_;
  std::thread thread_;
};

TEST_F(ViewerTest, IsNotTakenForSlowBeforeItsFirstTick) {
  EXPECT_EQ(counters_.stalled, 0u);
  With([this] { EXPECT_EQ(counters_.viewers, 1); });
}

// A tenth less than the period, so that a tick that is early does not halve the rate.
TEST_F(ViewerTest, GetsPicturesAtTheRateThatItHasAskedFor) {
  SetRate("0.5");
  Offer("first", 110'000);
  EXPECT_EQ(client_->AwaitMessage(1), "first");
  SetRate("0.5");
  Offer("second", 111'799);
  Offer("third", 111'799);
  EXPECT_EQ(Sent(), 1u);
  With([this] { viewer_->Tick(111'800, 1, false); });
  EXPECT_EQ(client_->AwaitMessage(1), "third");
  SetRate("5");  // what is next comes at the time that was set before
  Offer("fourth", 113'600);
  EXPECT_EQ(client_->AwaitMessage(1), "fourth");
  SetRate("5");
  Offer("fifth", 113'779);
  EXPECT_EQ(Sent(), 3u);
  Offer("sixth", 113'780);
  EXPECT_EQ(client_->AwaitMessage(1), "sixth");
}

}  // namespace
}  // namespace pheromone::web
