#include "server/web/tls.h"

#include <sys/socket.h>

#include <array>
#include <atomic>
#include <exception>
#include <map>
#include <string_view>
#include <utility>

#include <boost/asio/bind_executor.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
// Asio is compiled apart (BOOST_ASIO_SEPARATE_COMPILATION), but not this part, so that other
// programs do not need OpenSSL.
#include <boost/asio/ssl/impl/src.hpp>

#include "server/net/listen.h"

namespace pheromone::web {
namespace {

namespace asio = boost::asio;
namespace ssl = boost::asio::ssl;
using asio::ip::tcp;
using boost::system::error_code;
using std::chrono::milliseconds;
using std::chrono::steady_clock;
using Pipe = asio::local::stream_protocol::socket;

constexpr milliseconds kAfterFailedAccept{200};
// For the last bytes, and the client's own end, once the server has closed its side.
constexpr milliseconds kClosingPatience{2'000};
constexpr milliseconds kHurriedPatience{200};  // for either side, when the listener stops
// Of each end of a pair; the system doubles it.
constexpr int kPipeBytes = 64 << 10;
constexpr size_t kRecordBytes = 16 << 10;
constexpr unsigned char kHandshakeRecord = 0x16;  // RFC 8446, section 5.1

constexpr std::string_view kSpeakTls =
    "HTTP/1.1 400 Bad Request\r\nContent-Type: text/plain\r\nConnection: close\r\n"
    "Content-Length: 59\r\n\r\nThis port speaks HTTPS only: the address begins https://.\r\n";

auto ToError(error_code* error) {
  return asio::redirect_error(asio::use_awaitable, *error);
}

// One client. On a strand of its own, except `stage` and `Close`.
class TlsConnection : public std::enable_shared_from_this<TlsConnection> {
 public:
  enum class Stage { kHandshake, kOpen, kClosing };

  TlsConnection(tcp::socket socket, ssl::context* context, const TlsOptions* options,
                const TlsListener::Give* give)
      : client_(std::move(socket), *context),
        pipe_(client_.get_executor()),
        timer_(client_.get_executor()),
        options_(options),
        give_(give) {}

  auto executor() { return client_.get_executor(); }
  Stage stage() const { return stage_; }

  // Whether the handshake succeeded; then both directions run until they end.
  asio::awaitable<void> Run(TlsCounters* counters) {
    error_code ignored;
    client_.next_layer().set_option(tcp::no_delay(true), ignored);
    if (!co_await ShakeHands()) {
      ++counters->failed;
      Cut();
      co_return;
    }
    ++counters->accepted;
    if (!GiveOtherEnd()) {
      Cut();
      co_return;
    }
    asio::co_spawn(executor(), FromClient(), asio::detached);
    co_await ToClient();
  }

  void End() {
    asio::post(executor(), [self = shared_from_this()] { self->Cut(); });
  }

  // To make room, or when the listener stops: waits for no client.
  void Hurry() {
    asio::post(executor(), [self = shared_from_this()] {
      self->hurry_ = true;
      if (self->stage_ != Stage::kOpen) {
        self->Cut();
      } else if (self->waiting_) {
        self->Await(kHurriedPatience);
      }
    });
  }

 private:
  asio::awaitable<bool> ShakeHands() {
    error_code error;
    Await(options_->handshake_patience);
    co_await client_.next_layer().async_wait(tcp::socket::wait_read, ToError(&error));
    unsigned char first = kHandshakeRecord;
    if (!error) {
      client_.next_layer().receive(asio::buffer(&first, 1), tcp::socket::message_peek, error);
    }
    if (!error && first >= 'A' && first <= 'Z') {  // the method of a request
      stage_ = Stage::kClosing;
      Await(kClosingPatience);
      co_await asio::async_write(client_.next_layer(), asio::buffer(kSpeakTls), ToError(&error));
      co_await ReadRest();
      co_return false;
    }
    if (!error) {
      co_await client_.async_handshake(ssl::stream_base::server, ToError(&error));
    }
    AwaitNothing();
    co_return !error && client_.next_layer().is_open();
  }

  bool GiveOtherEnd() {
    std::array<int, 2> ends{-1, -1};
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
      return false;
    }
    Descriptor mine(ends[0]);
    Descriptor other(ends[1]);
    for (const int end : ends) {
      setsockopt(end, SOL_SOCKET, SO_SNDBUF, &kPipeBytes, sizeof kPipeBytes);
    }
    error_code error;
    pipe_.assign(asio::local::stream_protocol(), mine.get(), error);
    if (error) {
      return false;
    }
    (void)mine.release();
    stage_ = Stage::kOpen;
    (*give_)(std::move(other));
    return true;
  }

  asio::awaitable<void> FromClient() {
    const auto self = shared_from_this();
    std::array<char, kRecordBytes> bytes{};
    error_code error;
    while (!error && stage_ == Stage::kOpen) {
      const size_t size = co_await client_.async_read_some(asio::buffer(bytes), ToError(&error));
      if (size > 0) {
        error_code writing;
        co_await asio::async_write(pipe_, asio::buffer(bytes.data(), size), ToError(&writing));
        error = writing ? writing : error;
      }
    }
    error_code ignored;
    pipe_.shutdown(Pipe::shutdown_send, ignored);
  }

  asio::awaitable<void> ToClient() {
    const auto self = shared_from_this();
    std::array<char, kRecordBytes> bytes{};
    error_code error;
    error_code sending;
    while (!error && !sending) {
      const size_t size = co_await pipe_.async_read_some(asio::buffer(bytes), ToError(&error));
      if (size > 0) {
        Await(hurry_ ? kHurriedPatience : options_->patience);
        co_await asio::async_write(client_, asio::buffer(bytes.data(), size), ToError(&sending));
        AwaitNothing();
      }
    }
    if (!sending) {  // the server has closed its end
      stage_ = Stage::kClosing;
      Await(hurry_ ? kHurriedPatience : kClosingPatience);
      co_await client_.async_shutdown(ToError(&error));
      co_await ReadRest();
    }
    Cut();
  }

  // Closing with unread bytes would make the system discard the last bytes written.
  asio::awaitable<void> ReadRest() {
    std::array<char, kRecordBytes> rest{};
    error_code error;
    client_.next_layer().shutdown(tcp::socket::shutdown_send, error);
    while (!error && !hurry_) {
      co_await client_.next_layer().async_read_some(asio::buffer(rest), ToError(&error));
    }
  }

  // Ends the connection if what is done next takes longer than this.
  void Await(milliseconds patience) {
    waiting_ = true;
    timer_.expires_after(patience);
    timer_.async_wait([self = shared_from_this()](const error_code& error) {
      // It may have been set again while this was on its way.
      if (!error && self->waiting_ && self->timer_.expiry() <= steady_clock::now()) {
        self->Cut();
      }
    });
  }

  void AwaitNothing() {
    waiting_ = false;
    timer_.cancel();
  }

  // Everything under way ends with an error.
  void Cut() {
    error_code ignored;
    stage_ = Stage::kClosing;
    AwaitNothing();
    client_.next_layer().close(ignored);
    pipe_.close(ignored);
  }

  ssl::stream<tcp::socket> client_;
  Pipe pipe_;
  asio::steady_timer timer_;
  const TlsOptions* const options_;  // the listener's, which outlives this
  const TlsListener::Give* const give_;
  std::atomic<Stage> stage_{Stage::kHandshake};
  bool waiting_ = false;
  bool hurry_ = false;
};

}  // namespace

class TlsListener::Impl : public std::enable_shared_from_this<Impl> {
 public:
  Impl(asio::io_context& io, TlsOptions options, Give give)
      : io_(io),
        strand_(asio::make_strand(io)),
        options_(std::move(options)),
        give_(std::move(give)),
        acceptor_(strand_),
        pause_(strand_) {}

