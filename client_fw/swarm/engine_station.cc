#include "client_fw/swarm/engine_station.h"

#include <algorithm>
#include <array>
#include <span>

namespace pheromone::swarm {
namespace {

constexpr int64_t kNsPerMs = 1'000'000;
constexpr int64_t kLongAgo = -1'000'000'000;
constexpr uint16_t kGapTimeoutMs = 20;

}  // namespace

EngineStation::EngineStation(engine::Service* service, engine::LinkIndex link,
                             sim::RadioMedium* medium, const ServerTiming& timing)
    : service_(service),
      medium_(medium),
      timing_(timing),
      decoder_(kGapTimeoutMs),
      last_byte_ns_(kLongAgo),
      no_error_until_ns_(kLongAgo),
      number_(medium->AddStation(this)),
      link_(link) {}

void EngineStation::OnByte(uint8_t byte, int64_t time_ns) {
  last_byte_ns_ = time_ns;
  if (!decoder_.Push(byte, static_cast<uint32_t>(time_ns / kNsPerMs))) {
    return;
  }
  std::vector<engine::Outgoing> out;
  service_->Handle(link_, {&decoder_.message(), 1}, &out);
  for (const engine::Outgoing& outgoing : out) {
    if (outgoing.message.opcode == protocol::kCommand) {
      QueueCommand(outgoing.message);
    } else {
      QueueAnswer(outgoing.message, time_ns);
    }
  }
}

void EngineStation::OnTransmitted(int64_t time_ns) {
  if (command_leaving_) {
    command_leaving_ = false;
    ack_until_ns_ = time_ns + timing_.response_window_ns;
  }
}

void EngineStation::Queue(const engine::Outgoing& outgoing) {
  if (outgoing.message.opcode == protocol::kCommand) {
    QueueCommand(outgoing.message);
  } else {
    QueueAnswer(outgoing.message, medium_->now_ns());
  }
}

void EngineStation::QueueAnswer(const protocol::Message& message, int64_t request_end_ns) {
  if (message.opcode == protocol::kError) {
    if (request_end_ns < no_error_until_ns_) {
      ++suppressed_errors_;
      return;
    }
    no_error_until_ns_ = request_end_ns + timing_.response_window_ns;
  }
  answers_.push_back({request_end_ns + std::max(timing_.delay_ns, medium_->byte_ns()),
                      request_end_ns + timing_.response_window_ns, message});
}

// A repetition replaces the previous one if that was not yet sent.
void EngineStation::QueueCommand(const protocol::Message& message) {
  for (protocol::Message& waiting : commands_) {
    if (waiting.id == message.id) {
      waiting = message;
      return;
    }
  }
  commands_.push_back(message);
}

void EngineStation::Step() {
  decoder_.Expire(static_cast<uint32_t>(medium_->now_ns() / kNsPerMs));
  SendAnswers();
  SendCommand();
}

void EngineStation::SendAnswers() {
  const int64_t now_ns = medium_->now_ns();
  const int64_t first_bit_ns = now_ns + medium_->turnaround_ns(number_);
  while (!answers_.empty() && answers_.front().not_before_ns <= now_ns) {
    if (answers_.front().not_after_ns < first_bit_ns) {
      ++late_answers_;
      answers_.pop_front();
      continue;
    }
    if (!ChannelFree()) {
      return;
    }
    Send(answers_.front().message);
    SendRider(answers_.front().message.id);
    answers_.pop_front();
  }
}

void EngineStation::SendCommand() {
  if (commands_.empty() || !answers_.empty() || medium_->now_ns() < ack_until_ns_ ||
      !ChannelFree()) {
    return;
  }
  const protocol::Message command = commands_.front();
  commands_.pop_front();
  Send(command);
  command_leaving_ = true;
  ++commands_sent_;
}

// The server has the channel at this time, and this client is listening.
void EngineStation::SendRider(uint8_t id) {
  const auto rider = std::find_if(commands_.begin(), commands_.end(),
                                  [id](const protocol::Message& m) { return m.id == id; });
  if (rider != commands_.end()) {
    Send(*rider);
    commands_.erase(rider);
    command_leaving_ = true;
    ++commands_sent_;
  }
}

void EngineStation::Send(const protocol::Message& message) {
  std::array<uint8_t, protocol::kMaxFrame> frame{};
  const size_t size = EncodeFrame(message, frame.data(), frame.size());
  medium_->Transmit(number_, std::span(frame.data(), size));
}

// With the turnaround that follows, the first bit is T_t + B after the last byte heard.
bool EngineStation::ChannelFree() const {
  return !medium_->Busy(number_) && !decoder_.frame_open() &&
         medium_->now_ns() >= last_byte_ns_ + medium_->byte_ns();
}

}  // namespace pheromone::swarm
