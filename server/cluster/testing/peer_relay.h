// Between a node and the one that it dials, for tests: holds what they say, or cuts them off.
//
//   const auto relay = std::make_shared<PeerRelay>(&io, port);
//   relay->Start();
//
// One thread.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <boost/system/error_code.hpp>

namespace pheromone::cluster {

inline boost::asio::ip::tcp::endpoint LocalPort(uint16_t port) {
  return {boost::asio::ip::make_address("127.0.0.1"), port};
}

class PeerRelay : public std::enable_shared_from_this<PeerRelay> {
 public:
  PeerRelay(boost::asio::io_context* io, uint16_t to)
      : io_(io), acceptor_(*io, LocalPort(0)), to_(LocalPort(to)) {}

  void Start() {
    boost::asio::co_spawn(
        *io_, [self = shared_from_this()] { return self->AcceptAll(); }, boost::asio::detached);
  }
  uint16_t port() const { return acceptor_.local_endpoint().port(); }
  // Nothing more goes through, in one or both directions.
  void Hold(bool forth, bool back) {
    holds_forth_ = forth;
    holds_back_ = back;
  }
  void Cut() {
    for (const auto& socket : sockets_) {
      socket->close();
    }
    sockets_.clear();
  }

 private:
  using Socket = std::shared_ptr<boost::asio::ip::tcp::socket>;

  boost::asio::awaitable<void> AcceptAll() {
    const auto self = shared_from_this();
    boost::system::error_code error;
    while (!error) {
      const auto near =
          std::make_shared<boost::asio::ip::tcp::socket>(co_await acceptor_.async_accept(
              boost::asio::redirect_error(boost::asio::use_awaitable, error)));
      const auto far = std::make_shared<boost::asio::ip::tcp::socket>(*io_);
      if (!error) {
        co_await far->async_connect(to_,
                                    boost::asio::redirect_error(boost::asio::use_awaitable, error));
        sockets_.push_back(near);
        sockets_.push_back(far);
        Pump(near, far, &holds_forth_);
        Pump(far, near, &holds_back_);
        error.clear();
      }
    }
  }

  void Pump(const Socket& from, const Socket& to, const bool* holds) {
    boost::asio::co_spawn(
        *io_,
        [self = shared_from_this(), from, to, holds] { return self->PumpAll(from, to, holds); },
        boost::asio::detached);
  }

  boost::asio::awaitable<void> PumpAll(Socket from, Socket to, const bool* holds) {
    const auto self = shared_from_this();
    std::array<char, 4096> bytes{};
    boost::system::error_code error;
    boost::asio::steady_timer timer(*io_);
    while (!error) {
      const size_t size = co_await from->async_read_some(
          boost::asio::buffer(bytes),
          boost::asio::redirect_error(boost::asio::use_awaitable, error));
      while (*holds) {
        timer.expires_after(std::chrono::milliseconds(1));
        co_await timer.async_wait(boost::asio::use_awaitable);
      }
      if (!error) {
        co_await boost::asio::async_write(
            *to, boost::asio::buffer(bytes.data(), size),
            boost::asio::redirect_error(boost::asio::use_awaitable, error));
      }
    }
    from->close();
    to->close();
  }

  boost::asio::io_context* const io_;
  boost::asio::ip::tcp::acceptor acceptor_;
  const boost::asio::ip::tcp::endpoint to_;
  std::list<Socket> sockets_;
  bool holds_forth_ = false;
  bool holds_back_ = false;
};

}  // namespace pheromone::cluster
