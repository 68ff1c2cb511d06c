// Sends datagrams to a [[tracker]] of the server.
//
//   Result<Sender> sender = Sender::Open({"127.0.0.1", 4960});
//   sender.value().Send("pose radio-a 7 2.35 0.9 -90\n");
//
// One thread.
#pragma once

#include <string>
#include <string_view>

#include "server/base/descriptor.h"
#include "server/base/result.h"
#include "server/net/endpoint.h"

namespace pheromone::tracker {

class Sender {
 public:
  static Result<Sender> Open(const Endpoint& server);

  /// Errors: it could not be sent; that nobody listens there is known only after an earlier one.
  Status Send(std::string_view datagram);

 private:
  Sender(Descriptor descriptor, std::string name)
      : descriptor_(std::move(descriptor)), name_(std::move(name)) {}

  Descriptor descriptor_;
  std::string name_;
};

}  // namespace pheromone::tracker
