// A robot's conversation with the pheromone server, without any I/O: bytes, odometry and the time
// go in, frames, wheel speeds and counters come out.
//
//   conversation.OnByte(byte, now_ms);                    // each byte from the radio
//   conversation.behaviour()->OnDrive(status);            // what the drive has to tell
//   conversation.Poll(now_ms, &odometry, channel_busy);   // every millisecond or so
//   if (conversation.tx_size() != 0) ...                  // give tx() to the radio, at once
//   conversation.OnSent(now_ms);                          // when its last byte has left
//   drive.set_wheel_speeds(conversation.state().wheels);
//
// It sends HELLO until the server answers, then one request per period with the current pose
// (SENSE, or TRACE to deposit a trail). An unanswered request is repeated after a random number of
// slots, five times, then the next period begins. A TRACE is repeated byte for byte under its seq
// until it is answered, so that the server executes it once; while it waits, every second request
// is a SENSE, by which the robot drives on: on a buffered link from the first missing answer on. So
// is an EVENT repeated, which is sent after the intensities of a period have arrived. On a buffered
// link an answer may arrive after its request was abandoned; there a PING is sent after every
// timeout, and everything before its echo is discarded. Access to the channel is described in
// protocol/README.md, section 9.
//
// After fail_safe_ms without intensities the robot stops. HELLO is sent again when a request was
// given up and the server was not heard for 200 slots, fail_safe_ms at least. A robot that has lost
// its pose asks for nothing.
//
// Tags are read and written beside that: Ask (tag_exchange.h).
//
// With a key, everything is signed, and what the server has not signed is ignored
// (conversation_signing.cc).
//
// Times are milliseconds of a clock that may wrap. After a pause of
// the loop the robot stops and sends HELLO, as after a silence. Nothing is allocated; one instance
// belongs to one loop (not to interrupts). Malformed and foreign frames are counted and otherwise
// ignored.
#pragma once

#include <stdint.h>

#include "client_fw/core/base/moment.h"
#include "client_fw/core/conversation_state.h"
#include "client_fw/core/counters.h"
#include "client_fw/core/medium/medium_access.h"
#include "client_fw/core/requests/request_memory.h"
#include "client_fw/core/requests/tag_exchange.h"
#include "client_fw/core/steering/behaviour.h"
#include "client_fw/core/steering/parameters.h"
#include "protocol/byte_order.h"
#include "protocol/decoder.h"
#include "protocol/frame_parser.h"
#include "protocol/messages.h"

namespace pheromone {
namespace client {

constexpr uint8_t kMaxRetries = 5;

class Conversation : private ConversationState, private LinkSigning {
 public:
  /// `memory` must outlive the conversation.
  Conversation(const Parameters& parameters, RequestMemory* memory);
  /// A copy with a memory and an exchange of its own, for checkers that branch.
  Conversation(const Conversation& other, RequestMemory* memory, TagExchange* exchange = nullptr)
      : Conversation(other) {
    behaviour_ = Behaviour(other.behaviour_, memory);
    memory_ = memory;
    exchange_ = exchange;
  }

  /// A byte from the radio, read at `now_ms`. After a transmission, call OnSent first.
  void OnByte(uint8_t byte, Moment now_ms);

  /// Advances to `now_ms`. `odometry` is the drive's at that time, or null while there is none;
  /// then no intensities are requested. `channel_busy`: the radio detects a carrier; no
  /// transmission begins meanwhile.
  void Poll(Moment now_ms, const Odometry* odometry, bool channel_busy);

  /// What the robot does; and what is to be told to it, before Poll.
  const BehaviourState& state() const { return behaviour_.state(); }
  Behaviour* behaviour() { return &behaviour_; }

  /// The frame to send, without gaps and at once; it is kept until OnSent. Size 0: none.
  const uint8_t* tx() const { return tx_; }
  uint8_t tx_size() const { return tx_size_; }
  /// The last byte of tx() has left.
  void OnSent(Moment now_ms);

  /// Sends the request of TAG in `exchange` until it is answered, refused or dropped, one at a
  /// time, between the requests for intensities. `exchange` is to outlive that.
  void Ask(TagExchange* exchange);
  /// Sends HELLO, under the same nonce: the server may be another one.
  void GreetAgain() {
    SayHello();
    Contend();
  }
  /// For how long our adapter holds bytes back, as measured by now. Who begins or ceases to take
  /// part in rounds says HELLO.
  void SetAdapter(uint8_t adapter_ms, bool rounds) {
    const bool other = rounds != parameters().rounds;
    behaviour_.SetAdapter(adapter_ms, rounds);
    medium_.set_adapter_ms(adapter_ms);
    if (other) {
      in_turn_ = false;
      in_rounds_ = false;
      medium_.rounds()->Decline();
      GreetAgain();
    }
  }
  /// There are more robots than the channel can serve in a period, so periods are longer: perhaps
  /// longer than fail_safe_ms, which then stops the robot for a part of each.
  bool congested() const;

  /// The opcode of the request that has not been answered yet, 0: none.
  uint8_t awaited_opcode() const { return phase_ == Phase::kAwaiting ? asked_opcode_ : 0; }

  /// On what it depends whether the next request is a query, for checkers that compare states.
  uint8_t query_phase() const { return static_cast<uint8_t>(2 * query_ + (attempt_ != 0 ? 1 : 0)); }

