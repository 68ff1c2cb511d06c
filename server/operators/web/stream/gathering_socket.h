// A socket for a WebSocket stream of Beast that makes one system call of the many small messages of
// a moment. What a viewer gets ten times a second is a dozen of them, and each call costs more, in
// the kernel, which nothing interrupts, than copying the message.
//
// A small write is done as soon as it is copied; what was copied is sent once a turn of the
// thread's loop brings no more. A large one is sent with what was copied before it, and is done
// then. At most kMaxKept bytes wait beside those that are being sent: then a write is done when
// there is room. An error of what was sent after its write was done is that of the next one.
//
// One thread.
#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include <boost/asio/any_completion_handler.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/beast/core/role.hpp>
#include <boost/beast/websocket/teardown.hpp>
#include <boost/system/error_code.hpp>

#include "server/operators/web/connection.h"

namespace pheromone::web {

class GatheringSocket {
 public:
  using Socket = Connection;
  using next_layer_type = Socket;
  using executor_type = Socket::executor_type;
  static constexpr size_t kMaxSmall = size_t{1} << 15;
  static constexpr size_t kMaxKept = size_t{1} << 16;

  explicit GatheringSocket(Socket socket);
  GatheringSocket(GatheringSocket&&) = default;
  GatheringSocket& operator=(GatheringSocket&&) = delete;
  ~GatheringSocket();

  Socket& next_layer();
  const Socket& next_layer() const;
  executor_type get_executor() { return next_layer().get_executor(); }
  void Close();

  /// As Asio's AsyncReadStream and AsyncWriteStream require; the latter writes all or fails.
  template <typename Buffers, typename Token>
  auto async_read_some(const Buffers& buffers, Token&& token) {
    return next_layer().async_read_some(buffers, std::forward<Token>(token));
  }
  template <typename Buffers, typename Token>
  auto async_write_some(const Buffers& buffers, Token&& token) {
    return boost::asio::async_initiate<Token, Written>(
        [this](auto handler, const Buffers& given) {
          std::vector<boost::asio::const_buffer> list(boost::asio::buffer_sequence_begin(given),
                                                      boost::asio::buffer_sequence_end(given));
          Write(std::move(list), std::move(handler));
        },
        token, buffers);
  }

  // What Beast calls when it ends a connection.
  friend void teardown(boost::beast::role_type /*role*/, GatheringSocket& socket,
                       boost::system::error_code& /*error*/) {
    socket.Close();
  }
  template <typename Handler>
  friend void async_teardown(boost::beast::role_type /*role*/, GatheringSocket& socket,
                             Handler&& handler) {
    socket.End(std::forward<Handler>(handler));
  }

 private:
  using Written = void(boost::system::error_code, size_t);
  using Handler = boost::asio::any_completion_handler<Written>;
  class Writer;

  void Write(std::vector<boost::asio::const_buffer> buffers, Handler handler);
  void End(boost::asio::any_completion_handler<void(boost::system::error_code)> handler);

  std::shared_ptr<Writer> writer_;  // also that of what is being sent
};

}  // namespace pheromone::web
