// A relay in front of a member of etcd, which loses, holds or makes up answers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>

#include "server/net/endpoint.h"

namespace pheromone::cluster {

class Relay {
 public:
  enum class Fate : uint8_t {
    kPass,
    kLoseAnswer,  ///< the member gets the request; its answer goes nowhere
    kSwallow,     ///< no one gets the request
    kHold,        ///< the member gets the request at Release
    kMakeUp,      ///< SetMadeUp has the answer
  };
  /// Of a request: of head and body.
  using Decide = std::function<Fate(std::string_view request)>;

  Relay(boost::asio::io_context* io, const Endpoint& member);
  ~Relay();
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;

  const Endpoint& endpoint() const;
  void SetDecide(Decide decide);
  void Release();
  void SetMadeUp(std::string body, int status = 200);

 private:
  struct State;
  static boost::asio::awaitable<void> Accept(std::shared_ptr<State> state);
  static boost::asio::awaitable<void> Serve(std::shared_ptr<State> state,
                                            boost::asio::ip::tcp::socket client);

  std::shared_ptr<State> state_;
};

}  // namespace pheromone::cluster