  void SetCertificate(TlsContext context) {
    SSL_CTX_up_ref(context.get());
    auto made = std::make_shared<ssl::context>(context.get());
    asio::post(strand_, [self = shared_from_this(), made = std::move(made)]() mutable {
      self->context_ = std::move(made);
    });
  }

  Status Listen() {
    const Result<std::string> listening =
        pheromone::Listen(options_.address, options_.port, &acceptor_, [this] {
          error_code ignored;
          acceptor_.set_option(tcp::acceptor::reuse_address(true), ignored);
        });
    if (!listening.ok()) {
      return listening.failure();
    }
    error_code ignored;
    port_ = acceptor_.local_endpoint(ignored).port();
    asio::co_spawn(strand_, Accept(), asio::detached);
    return Ok();
  }

  void Stop() {
    asio::post(strand_, [self = shared_from_this()] {
      error_code ignored;
      self->stopping_ = true;
      self->pause_.cancel();
      self->acceptor_.close(ignored);
      for (const auto& [number, connection] : self->connections_) {
        connection->Hurry();
      }
    });
  }

  uint16_t port() const { return port_; }
  const TlsCounters& counters() const { return counters_; }

 private:
  asio::awaitable<void> Accept() {
    const auto self = shared_from_this();
    while (!stopping_) {
      error_code error;
      bool taken = false;
      try {
        tcp::socket socket(asio::make_strand(io_));
        co_await acceptor_.async_accept(socket, ToError(&error));
        if (!error && !stopping_) {
          Welcome(std::move(socket));
          taken = true;
        }
      } catch (const std::exception& failure) {  // for example out of memory
        Tell(std::string("a connection was not accepted: ") + failure.what());
      }
      if (!taken && !stopping_) {
        pause_.expires_after(kAfterFailedAccept);
        co_await pause_.async_wait(ToError(&error));
      }
    }
  }

