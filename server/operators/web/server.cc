#include "server/operators/web/server.h"

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "server/net/listen.h"
#include "server/operators/web/connection.h"
#include "server/operators/web/connection_pace.h"
#include "server/operators/web/session.h"
#include "server/operators/web/unix_socket.h"

namespace pheromone::web {
namespace {

namespace asio = boost::asio;
using Local = asio::local::stream_protocol;
using asio::ip::tcp;
using boost::system::error_code;

// For example out of descriptors: retry later.
constexpr std::chrono::milliseconds kAfterTrouble{200};
constexpr char kNotAccepted[] = "web: a connection was not accepted: ";
constexpr std::chrono::minutes kBetweenComplaints{1};  // of clients that connect too often

// The acceptor itself has failed, not one connection.
bool IsLost(const error_code& error) {
  return error == asio::error::operation_aborted || error == asio::error::bad_descriptor ||
         error == asio::error::invalid_argument || error == asio::error::not_socket;
}

using Sessions = std::set<std::shared_ptr<SessionBase>>;

// The connections of one listener.
struct Crowd {
  Sessions served;
  Sessions beyond;  // connections above the limit: each gets an error
  std::shared_ptr<LongAnswers> long_answers;
};

// As in Request.
std::string ClientOf(Connection::Protocol::socket* socket) {
  error_code error;
  const auto peer = socket->remote_endpoint(error);
  const int family = error ? AF_UNSPEC : peer.protocol().family();
  if (family == AF_INET || family == AF_INET6) {
    tcp::endpoint endpoint;
    endpoint.resize(peer.size());
    std::memcpy(endpoint.data(), peer.data(), peer.size());
    return endpoint.address().to_string();
  }
  return family == AF_UNIX ? PeerOf(socket->native_handle()) : "";
}

std::string WordsOf(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const std::exception& exception) {
    return exception.what();
  } catch (...) {
    return "for an unknown reason";
  }
}

// Closes one connection to make room, if possible: the one that has been idle for longest.
bool MakeRoom(Sessions* sessions) {
  for (;;) {
    auto idlest = sessions->end();
    std::optional<uint64_t> since;
    for (auto it = sessions->begin(); it != sessions->end(); ++it) {
      const std::optional<uint64_t> its = (*it)->idle_since();
      if (its && (!since || *its < *since)) {
        idlest = it;
        since = its;
      }
    }
    if (!since) {
      return false;
    }
    if ((*idlest)->Claim(*since)) {  // otherwise a request has just arrived on it
      (*idlest)->Close();
      sessions->erase(idlest);
      return true;
    }
  }
}

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
        local_pause_(strand_),
        tcp_pause_(strand_),
        watch_(strand_),
        pace_(options_.pace) {
    for (Crowd* const crowd : {&local_crowd_, &tcp_crowd_}) {
      crowd->long_answers = std::make_shared<LongAnswers>(options_.long_answers);
    }
  }

  void OnUpgrade(std::string path, UpgradeHandler handler) {
    upgrades_.insert_or_assign(std::move(path), std::move(handler));
  }

  Status ListenOnSocket() {
    Status listening = Open(&local_);
    if (listening.ok()) {
      asio::co_spawn(strand_, Accept(&local_, &local_crowd_, &local_pause_), asio::detached);
      asio::co_spawn(strand_, WatchSocket(), asio::detached);
    }
    return listening;
  }

  Status ListenOnPort() {
    Status listening = Open(&tcp_);
    if (listening.ok()) {
      asio::co_spawn(strand_, Accept(&tcp_, &tcp_crowd_, &tcp_pause_), asio::detached);
    }
    return listening;
  }

  void SetCertificate(TlsContext context) {
    const std::lock_guard lock(context_mutex_);
    context_ = std::move(context);
  }

  void Stop() {
    asio::post(strand_, [self = shared_from_this()] {
      error_code ignored;
      self->stopping_ = true;
      self->local_pause_.cancel();
      self->watch_.cancel();
      self->tcp_pause_.cancel();
      self->tcp_.close(ignored);
      if (self->local_.is_open()) {
        self->local_.close(ignored);
        if (IdentityOf(self->options_.socket_path) == self->identity_) {
          unlink(self->options_.socket_path.c_str());
        }
      }
      for (const auto& [number, connection] : self->handshakes_) {
        connection->Close();
      }
      for (const Crowd* crowd : {&self->local_crowd_, &self->tcp_crowd_}) {
        for (const Sessions* sessions : {&crowd->served, &crowd->beyond}) {
          for (const auto& session : *sessions) {
            session->Close();
          }
        }
      }
    });
  }

  uint16_t port() const { return port_; }
  const TlsCounters& tls_counters() const { return tls_counters_; }

 private:
  Status Open(Local::acceptor* acceptor) {
    Status listening = ListenOnUnixSocket(options_.socket_path, acceptor);
    if (listening.ok()) {
      identity_ = IdentityOf(options_.socket_path);
    }
    return listening;
  }

