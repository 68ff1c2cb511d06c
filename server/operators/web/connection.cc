#include "server/operators/web/connection.h"

#include <openssl/ssl.h>

#include <algorithm>
#include <array>
#include <exception>
#include <new>
#include <string_view>

#include <boost/asio/append.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/basic_stream.hpp>

namespace pheromone::web {
namespace {

namespace asio = boost::asio;
namespace ssl = boost::asio::ssl;
using boost::system::error_code;
using std::chrono::milliseconds;

constexpr size_t kRecordBytes = 16 << 10;
constexpr unsigned char kHandshakeRecord = 0x16;  // RFC 8446, section 5.1
constexpr milliseconds kEndPatience{2'000};

constexpr std::string_view kSpeakTls =
    "HTTP/1.1 400 Bad Request\r\nContent-Type: text/plain\r\nConnection: close\r\n"
    "Content-Length: 59\r\n\r\nThis port speaks HTTPS only: the address begins https://.\r\n";

auto Into(error_code* error) {
  return asio::redirect_error(asio::use_awaitable, *error);
}

}  // namespace

struct Connection::Core : std::enable_shared_from_this<Core> {
  using Stream = boost::beast::basic_stream<Protocol>;

  Core(Protocol::socket socket, const TlsContext& context) : plain(std::move(socket)) {
    if (context != nullptr) {
      SSL* const state = SSL_new(context.get());
      if (state == nullptr) {
        throw std::bad_alloc();
      }
      tls = std::make_unique<ssl::stream<Stream&>>(plain, state);
    }
  }

  auto strand() { return plain.get_executor(); }

  // A record's worth: one call, and one packet, of a header and what follows it.
  asio::const_buffer Gather(const std::vector<asio::const_buffer>& buffers) {
    const auto first = std::find_if(buffers.begin(), buffers.end(),
                                    [](const asio::const_buffer& it) { return it.size() != 0; });
    if (first == buffers.end() || first->size() >= kRecordBytes || buffers.end() - first == 1) {
      return first != buffers.end() ? *first : asio::const_buffer();
    }
    gathered.resize(std::min(kRecordBytes, asio::buffer_size(buffers)));
    asio::buffer_copy(asio::buffer(gathered), buffers);
    return asio::buffer(gathered);
  }

  template <typename Done>
  void Abort(Done done) {
    asio::post(strand(), [done = std::move(done)]() mutable {
      done(make_error_code(asio::error::operation_aborted), 0);
    });
  }

  asio::awaitable<void> End(std::string last, milliseconds patience, bool reads_rest) {
    const auto self = shared_from_this();
    error_code error;
    plain.expires_after(patience);
    if (tls != nullptr && !is_broken) {
      if (!last.empty()) {
        co_await asio::async_write(*tls, asio::buffer(last), Into(&error));
      }
      // As if the client had said so first: its word is not waited for.
      SSL_set_shutdown(tls->native_handle(), SSL_RECEIVED_SHUTDOWN);
      co_await tls->async_shutdown(Into(&error));
    } else if (tls == nullptr && !last.empty()) {
      plain.socket().non_blocking(true, error);  // a client that does not read does without it
      plain.socket().write_some(asio::buffer(last), error);
    }
    reads_rest = reads_rest && error != asio::error::operation_aborted;
    plain.socket().shutdown(Protocol::socket::shutdown_send, error);
    std::array<char, 4096> rest{};
    constexpr int kMaxReads = 1024;
    for (int i = 0; i < kMaxReads && !error && reads_rest; ++i) {
      co_await plain.async_read_some(asio::buffer(rest), Into(&error));
    }
    plain.close();
  }

