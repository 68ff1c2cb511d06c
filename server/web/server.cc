#include "server/web/server.h"

#include <unistd.h>

#include <atomic>
#include <set>
#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>

#include "server/web/session.h"
#include "server/web/unix_socket.h"

namespace pheromone::web {
namespace {

namespace asio = boost::asio;
using Local = asio::local::stream_protocol;
using asio::ip::tcp;
using boost::system::error_code;

// Out of descriptors, say: haste would not help.
constexpr std::chrono::milliseconds kAfterTrouble{200};

}  // namespace

class Server::Impl : public std::enable_shared_from_this<Impl> {
 public:
  Impl(asio::io_context& io, ServerOptions options, Handle handle)
      : io_(io),
        strand_(asio::make_strand(io)),
        options_(std::move(options)),
        handle_(std::move(handle)),
        local_(strand_),
        tcp_(strand_),
        pause_(strand_) {}

  Status ListenOnSocket() {
    Status listening = ListenOnUnixSocket(options_.socket_path, &local_);
    if (listening.ok()) {
      identity_ = IdentityOf(options_.socket_path);
      asio::co_spawn(strand_, Accept(&local_, true), asio::detached);
    }
    return listening;
  }

  Status ListenOnPort() {
    error_code error;
    const auto address = asio::ip::make_address(options_.listen_address, error);
    const tcp::endpoint endpoint(address, options_.listen_port);
    if (!error) {
      tcp_.open(endpoint.protocol(), error);
    }
    if (!error) {
      tcp_.set_option(tcp::acceptor::reuse_address(true), error);
      tcp_.bind(endpoint, error);
    }
    if (!error) {
      tcp_.listen(asio::socket_base::max_listen_connections, error);
    }
    if (error) {
      error_code ignored;
      tcp_.close(ignored);
      return Error{"cannot listen on " + options_.listen_address + " port " +
                   std::to_string(options_.listen_port) + ": " + error.message()};
    }
    port_ = tcp_.local_endpoint(error).port();
    asio::co_spawn(strand_, Accept(&tcp_, false), asio::detached);
    return Ok();
  }

  void Stop() {
    asio::post(strand_, [self = shared_from_this()] {
      error_code ignored;
      self->stopping_ = true;
      self->pause_.cancel();
      self->tcp_.close(ignored);
      if (self->local_.is_open()) {
        self->local_.close(ignored);
        if (IdentityOf(self->options_.socket_path) == self->identity_) {
          unlink(self->options_.socket_path.c_str());
        }
      }
      for (const auto& session : self->sessions_) {
        session->Close();
      }
    });
  }

  uint16_t port() const { return port_; }

 private:
  template <typename Acceptor>
  asio::awaitable<void> Accept(Acceptor* acceptor, bool local) {
    const auto self = shared_from_this();
    using Protocol = typename Acceptor::protocol_type;
    while (!stopping_) {
      error_code error;
      typename Protocol::socket socket(asio::make_strand(io_));
      co_await acceptor->async_accept(socket, asio::redirect_error(asio::use_awaitable, error));
      if (stopping_) {
        break;
      }
      if (error) {
        pause_.expires_after(kAfterTrouble);
        co_await pause_.async_wait(asio::redirect_error(asio::use_awaitable, error));
        continue;
      }
      const bool full = sessions_.size() >= options_.max_connections;
      if (full && turned_away_ >= options_.max_connections) {
        continue;  // too many even to be told so: the socket closes here
      }
      Welcome<Protocol>(std::move(socket), local, full);
    }
  }

  template <typename Protocol>
  void Welcome(typename Protocol::socket socket, bool local, bool full) {
    Handle handle = handle_;
    if (full) {
      handle = [](const Request&) {
        Response refused =
            Refuse(503, {"too many connections", "", "fewer of them; try again in a moment"});
        refused.headers.emplace_back("Connection", "close");
        return refused;
      };
    }
    const auto session = std::make_shared<Session<Protocol>>(std::move(socket), local,
                                                             std::move(handle), options_.patience);
    sessions_.insert(session);
    turned_away_ += full ? 1u : 0u;
    asio::co_spawn(session->executor(), session->Run(),
                   asio::bind_executor(strand_, [self = shared_from_this(), session,
                                                 full](const std::exception_ptr& /*failed*/) {
                     self->sessions_.erase(session);
                     self->turned_away_ -= full ? 1u : 0u;
                   }));
  }

  asio::io_context& io_;
  const asio::strand<asio::io_context::executor_type> strand_;
  const ServerOptions options_;
  const Handle handle_;
  Local::acceptor local_;
  tcp::acceptor tcp_;
  asio::steady_timer pause_;
  std::string identity_;  // of the socket's file
  std::set<std::shared_ptr<SessionBase>> sessions_;
  size_t turned_away_ = 0;
  std::atomic<uint16_t> port_{0};
  bool stopping_ = false;
};

Server::Server(asio::io_context& io, ServerOptions options, Handle handle)
    : impl_(std::make_shared<Impl>(io, std::move(options), std::move(handle))) {}

Server::~Server() = default;

Status Server::ListenOnSocket() {
  return impl_->ListenOnSocket();
}

Status Server::ListenOnPort() {
  return impl_->ListenOnPort();
}

void Server::Stop() {
  impl_->Stop();
}

uint16_t Server::port() const {
  return impl_->port();
}

}  // namespace pheromone::web
