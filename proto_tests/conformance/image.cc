// The image for a microcontroller: reads a command from its port, runs the function under test,
// sends what came out. See commands.h. Polled, without interrupts: nothing here depends on time.
#include <stddef.h>
#include <stdint.h>

#include "client_fw/core/base/angle.h"
#include "client_fw/core/steering/careful.h"
#include "client_fw/core/steering/fuzzy.h"
#include "client_fw/core/steering/steering.h"
#include "client_fw/core/tasks/net_executor.h"
#include "proto_tests/conformance/commands.h"
#include "proto_tests/conformance/port.h"
#include "protocol/byte_order.h"
#include "protocol/crc16.h"
#include "protocol/decoder.h"
#include "protocol/fields.h"
#include "protocol/frame.h"

namespace pheromone {
namespace conformance {
namespace {

uint8_t request_bytes[kMaxRequest];
uint8_t reply_bytes[kMaxReply];

// The payload, taken piece by piece. Reading over its end gives zeros and makes the request bad.
class Reader {
 public:
  Reader(const uint8_t* bytes, uint16_t size) : at_(bytes), left_(size) {}

  bool good() const { return good_; }
  uint16_t left() const { return left_; }
  const uint8_t* at() const { return at_; }

  uint8_t U8() {
    const uint8_t* from = Take(1);
    return from != nullptr ? *from : 0;
  }
  uint16_t U16() {
    const uint8_t* from = Take(2);
    return from != nullptr ? protocol::GetU16(from) : 0;
  }
  int16_t I16() {
    const uint8_t* from = Take(2);
    return from != nullptr ? protocol::GetI16(from) : 0;
  }
  uint32_t U32() {
    const uint8_t* from = Take(4);
    return from != nullptr ? protocol::GetU32(from) : 0;
  }
  int32_t I32() {
    const uint8_t* from = Take(4);
    return from != nullptr ? protocol::GetI32(from) : 0;
  }

  void Refuse() {
    good_ = false;
    left_ = 0;
  }

 private:
  const uint8_t* Take(uint8_t size) {
    if (left_ < size) {
      Refuse();
      return nullptr;
    }
    const uint8_t* from = at_;
    at_ += size;
    left_ = static_cast<uint16_t>(left_ - size);
    return from;
  }

  const uint8_t* at_;
  uint16_t left_;
  bool good_ = true;
};

class Writer {
 public:
  bool good() const { return good_; }
  uint16_t size() const { return size_; }

  void U8(uint8_t value) {
    if (size_ == kMaxReply) {
      good_ = false;
      return;
    }
    reply_bytes[size_++] = value;
  }
  void U16(uint16_t value) {
    U8(static_cast<uint8_t>(value & 0xFFu));
    U8(static_cast<uint8_t>(value >> 8));
  }
  void I16(int16_t value) { U16(static_cast<uint16_t>(value)); }
  void U32(uint32_t value) {
    U16(static_cast<uint16_t>(value & 0xFFFFu));
    U16(static_cast<uint16_t>(value >> 16));
  }
  void I32(int32_t value) { U32(static_cast<uint32_t>(value)); }
  void Bytes(const uint8_t* bytes, size_t size) {
    for (size_t i = 0; i < size; ++i) {
      U8(bytes[i]);
    }
  }

 private:
  uint16_t size_ = 0;
  bool good_ = true;
};

void EncodeOne(Reader* in, Writer* out) {
  uint8_t wire[protocol::kMaxFrame];
  const uint16_t capacity = in->U16();
  protocol::Message message;
  message.id = in->U8();
  message.opcode = in->U8();
  message.length = in->U8();
  if (capacity > sizeof(wire) || in->left() > protocol::kMaxData) {
    in->Refuse();
    return;
  }
  for (uint8_t i = 0; in->left() > 0; ++i) {
    message.data[i] = in->U8();
  }
  out->Bytes(wire, protocol::EncodeFrame(message, wire, capacity));
}

void DecodeStream(Reader* in, Writer* out) {
  protocol::FrameDecoder decoder(in->U16());
  uint32_t now_ms = in->U32();
  Writer frames = *out;  // their number is known only afterwards
  frames.U8(0);
  uint8_t count = 0;
  while (in->left() > 0) {
    now_ms += in->U8();
    if (decoder.Push(in->U8(), now_ms)) {
      const protocol::Message& message = decoder.message();
      frames.U8(message.id);
      frames.U8(message.opcode);
      frames.U8(message.length);
      frames.Bytes(message.data, message.length);
      ++count;
    }
  }
  out->U8(count);
  *out = frames;
  const protocol::DecoderCounters& c = decoder.counters();
  out->U32(c.frames);
  out->U32(c.crc_errors);
  out->U32(c.bad_escapes);
  out->U32(c.oversize);
  out->U32(c.runts);
  out->U32(c.refused);
  out->U32(c.restarts);
  out->U32(c.timeouts);
  out->U32(c.ignored_bytes);
  out->U8(decoder.frame_open() ? 1 : 0);
}

void TellLengths(Writer* out) {
  uint8_t opcode = 0;
  do {
    const protocol::LengthRule rule = protocol::LengthOf(opcode);
    out->U8(rule.known ? 1 : 0);
    out->U8(rule.least);
    out->U8(rule.most);
  } while (++opcode != 0);
  uint8_t code = 0;
  do {
    out->U8(protocol::CommandArgumentLength(code));
  } while (++code != 0);
}

class MessageDecoder {
 public:
  MessageDecoder(const protocol::Message& message, Writer* out) : message_(message), out_(out) {}