  Stream plain;
  std::unique_ptr<ssl::stream<Stream&>> tls;  // null: plain
  std::string gathered;                       // what is being encrypted
  bool is_shaking_hands = false;
  bool is_cancelled = false;
  bool is_broken = false;  // a write failed, perhaps in the middle of a record
};

Connection::Connection(Protocol::socket socket, const TlsContext& context)
    : core_(std::make_shared<Core>(std::move(socket), context)), executor_(core_->strand()) {}

Connection::~Connection() {
  if (core_ != nullptr) {
    Close();
  }
}

void Connection::Read(asio::mutable_buffer buffer, Handler handler) {
  auto done = [core = core_, work = asio::make_work_guard(executor_), handler = std::move(handler)](
                  error_code error, size_t size) mutable {
    asio::dispatch(work.get_executor(), asio::append(std::move(handler), error, size));
  };
  asio::dispatch(core_->strand(), [core = core_.get(), buffer, done = std::move(done)]() mutable {
    if (core->is_cancelled) {
      core->Abort(std::move(done));
    } else if (core->tls != nullptr) {
      core->tls->async_read_some(buffer, std::move(done));
    } else {
      core->plain.async_read_some(buffer, std::move(done));
    }
  });
}

void Connection::Write(std::vector<asio::const_buffer> buffers, Handler handler) {
  auto done = [core = core_, work = asio::make_work_guard(executor_), handler = std::move(handler)](
                  error_code error, size_t size) mutable {
    core->is_broken |= error.failed();
    asio::dispatch(work.get_executor(), asio::append(std::move(handler), error, size));
  };
  asio::dispatch(core_->strand(), [core = core_.get(), buffers = std::move(buffers),
                                   done = std::move(done)]() mutable {
    if (core->is_cancelled) {
      core->Abort(std::move(done));
    } else if (core->tls != nullptr) {
      core->tls->async_write_some(core->Gather(buffers), std::move(done));
    } else {
      core->plain.async_write_some(buffers, std::move(done));
    }
  });
}

void Connection::SetPatience(std::optional<milliseconds> patience) {
  if (patience) {
    core_->plain.expires_after(*patience);
  } else {
    core_->plain.expires_never();
  }
}

void Connection::Cancel() {
  core_->is_cancelled = true;  // it may come between two operations
  core_->plain.cancel();
}

void Connection::Close() {
  asio::dispatch(core_->strand(), [core = core_] { core->plain.close(); });
}

void Connection::SetSendBuffer(int bytes) {
  asio::dispatch(core_->strand(), [core = core_, bytes] {
    error_code ignored;
    core->plain.socket().set_option(asio::socket_base::send_buffer_size(bytes), ignored);
  });
}

asio::awaitable<bool> Connection::ShakeHands(milliseconds patience) {
  const auto core = core_;
  error_code error;
  core->is_shaking_hands = true;
  asio::steady_timer timer(core->strand(), patience);
  timer.async_wait([core](const error_code& stopped) {
    if (!stopped && core->is_shaking_hands) {
      core->plain.close();
    }
  });
  unsigned char first = kHandshakeRecord;
  co_await core->plain.socket().async_wait(Protocol::socket::wait_read, Into(&error));
  if (!error) {
    core->plain.socket().receive(asio::buffer(&first, 1), Protocol::socket::message_peek, error);
  }
  if (!error && first >= 'A' && first <= 'Z') {  // the method of a request
    core->plain.expires_after(kEndPatience);
    co_await asio::async_write(core->plain, asio::buffer(kSpeakTls), Into(&error));
    core->is_shaking_hands = false;
    core->is_broken = true;  // there is no TLS to end
    co_await core->End({}, kEndPatience, true);
    co_return false;
  }
  if (!error) {
    co_await core->tls->async_handshake(ssl::stream_base::server, Into(&error));
  }
  core->is_shaking_hands = false;
  if (error) {
    core->plain.close();
  }
  co_return !error && core->plain.socket().is_open();
}

asio::awaitable<void> Connection::End(milliseconds patience, bool reads_rest) {
  return core_->End({}, patience, reads_rest);
}

void Connection::EndWith(std::string last, asio::any_completion_handler<void(error_code)> handler) {
  auto done = [work = asio::make_work_guard(executor_),
               handler = std::move(handler)](const std::exception_ptr& /*failure*/) mutable {
    asio::dispatch(work.get_executor(), asio::append(std::move(handler), error_code()));
  };
  asio::co_spawn(core_->strand(), core_->End(std::move(last), kEndPatience, true), std::move(done));
}

std::optional<Connection::Protocol::socket> Connection::Release(const executor_type& executor) {
  if (core_->tls != nullptr) {
    return std::nullopt;
  }
  error_code error;
  core_->plain.expires_never();
  Protocol::socket socket = core_->plain.release_socket();
  const auto protocol = socket.local_endpoint(error).protocol();
  const int descriptor = error ? -1 : socket.release(error);
  if (error || descriptor < 0) {
    return std::nullopt;
  }
  return Protocol::socket(executor, protocol, descriptor);
}

bool Connection::MoveTo(asio::io_context& io) {
  if (core_->tls == nullptr) {
    auto socket = Release(io.get_executor());
    if (!socket) {
      return false;
    }
    core_ = std::make_shared<Core>(std::move(*socket), nullptr);
  } else {
    core_->plain.expires_never();
  }
  executor_ = io.get_executor();
  return true;
}

}  // namespace pheromone::web
