#include "server/operators/web/stream/gathering_socket.h"

#include <optional>
#include <string>

#include <boost/asio/append.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>

namespace pheromone::web {

namespace asio = boost::asio;
using boost::system::error_code;

class GatheringSocket::Writer : public std::enable_shared_from_this<Writer> {
 public:
  using Buffers = std::vector<asio::const_buffer>;

  explicit Writer(Socket it) : socket(std::move(it)) {}

  void Write(Buffers buffers, Handler handler) {
    const size_t size = asio::buffer_size(buffers);
    if (error_) {
      asio::post(socket.get_executor(), asio::append(std::move(handler), error_, size_t{0}));
    } else if (size <= kMaxSmall && kept_.size() + size <= kMaxKept) {
      for (const asio::const_buffer& buffer : buffers) {
        kept_.append(static_cast<const char*>(buffer.data()), buffer.size());
      }
      asio::post(socket.get_executor(), asio::append(std::move(handler), error_code(), size));
      SendSoon();
    } else if (is_sending_) {
      held_.emplace(Held{std::move(buffers), std::move(handler)});
    } else {
      Send(std::move(buffers), std::move(handler));
    }
  }

  std::string TakeLast() { return is_sending_ ? std::string() : std::exchange(kept_, {}); }

  Socket socket;

 private:
  struct Held {
    Buffers buffers;
    Handler handler;
  };

  void SendSoon() {
    if (is_sending_ || is_posted_) {
      return;
    }
    is_posted_ = true;
    asio::post(socket.get_executor(), [self = shared_from_this(), size = kept_.size()] {
      self->is_posted_ = false;
      if (self->is_sending_ || self->kept_.empty()) {
        return;
      }
      if (self->kept_.size() > size) {
        self->SendSoon();  // perhaps there is still more
      } else {
        self->Send({}, nullptr);
      }
    });
  }

  void Send(Buffers buffers, Handler handler) {
    is_sending_ = true;
    sending_.swap(kept_);
    const size_t size = asio::buffer_size(buffers);
    buffers.insert(buffers.begin(), asio::buffer(sending_));
    asio::async_write(socket, buffers,
                      [self = shared_from_this(), size, handler = std::move(handler)](
                          error_code error, size_t /*written*/) mutable {
                        self->is_sending_ = false;
                        self->sending_.clear();
                        self->error_ = error;
                        if (handler) {
                          std::move(handler)(error, error ? 0 : size);
                        }
                        self->Continue();
                      });
  }

  void Continue() {
    if (is_sending_) {
      return;  // the handler wrote
    }
    if (held_) {
      Held held = std::move(*held_);
      held_.reset();
      Write(std::move(held.buffers), std::move(held.handler));
    } else if (error_) {
      kept_.clear();
    } else if (!kept_.empty()) {
      Send({}, nullptr);
    }
  }

  std::string kept_;
  std::string sending_;
  std::optional<Held> held_;
  error_code error_;
  bool is_sending_ = false;
  bool is_posted_ = false;
};

GatheringSocket::GatheringSocket(Socket socket)
    : writer_(std::make_shared<Writer>(std::move(socket))) {}

GatheringSocket::~GatheringSocket() {
  if (writer_ != nullptr) {
    Close();
  }
}

GatheringSocket::Socket& GatheringSocket::next_layer() {
  return writer_->socket;
}

const GatheringSocket::Socket& GatheringSocket::next_layer() const {
  return writer_->socket;
}

void GatheringSocket::Close() {
  writer_->socket.Close();
}

void GatheringSocket::Write(std::vector<asio::const_buffer> buffers, Handler handler) {
  writer_->Write(std::move(buffers), std::move(handler));
}

void GatheringSocket::End(asio::any_completion_handler<void(error_code)> handler) {
  writer_->socket.EndWith(writer_->TakeLast(), std::move(handler));
}

}  // namespace pheromone::web
