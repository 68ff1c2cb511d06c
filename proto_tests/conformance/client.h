// The host's side of commands.h: functions that run on the microcontroller.
//
// Each throws std::runtime_error if the image refuses the request, crashes, or answers with more or
// less than commands.h says. Batches of any size are split into requests. One thread.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client_fw/core/base/angle.h"
#include "client_fw/core/steering/careful.h"
#include "client_fw/core/steering/fuzzy.h"
#include "client_fw/core/steering/steering.h"
#include "client_fw/core/tasks/net_executor.h"
#include "proto_tests/conformance/commands.h"
#include "proto_tests/conformance/target.h"
#include "protocol/opcodes.h"
#include "protocol/testing/listen.h"
#include "protocol/testing/naive_protocol.h"
#include "protocol/testing/vectors.h"

namespace pheromone::conformance {

/// A message that Decode accepted.
struct DecodedMessage {
  std::string text;        ///< name and fields, as testing::TextOf
  testing::Bytes encoded;  ///< ID, OPCODE, DATA of Encode; empty if that failed
};

struct SteerInput {
  client::Law law;
  int16_t left;
  int16_t right;
  int16_t k_mm_s;
  uint8_t gain_16ths;
};

struct FuzzyInput {
  client::FuzzyState before;
  int16_t left;
  int16_t right;
  int16_t k_mm_s;
};

struct FuzzyOutput {
  client::WheelSpeeds wheels;
  client::FuzzyState after;
};

struct FiringOutput {
  client::Firing firing;
  uint32_t marking;
};

struct CarefulInput {
  client::CarefulState before;
  int16_t left;
  int16_t right;
  client::BinaryAngle heading;
  int16_t k_mm_s;
};

struct CarefulOutput {
  client::WheelSpeeds wheels;
  client::WheelSpeeds search;
  client::CarefulState after;
};

struct PlaceInput {
  client::Pose start;
  client::Odometry odometry;
};

struct UnitsInput {
  int32_t mm;
  uint16_t unit_10um;
};

struct UnitsOutput {
  bool done;
  int32_t units;  ///< 0 if not done
};

struct Lengths {
  std::vector<protocol::LengthRule> of_opcode;  ///< 256
  std::vector<uint8_t> of_arguments;            ///< by a COMMAND's code, 256
};

class ConformanceClient {
 public:
  /// Powers the image up and waits until it is ready.
  ConformanceClient();

  /// sizeof(int) and sizeof(void*).
  std::pair<int, int> Identify();
  uint16_t Crc(const testing::Bytes& bytes);
  /// EncodeFrame. `length` is what the message claims; `data` what is in it.
  testing::Bytes EncodeFrame(uint8_t id, uint8_t opcode, uint8_t length, const testing::Bytes& data,
                             uint16_t capacity);
  /// A whole stream through a fresh FrameDecoder; pauses must be under 256 ms.
  testing::Heard DecodeStream(const std::vector<testing::TimedByte>& stream,
                              uint16_t gap_timeout_ms);
  Lengths GetLengths();
  /// Every message as which Decode takes `body`.
  std::vector<DecodedMessage> DecodeMessage(const testing::Bytes& body);

  std::vector<client::WheelSpeeds> Steer(const std::vector<SteerInput>& inputs);
  /// Notice, and then SteerCareful and Search.
  std::vector<CarefulOutput> SteerCareful(const std::vector<CarefulInput>& inputs);
  /// With kTunedFuzzy.
  std::vector<FuzzyOutput> SteerFuzzy(const std::vector<FuzzyInput>& inputs);
  /// Fires these, by number, one after the other; about 500 of them fit into a request.
  std::vector<FiringOutput> FireNet(const std::vector<client::NetTransition>& transitions,
                                    uint32_t marking, const std::vector<uint8_t>& fired);
  /// Sine and cosine.
  std::vector<std::pair<int16_t, int16_t>> Sine(const std::vector<client::BinaryAngle>& angles);
  std::vector<client::Pose> Place(const std::vector<PlaceInput>& inputs);
  std::vector<UnitsOutput> ToPoseUnits(const std::vector<UnitsInput>& inputs);

  /// Sends a raw request and returns the reply's status and payload; the basis of the functions
  /// above.
  testing::Bytes Ask(const testing::Bytes& command_and_payload);

 private:
  testing::Bytes AskDone(const testing::Bytes& command_and_payload);
  testing::Bytes ReceiveReply();

  std::unique_ptr<Target> target_;
};

}  // namespace pheromone::conformance
