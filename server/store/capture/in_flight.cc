#include "server/store/capture/in_flight.h"

#include <algorithm>

#include "protocol/signing.h"

namespace pheromone::capture {
namespace {

bool StandsFor(const protocol::RoundAnswer& answer, const protocol::Message& message) {
  protocol::SenseAnswer sense;
  protocol::TraceAnswer trace;
  protocol::ErrorAnswer error;
  if (Decode(message, &sense)) {
    return sense.left == answer.left && sense.right == answer.right;
  }
  if (Decode(message, &trace)) {
    return trace.left == answer.left && trace.right == answer.right;
  }
  return Decode(message, &error) && answer.left == protocol::kNoIntensities &&
         static_cast<int16_t>(error.reason) == answer.right;
}

}  // namespace

bool Same(const protocol::Message& a, const protocol::Message& b) {
  return a.id == b.id && a.opcode == b.opcode && a.length == b.length &&
         std::equal(a.data, a.data + a.length, b.data);
}

void InFlight::Add(const Sent& sent) {
  std::deque<protocol::Message>& queue = waiting_[{sent.link, sent.message.id}];
  if (sent.message.id == protocol::kBroadcastId) {
    std::erase_if(queue, [&](const auto& it) { return Same(it, sent.message); });
  }
  queue.push_back(sent.message);
  if (queue.size() > kMax) {
    queue.pop_front();
  }
}

bool InFlight::Take(const Sent& sent) {
  return protocol::IsGreeting(sent.message) || TakeExactly(sent) ||
         TakeExactly({sent.link, protocol::WithoutSignature(sent.message)});
}

bool InFlight::TakeExactly(const Sent& sent) {
  const auto found = waiting_.find({sent.link, sent.message.id});
  if (found == waiting_.end()) {
    return false;
  }
  std::deque<protocol::Message>& queue = found->second;
  const auto at = std::find_if(queue.begin(), queue.end(),
                               [&](const auto& it) { return Same(it, sent.message); });
  if (at == queue.end()) {
    return false;
  }
  if (sent.message.id != protocol::kBroadcastId) {
    last_[found->first] = *at;
    queue.erase(at);
    if (queue.empty()) {
      waiting_.erase(found);
    }
  }
  return true;
}

bool InFlight::TakeFor(engine::LinkIndex link, uint8_t id, const protocol::RoundAnswer& answer) {
  const auto begin = waiting_.lower_bound({link, id});
  const auto end = waiting_.upper_bound({link, id != 0 ? id : protocol::kBroadcastId});
  for (auto it = begin; it != end; ++it) {
    std::deque<protocol::Message>& queue = it->second;
    const auto at = std::find_if(queue.begin(), queue.end(),
                                 [&](const auto& message) { return StandsFor(answer, message); });
    if (at != queue.end()) {
      last_[it->first] = *at;
      queue.erase(at);
      if (queue.empty()) {
        waiting_.erase(it);
      }
      return true;
    }
  }
  return false;
}

bool InFlight::WasLast(const Sent& sent) const {
  const auto last = last_.find({sent.link, sent.message.id});
  return last != last_.end() && (Same(last->second, sent.message) ||
                                 Same(last->second, protocol::WithoutSignature(sent.message)));
}

size_t InFlight::Count(const Sent& sent) const {
  const auto found = waiting_.find({sent.link, sent.message.id});
  return found == waiting_.end() ? 0
                                 : static_cast<size_t>(std::count_if(
                                       found->second.begin(), found->second.end(),
                                       [&](const auto& it) { return Same(it, sent.message); }));
}

const protocol::Message* InFlight::First(engine::LinkIndex link, uint8_t id) const {
  const auto found = waiting_.find({link, id});
  return found != waiting_.end() ? &found->second.front() : nullptr;
}

std::vector<Sent> InFlight::All() const {
  std::vector<Sent> all;
  for (const auto& [key, queue] : waiting_) {
    for (const protocol::Message& message : queue) {
      all.push_back({key.first, message});
    }
  }
  return all;
}

size_t InFlight::size() const {
  size_t size = 0;
  for (const auto& [key, queue] : waiting_) {
    size += key.second == protocol::kBroadcastId ? 0 : queue.size();
  }
  return size;
}

}  // namespace pheromone::capture