  /// The number of the ROUND that is to bring the answer to what was sent in a turn; -1: none.
  int awaited_round() const {
    return in_turn_ ? static_cast<uint8_t>(medium_.rounds().values().number + 1u) : -1;
  }

  /// The place of its answer there.
  uint8_t awaited_place() const { return in_turn_ ? asked_index_ : uint8_t{0}; }
  bool in_rounds() const { return in_rounds_; }

  const RequestState& requests() const { return requests_; }
  /// The server's last HELLO answer; meaningful once there was one.
  protocol::HelloAnswer server() const;
  /// Of its messages; 0 before the first answer.
  uint16_t pose_unit_10um() const { return protocol::GetU16(server_ + kPoseUnitAt); }
  Counters counters() const;
  const protocol::DecoderCounters& decoder_counters() const { return medium_.state().decoder; }

 private:
  enum : uint8_t { kPingSize = 4 };  // nonce and number

  // Time and the channel: conversation.cc.
  void Advance(Moment now_ms);
  void CheckSilence();
  void OnMiss();
  void Retry();
  void SayHello();
  void WaitForHello();
  void GiveUp();
  void Rest();
  uint16_t NeededMs() const;
  uint16_t EarlyMs() const;
  uint16_t PeriodMs();
  void Contend(MediumAccess::Delay delay = MediumAccess::kRandom);
  void Greet(bool greeted);
  bool IsUrgent() const;
  void OnSuccess();

  // Rounds: conversation_rounds.cc.
  void OnRound(const uint8_t* data, uint8_t length);
  void OnRoundAnswer(const uint8_t* answer);
  void CheckTurns(const Odometry* odometry);
  void TakeTurn(const Odometry* odometry);
  void LeaveRounds();
  /// The server grants turns, and we take part.
  bool HasTurns() const {
    return RoundPeriod() != 0 && requests_.greeted && medium_.rounds().left_ms() != 0;
  }

  // Sending: conversation_send.cc.
  void Begin(const Odometry* odometry);
  uint8_t RoundPeriod() const;
  void Send(uint8_t opcode, const uint8_t* data, uint8_t length);
  bool MakeRequest(const Odometry* odometry);
  bool MakeFresh(const Odometry& odometry, uint8_t* opcode);
  bool AppendCoordinate(int32_t mm);
  void AppendByte(uint8_t value);
  void Append(uint16_t value);
  void AppendSeq();
  void MakeEvent();
  void MakePending(uint8_t opcode);
  void DropPending();
  void SendAck();

  // Signing: conversation_signing.cc.
  LinkSigning* signing() { return this; }
  bool is_signed() const { return on(); }
  uint8_t SignatureOf(const FrameView& frame, uint8_t* signature);
  bool Unsign(const FrameView& frame, uint8_t* length);
  void FollowRound(const uint8_t* data, uint8_t length);
  void OnGreeting(const FrameView& frame);
  bool SavesHellos() const;
  bool NumberHello();

  // Receiving: conversation_receive.cc.
  void OnFrame();
  void OnForeign(uint8_t id, uint8_t opcode, const uint8_t* data, uint8_t length);
  // These return false for unexpected messages.
  bool OnAnswer(uint8_t opcode, const uint8_t* data, uint8_t length);
  bool OnHelloAnswer(const uint8_t* data, uint8_t length);
  bool OnEcho(const uint8_t* data, uint8_t length);
  bool OnDone(const uint8_t* data, uint8_t length);
  void OnIntensities(const uint8_t* data);
  bool OnError(const uint8_t* data, uint8_t length);
  void OnRefusal(protocol::Reason reason);
  /// Answers may be late. That of a change rather waits for the log than it is lost.
  bool IsBuffered() const { return kHasAdapters && parameters().buffered_link; }
  bool RequestPending() const { return memory_->opcode == asked_opcode_; }

  /// While that waits, the robot steers by queries. A request of TAG has its own turns.
  bool ChangePending() const { return RequestPending() && !IsTag(asked_opcode_); }

  // Tags: conversation_tags.cc.
  static bool IsTag(uint8_t opcode) {
    return kHasTags && protocol::ServiceOf(opcode) == protocol::ServiceOf(protocol::kScan);
  }
  bool HasTagRequest() const;
  bool Awaits(bool pending) const;
  bool MakeTagRequest(const Odometry* odometry, uint8_t* opcode);
  void SendTagRequest(uint8_t opcode);
  void PreferSteering();
  bool OnTagAnswer(uint8_t opcode, const uint8_t* data, uint8_t length);
  void OnTagRefusal(protocol::Reason reason);
  void GoOnAfterTag();
  void DropTagRequest();

  void OnCommand(const uint8_t* data, uint8_t length);
  void TellCounter(uint8_t id);
  const Parameters& parameters() const { return behaviour_.state().parameters; }

  void Count(unsigned ConversationCounters::*which) {
    if (kAllCounters || which == &Counters::requests || which == &Counters::timeouts) {
      ++(counters_.*which);
    }
  }
  void HearServer();
#if PHEROMONE_SIGNING
  void HearServerOfOthers();
#else
  void HearServerOfOthers() {
    HearServer();
  }
#endif

  MediumAccess medium_;
  Behaviour behaviour_;
  RequestMemory* memory_;
  TagExchange* exchange_ = nullptr;  // the last one asked for
  ConversationCounters counters_ = ConversationCounters();
};

}  // namespace client
}  // namespace pheromone