  void Welcome(tcp::socket socket) {
    if (connections_.size() >= options_.max_connections && !MakeRoom()) {
      return;  // the socket is closed here
    }
    const auto connection =
        std::make_shared<TlsConnection>(std::move(socket), context_.get(), &options_, &give_);
    const uint64_t number = next_++;
    connections_.emplace(number, connection);
    counters_.connections = connections_.size();
    asio::co_spawn(connection->executor(), connection->Run(&counters_),
                   asio::bind_executor(strand_, [self = shared_from_this(), connection,
                                                 number](const std::exception_ptr& failure) {
                     self->Leave(number);
                     if (failure != nullptr) {  // for example out of memory
                       connection->End();
                     }
                   }));
  }

  bool MakeRoom() {
    for (const auto stage : {TlsConnection::Stage::kClosing, TlsConnection::Stage::kHandshake}) {
      for (const auto& [number, connection] : connections_) {
        if (connection->stage() == stage) {
          connection->Hurry();
          Leave(number);
          return true;
        }
      }
    }
    return false;
  }

  void Leave(uint64_t number) {
    connections_.erase(number);
    counters_.connections = connections_.size();
  }

  void Tell(const std::string& text) const {
    if (options_.tell) {
      options_.tell(text);
    }
  }

  asio::io_context& io_;
  const asio::strand<asio::io_context::executor_type> strand_;
  const TlsOptions options_;
  const Give give_;
  std::shared_ptr<ssl::context> context_;
  tcp::acceptor acceptor_;
  asio::steady_timer pause_;
  std::map<uint64_t, std::shared_ptr<TlsConnection>> connections_;  // the oldest first
  uint64_t next_ = 0;
  TlsCounters counters_;
  std::atomic<uint16_t> port_{0};
  bool stopping_ = false;
};

TlsListener::TlsListener(asio::io_context& io, TlsOptions options, Give give)
    : impl_(std::make_shared<Impl>(io, std::move(options), std::move(give))) {}

TlsListener::~TlsListener() = default;

void TlsListener::SetCertificate(TlsContext context) {
  impl_->SetCertificate(std::move(context));
}

Status TlsListener::Listen() {
  return impl_->Listen();
}

void TlsListener::Stop() {
  impl_->Stop();
}

uint16_t TlsListener::port() const {
  return impl_->port();
}

const TlsCounters& TlsListener::counters() const {
  return impl_->counters();
}

}  // namespace pheromone::web
