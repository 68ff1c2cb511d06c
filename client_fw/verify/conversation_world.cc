#include "client_fw/verify/conversation_world.h"

#include <cassert>
#include <utility>

#include "server/core/engine/refusal.h"

namespace pheromone::verify {
namespace {

using engine::Handling;
using protocol::Message;

constexpr uint16_t kFirstBoot = 1;
constexpr uint32_t kPatienceMs = 30'000;
constexpr uint32_t kSilenceMs = 30'000;
constexpr uint32_t kQuietStartMs = 2'001;

void ForgetRobot(const Message& request, engine::Engine* server) {
  if (request.opcode == protocol::kHello && request.id != kChangesRobot) {
    server->ForgetAsMutant(0, kChangesRobot);
  }
}

// With the robot: its HELLO is answered as that of an unknown one.
void ForgetRequest(const Message& request, engine::Engine* server) {
  protocol::HelloRequest hello;
  const engine::RobotState* const robot = server->robots().Find(0, request.id);
  if (protocol::Decode(request, &hello) && robot != nullptr && robot->hello.nonce != hello.nonce) {
    server->ForgetAsMutant(0, request.id);
  }
}

// A ROUND does if it ends the pending request with intensities; its refusals count as requests
// lost.
bool Acknowledges(const Message& message, uint8_t pending_opcode) {
  return message.opcode == (pending_opcode | protocol::kFromServer) ||
         message.opcode == protocol::kRound;
}

SharedEngine::Mutation MutationOf(ServerMutant mutant) {
  return mutant == ServerMutant::kForgetsRobot     ? ForgetRobot
         : mutant == ServerMutant::kForgetsRequest ? ForgetRequest
                                                   : nullptr;
}

}  // namespace

ConversationWorld::ConversationWorld(const ConversationLimits& limits)
    : left_(limits),
      robot_(RobotFor(limits.kind, boot_counter_), &memory_),
      server_(SharedEngine::Of(ServerFor(limits.kind), MutationOf(limits.server))),
      durable_(server_),
      told_(static_cast<size_t>(limits.changes)) {
  AskForChange();
}

ConversationWorld::ConversationWorld(const ConversationWorld& other)
    : left_(other.left_),
      memory_(other.memory_),
      boot_counter_(other.boot_counter_),
      exchange_(other.exchange_),
      robot_(other.robot_, &memory_, &exchange_),
      now_ms_(other.now_ms_),
      server_(other.server_),
      durable_(other.durable_),
      held_(other.held_),
      to_server_(other.to_server_),
      to_robot_(other.to_robot_),
      made_(other.made_),
      told_(other.told_),
      pending_(other.pending_),
      fault_(other.fault_),
      number_(other.number_),
      turns_(other.turns_),
      place_(other.place_),
      other_was_heard_(other.other_was_heard_),
      answered_(other.answered_) {}

ConversationWorld::ConversationWorld(ConversationWorld&& other) noexcept
    : left_(other.left_),
      memory_(other.memory_),
      boot_counter_(other.boot_counter_),
      exchange_(other.exchange_),
      robot_(other.robot_, &memory_, &exchange_),
      now_ms_(other.now_ms_),
      server_(std::move(other.server_)),
      durable_(std::move(other.durable_)),
      held_(std::move(other.held_)),
      to_server_(std::move(other.to_server_)),
      to_robot_(std::move(other.to_robot_)),
      made_(other.made_),
      told_(std::move(other.told_)),
      pending_(other.pending_),
      fault_(std::move(other.fault_)),
      number_(other.number_),
      turns_(other.turns_),
      place_(other.place_),
      other_was_heard_(other.other_was_heard_),
      answered_(std::move(other.answered_)) {}

std::string ConversationWorld::Wrong() const {
  uint32_t all = 0;
  for (int change = 0; change < made_; ++change) {
    const uint32_t times = TimesMade(*server_, change);
    const Told told = told_[static_cast<size_t>(change)];
    all += times;
    if (times > 1) {
      return "change " + std::to_string(change) + " was made " + std::to_string(times) + " times";
    }
    if (times == 0 && told == Told::kMade) {
      return "change " + std::to_string(change) + " was acknowledged and is gone";
    }
    if (times != 0 && told == Told::kRefused) {
      return "change " + std::to_string(change) + " was refused and is made";
    }
  }
  if (is_of_tags() && GenerationOn(**server_) != all) {
    return "the tag's generation is not the number of changes";
  }
  if (exchange_.state == client::TagExchange::kAsked && exchange_.is_pending &&
      !IsOfTags(memory_.opcode)) {
    return "the robot waits for the answer to a WRITE that it does not repeat";
  }
  return fault_;
}

// The next WRITE, if it has one to make and none is under way.
void ConversationWorld::AskForChange() {
  if (is_of_tags() && left_.changes > 0 && exchange_.state != client::TagExchange::kAsked) {
    exchange_.message = WriteOf(left_.kind, made_);
    robot_.Ask(&exchange_);
  }
}

// Lets time pass until the robot sends, with its next change if it has one to make. HELLO after a
// silence is not sent here, but after HearNothing.
bool ConversationWorld::Send(bool in_next_period) {
  const bool was_greeted = robot_.requests().greeted;
  if (in_next_period) {
    now_ms_ += kTagPeriodMs;
    robot_.Poll(now_ms_, nullptr, true);
  }
  const bool has_pose =
      is_of_tags() ? IsOfTags(memory_.opcode) || exchange_.state == client::TagExchange::kAsked
                   : left_.changes > 0;
  if (robot_.requests().greeted && !has_pose && memory_.opcode == 0 && robot_.state().events == 0) {
    return false;  // it has nothing to send
  }
  for (uint32_t waited = 0; waited < kPatienceMs; ++waited) {
    client::Odometry odometry{};
    odometry.x_mm = made_ * kBetweenMm;
    ++now_ms_;
    const uint8_t seq_before = memory_.seq;
    robot_.Poll(now_ms_, has_pose ? &odometry : nullptr, false);
    if (robot_.tx_size() == 0) {
      continue;
    }
    const Message sent = TakeSent(seq_before);
    if (was_greeted && !robot_.requests().greeted) {
      return false;
    }
    to_server_.push_back(sent);
    return true;
  }
  return false;
}

// What the robot has in its transmitter is sent.
Message ConversationWorld::TakeSent(uint8_t seq_before) {
  protocol::FrameDecoder decoder(protocol::kNoGapTimeout);
  Message sent;
  decoder.PushBlock(robot_.tx(), robot_.tx_size(), 0, [&](const Message& it) { sent = it; });
  robot_.OnSent(now_ms_);
  if (memory_.seq != seq_before) {
    const bool is_change =
        sent.opcode == protocol::kTagWrite || protocol::ServiceOf(sent.opcode) == protocol::kTrace;
    left_.changes -= is_change ? 1 : 0;
    pending_ = is_change ? made_++ : -1;  // or an EVENT
  } else if (left_.repeats_with_pose && sent.opcode == protocol::kTagWrite) {
    ++sent.data[1];  // of x
  }
  return sent;
}

// The channel is busy so long that all its timers run down, and then loses what is repeated until
// the robot gives it up.
void ConversationWorld::HearNothing() {
  --left_.silences;
  now_ms_ += kSilenceMs;
  robot_.Poll(now_ms_, nullptr, true);
  for (uint32_t waited = 0; waited < kPatienceMs && robot_.requests().greeted; ++waited) {
    ++now_ms_;
    const uint8_t seq_before = memory_.seq;
    robot_.Poll(now_ms_, nullptr, false);
    if (robot_.tx_size() != 0) {
      TakeSent(seq_before);
    }
  }
}

void ConversationWorld::Arrive(size_t frame, bool also_later) {
  const Message message = to_server_[frame];
  if (!also_later) {
    to_server_.erase(to_server_.begin() + static_cast<ptrdiff_t>(frame));
  }
  std::vector<engine::Outgoing> out;
  Handle(message, &out);
  for (const engine::Outgoing& answer : out) {
    Deliver(answer);
  }
}

void ConversationWorld::Handle(const Message& request, std::vector<engine::Outgoing>* out) {
  switch ((*server_)->Classify(0, request)) {
    case Handling::kIgnore:
      break;
    case Handling::kAnswer:
      (*server_)->Answer({1, 0}, 0, request, out);
      break;
    case Handling::kChange:
      server_ = server_->After(0, request, out);
      break;
  }
}

// In a frame of its own, now or when the log is synced.
void ConversationWorld::Deliver(const engine::Outgoing& answer) {
  const bool waits = answer.durable_at > (*durable_)->sequence();
  std::vector<Message>& to = waits ? held_ : to_robot_;
  if (waits) {
    to.clear();  // one for each robot, to its latest request (held_answers.h)
  }
  to.push_back(answer.message);
}

// Service refuses it like this (section 7 of the protocol, step 5).
void ConversationWorld::TurnAway(size_t frame, protocol::Reason reason) {
  --left_.turned_away;
  const Message message = to_server_[frame];
  to_server_.erase(to_server_.begin() + static_cast<ptrdiff_t>(frame));
  to_robot_.push_back(engine::ErrorMessage(message, reason));
}

void ConversationWorld::Hear(size_t frame, bool also_later) {
  const Message message = to_robot_[frame];
  if (!also_later) {
    to_robot_.erase(to_robot_.begin() + static_cast<ptrdiff_t>(frame));
  }
  Take(message);
}

void ConversationWorld::Sense(const Message& request) {
  std::vector<engine::Outgoing> out;
  (*server_)->Answer({1, 0}, 0, request, &out);
  Take(out.front().message);
}

void ConversationWorld::Take(const Message& message) {
  uint8_t wire[protocol::kMaxFrame];
  const size_t size = protocol::EncodeFrame(message, wire, sizeof wire);
  const uint8_t pending_opcode = memory_.opcode;
  const bool was_asked = exchange_.state == client::TagExchange::kAsked && exchange_.is_pending;
  for (size_t i = 0; i < size; ++i) {
    robot_.OnByte(wire[i], now_ms_);
  }
  if (pending_opcode != 0 && memory_.opcode == 0) {
    if (pending_ >= 0 && is_of_tags()) {
      Settle(message, was_asked);
    } else if (pending_ >= 0 && Acknowledges(message, pending_opcode)) {
      told_[static_cast<size_t>(pending_)] = Told::kMade;
    }
    pending_ = -1;
  }
  AskForChange();
}

// The pending WRITE is no longer so, by this message. After a warm reset nobody waits for it.
void ConversationWorld::Settle(const Message& message, bool was_asked) {
  using client::TagExchange;
  protocol::ErrorAnswer error;
  const bool is_answer = message.opcode == (protocol::kTagWrite | protocol::kFromServer);
  const bool is_refusal = protocol::Decode(message, &error);
  const bool is_final = is_refusal && error.reason != protocol::Reason::kSequenceReused &&
                        error.reason != protocol::Reason::kReadOnly;
  const TagExchange::State expected = is_answer  ? TagExchange::kAnswered
                                      : is_final ? TagExchange::kRefused
                                                 : TagExchange::kDropped;
  const bool may_drop =
      boot_counter_ != kFirstBoot || (is_refusal && error.reason == protocol::Reason::kReadOnly);
  Told& told = told_[static_cast<size_t>(pending_)];
  std::string fault;
  if (is_answer) {
    told = Told::kMade;
    fault = IsInVain(left_.kind, pending_)
                ? "was not refused"
                : FaultOfAnswer(**server_, pending_, was_asked ? exchange_.message : message);
    if (TimesMade(*durable_, pending_) == 0) {
      fault = "was acknowledged before it was durable";
    }
  } else if (is_final) {
    told = Told::kRefused;
    if (error.reason != protocol::Reason::kGenerationChanged) {
      fault = "was refused for reason " + std::to_string(static_cast<int>(error.reason));
    } else if (!IsInVain(left_.kind, pending_)) {
      fault = "was refused: its generation has changed";
    }
  } else if (!may_drop) {
    fault = "was given up";
  }
  if (was_asked && exchange_.state != expected) {
    fault = "was told to the robot otherwise";
  }
  if (!fault.empty()) {
    fault_ = "change " + std::to_string(pending_) + " " + fault;
  }
}

void ConversationWorld::Sync() {
  durable_ = server_;
  to_robot_.insert(to_robot_.end(), held_.begin(), held_.end());
  held_.clear();
}

// All that was acknowledged is durable, so the epoch stays.
void ConversationWorld::Crash() {
  --left_.crashes;
  server_ = durable_;
  held_.clear();
  answered_.clear();
  other_was_heard_ = false;
  turns_ = 0;
  if (left_.server == ServerMutant::kNumbersAgain) {
    --number_;
  } else if (robot_.in_rounds()) {
    now_ms_ += kQuietStartMs;
    robot_.Poll(now_ms_, nullptr, true);
  }
}

void ConversationWorld::Reset(bool keeps_memory) {
  if (keeps_memory) {
    --left_.warm_resets;
    memory_.numbered = memory_.numbered && !left_.takes_numbers_back;
  } else {
    --left_.power_losses;
    ++boot_counter_;
    memory_ = client::RequestMemory{};
    pending_ = -1;
  }
  exchange_ = client::TagExchange{};
  robot_ = client::Conversation(RobotFor(left_.kind, boot_counter_), &memory_);
  AskForChange();
}

void ConversationWorld::OtherHello() {
  --left_.other_robots;
  Message hello;
  protocol::Encode(protocol::HelloRequest{kChangesRobot + 1, 9, 1, 0}, &hello);
  std::vector<engine::Outgoing> ignored;
  if ((*server_)->Classify(0, hello) == Handling::kChange) {
    server_ = server_->After(0, hello, &ignored);
  }
}

void ConversationWorld::Next(const Visit& visit) const {
  const auto step = [&](const std::string& name, const auto& act) {
    ConversationWorld next(*this);
    act(&next);
    if (next.to_server_.size() <= left_.in_flight && next.to_robot_.size() <= left_.in_flight) {
      visit(name, std::move(next));
    }
  };
  const auto send = [&](bool in_next_period) {
    ConversationWorld next(*this);
    if (!next.Send(in_next_period)) {
      return;
    }
    const Message sent = next.to_server_.back();
    if (protocol::ServiceOf(sent.opcode) == protocol::kSense) {
      next.to_server_.pop_back();
      ConversationWorld answered(next);
      answered.Sense(sent);
      visit("the robot senses", std::move(answered));
      visit("the robot senses in vain", std::move(next));
    } else if (next.to_server_.size() <= left_.in_flight) {
      visit("the robot sends " + std::to_string(sent.opcode), std::move(next));
    }
  };
  if (left_.rounds > 0) {
    NextRounds(visit);
  }
  if (!robot_.in_rounds()) {
    send(false);
  }
  if (is_of_tags() &&
      robot_.requests().event_turn) {  // tags have their turn only until the next period
    send(true);
  }
  for (size_t i = 0; i < to_server_.size(); ++i) {
    const std::string what = "request " + std::to_string(to_server_[i].opcode);
    step(what + " arrives", [i](ConversationWorld* it) { it->Arrive(i, false); });
    step(what + " arrives and is repeated", [i](ConversationWorld* it) { it->Arrive(i, true); });
    step(what + " is lost", [i](ConversationWorld* it) {
      it->to_server_.erase(it->to_server_.begin() + static_cast<ptrdiff_t>(i));
    });
    if (left_.turned_away > 0 && (*server_)->Classify(0, to_server_[i]) == Handling::kChange) {
      step(what + " arrives, the log is busy",
           [i](ConversationWorld* it) { it->TurnAway(i, protocol::Reason::kBusy); });
      step(what + " arrives, the log is read-only",
           [i](ConversationWorld* it) { it->TurnAway(i, protocol::Reason::kReadOnly); });
    }
  }
  for (size_t i = 0; i < to_robot_.size(); ++i) {
    const std::string what = "answer " + std::to_string(to_robot_[i].opcode);
    step(what + " arrives", [i](ConversationWorld* it) { it->Hear(i, false); });
    step(what + " arrives and is repeated", [i](ConversationWorld* it) { it->Hear(i, true); });
    step(what + " is lost", [i](ConversationWorld* it) {
      it->to_robot_.erase(it->to_robot_.begin() + static_cast<ptrdiff_t>(i));
    });
  }
  if (server_ != durable_) {
    step("the log is synced", [](ConversationWorld* it) { it->Sync(); });
    if (left_.crashes > 0) {
      step("the server crashes", [](ConversationWorld* it) { it->Crash(); });
    }
  }
  if (left_.silences > 0 && robot_.requests().greeted) {
    step("the robot hears nothing", [](ConversationWorld* it) { it->HearNothing(); });
  }
  if (left_.warm_resets > 0) {
    step("the robot is reset", [](ConversationWorld* it) { it->Reset(true); });
  }
  if (left_.power_losses > 0) {
    step("the robot loses power", [](ConversationWorld* it) { it->Reset(false); });
  }
  if (left_.other_robots > 0) {
    step("another robot says HELLO", [](ConversationWorld* it) { it->OtherHello(); });
  }
}

Explored ExploreConversation(const ConversationLimits& limits, size_t max_states) {
  return Explore<ConversationWorld>(
      ConversationWorld(limits),
      {.key = [](const ConversationWorld& it) { return it.Key(); },
       .next = [](const ConversationWorld& it, const auto& visit) { it.Next(visit); },
       .wrong = [](const ConversationWorld& it) { return it.Wrong(); },
       .finished = [](const ConversationWorld& it) { return it.Finished(); },
       .must_finish = [](const ConversationWorld& it) { return it.MustFinish(); },
       .max_states = max_states});
}

}  // namespace pheromone::verify
