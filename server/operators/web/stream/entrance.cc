#include "server/operators/web/stream/entrance.h"

#include <memory>
#include <string>
#include <utility>

#include <boost/asio/post.hpp>

#include "server/operators/web/stream/conversation.h"

namespace pheromone::web {
namespace {

// RFC 6455, section 4.1: a client waits for the answer to its handshake.
void Dismiss(Entrance::Guest guest) {
  const auto kept = std::make_shared<Entrance::Guest>(std::move(guest));
  const Response refused = Refuse(400, {"found bytes behind the handshake", "request",
                                        "a client that waits for the answer to it"});
  kept->connection.EndWith(
      "HTTP/1.1 400 Bad Request\r\nContent-Type: application/json\r\n"
      "Connection: close\r\nContent-Length: " +
          std::to_string(refused.body.size()) + "\r\n\r\n" + refused.body,
      [kept](boost::system::error_code /*error*/) {});
}

}  // namespace

Entrance::Entrance(boost::asio::io_context* io, Api* api, StreamCounters* counters,
                   EntranceOptions options)
    : io_(*io), api_(*api), counters_(*counters), options_(std::move(options)) {}

std::optional<Response> Entrance::Check(const Request& request) {
  auto refused = api_.CheckStream(request);
  if (!refused && ChooseSubprotocol(request.subprotocols).empty()) {
    std::string expected(kSubprotocols[0]);
    expected.append(" or ").append(kSubprotocols[1]);
    refused = Refuse(400, {"found no known WebSocket subprotocol", "Sec-WebSocket-Protocol",
                           std::move(expected)});
  }
  if (!refused && (is_closed_ || guests_ >= options_.max_guests)) {
    refused = Refuse(503, {options_.too_many, "", options_.limit});
  }
  counters_.refused += refused ? 1 : 0;
  return refused;
}

void Entrance::Take(Upgrade upgrade, std::weak_ptr<const void> owner,
                    std::function<void(Guest)> welcome) {
  const auto offered = upgrade.message[boost::beast::http::field::sec_websocket_protocol];
  std::string subprotocol(ChooseSubprotocol({offered.data(), offered.size()}));
  if (is_closed_ || !upgrade.connection.MoveTo(io_)) {
    return;  // the connection is closed
  }
  ++guests_;
  boost::asio::post(io_,
                    [this, owner = std::move(owner), welcome = std::move(welcome),
                     is_early = !upgrade.rest.empty(),
                     guest = Guest{std::move(upgrade.connection), std::move(upgrade.place),
                                   std::move(upgrade.message), std::move(subprotocol)}]() mutable {
                      const auto still = owner.lock();
                      if (still == nullptr) {
                        return;
                      }
                      if (!is_closed_ && !is_early) {
                        welcome(std::move(guest));
                        return;
                      }
                      Leave();
                      if (is_early) {
                        Dismiss(std::move(guest));
                      }
                    });
}

}  // namespace pheromone::web
