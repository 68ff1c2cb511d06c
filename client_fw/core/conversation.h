// A robot's talk with the pheromone server, without any I/O: bytes, poses and the time go in,
// frames, wheel speeds and counters come out.
//
//   conversation.OnByte(byte, now_ms);                    // each byte from the radio
//   conversation.Poll(now_ms, &pose, channel_busy);       // every millisecond or so
//   if (conversation.tx_size() != 0) ...                  // give tx() to the radio, at once
//   conversation.OnSent(now_ms);                          // when its last byte has left
//   drive.set_wheel_speeds(conversation.wheels());
//
// It says HELLO until the server answers, then asks once a period with the pose of that moment
// (SENSE, or TRACE to leave a trail), one request at a time. An unanswered request is repeated
// after a random number of slots, five times, then the next period begins. A TRACE is repeated to
// the bit under its seq until it is answered, so that the server executes it once. On a buffered
// link an answer may come after its request was given up; there a PING is sent after every timeout,
// and nothing is believed before its echo.
//
// Fail-safe: wheels() is zero before the first answer, and again when intensities have been missing
// for Parameters::fail_safe_ms, until they come. After such a silence HELLO is said again.
//
// Times are uint32_t milliseconds that may wrap. After a pause of the loop of half a minute or more
// the robot stops and says HELLO, as after a silence. Nothing is allocated; one instance belongs to
// one loop (not to interrupts). Malformed and foreign frames are counted and otherwise ignored.
#pragma once

#include <stdint.h>

#include "client_fw/core/angle.h"
#include "client_fw/core/backoff.h"
#include "client_fw/core/conversation_state.h"
#include "client_fw/core/counters.h"
#include "client_fw/core/parameters.h"
#include "client_fw/core/steering.h"
#include "protocol/decoder.h"
#include "protocol/messages.h"

namespace pheromone {
namespace client {

/// DATA of the longest request with a seq: TRACE_WIDE.
constexpr uint8_t kMaxPending = 11;
/// The longest thing a client sends: TRACE_WIDE made of nothing but DLE. Radio rings hold this
/// much.
constexpr uint8_t kMaxClientFrame = 4 + 2 * (kMaxPending + 4);
constexpr uint8_t kMaxRetries = 5;

/// What must outlive a warm reset for "exactly once": plain memory, zeroed by the caller when the
/// boot counter changes or when the memory cannot be trusted. Nobody else writes to it.
struct RequestMemory {
  uint16_t nonce;  ///< of the boot that used it; another boot counter clears the rest
  uint16_t epoch;  ///< the server's, as last heard
  uint8_t seq;     ///< of the last request that had one
  uint8_t opcode;  ///< of the request not yet answered, 0: none
  uint8_t length;
  uint8_t data[kMaxPending];
  uint8_t sent;     ///< how often it was sent and not refused; 2: or more often
  bool remembered;  ///< the server greeted us and must remember a request, or has forgotten us
};

/// Why the wheels stand still. Any one of them is enough.
enum StopFlag : uint8_t {
  kNoAnswerYet = 0x01,   ///< since the start
  kFailSafe = 0x02,      ///< answers stopped coming
  kHalted = 0x04,        ///< by a COMMAND, until resume
  kOffTheMap = 0x08,     ///< the pose has no place on the map; until an answer comes
  kWrongVersion = 0x10,  ///< the server speaks another protocol version
  kTypeMissing = 0x20,   ///< the server has no such pheromone
};

class Conversation : private ConversationState {
 public:
  /// `memory` must outlive the conversation.
  Conversation(const Parameters& parameters, RequestMemory* memory);

  /// A byte from the radio, read at `now_ms`. After a transmission, tell OnSent first.
  void OnByte(uint8_t byte, uint32_t now_ms);

  /// Lets time pass. `pose` is the pose on the map at `now_ms`, or null while there is none; then
  /// no request is sent. `channel_busy`: the radio hears a carrier; nothing is begun meanwhile.
  void Poll(uint32_t now_ms, const Pose* pose, bool channel_busy);

  /// A frame to send, whole and at once; it stays until OnSent. Size 0: nothing.
  const uint8_t* tx() const { return tx_; }
  uint8_t tx_size() const { return tx_size_; }
  /// The last byte of tx() has left.
  void OnSent(uint32_t now_ms);

  WheelSpeeds wheels() const { return wheels_; }
  /// A set of StopFlag; 0 while driving.
  uint8_t flags() const { return flags_; }
  /// The last intensities, 1/4096 of a unit; 0 before the first.
  int16_t p_left() const { return p_left_; }
  int16_t p_right() const { return p_right_; }

  /// HELLO has been answered and the server is the one we can talk to.
  bool greeted() const { return greeted_; }
  /// The server's last HELLO answer; meaningful once counters().hello_answers is not 0.
  const protocol::HelloAnswer& server() const { return server_; }
  /// As given, with type and speed as COMMANDs have changed them.
  const Parameters& parameters() const { return parameters_; }
  const Counters& counters() const { return counters_; }
  const protocol::DecoderCounters& decoder_counters() const { return decoder_.counters(); }
  /// The reason of the last ERROR, kNone before.
  protocol::Reason last_error() const { return last_error_; }

 private:
  enum : uint8_t { kPingSize = 4 };  // nonce and number

  // Time and sending: conversation.cc.
  void Restart();
  void CheckSilence();
  bool CountDown(uint16_t elapsed_ms, bool free);
  void Begin(Job job, const Pose* pose);
  void MakeHello(protocol::Message* message);
  void MakePing(protocol::Message* message);
  void MakeAck(protocol::Message* message);
  bool MakeRequest(const Pose* pose, protocol::Message* message);
  bool MakeFresh(const Pose& pose, protocol::Message* message);
  void OnMiss();
  void Retry();
  void SayHello();
  void WaitForHello();
  void WaitForNextPeriod();
  void WaitUntil(uint16_t ms);
  void Wait(uint16_t countdown_ms);
  uint16_t RandomDelay();
  uint8_t SlotMs() const;
  uint8_t WindowMs() const;
  uint16_t Since(uint16_t ms) const { return static_cast<uint16_t>(now_ - ms); }
  bool FrameOpen() const;
  void SetFlags(uint8_t set, uint8_t clear);
  void StopOffTheMap();
  void StopFailSafe();
  void DropPending();

  // Receiving: conversation_receive.cc.
  void OnMessage(const protocol::Message& message);
  void OnForeign(const protocol::Message& message);
  void OnAnswer(const protocol::Message& message);
  // These return false for what nobody waited for.
  bool OnHelloAnswer(const protocol::Message& message);
  bool OnEcho(const protocol::Message& message);
  bool OnIntensities(const protocol::Message& message);
  bool OnError(const protocol::Message& message);
  void OnCommand(const protocol::Message& message);
  protocol::Reason Execute(const protocol::Command& command);
  void Hold();
  void HearOther();
  bool HasType(uint8_t type) const;

  RequestMemory* memory_;
  Random random_;
  ContentionWindow window_;
  Parameters parameters_;
  protocol::HelloAnswer server_;
  Counters counters_;
  protocol::FrameDecoder decoder_;
  uint8_t tx_[kMaxClientFrame];
};

}  // namespace client
}  // namespace pheromone
