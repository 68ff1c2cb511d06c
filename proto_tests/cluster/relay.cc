#include "proto_tests/cluster/relay.h"

#include <array>
#include <cstdlib>
#include <utility>

#include <boost/asio/buffer.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <boost/system/error_code.hpp>

namespace pheromone::cluster {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

auto Into(error_code* error) {
  return asio::redirect_error(asio::use_awaitable, *error);
}

// What the member sends goes to the client, or nowhere.
asio::awaitable<void> PassAnswers(std::shared_ptr<tcp::socket> from,
                                  std::shared_ptr<tcp::socket> to,
                                  std::shared_ptr<const bool> is_lost) {
  std::array<char, 16'384> bytes{};
  error_code error;
  while (!error) {
    const size_t size = co_await from->async_read_some(asio::buffer(bytes), Into(&error));
    if (!error && !*is_lost) {
      co_await asio::async_write(*to, asio::buffer(bytes, size), Into(&error));
    }
  }
  error_code ignored;
  to->close(ignored);
}

// Reads until all of a request, as EtcdClient writes it, is at the beginning of `received`: its
// size.
asio::awaitable<size_t> ReadRequest(tcp::socket* from, std::string* received, error_code* error) {
  constexpr std::string_view kLength = "Content-Length: ";
  std::array<char, 16'384> bytes{};
  while (!*error) {
    const size_t head = received->find("\r\n\r\n");
    const size_t length = received->find(kLength);
    if (head != std::string::npos && length < head) {
      const size_t body = std::strtoul(received->c_str() + length + kLength.size(), nullptr, 10);
      if (received->size() >= head + 4 + body) {
        co_return head + 4 + body;
      }
    }
    const size_t size = co_await from->async_read_some(asio::buffer(bytes), Into(error));
    received->append(bytes.data(), size);
  }
  co_return size_t{0};
}

}  // namespace

struct Relay::State {
  explicit State(asio::io_context* io_context)
      : io(io_context),
        acceptor(*io_context),
        held(*io_context, asio::steady_timer::time_point::max()) {}
  asio::io_context* io;
  tcp::acceptor acceptor;
  Endpoint endpoint;
  tcp::endpoint member;
  Decide decide;
  std::string made_up;
  asio::steady_timer held;  // canceled by Release
};

Relay::Relay(asio::io_context* io, const Endpoint& member) : state_(std::make_shared<State>(io)) {
  state_->member = {asio::ip::make_address(member.address), member.port};
  state_->acceptor.open(tcp::v4());
  state_->acceptor.bind({asio::ip::make_address("127.0.0.1"), 0});
  state_->acceptor.listen();
  state_->endpoint = {"127.0.0.1", state_->acceptor.local_endpoint().port()};
  asio::co_spawn(*io, Accept(state_), asio::detached);
}

Relay::~Relay() {
  error_code ignored;
  state_->acceptor.close(ignored);
  Release();
}

const Endpoint& Relay::endpoint() const {
  return state_->endpoint;
}
void Relay::SetDecide(Decide decide) {
  state_->decide = std::move(decide);
}

void Relay::Release() {
  state_->held.cancel();
}

void Relay::SetMadeUp(std::string body, int status) {
  state_->made_up = "HTTP/1.1 " + std::to_string(status) +
                    " x\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
}

asio::awaitable<void> Relay::Accept(std::shared_ptr<State> state) {
  error_code error;
  while (!error) {
    tcp::socket client = co_await state->acceptor.async_accept(Into(&error));
    if (!error) {
      asio::co_spawn(*state->io, Serve(state, std::move(client)), asio::detached);
    }
  }
}

asio::awaitable<void> Relay::Serve(std::shared_ptr<State> state, tcp::socket accepted) {
  const auto client = std::make_shared<tcp::socket>(std::move(accepted));
  const auto member = std::make_shared<tcp::socket>(*state->io);
  const auto is_lost = std::make_shared<bool>(false);
  error_code error;
  co_await member->async_connect(state->member, Into(&error));
  if (error) {
    co_return;
  }
  asio::co_spawn(*state->io, PassAnswers(member, client, is_lost), asio::detached);
  std::string received;
  while (!error) {
    const size_t size = co_await ReadRequest(client.get(), &received, &error);
    if (error) {
      break;
    }
    Fate fate = state->decide ? state->decide({received.data(), size}) : Fate::kPass;
    *is_lost = fate == Fate::kLoseAnswer;
    if (fate == Fate::kHold) {
      error_code ignored;
      co_await state->held.async_wait(Into(&ignored));
      fate = Fate::kPass;
    }
    if (fate == Fate::kMakeUp) {
      co_await asio::async_write(*client, asio::buffer(state->made_up), Into(&error));
    } else if (fate != Fate::kSwallow) {
      co_await asio::async_write(*member, asio::buffer(received, size), Into(&error));
    }
    received.erase(0, size);
  }
  error_code ignored;
  member->close(ignored);
}

}  // namespace pheromone::cluster
