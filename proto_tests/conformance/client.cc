#include "proto_tests/conformance/client.h"

#include <algorithm>
#include <cstddef>
#include <stdexcept>

#include "protocol/byte_order.h"
#include "protocol/fields.h"
#include "protocol/testing/message_fields.h"

namespace pheromone::conformance {
namespace {

using testing::Bytes;

void PutU8(uint8_t value, Bytes* to) {
  to->push_back(value);
}

void PutU16(uint16_t value, Bytes* to) {
  to->insert(to->end(), {static_cast<uint8_t>(value & 0xFFu), static_cast<uint8_t>(value >> 8)});
}

void PutU32(uint32_t value, Bytes* to) {
  PutU16(static_cast<uint16_t>(value & 0xFFFFu), to);
  PutU16(static_cast<uint16_t>(value >> 16), to);
}

void PutPose(const client::Pose& pose, Bytes* to) {
  PutU32(static_cast<uint32_t>(pose.x_mm), to);
  PutU32(static_cast<uint32_t>(pose.y_mm), to);
  PutU16(pose.heading, to);
}

// A reply's payload, taken piece by piece.
class Reply {
 public:
  explicit Reply(Bytes bytes) : bytes_(std::move(bytes)) {}

  bool empty() const { return at_ == bytes_.size(); }

  uint8_t U8() { return *Take(1); }
  uint16_t U16() { return protocol::GetU16(Take(2)); }
  int16_t I16() { return protocol::GetI16(Take(2)); }
  uint32_t U32() { return protocol::GetU32(Take(4)); }
  int32_t I32() { return protocol::GetI32(Take(4)); }
  Bytes Some(size_t size) {
    const uint8_t* from = Take(size);
    return Bytes(from, from + size);
  }

  void ExpectEnd() const {
    if (!empty()) {
      throw std::runtime_error("the chip's reply is too long");
    }
  }

 private:
  const uint8_t* Take(size_t size) {
    if (bytes_.size() - at_ < size) {
      throw std::runtime_error("the chip's reply is too short");
    }
    const uint8_t* from = bytes_.data() + at_;
    at_ += size;
    return from;
  }

  Bytes bytes_;
  size_t at_ = 0;
};

// Reads the message with a number, as the image has sent its fields.
class MessageReader {
 public:
  MessageReader(uint8_t number, Reply* reply) : left_(number), reply_(reply) {}

  template <typename M>
  void Visit(M message) {
    if (left_-- == 0) {
      protocol::ForEachField(message, this);
      text = testing::TextOf(message);
    }
  }
  template <typename Field>
  void Add(const char* /*name*/, Field& field) {
    field = static_cast<Field>(reply_->I32());
  }

  std::string text;