  Status Open(tcp::acceptor* acceptor) {
    Endpoint where = options_.listen;
    where.port = port_ != 0 ? port_.load() : where.port;
    const Result<std::string> listening = Listen(where, acceptor, [acceptor] {
      error_code ignored;
      acceptor->set_option(tcp::acceptor::reuse_address(true), ignored);
    });
    if (!listening.ok()) {
      return listening.error();
    }
    error_code ignored;
    port_ = acceptor->local_endpoint(ignored).port();
    return Ok();
  }

  // As the log calls them.
  static std::string KindOf(const Local::acceptor* /*acceptor*/) { return "control: "; }
  static std::string KindOf(const tcp::acceptor* /*acceptor*/) { return "web: "; }
  std::string NameOf(const Local::acceptor* acceptor) const {
    return KindOf(acceptor) + options_.socket_path;
  }
  std::string NameOf(const tcp::acceptor* acceptor) const {
    return KindOf(acceptor) + ToText(Endpoint{options_.listen.address, port_});
  }

  // Whoever removes the file of a socket takes it from those who come; nobody is told.
  asio::awaitable<void> WatchSocket() {
    const auto self = shared_from_this();
    while (!stopping_) {
      error_code ignored;
      watch_.expires_after(options_.listen_again);
      co_await watch_.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
      if (!stopping_ && local_.is_open() && IdentityOf(options_.socket_path) != identity_) {
        local_.close(ignored);  // ends Accept's wait
      }
    }
  }

  template <typename Acceptor>
  asio::awaitable<void> ListenAgain(Acceptor* acceptor, asio::steady_timer* pause) {
    error_code ignored;
    acceptor->close(ignored);
    Tell(NameOf(acceptor) + ": lost, nobody can connect; trying to listen again");
    std::string told;
    for (;;) {
      const Status listening = Open(acceptor);
      if (listening.ok()) {
        Tell(NameOf(acceptor) + ": listening again");
        co_return;
      }
      if (listening.error() != told) {
        told = listening.error();
        Tell(KindOf(acceptor) + told + "; trying again");
      }
      pause->expires_after(options_.listen_again);
      co_await pause->async_wait(asio::redirect_error(asio::use_awaitable, ignored));
      if (stopping_) {
        co_return;
      }
    }
  }

  template <typename Acceptor>
  asio::awaitable<void> Accept(Acceptor* acceptor, Crowd* crowd, asio::steady_timer* pause) {
    const auto self = shared_from_this();
    while (!stopping_) {
      error_code error;
      bool taken = false;
      try {
        Connection::Protocol::socket socket(asio::make_strand(io_));
        co_await acceptor->async_accept(socket, asio::redirect_error(asio::use_awaitable, error));
        if (!error && !stopping_) {
          std::string client = ClientOf(&socket);
          if (crowd == &tcp_crowd_) {
            TakeInTurn(std::move(socket), std::move(client));
          } else {
            Welcome(Connection(std::move(socket)), crowd, std::move(client));
          }
          taken = true;
        }
      } catch (const std::exception& failure) {  // for example out of memory
        Tell(kNotAccepted + std::string(failure.what()));
      }
      if (!stopping_ && IsLost(error)) {
        co_await ListenAgain(acceptor, pause);
      } else if (!taken && !stopping_) {
        pause->expires_after(kAfterTrouble);
        co_await pause->async_wait(asio::redirect_error(asio::use_awaitable, error));
      }
    }
  }

  // One of the port, at the pace of its client.
  void TakeInTurn(Connection::Protocol::socket socket, std::string client) {
    const auto now = std::chrono::steady_clock::now();
    const auto wait = pace_.Next(NetworkOf(client), now);
    if (wait == ConnectionPace::Duration::zero()) {
      Take(std::move(socket), std::move(client));
      return;
    }
    if (!complained_ || now - *complained_ >= kBetweenComplaints) {
      complained_ = now;
      Tell("web: " + client + " connects too often; its new connections wait, or are closed");
    }
    if (wait) {
      const auto timer = std::make_shared<asio::steady_timer>(strand_, *wait);
      const auto held = std::make_shared<Connection::Protocol::socket>(std::move(socket));
      timer->async_wait([self = shared_from_this(), timer, held, client](const error_code&) {
        try {
          if (!self->stopping_) {
            self->Take(std::move(*held), client);
          }
        } catch (const std::exception& failure) {
          self->Tell(kNotAccepted + std::string(failure.what()));
        }
      });
    }
  }

  void Take(Connection::Protocol::socket socket, std::string client) {
    const TlsContext context = Context();
    if (context != nullptr) {
      error_code ignored;
      socket.set_option(tcp::no_delay(true), ignored);
      ShakeHands(std::make_shared<Connection>(std::move(socket), context), std::move(client));
    } else {
      Welcome(Connection(std::move(socket)), &tcp_crowd_, std::move(client));
    }
  }

  TlsContext Context() {
    const std::lock_guard lock(context_mutex_);
    return context_;
  }

