#include "client_fw/boards/host/server_choice.h"

#include <algorithm>
#include <utility>

#include "protocol/messages.h"
#include "protocol/opcodes.h"

namespace pheromone::client {
namespace {

// Of a frame, after a pad byte perhaps.
std::optional<protocol::Message> MessageIn(std::span<const uint8_t> frame) {
  protocol::FrameDecoder decoder(protocol::kNoGapTimeout);
  std::optional<protocol::Message> found;
  decoder.PushBlock(frame.data(), frame.size(), 0,
                    [&](const protocol::Message& message) { found = message; });
  return found;
}

}  // namespace

void ServerChoice::OnSent(std::span<const uint8_t> frame, int64_t now_ms) {
  const std::optional<protocol::Message> sent = MessageIn(frame);
  if (!sent || sent->opcode == protocol::kCommandAck) {
    return;  // which is not answered
  }
  unanswered_.assign(frame.begin(), frame.end());
  is_query_ = !protocol::IsMutating(sent->opcode);
  if (!asked_ms_) {
    asked_ms_ = now_ms;
  }
  if (is_query_ && !queried_ms_) {
    queried_ms_ = now_ms;
  }
  if (!is_query_) {
    change_ =
        Change{sent->opcode, sent->data[0], Waits(now_ms) ? change_->since_ms : now_ms, now_ms};
  }
  if (sent->opcode == protocol::kHello) {
    hello_ = unanswered_;
    doubtful_ = false;  // the client looks at the answer itself
  }
}

void ServerChoice::OnReceived(std::span<const uint8_t> bytes, int64_t now_ms) {
  decoder_.PushBlock(bytes.data(), bytes.size(), static_cast<uint32_t>(now_ms),
                     [this](const protocol::Message& message) { Hear(message); });
}

void ServerChoice::Hear(const protocol::Message& message) {
  if (!protocol::IsFromServer(message.opcode) ||
      (message.id != id_ && message.id != protocol::kBroadcastId)) {
    return;
  }
  heard_ = true;
  moves_ = 0;
  refused_ = false;
  unanswered_.clear();
  asked_ms_.reset();
  queried_ms_.reset();
  protocol::ErrorAnswer error;
  if (message.opcode == protocol::kHelloAnswer) {
    OnHelloAnswer(message);
  } else if (!change_) {
    return;
  } else if (message.opcode == (change_->opcode | protocol::kFromServer)) {
    if (message.data[0] == change_->seq) {
      change_.reset();
    }
  } else if (Decode(message, &error) && error.refused_opcode == change_->opcode &&
             error.seq == change_->seq && error.reason != protocol::Reason::kBusy &&
             error.reason != protocol::Reason::kReadOnly) {
    change_.reset();
  }
}

void ServerChoice::OnHelloAnswer(const protocol::Message& message) {
  protocol::HelloAnswer answer;
  const std::optional<protocol::Message> said = MessageIn(hello_);
  protocol::HelloRequest hello;
  if (!Decode(message, &answer) || !said || !Decode(*said, &hello) || answer.nonce != hello.nonce) {
    return;
  }
  new_epoch_ |= doubtful_ && epoch_ && *epoch_ != answer.epoch;
  doubtful_ = false;
  epoch_ = answer.epoch;
  change_.reset();  // the client drops it, or repeats it
}

// One that was given up is not sent any more.
bool ServerChoice::Waits(int64_t now_ms) const {
  return change_ && now_ms - change_->sent_ms < kInquiryMs;
}

bool ServerChoice::IsDue(int64_t now_ms) const {
  const size_t rounds = moves_ / servers_;
  const auto patience_ms = [rounds](int64_t first_ms) {
    return first_ms << std::min(rounds, kPatienceDoublings);
  };
  if (refused_ && (rounds == 0 || now_ms - arrived_ms_ >= patience_ms(kServerPatienceMs))) {
    return true;
  }
  if (asked_ms_ && queried_ms_ && now_ms - *asked_ms_ >= patience_ms(kServerPatienceMs) &&
      now_ms - *queried_ms_ >= patience_ms(kQueryPatienceMs)) {
    return true;
  }
  return change_ && change_->sent_ms - change_->since_ms >= kChangePatienceMs;
}

bool ServerChoice::Move(int64_t now_ms) {
  if (servers_ < 2 || !IsDue(now_ms)) {
    return false;
  }
  server_ = (server_ + 1) % servers_;
  ++moves_;
  refused_ = false;
  arrived_ms_ = now_ms;
  decoder_ = protocol::FrameDecoder(protocol::kNoGapTimeout);
  asked_ms_.reset();
  queried_ms_.reset();
  if (!unanswered_.empty()) {
    asked_ms_ = now_ms;
    if (is_query_) {
      queried_ms_ = now_ms;
    }
  }
  if (change_) {
    change_->since_ms = now_ms;
  }
  heard_ = false;
  doubtful_ = epoch_ && unanswered_ != hello_;
  next_inquiry_ms_ = now_ms;
  return true;
}

std::span<const uint8_t> ServerChoice::TakeInquiry(int64_t now_ms) {
  if (!doubtful_ || !heard_ || !unanswered_.empty() || Waits(now_ms) || now_ms < next_inquiry_ms_) {
    return {};
  }
  next_inquiry_ms_ = now_ms + kInquiryMs;
  return hello_;
}

bool ServerChoice::TakeNewEpoch() {
  return std::exchange(new_epoch_, false);
}

}  // namespace pheromone::client
