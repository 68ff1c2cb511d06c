#include "client_fw/attach/servers.h"

#include <utility>

namespace pheromone::attach {

Status CheckServers(const std::vector<Address>& addresses) {
  if (addresses.empty()) {
    return Error{"expected an address"};
  }
  for (const Address& address : addresses) {
    if (addresses.size() > 1 && address.kind == Address::Kind::kSerial) {
      return Error{address.text + ": one of several servers, expected HOST:PORT or udp:HOST:PORT"};
    }
    if (address.kind != addresses.front().kind) {
      return Error{addresses.front().text + " and " + address.text +
                   ": expected several servers either all by TCP or all by UDP"};
    }
    if (addresses.size() > 1 && address.paced) {
      return Error{"several servers have no modem whose bit rate could be given"};
    }
  }
  return Ok();
}

Servers::Servers(std::vector<Address> addresses, uint8_t id)
    : addresses_(std::move(addresses)),
      choice_(addresses_.size(), id),
      connection_(addresses_.front()) {}

void Servers::Advance(int64_t now_ms) {
  connection_.Advance(now_ms);
}

void Servers::Choose(int64_t now_ms) {
  if (addresses_.size() < 2) {
    return;
  }
  const bool refused = refusals_ != connection_.refusals();
  if (refused) {
    refusals_ = connection_.refusals();
    choice_.OnRefused();
  }
  if (choice_.Move(now_ms)) {
    ++all_moves_;
    left_ = connection_.address().text + ": " +
            (!refused                        ? "no answer"
             : connection_.trouble().empty() ? "nobody is there"
                                             : connection_.trouble());
    connection_.MoveTo(addresses_[choice_.server()], now_ms);
    connection_.Advance(now_ms);
  }
  if (openings_ != connection_.openings()) {
    openings_ = connection_.openings();
    connection_.Write(choice_.unanswered(), now_ms);
  }
  connection_.Write(choice_.TakeInquiry(now_ms), now_ms);
}

std::span<const uint8_t> Servers::Read(int64_t now_ms) {
  const std::span<const uint8_t> bytes = connection_.Read(now_ms);
  choice_.OnReceived(bytes, now_ms);
  return bytes;
}

void Servers::Write(std::span<const uint8_t> frame, int64_t now_ms) {
  if (frame.empty()) {
    return;
  }
  choice_.OnSent(frame, now_ms);
  connection_.Write(frame, now_ms);
}

}  // namespace pheromone::attach
