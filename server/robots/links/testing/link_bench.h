// What the tests of links share: a server around a real io_context, and a robot at the other end of
// a descriptor. Nothing sleeps: everything waits for what it expects, with a deadline.
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <boost/asio/thread_pool.hpp>

#include "protocol/decoder.h"
#include "protocol/frame.h"
#include "server/base/testing/temporary_folder.h"
#include "server/core/engine/testing/bench.h"
#include "server/core/engine/testing/scripted_log.h"
#include "server/robots/links/link.h"
#include "server/robots/links/link_router.h"
#include "server/robots/links/port.h"

namespace pheromone::links::testing {

constexpr std::chrono::seconds kPatience{20};

/// Whether `condition` became true in time.
inline bool Eventually(const std::function<bool()>& condition,
                       std::chrono::milliseconds patience = kPatience) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) {
      return false;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

/// The engine, its router and the threads of an io_context; beside it, as in the daemon, a
/// thread for each port. Links "radio-a" and "radio-b".
class Server {
 public:
  explicit Server(size_t io_threads = 2)
      : io_threads_(io_threads), service_(&log_, [] { return Now(); }), router_(&service_) {
    std::signal(SIGPIPE, SIG_IGN);
    if (!service_.Configure(engine::testing::SmallConfig(), 7).ok()) {
      std::abort();
    }
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  ~Server() { Stop(); }

  LinkContext Context(engine::LinkIndex index) {
    return {.index = index,
            .router = &router_,
            .log =
                [this](const LinkNotice& notice) {
                  const std::lock_guard lock(mutex_);
                  lines_.push_back(ToText(notice));
                },
            .aside = aside_.get_executor(),
            .backoff = {std::chrono::milliseconds(5), std::chrono::milliseconds(20), 1}};
  }

  /// Starts a link, and with the first one the threads.
  Status Start(std::unique_ptr<Link> link) {
    router_.Add(link.get());
    links_.push_back(std::move(link));
    Status status = links_.back()->Start();
    while (threads_.size() < io_threads_) {
      threads_.emplace_back([this] { io_.run(); });
    }
    return status;
  }

  /// Has the log stuck no longer, and sends what waited for it.
  void GoOn() {
    log_.Heal();
    std::vector<engine::Outgoing> out;
    service_.Release(&out);
    router_.Deliver(out);
  }

  /// Has an operator halt a robot of the first link, or all.
  Status Halt(uint8_t id) {
    std::vector<engine::Outgoing> out;
    Status issued = service_.Issue({0, id, protocol::CommandCode::kHalt, {}}, &out);
    router_.Deliver(out);
    return issued;
  }

  /// Stops the links; returns when io_context has nothing left to do.
  void Stop() {
    for (const auto& link : links_) {
      link->Stop();
    }
    for (std::thread& thread : threads_) {
      thread.join();
    }
    threads_.clear();
  }

  std::vector<std::string> lines() {
    const std::lock_guard lock(mutex_);
    return lines_;
  }

  Link& link(size_t index = 0) { return *links_[index]; }
  boost::asio::io_context& io() { return io_; }
  engine::testing::ScriptedLog& log() { return log_; }
  engine::Service& service() { return service_; }
  LinkRouter& router() { return router_; }

 private:
  static engine::ClockReading Now() {
    const auto since = std::chrono::steady_clock::now().time_since_epoch();
    const auto now = std::chrono::duration_cast<std::chrono::milliseconds>(since).count();
    return {static_cast<uint64_t>(now), now};
  }

  const size_t io_threads_;
  boost::asio::io_context io_;
  boost::asio::thread_pool aside_{2};
  engine::testing::ScriptedLog log_;
  engine::Service service_;
  LinkRouter router_;
  std::mutex mutex_;
  std::vector<std::string> lines_;
  std::vector<std::unique_ptr<Link>> links_;
  std::vector<std::thread> threads_;
};

/// The bytes of a message.
inline std::vector<uint8_t> Wire(const protocol::Message& message) {
  std::vector<uint8_t> wire(protocol::kMaxFrame);
  wire.resize(protocol::EncodeFrame(message, wire.data(), wire.size()));
  return wire;
}

/// The other end of a line.
class Peer {
 public:
  explicit Peer(Descriptor descriptor) : descriptor_(std::move(descriptor)) {}
  /// Opens a port as a robot's program would.
  explicit Peer(const std::string& path)
      : descriptor_(open(path.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC)) {}

  bool connected() const { return descriptor_.valid(); }
  int descriptor() const { return descriptor_.get(); }
  void HangUp() { descriptor_ = Descriptor(); }

  bool SendBytes(const std::vector<uint8_t>& bytes) const {
    size_t sent = 0;
    while (sent < bytes.size()) {
      const ssize_t size = write(descriptor_.get(), bytes.data() + sent, bytes.size() - sent);
      if (size <= 0) {
        return false;
      }
      sent += static_cast<size_t>(size);
    }
    return true;
  }
  bool Send(const protocol::Message& message) const { return SendBytes(Wire(message)); }

  /// The next message, if one comes in time.
  std::optional<protocol::Message> Receive(std::chrono::milliseconds patience = kPatience) {
    const auto deadline = std::chrono::steady_clock::now() + patience;
    while (received_.empty()) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
          deadline - std::chrono::steady_clock::now());
      if (left.count() < 0 || (!ReadOnce(static_cast<int>(left.count())) && ended_)) {
        return std::nullopt;
      }
    }
    const protocol::Message message = received_.front();
    received_.pop_front();
    return message;
  }

  /// Sends and waits for one message in return.
  std::optional<protocol::Message> Ask(const protocol::Message& message) {
    return Send(message) ? Receive() : std::nullopt;
  }

  /// Whether the line ended in time.
  bool SeesTheEnd() {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (std::chrono::steady_clock::now() < deadline) {
      if (!ReadOnce(100) && ended_) {
        return true;
      }
    }
    return false;
  }

 private:
  // False when nothing came.
  bool ReadOnce(int patience_ms) {
    pollfd ready{descriptor_.get(), POLLIN, 0};
    if (poll(&ready, 1, patience_ms) <= 0) {
      return false;
    }
    uint8_t buffer[4096];
    const ssize_t size = read(descriptor_.get(), buffer, sizeof buffer);
    // As in session.cc: a kernel may report the end of a terminal that is merely idle.
    pollfd line{descriptor_.get(), POLLRDHUP, 0};
    ended_ = size < 0 || (size == 0 && poll(&line, 1, 0) != 0);
    if (size > 0) {
      decoder_.PushBlock(buffer, static_cast<size_t>(size), 0,
                         [this](const protocol::Message& it) { received_.push_back(it); });
    }
    return size > 0;
  }

  Descriptor descriptor_;
  protocol::FrameDecoder decoder_{protocol::kNoGapTimeout};
  std::deque<protocol::Message> received_;
  bool ended_ = false;
};

inline protocol::Message PingOf(uint8_t id, uint8_t number) {
  protocol::Ping ping;
  ping.id = id;
  ping.length = 1;
  ping.payload[0] = number;
  return engine::testing::MessageOf(ping);
}

/// An answer to somebody who asked so long ago, on the first connection of a link.
inline engine::Outgoing AnswerAfter(std::chrono::milliseconds waited,
                                    const protocol::Message& message) {
  engine::Outgoing answer{0, 0, message};
  const auto asked = std::chrono::steady_clock::now() - waited;
  answer.asker.asked_ns = std::chrono::nanoseconds(asked.time_since_epoch()).count();
  answer.asker.connection = 1;
  return answer;
}

/// Whether this is the answer to PingOf(id, number).
inline bool IsEcho(const std::optional<protocol::Message>& message, uint8_t id, uint8_t number) {
  protocol::Ping ping;
  return message && protocol::Decode(*message, &ping) && ping.answer && ping.id == id &&
         ping.length == 1 && ping.payload[0] == number;
}

}  // namespace pheromone::links::testing