  void ShakeHands(const std::shared_ptr<Connection>& connection, std::string client) {
    if (handshakes_.size() >= options_.max_handshakes) {
      handshakes_.begin()->second->Close();
      handshakes_.erase(handshakes_.begin());
    }
    const uint64_t number = next_handshake_++;
    handshakes_.emplace(number, connection);
    CountTls();
    asio::co_spawn(connection->get_executor(), connection->ShakeHands(options_.handshake_patience),
                   asio::bind_executor(strand_, [self = shared_from_this(), connection, number,
                                                 client = std::move(client)](
                                                    const std::exception_ptr& failure, bool done) {
                     self->handshakes_.erase(number);
                     if (failure == nullptr && done) {
                       ++self->tls_counters_.accepted;
                       if (!self->stopping_) {
                         self->Welcome(std::move(*connection), &self->tcp_crowd_, client, true);
                       }
                     } else {
                       ++self->tls_counters_.failed;
                     }
                     self->CountTls();
                   }));
  }

  void CountTls() {
    tls_counters_.connections =
        handshakes_.size() + tcp_crowd_.served.size() + tcp_crowd_.beyond.size();
  }

  void Welcome(Connection connection, Crowd* crowd, std::string client, bool encrypted = false) {
    const size_t limit = options_.max_connections;
    const bool full = crowd->served.size() >= limit && !MakeRoom(&crowd->served);
    Sessions* const sessions = full ? &crowd->beyond : &crowd->served;
    if (full && crowd->beyond.size() >= limit && !MakeRoom(&crowd->beyond)) {
      return;  // too many even for an error response: the socket is closed here
    }
    const auto session = std::make_shared<Session>(
        std::move(connection),
        SessionTraits{crowd == &local_crowd_, encrypted, full, options_.patience, std::move(client),
                      crowd->long_answers},
        full ? Refusal() : handle_, full ? nullptr : &upgrades_);
    sessions->insert(session);
    asio::co_spawn(session->executor(), session->Run(),
                   asio::bind_executor(strand_, [self = shared_from_this(), session,
                                                 sessions](const std::exception_ptr& failure) {
                     self->Leave(session, sessions);
                     if (failure != nullptr) {
                       self->Tell("web: a connection was dropped: " + WordsOf(failure));
                     }
                   }));
  }

  // An upgraded connection counts until its owner releases it.
  void Leave(const std::shared_ptr<Session>& session, Sessions* sessions) {
    const std::shared_ptr<PlaceState> place = session->place();
    if (place == nullptr) {
      sessions->erase(session);
      CountTls();
      return;
    }
    place->OnRelease([self = shared_from_this(), session, sessions] {
      asio::dispatch(self->strand_, [self, session, sessions] {
        sessions->erase(session);
        self->CountTls();
      });
    });
  }

  void Tell(const std::string& text) const {
    if (options_.tell) {
      options_.tell(text);
    }
  }

  // The response to connections above the limit.
  Handle Refusal() {
    return [self = shared_from_this()](Request request, Respond respond) {
      if (self->options_.is_urgent && self->options_.is_urgent(request)) {
        self->handle_(std::move(request), std::move(respond));
      } else {
        respond(
            Refuse(503, {"too many connections", "", "fewer connections; try again in a moment"}));
      }
    };
  }

  asio::io_context& io_;
  const asio::strand<asio::io_context::executor_type> strand_;
  const ServerOptions options_;
  const Handle handle_;
  Upgrades upgrades_;  // constant once it listens
  Local::acceptor local_;
  tcp::acceptor tcp_;
  // One each: restarting a timer would end the other's wait for it.
  asio::steady_timer local_pause_;
  asio::steady_timer tcp_pause_;
  asio::steady_timer watch_;
  std::string identity_;  // of the socket's file
  Crowd local_crowd_;
  Crowd tcp_crowd_;
  ConnectionPace pace_;  // of the port's clients
  std::optional<std::chrono::steady_clock::time_point> complained_;
  std::mutex context_mutex_;
  TlsContext context_;                                          // null: the port speaks plain HTTP
  std::map<uint64_t, std::shared_ptr<Connection>> handshakes_;  // the oldest first
  uint64_t next_handshake_ = 0;
  TlsCounters tls_counters_;
  std::atomic<uint16_t> port_{0};
  bool stopping_ = false;
};

Server::Server(asio::io_context& io, ServerOptions options, Handle handle)
    : impl_(std::make_shared<Impl>(io, std::move(options), std::move(handle))) {}

Server::~Server() = default;

void Server::OnUpgrade(std::string path, UpgradeHandler handler) {
  impl_->OnUpgrade(std::move(path), std::move(handler));
}

Status Server::ListenOnSocket() {
  return impl_->ListenOnSocket();
}

Status Server::ListenOnPort() {
  return impl_->ListenOnPort();
}

void Server::SetCertificate(TlsContext context) {
  impl_->SetCertificate(std::move(context));
}

void Server::Stop() {
  impl_->Stop();
}

uint16_t Server::port() const {
  return impl_->port();
}

const TlsCounters& Server::tls_counters() const {
  return impl_->tls_counters();
}

}  // namespace pheromone::web