  template <typename Struct>
  void Visit(Struct decoded) {
    if (Decode(message_, &decoded)) {
      out_->U8(number_);
      protocol::ForEachField(decoded, this);
      protocol::Message again;
      out_->U8(Encode(decoded, &again) ? 1 : 0);
      out_->U8(again.length);
      out_->U8(again.id);
      out_->U8(again.opcode);
      out_->Bytes(again.data, again.length);
    }
    ++number_;
  }

  template <typename Field>
  void Add(const char* /*name*/, Field field) {
    out_->I32(static_cast<int32_t>(field));
  }

 private:
  const protocol::Message& message_;
  Writer* out_;
  uint8_t number_ = 0;
};

void DecodeMessage(Reader* in, Writer* out) {
  protocol::Message message;
  message.id = in->U8();
  message.opcode = in->U8();
  if (in->left() > protocol::kMaxData) {
    in->Refuse();
    return;
  }
  while (in->left() > 0) {
    message.data[message.length++] = in->U8();
  }
  MessageDecoder decoder(message, out);
  protocol::ForEachMessage(&decoder);
}

void Steer(Reader* in, Writer* out) {
  while (in->left() > 0) {
    const client::Law law = static_cast<client::Law>(in->U8());
    const int16_t left = in->I16();
    const int16_t right = in->I16();
    const int16_t k_mm_s = in->I16();
    const client::WheelSpeeds wheels = client::Steer(law, left, right, k_mm_s, in->U8());
    out->I16(wheels.left_mm_s);
    out->I16(wheels.right_mm_s);
  }
}

void SteerFuzzy(Reader* in, Writer* out) {
  while (in->left() > 0) {
    client::FuzzyState state = {in->I16()};
    const int16_t left = in->I16();
    const int16_t right = in->I16();
    const client::WheelSpeeds wheels =
        client::SteerFuzzy(left, right, in->I16(), client::kTunedFuzzy, &state);
    out->I16(wheels.left_mm_s);
    out->I16(wheels.right_mm_s);
    out->I16(state.error);
  }
}

void FireNet(Reader* in, Writer* out) {
  client::NetTransition transitions[client::kMaxNetTransitions];
  const uint8_t count = in->U8();
  if (count > client::kMaxNetTransitions) {
    in->Refuse();
    return;
  }
  for (uint8_t i = 0; i < count; ++i) {
    transitions[i].takes = in->U32();
    transitions[i].gives = in->U32();
    transitions[i].inhibited_by = in->U32();
  }
  uint32_t marking = in->U32();
  while (in->left() > 0) {
    const uint8_t transition = in->U8();
    if (transition >= count) {
      in->Refuse();
      return;
    }
    const uint32_t before = marking;
    const client::Firing firing = client::Fire(transitions[transition], &marking);
    out->U8(static_cast<uint8_t>(firing));
    if (firing == client::Firing::kFired || marking != before) {  // the latter would be a bug
      out->U32(marking);
    }
  }
}

void SteerCareful(Reader* in, Writer* out) {
  while (in->left() > 0) {
    client::CarefulState state = client::kCarefulStart;
    state.plateau = in->I16();
    state.course = in->U16();
    state.turn = in->U16();
    state.mode = static_cast<client::CarefulState::Mode>(in->U8());
    state.aside = static_cast<client::CarefulState::Side>(in->U8());
    state.stronger = static_cast<client::CarefulState::Side>(in->U8());
    state.clear = in->U8();
    const int16_t left = in->I16();
    const int16_t right = in->I16();
    client::Notice(left, right, in->U16(), &state);
    const int16_t k_mm_s = in->I16();
    const client::WheelSpeeds all[] = {
        client::SteerCareful(left, right, k_mm_s, client::kUnitGain, state),
        client::Search(k_mm_s, state)};
    for (const client::WheelSpeeds& wheels : all) {
      out->I16(wheels.left_mm_s);
      out->I16(wheels.right_mm_s);
    }
    out->I16(state.plateau);
    out->U16(state.course);
    out->U16(state.turn);
    out->U8(static_cast<uint8_t>(state.mode));
    out->U8(static_cast<uint8_t>(state.aside));
    out->U8(static_cast<uint8_t>(state.stronger));
    out->U8(state.clear);
  }
}

void Sine(Reader* in, Writer* out) {
  while (in->left() > 0) {
    const client::BinaryAngle angle = in->U16();
    out->I16(client::SinQ14(angle));
    out->I16(client::CosQ14(angle));
  }
}

client::Pose TakePose(Reader* in) {
  client::Pose pose;
  pose.x_mm = in->I32();
  pose.y_mm = in->I32();
  pose.heading = in->U16();
  return pose;
}

void Place(Reader* in, Writer* out) {
  while (in->left() > 0) {
    const client::StartPose start(TakePose(in));
    const client::Pose placed = start.Place(TakePose(in));
    out->I32(placed.x_mm);
    out->I32(placed.y_mm);
    out->U16(placed.heading);
  }
}

void ToPoseUnits(Reader* in, Writer* out) {
  while (in->left() > 0) {
    const int32_t mm = in->I32();
    int32_t units = 0;
    const bool done = client::ToPoseUnits(mm, in->U16(), &units);
    out->U8(done ? 1 : 0);
    out->I32(done ? units : 0);
  }
}

void Answer(uint8_t command, Reader* in, Writer* out) {
  switch (command) {
    case kIdentify:
      out->U8(sizeof(int));
      out->U8(sizeof(void*));
      break;
    case kCrc:
      out->U16(protocol::Crc16(in->at(), in->left()));
      break;
    case kEncodeFrame:
      EncodeOne(in, out);
      break;
    case kDecodeStream:
      DecodeStream(in, out);
      break;
    case kLengths:
      TellLengths(out);
      break;
    case kDecodeMessage:
      DecodeMessage(in, out);
      break;
    case kSteer:
      Steer(in, out);
      break;
    case kFuzzy:
      SteerFuzzy(in, out);
      break;
    case kCareful:
      SteerCareful(in, out);
      break;
    case kFireNet:
      FireNet(in, out);
      break;
    case kSine:
      Sine(in, out);
      break;
    case kPlace:
      Place(in, out);
      break;
    case kToPoseUnits:
      ToPoseUnits(in, out);
      break;
    default:
      in->Refuse();
  }
}

void SendReply(uint8_t status, uint16_t size) {
  const uint16_t whole = static_cast<uint16_t>(size + 1u);
  Send(static_cast<uint8_t>(whole & 0xFFu));
  Send(static_cast<uint8_t>(whole >> 8));
  Send(status);
  for (uint16_t i = 0; i < size; ++i) {
    Send(reply_bytes[i]);
  }
}

// A request that does not fit is read to its end all the same, so that the next one is understood.
void Serve() {
  const uint8_t low = Receive();
  const uint16_t size = static_cast<uint16_t>(low | (static_cast<uint16_t>(Receive()) << 8));
  for (uint16_t i = 0; i < size; ++i) {
    const uint8_t byte = Receive();
    if (i < kMaxRequest) {
      request_bytes[i] = byte;
    }
  }
  Writer out;
  if (size == 0 || size > kMaxRequest) {
    SendReply(kRefused, 0);
    return;
  }
  Reader in(request_bytes + 1, static_cast<uint16_t>(size - 1u));
  Answer(request_bytes[0], &in, &out);
  if (in.good() && out.good()) {
    SendReply(kDone, out.size());
  } else {
    SendReply(kRefused, 0);
  }
}

}  // namespace
}  // namespace conformance
}  // namespace pheromone

int main() {
  pheromone::conformance::StartPort();
  pheromone::conformance::SendReply(pheromone::conformance::kDone, 0);
  for (;;) {
    pheromone::conformance::Serve();
  }
}