 private:
  int left_;
  Reply* reply_;
};

// Splits `inputs` so that requests and replies fit; asks for each piece.
template <typename Output, typename Input, typename Ask, typename Put, typename Take>
std::vector<Output> InBatches(uint8_t command, const std::vector<Input>& inputs, const Ask& ask,
                              const Put& put, const Take& take) {
  constexpr size_t kBatch = 48;  // of the longest: 48 * 20 bytes
  std::vector<Output> outputs;
  for (size_t from = 0; from < inputs.size(); from += kBatch) {
    const size_t to = std::min(from + kBatch, inputs.size());
    Bytes request{command};
    for (size_t i = from; i < to; ++i) {
      put(inputs[i], &request);
    }
    Reply reply(ask(request));
    for (size_t i = from; i < to; ++i) {
      outputs.push_back(take(&reply));
    }
    reply.ExpectEnd();
  }
  return outputs;
}

}  // namespace

ConformanceClient::ConformanceClient() : target_(MakeTarget()) {
  if (ReceiveReply() != Bytes{kDone}) {
    throw std::runtime_error("the chip did not say that it is ready");
  }
}

Bytes ConformanceClient::Ask(const Bytes& command_and_payload) {
  if (command_and_payload.size() > 0xFFFF) {
    throw std::runtime_error("a request of this size cannot be said");
  }
  Bytes request;
  PutU16(static_cast<uint16_t>(command_and_payload.size()), &request);
  request.insert(request.end(), command_and_payload.begin(), command_and_payload.end());
  target_->Send(request);
  return ReceiveReply();
}

Bytes ConformanceClient::AskDone(const Bytes& command_and_payload) {
  Bytes reply = Ask(command_and_payload);
  if (reply.empty() || reply[0] != kDone) {
    throw std::runtime_error("the chip refused a request");
  }
  reply.erase(reply.begin());
  return reply;
}

Bytes ConformanceClient::ReceiveReply() {
  size_t size = target_->Receive();
  size += size_t{target_->Receive()} << 8;
  Bytes reply(size);
  for (uint8_t& byte : reply) {
    byte = target_->Receive();
  }
  return reply;
}

std::pair<int, int> ConformanceClient::Identify() {
  Reply reply(AskDone({kIdentify}));
  const int size_of_int = reply.U8();
  const int size_of_pointer = reply.U8();
  reply.ExpectEnd();
  return {size_of_int, size_of_pointer};
}

uint16_t ConformanceClient::Crc(const Bytes& bytes) {
  Bytes request{kCrc};
  request.insert(request.end(), bytes.begin(), bytes.end());
  Reply reply(AskDone(request));
  const uint16_t crc = reply.U16();
  reply.ExpectEnd();
  return crc;
}

Bytes ConformanceClient::EncodeFrame(uint8_t id, uint8_t opcode, uint8_t length, const Bytes& data,
                                     uint16_t capacity) {
  Bytes request{kEncodeFrame};
  PutU16(capacity, &request);
  request.insert(request.end(), {id, opcode, length});
  request.insert(request.end(), data.begin(), data.end());
  return AskDone(request);
}

testing::Heard ConformanceClient::DecodeStream(const std::vector<testing::TimedByte>& stream,
                                               uint16_t gap_timeout_ms) {
  Bytes request{kDecodeStream};
  PutU16(gap_timeout_ms, &request);
  uint32_t now_ms = stream.empty() ? 0 : stream.front().at_ms;
  PutU32(now_ms, &request);
  for (const testing::TimedByte& timed : stream) {
    const uint32_t pause_ms = timed.at_ms - now_ms;
    if (pause_ms > 0xFF) {
      throw std::runtime_error("a pause too long for the request");
    }
    now_ms = timed.at_ms;
    request.insert(request.end(), {static_cast<uint8_t>(pause_ms), timed.byte});
  }
  Reply reply(AskDone(request));
  testing::Heard heard;
  for (int frames = reply.U8(); frames > 0; --frames) {
    Bytes body = reply.Some(2);
    const Bytes data = reply.Some(reply.U8());
    body.insert(body.end(), data.begin(), data.end());
    heard.bodies.push_back(body);
  }
  protocol::DecoderCounters& c = heard.counters;
  for (uint32_t* counter : {&c.frames, &c.crc_errors, &c.bad_escapes, &c.oversize, &c.runts,
                            &c.refused, &c.restarts, &c.timeouts, &c.ignored_bytes}) {
    *counter = reply.U32();
  }
  heard.frame_open = reply.U8() != 0;
  reply.ExpectEnd();
  return heard;
}

Lengths ConformanceClient::GetLengths() {
  Reply reply(AskDone({kLengths}));
  Lengths lengths;
  for (int opcode = 0; opcode < 256; ++opcode) {
    const Bytes rule = reply.Some(3);
    lengths.of_opcode.push_back({rule[0] != 0, rule[1], rule[2]});
  }
  lengths.of_arguments = reply.Some(256);
  reply.ExpectEnd();
  return lengths;
}

std::vector<DecodedMessage> ConformanceClient::DecodeMessage(const Bytes& body) {
  Bytes request{kDecodeMessage};
  request.insert(request.end(), body.begin(), body.end());
  Reply reply(AskDone(request));
  std::vector<DecodedMessage> all;
  while (!reply.empty()) {
    MessageReader reader(reply.U8(), &reply);
    protocol::ForEachMessage(&reader);
    if (reader.text.empty()) {
      throw std::runtime_error("the chip decoded a message of unknown number");
    }
    DecodedMessage decoded;
    decoded.text = reader.text;
    const bool encoded = reply.U8() != 0;
    const size_t length = reply.U8();
    const Bytes again = reply.Some(2 + length);
    if (encoded) {
      decoded.encoded = again;
    }
    all.push_back(decoded);
  }
  return all;
}

std::vector<client::WheelSpeeds> ConformanceClient::Steer(const std::vector<SteerInput>& inputs) {
  return InBatches<client::WheelSpeeds>(
      kSteer, inputs, [this](const Bytes& request) { return AskDone(request); },
      [](const SteerInput& input, Bytes* to) {
        PutU8(static_cast<uint8_t>(input.law), to);
        PutU16(static_cast<uint16_t>(input.left), to);
        PutU16(static_cast<uint16_t>(input.right), to);
        PutU16(static_cast<uint16_t>(input.k_mm_s), to);
        PutU8(input.gain_16ths, to);
      },
      [](Reply* reply) {
        const int16_t left = reply->I16();
        return client::WheelSpeeds{left, reply->I16()};
      });
}

std::vector<FuzzyOutput> ConformanceClient::SteerFuzzy(const std::vector<FuzzyInput>& inputs) {
  return InBatches<FuzzyOutput>(
      kFuzzy, inputs, [this](const Bytes& request) { return AskDone(request); },
      [](const FuzzyInput& input, Bytes* to) {
        PutU16(static_cast<uint16_t>(input.before.error), to);
        PutU16(static_cast<uint16_t>(input.left), to);
        PutU16(static_cast<uint16_t>(input.right), to);
        PutU16(static_cast<uint16_t>(input.k_mm_s), to);
      },
      [](Reply* reply) {
        const int16_t left = reply->I16();
        const int16_t right = reply->I16();
        return FuzzyOutput{{left, right}, {reply->I16()}};
      });
}

std::vector<FiringOutput> ConformanceClient::FireNet(
    const std::vector<client::NetTransition>& transitions, uint32_t marking,
    const std::vector<uint8_t>& fired) {
  Bytes request{kFireNet};
  PutU8(static_cast<uint8_t>(transitions.size()), &request);
  for (const client::NetTransition& transition : transitions) {
    PutU32(transition.takes, &request);
    PutU32(transition.gives, &request);
    PutU32(transition.inhibited_by, &request);
  }
  PutU32(marking, &request);
  request.insert(request.end(), fired.begin(), fired.end());
  Reply reply(AskDone(request));
  std::vector<FiringOutput> outputs;
  for (size_t i = 0; i < fired.size(); ++i) {
    const auto firing = static_cast<client::Firing>(reply.U8());
    marking = firing == client::Firing::kFired ? reply.U32() : marking;
    outputs.push_back({firing, marking});
  }
  reply.ExpectEnd();
  return outputs;
}

std::vector<CarefulOutput> ConformanceClient::SteerCareful(
    const std::vector<CarefulInput>& inputs) {
  return InBatches<CarefulOutput>(
      kCareful, inputs, [this](const Bytes& request) { return AskDone(request); },
      [](const CarefulInput& input, Bytes* to) {
        PutU16(static_cast<uint16_t>(input.before.plateau), to);
        PutU16(input.before.course, to);
        PutU16(input.before.turn, to);
        PutU8(static_cast<uint8_t>(input.before.mode), to);
        PutU8(static_cast<uint8_t>(input.before.aside), to);
        PutU8(static_cast<uint8_t>(input.before.stronger), to);
        PutU8(input.before.clear, to);
        PutU16(static_cast<uint16_t>(input.left), to);
        PutU16(static_cast<uint16_t>(input.right), to);
        PutU16(input.heading, to);
        PutU16(static_cast<uint16_t>(input.k_mm_s), to);
      },
      [](Reply* reply) {
        CarefulOutput output{};
        for (client::WheelSpeeds* wheels : {&output.wheels, &output.search}) {
          wheels->left_mm_s = reply->I16();
          wheels->right_mm_s = reply->I16();
        }
        output.after.plateau = reply->I16();
        output.after.course = reply->U16();
        output.after.turn = reply->U16();
        output.after.mode = static_cast<client::CarefulState::Mode>(reply->U8());
        output.after.aside = static_cast<client::CarefulState::Side>(reply->U8());
        output.after.stronger = static_cast<client::CarefulState::Side>(reply->U8());
        output.after.clear = reply->U8();
        return output;
      });
}

std::vector<std::pair<int16_t, int16_t>> ConformanceClient::Sine(
    const std::vector<client::BinaryAngle>& angles) {
  return InBatches<std::pair<int16_t, int16_t>>(
      kSine, angles, [this](const Bytes& request) { return AskDone(request); },
      [](client::BinaryAngle angle, Bytes* to) { PutU16(angle, to); },
      [](Reply* reply) {
        const int16_t sine = reply->I16();
        return std::pair{sine, reply->I16()};
      });
}

std::vector<client::Pose> ConformanceClient::Place(const std::vector<PlaceInput>& inputs) {
  return InBatches<client::Pose>(
      kPlace, inputs, [this](const Bytes& request) { return AskDone(request); },
      [](const PlaceInput& input, Bytes* to) {
        PutPose(input.start, to);
        PutPose(input.odometry, to);
      },
      [](Reply* reply) {
        const int32_t x_mm = reply->I32();
        const int32_t y_mm = reply->I32();
        return client::Pose{x_mm, y_mm, reply->U16()};
      });
}

std::vector<UnitsOutput> ConformanceClient::ToPoseUnits(const std::vector<UnitsInput>& inputs) {
  return InBatches<UnitsOutput>(
      kToPoseUnits, inputs, [this](const Bytes& request) { return AskDone(request); },
      [](const UnitsInput& input, Bytes* to) {
        PutU32(static_cast<uint32_t>(input.mm), to);
        PutU16(input.unit_10um, to);
      },
      [](Reply* reply) {
        const bool done = reply->U8() != 0;
        return UnitsOutput{done, reply->I32()};
      });
}

}  // namespace pheromone::conformance
