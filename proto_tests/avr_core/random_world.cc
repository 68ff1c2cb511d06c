#include "proto_tests/avr_core/random_world.h"

#include <algorithm>
#include <array>
#include <utility>

#include "client_fw/core/conversation.h"
#include "client_fw/core/steering/settings.h"
#include "proto_tests/avr_core/core_turn.h"
#include "protocol/byte_order.h"
#include "protocol/frame.h"

namespace pheromone::core_boundary {
namespace {

using protocol::Message;

sim::PioneerConfig PioneerOf(std::mt19937_64* random) {
  sim::PioneerConfig config;
  const auto models = sim::PioneerModels();
  config.model = models[(*random)() % models.size()];
  config.position_bits = (*random)() % 2 == 0 ? 15 : 16;
  config.errors.slip = 0.1;
  config.errors.seed = (*random)();
  return config;
}

void PutU16(uint32_t value, RandomWorld::Bytes* to) {
  std::array<uint8_t, 2> bytes{};
  protocol::PutU16(bytes.data(), static_cast<uint16_t>(value & 0xFFFF));
  to->insert(to->end(), bytes.begin(), bytes.end());
}

void PutU32(uint32_t value, RandomWorld::Bytes* to) {
  PutU16(value, to);
  PutU16(value >> 16, to);
}

void PutBytes(const RandomWorld::Bytes& bytes, RandomWorld::Bytes* to) {
  to->push_back(static_cast<uint8_t>(bytes.size()));
  to->insert(to->end(), bytes.begin(), bytes.end());
}

// The next list of bytes in a reply, whose length comes first.
std::span<const uint8_t> TakeBytes(const RandomWorld::Bytes& reply, size_t* at) {
  const size_t size = reply.at(*at);
  const std::span<const uint8_t> bytes(reply.data() + *at + 1, size);
  *at += 1 + size;
  return bytes;
}

}  // namespace

RandomWorld::RandomWorld(uint64_t seed)
    : random_(seed),
      pioneer_(PioneerOf(&random_), {}),
      clock_offset_ms_(0u - Below(20'000)),  // the clock wraps soon
      id_(static_cast<uint8_t>(1 + Below(254))),
      boot_counter_(static_cast<uint16_t>(random_())) {}

RandomWorld::Bytes RandomWorld::Start(bool keep) {
  if (!keep) {
    ++boot_counter_;
  }
  Bytes request = {kStart, static_cast<uint8_t>(keep ? 1 : 0), id_};
  PutU16(boot_counter_, &request);
  request.push_back(OneIn(4) ? 1 : 0);
  PutU32(Below(4000), &request);
  PutU32(0u - Below(4000), &request);
  PutU16(Below(65536), &request);
  const std::vector<std::pair<uint8_t, uint32_t>> settings = {
      {client::kTypeSetting, 1 + Below(3)},
      {client::kLawSetting, Below(4)},
      {client::kLayTrailSetting, Below(2)},
      {client::kLostTrailSetting, Below(4)},
      {client::kGainSetting, Below(client::kMaxGain + 1)},
      {client::kSpeedSetting, Below(600)},
      {client::kPeriodSetting, OneIn(4) ? 0 : 5 + Below(60)},
      {client::kFailSafeSetting, 300 + Below(400)},
      {client::kLostAfterSetting, 200 + Below(500)},
      {client::kStartReleasedSetting, OneIn(4) ? 0 : 1},
  };
  for (const auto& [id, value] : settings) {
    request.push_back(id);
    PutU16(value, &request);
  }
  return request;
}

RandomWorld::Bytes RandomWorld::NextTurn() {
  // Now and then the loop hangs for a while.
  now_ms_ += OneIn(5000) ? 200 + Below(2000) : 1 + Below(8);
  if (OneIn(300)) {
    SendCommand();
  }
  if (OneIn(300)) {
    SendForeign();
  }
  Bytes radio;
  while (!on_air_.empty() && on_air_.front().end_ms <= now_ms_ && radio.size() < kMaxBytes) {
    radio.push_back(on_air_.front().byte);
    on_air_.pop_front();
  }
  if (OneIn(400)) {
    radio.push_back(static_cast<uint8_t>(random_()));
  }
  pioneer_.AdvanceTo(now_ms_ * 1'000'000);
  Bytes robot = pioneer_.TakeOutput();
  robot.resize(std::min<size_t>(robot.size(), kMaxBytes));
  if (!robot.empty() && OneIn(20)) {
    robot[Below(static_cast<uint32_t>(robot.size()))] ^= static_cast<uint8_t>(1u << Below(8));
  }
  radio.resize(std::min<size_t>(radio.size(), kMaxBytes));

  Bytes request = {kTurn};
  PutU32(static_cast<uint32_t>(now_ms_) + clock_offset_ms_, &request);
  const bool carrier = !on_air_.empty() && on_air_.front().end_ms <= now_ms_ + 2;
  request.push_back(
      static_cast<uint8_t>((now_ms_ >= idle_at_ms_ ? kIdle : 0) | (carrier ? kCarrier : 0)));
  PutBytes(radio, &request);
  PutBytes(robot, &request);
  return request;
}

void RandomWorld::Take(const Bytes& reply) {
  size_t at = 0;
  const auto radio = TakeBytes(reply, &at);
  const auto robot = TakeBytes(reply, &at);
  if (!radio.empty()) {
    idle_at_ms_ = std::max(idle_at_ms_, now_ms_) + static_cast<int64_t>(radio.size()) + 2;
    ToServer(radio);
  }
  pioneer_.OnBytes(robot, now_ms_ * 1'000'000);
}

void RandomWorld::ToServer(std::span<const uint8_t> bytes) {
  for (const uint8_t byte : bytes) {
    if (server_.Push(byte, 0)) {
      OnRequest(server_.message());
    }
  }
}

void RandomWorld::OnRequest(const Message& request) {
  if (request.opcode == protocol::kCommandAck) {
    return;
  }
  ++requests_;
  if (OneIn(12)) {
    return;  // lost
  }
  Message answer;
  if (OneIn(25)) {
    protocol::ErrorAnswer error;
    error.id = id_;
    error.refused_opcode = request.opcode;
    error.reason = static_cast<protocol::Reason>(1 + Below(12));
    error.seq = protocol::IsMutating(request.opcode) ? request.data[0] : 0;
    Encode(error, &answer);
  } else if (!Answer(request, &answer)) {
    return;
  }
  // Mostly in time, sometimes just so, sometimes after the window.
  answered_ += SendFromServer(answer, idle_at_ms_ + 2 + Below(OneIn(10) ? 60 : 5)) ? 1u : 0u;
  if (OneIn(12)) {
    SendFromServer(answer, idle_at_ms_ + 30);  // once more
  }
}

bool RandomWorld::Answer(const Message& request, Message* answer) {
  protocol::HelloRequest hello;
  protocol::TraceRequest trace;
  protocol::SenseRequest sense;
  protocol::EventReport event;
  if (Decode(request, &hello)) {
    epoch_ = static_cast<uint16_t>(epoch_ + (OneIn(10) ? 1 : 0));
    protocol::HelloAnswer to;
    to.id = id_;
    to.nonce = static_cast<uint16_t>(hello.nonce + (OneIn(30) ? 1 : 0));
    to.protocol_version = OneIn(100) ? 9 : protocol::kProtocolVersion;
    to.epoch = epoch_;
    to.pose_unit_10um = std::array<uint16_t, 4>{100, 100, 200, 5000}[Below(4)];
    to.antenna_distance_mm = 300;
    to.type_mask = OneIn(40) ? 0x0010 : 0xFFFE;
    to.slot_ms = static_cast<uint8_t>(Below(3));
    to.response_window_ms = static_cast<uint8_t>(6 + Below(20));
    to.last_opcode = OneIn(2) ? 0x31 : 0;
    to.last_seq = static_cast<uint8_t>(random_());
    Encode(to, answer);
  } else if (Decode(request, &trace)) {
    Encode(protocol::TraceAnswer{id_, trace.type, trace.wide, trace.seq, Intensity(), Intensity()},
           answer);
  } else if (Decode(request, &sense)) {
    Encode(protocol::SenseAnswer{id_, sense.type, sense.wide, Intensity(), Intensity()}, answer);
  } else if (Decode(request, &event)) {
    Encode(protocol::EventAck{id_, event.seq}, answer);
  } else {
    return false;
  }
  return true;
}

// Long periods without anything to sense, and the ends of the range.
int16_t RandomWorld::Intensity() {
  if (now_ms_ / 2000 % 3 == 0) {
    return 0;
  }
  if (OneIn(10)) {
    return std::array<int16_t, 4>{INT16_MIN, INT16_MAX, -1, 1}[Below(4)];
  }
  return static_cast<int16_t>(static_cast<int32_t>(Below(16'000)) - (OneIn(4) ? 8'000 : 0));
}

bool RandomWorld::SendFromServer(const Message& message, int64_t begin_ms) {
  std::array<uint8_t, protocol::kMaxFrame> frame{};
  const size_t size = EncodeFrame(message, frame.data(), frame.size());
  int64_t at = std::max(begin_ms, free_at_ms_);
  bool intact = true;
  if (OneIn(15)) {
    frame[Below(static_cast<uint32_t>(size))] ^= static_cast<uint8_t>(1u << Below(8));
    intact = false;
  }
  for (size_t i = 0; i < size; ++i) {
    if (OneIn(500)) {
      intact = false;
      continue;  // this byte was not heard
    }
    at += OneIn(500) ? 25 : 1;
    on_air_.push_back({at, frame[i]});
  }
  free_at_ms_ = at;
  return intact;
}

void RandomWorld::SendCommand() {
  protocol::Command command;
  command.id = OneIn(10) ? protocol::kBroadcastId : id_;
  command.seq = OneIn(4) ? command_seq_ : ++command_seq_;
  command.code = static_cast<protocol::CommandCode>(1 + Below(9));
  if (OneIn(2)) {
    command.code = protocol::CommandCode::kResume;  // or it would stand most of the time
  }
  for (uint8_t& argument : command.arguments) {
    argument = static_cast<uint8_t>(OneIn(2) ? Below(12) : Below(256));
  }
  if (command.code == protocol::CommandCode::kSetParameter) {
    const uint32_t id = OneIn(4) ? client::kPoseX + Below(4) : Below(client::kEndOfSettings + 1);
    command.arguments[0] = static_cast<uint8_t>(id);
    protocol::PutU32(command.arguments + 1, Below(OneIn(2) ? 4 : 1000));
  }
  Message message;
  Encode(command, &message);
  SendFromServer(message, now_ms_);
  ++commands_;
}

void RandomWorld::SendForeign() {
  Message message;
  message.id = static_cast<uint8_t>(1 + Below(254));
  message.opcode = std::array<uint8_t, 8>{0x01, 0x81, 0x31, 0xB1, 0x52, 0xD1, 0x71, 0xF1}[Below(8)];
  message.length = static_cast<uint8_t>(Below(16));
  for (uint8_t i = 0; i < message.length; ++i) {
    message.data[i] = static_cast<uint8_t>(OneIn(3) ? protocol::kDle : Below(256));
  }
  SendFromServer(message, now_ms_);
}

}  // namespace pheromone::core_boundary
