// A client's connection, plain or encrypted: an AsyncReadStream and AsyncWriteStream of Asio. One
// class, since what Beast makes of a stream takes long to compile.
//
//   Connection connection(std::move(socket), context);           // a null context: plain
//   if (co_await connection.ShakeHands(patience)) {
//     co_await asio::async_write(connection, asio::buffer(text), ...);
//     co_await connection.End(patience, true);
//   }
//
// It is read, written and encrypted on the executor of its socket, a strand. Operations may be
// started on the thread of get_executor() only, and are completed there: the same strand, until
// MoveTo. They may be one read and one write at a time. An operation keeps what it needs:
// destroying a connection closes it.
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <boost/asio/any_completion_handler.hpp>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/system/error_code.hpp>

#include "server/net/certificate.h"

namespace pheromone::web {

class Connection {
 public:
  /// Of TCP and of Unix sockets alike.
  using Protocol = boost::asio::generic::stream_protocol;
  using executor_type = boost::asio::any_io_executor;

  explicit Connection(Protocol::socket socket, const TlsContext& context = nullptr);
  Connection(Connection&&) = default;
  Connection& operator=(Connection&&) = delete;
  ~Connection();

  executor_type get_executor() const { return executor_; }

  template <typename Buffers, typename Token>
  auto async_read_some(const Buffers& buffers, Token&& token) {
    return boost::asio::async_initiate<Token, Transferred>(
        [this](auto handler, const Buffers& given) {
          boost::asio::mutable_buffer first;
          for (auto it = boost::asio::buffer_sequence_begin(given);
               first.size() == 0 && it != boost::asio::buffer_sequence_end(given); ++it) {
            first = *it;
          }
          Read(first, std::move(handler));
        },
        token, buffers);
  }
  template <typename Buffers, typename Token>
  auto async_write_some(const Buffers& buffers, Token&& token) {
    return boost::asio::async_initiate<Token, Transferred>(
        [this](auto handler, const Buffers& given) {
          std::vector<boost::asio::const_buffer> list(boost::asio::buffer_sequence_begin(given),
                                                      boost::asio::buffer_sequence_end(given));
          Write(std::move(list), std::move(handler));
        },
        token, buffers);
  }

  /// The operations that are started from now on fail, and the connection is closed, unless they
  /// are done within this time; null: they may take as long as they like. On its strand.
  void SetPatience(std::optional<std::chrono::milliseconds> patience);
  /// Operations under way fail, and all that follow. On its strand.
  void Cancel();
  /// Any thread of get_executor().
  void Close();
  void SetSendBuffer(int bytes);

  /// Of TLS; on its strand. A client that speaks plain HTTP is told so, with status 400.
  boost::asio::awaitable<bool> ShakeHands(std::chrono::milliseconds patience);
  /// Says that there is no more, and reads what the client still sends, if wanted: closing with
  /// unread bytes would make the system discard the last bytes written. Then closes. On its strand.
  boost::asio::awaitable<void> End(std::chrono::milliseconds patience, bool reads_rest);
  /// The same, after sending the last bytes; `handler` is called on the thread of get_executor().
  void EndWith(std::string last,
               boost::asio::any_completion_handler<void(boost::system::error_code)> handler);

  /// Operations are started, and completed, on `io`, which one thread runs; what is not encrypted
  /// is also read and written there. On its strand, with no operation under way. False: it is
  /// closed.
  bool MoveTo(boost::asio::io_context& io);
  /// The socket of a plain connection; none: it is closed, or TLS. As MoveTo.
  std::optional<Protocol::socket> Release(const executor_type& executor);

 private:
  using Transferred = void(boost::system::error_code, size_t);
  using Handler = boost::asio::any_completion_handler<Transferred>;
  struct Core;

  // What Beast calls when it ends a WebSocket too late.
  friend void beast_close_socket(Connection& connection) { connection.Close(); }

  void Read(boost::asio::mutable_buffer buffer, Handler handler);
  void Write(std::vector<boost::asio::const_buffer> buffers, Handler handler);

  std::shared_ptr<Core> core_;
  executor_type executor_;
};

}  // namespace pheromone::web
