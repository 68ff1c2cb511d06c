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
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "protocol/opcodes.h"
#include "server/robots/links/listening_link.h"
#include "server/robots/links/port.h"
#include "server/robots/links/session.h"

namespace pheromone::links {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr char kConnectionClosed[] = "the connection is closed";

class TcpLink final : public ListeningLink<tcp::acceptor> {
 public:
  TcpLink(asio::io_context& io, const LinkConfig& config, LinkContext context)
      : ListeningLink(io, config, std::move(context), "tcp") {}

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

  void Prepare() override {
    error_code ignored;
    socket().set_option(tcp::acceptor::reuse_address(true), ignored);
  }

  void OnStop() override {
    for (Connection& connection : connections_) {
      connection.session->Close();
    }
  }

  asio::awaitable<bool> Receive() override {
    error_code error;
    tcp::socket accepted =
        co_await socket().async_accept(asio::redirect_error(asio::use_awaitable, error));
    if (!error) {
      ResetBackoff();
      TryToWelcome(std::move(accepted));
    }
    co_return !error;
  }

  // An exception ends the connection, not the link.
  void TryToWelcome(tcp::socket accepted) {
    try {
      Welcome(std::move(accepted));
    } catch (...) {
      ReportError(InternalError(std::current_exception()), kConnectionClosed);
    }
  }

  void Welcome(tcp::socket accepted) {
    error_code error;
    accepted.set_option(tcp::no_delay(true), error);
    accepted.set_option(asio::socket_base::keep_alive(true), error);
    Descriptor descriptor(accepted.release(error));
    if (error || stopping()) {
      return;
    }
    if (connections_.size() >= config().max_connections) {
      MakeRoom();
    }
    record()->Count([](LinkCounters& counters) { ++counters.opened; });
    ConversationOptions options;
    options.channel.gap_timeout_ms = config().gap_timeout_ms;
    options.channel.signing = context().signing;
    options.channel.to_all_is_signed = true;
    options.on_refused = [this](const auto& message) { CountUndeliverable(message); };
    // List iterators stay valid: `self` refers to the connection as long as it runs.
    const auto self = connections_.emplace(connections_.end());
    try {
      self->session.emplace(
          strand(), options,
          [this, self](Session* /*from*/, auto batch, auto* answers) {
            Take(&*self, batch, answers);
          },
          record(), NextLine());
      asio::co_spawn(strand(), Converse(self, std::move(descriptor)),
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

  void Route(const engine::Outgoing& outgoing) override {
    const protocol::Message& message = outgoing.message;
    if (message.id == protocol::kBroadcastId) {
      // With a counter for each, somebody could play to a robot what was for another one.
      engine::Outgoing sealed = outgoing;
      if (context().signing != nullptr) {
        context().signing->Sign(&sealed.message);
      }
      for (Connection& connection : connections_) {
        connection.session->Send(sealed);
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

  std::list<Connection> connections_;          // in the order in which they came
  std::array<Connection*, 256> last_spoke_{};  // by client ID
};

}  // namespace

std::unique_ptr<Link> MakeTcpLink(asio::io_context& io, const LinkConfig& config,
                                  LinkContext context) {
  return std::make_unique<TcpLink>(io, config, std::move(context));
}

}  // namespace pheromone::links
