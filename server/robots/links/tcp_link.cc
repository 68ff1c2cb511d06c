#include "server/robots/links/tcp_link.h"

#include <algorithm>
#include <array>
#include <exception>
#include <list>
#include <optional>
#include <tuple>
#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/strand.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "protocol/opcodes.h"
#include "server/net/listen.h"
#include "server/robots/links/keep_running.h"
#include "server/robots/links/port.h"
#include "server/robots/links/session.h"

namespace pheromone::links {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr char kConnectionClosed[] = "the connection is closed";

class TcpLink final : public Link {
 public:
  TcpLink(asio::io_context& io, TcpOptions options, LinkContext context)
      : Link(std::move(context)),
        options_(std::move(options)),
        strand_(asio::make_strand(io)),
        acceptor_(strand_),
        retry_(strand_),
        backoff_(options_.backoff) {}

  Status Start() override {
    Status listening = Listen();
    KeepRunning(
        strand_, [this] { return Accept(); },
        [this](const Error& error) { ReportError(error, "the link continues"); });
    return listening;
  }

  void Stop() override {
    asio::post(strand_, [this] {
      error_code ignored;
      stopping_ = true;
      acceptor_.close(ignored);
      retry_.cancel();
      for (Connection& connection : connections_) {
        connection.session->Close();
      }
      record()->SetDown("stopped");
    });
  }

  void Send(std::vector<engine::Outgoing> messages) override {
    asio::post(strand_, [this, messages = std::move(messages)] {
      for (const engine::Outgoing& outgoing : messages) {
        Route(outgoing);
      }
    });
  }

 private:
  struct Connection {
    std::optional<Session> session;
    bool has_spoken = false;  // a whole frame of a client that the link serves

    // The order in which connections are closed to make room; among equals, the oldest first.
    std::tuple<bool, bool, Clock::time_point> Rank() const {
      return {session->closed(), has_spoken,
              has_spoken ? session->last_read() : Clock::time_point()};
    }
  };

  Status Listen() {
    const auto where =
        pheromone::Listen(options_.listen_address, options_.listen_port, &acceptor_, [this] {
          error_code ignored;
          acceptor_.set_option(tcp::acceptor::reuse_address(true), ignored);
        });
    if (!where.ok()) {
      ReportFailure(where.error());
      return where.failure();
    }
    ReportUp("tcp " + where.value(), where.value());
    return Ok();
  }

  asio::awaitable<void> Accept() {
    while (!stopping_) {
      error_code error;
      if (acceptor_.is_open()) {
        tcp::socket socket =
            co_await acceptor_.async_accept(asio::redirect_error(asio::use_awaitable, error));
        if (!error) {
          backoff_.Reset();
          TryToWelcome(std::move(socket));
          continue;
        }
      }
      if (!stopping_) {  // not listening, or out of descriptors: retry later
        retry_.expires_after(backoff_.Next());
        record()->SetNextAttempt(retry_.expiry());
        co_await retry_.async_wait(asio::redirect_error(asio::use_awaitable, error));
      }
      if (!stopping_ && !acceptor_.is_open()) {
        static_cast<void>(Listen());
      }
    }
  }

  // An exception ends the connection, not the link.
  void TryToWelcome(tcp::socket socket) {
    try {
      Welcome(std::move(socket));
    } catch (...) {
      ReportError(InternalError(std::current_exception()), kConnectionClosed);
    }
  }

  void Welcome(tcp::socket socket) {
    error_code error;
    socket.set_option(tcp::no_delay(true), error);
    socket.set_option(asio::socket_base::keep_alive(true), error);
    Descriptor descriptor(socket.release(error));
    if (error || stopping_) {
      return;
    }
    if (connections_.size() >= options_.max_connections) {
      MakeRoom();
    }
    record()->Count([](LinkCounters& counters) { ++counters.opened; });
    ConversationOptions options;
    options.channel.gap_timeout_ms = options_.gap_timeout_ms;
    // List iterators stay valid: `self` refers to the connection as long as it runs.
    const auto self = connections_.emplace(connections_.end());
    try {
      self->session.emplace(
          strand_, options,
          [this, self](Session* /*from*/, auto batch, auto* answers) {
            Take(&*self, batch, answers);
          },
          record(), NextLine());
      asio::co_spawn(strand_, Converse(self, std::move(descriptor)),
                     [this](const std::exception_ptr& thrown) {
                       if (thrown) {
                         ReportError(InternalError(thrown), kConnectionClosed);
                       }
                     });
    } catch (...) {
      connections_.erase(self);
      throw;
    }
  }

  asio::awaitable<void> Converse(std::list<Connection>::iterator self, Descriptor descriptor) {
    try {
      co_await self->session->Run(std::move(descriptor));
    } catch (...) {
      ReportError(InternalError(std::current_exception()), kConnectionClosed);
    }
    for (Connection*& place : last_spoke_) {
      if (place == &*self) {
        place = nullptr;
      }
    }
    connections_.erase(self);
  }

  // A robot that reconnects must find room, even if others did not close their connections.
  // Connections that never sent a message are closed first, the oldest first: they are not robots,
  // or new ones that have had as much time as possible. Then the one that has been silent for
  // longest.
  void MakeRoom() {
    const auto goes = std::min_element(
        connections_.begin(), connections_.end(),
        [](const Connection& a, const Connection& b) { return a.Rank() < b.Rank(); });
    goes->session->Close();
    record()->Count([](LinkCounters& counters) { ++counters.dropped_connections; });
  }

  void Take(Connection* from, std::span<const protocol::Message> batch,
            std::vector<engine::Outgoing>* answers) {
    for (const protocol::Message& message : batch) {
      if (!protocol::IsFromServer(message.opcode) && Allows(message.id)) {
        last_spoke_[message.id] = from;
        const bool is_robot = message.id != 0 && message.id != protocol::kBroadcastId;
        from->has_spoken = from->has_spoken || is_robot;
      }
    }
    const engine::Asker asker = from->session->asker();
    Handle(batch, {&asker, 1}, answers);
  }

  void Route(const engine::Outgoing& outgoing) {
    if (IsTooLate(outgoing)) {
      return;
    }
    const protocol::Message& message = outgoing.message;
    if (message.id == protocol::kBroadcastId) {
      for (Connection& connection : connections_) {
        connection.session->Send(outgoing);
      }
      return;
    }
    Connection* const to =
        outgoing.asker.known() ? Find(outgoing.asker.connection) : last_spoke_[message.id];
    if (to != nullptr) {
      to->session->Send(outgoing);
    } else {
      CountUndeliverable(message);
    }
  }

  // Null if it has ended.
  Connection* Find(uint32_t number) {
    const auto found =
        std::find_if(connections_.begin(), connections_.end(),
                     [number](const Connection& it) { return it.session->connection() == number; });
    return found != connections_.end() && !found->session->closed() ? &*found : nullptr;
  }

  const TcpOptions options_;
  const asio::strand<asio::io_context::executor_type> strand_;
  tcp::acceptor acceptor_;
  asio::steady_timer retry_;
  Backoff backoff_;
  std::list<Connection> connections_;          // in the order in which they came
  std::array<Connection*, 256> last_spoke_{};  // by client ID
  bool stopping_ = false;
};

}  // namespace

std::unique_ptr<Link> MakeTcpLink(asio::io_context& io, TcpOptions options, LinkContext context) {
  return std::make_unique<TcpLink>(io, std::move(options), std::move(context));
}

}  // namespace pheromone::links
