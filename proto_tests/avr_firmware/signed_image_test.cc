// The AVR's image of a robot that signs its frames, between a radio channel with a naive server
// that signs its own (OpenSSL) and a simulated Pioneer.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iostream>
#include <optional>
#include <vector>

#include "client_fw/core/testing/naive_server.h"
#include "client_fw/core/testing/naive_signer.h"
#include "client_fw/sim/avr/avr_robot.h"
#include "client_fw/sim/avr/avr_settings.h"
#include "client_fw/sim/radio_medium.h"
#include "protocol/coded_frame.h"
#include "protocol/decoder.h"
#include "protocol/frame.h"
#include "protocol/messages.h"

namespace pheromone::firmware {
namespace {

using client::NaiveSigner;
using protocol::Message;

constexpr int64_t kMs = 1'000'000;
constexpr uint8_t kId = 7;
constexpr size_t kKeyAddress = 0x200;

// Of client_fw/boards/avr/eeprom.h, by the CRC's definition.
uint16_t CheckOf(const std::vector<uint8_t>& bytes) {
  unsigned crc = 0;
  for (const uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) {
      crc = (crc & 1u) != 0 ? (crc >> 1) ^ 0xA001u : crc >> 1;
    }
  }
  return static_cast<uint16_t>(~crc);
}

std::vector<uint8_t> EepromWith(const std::vector<uint8_t>& key) {
  client::Settings settings;
  settings.start_released = true;
  settings.lost_after_ms = 0;
  std::vector<uint8_t> eeprom = sim::AvrEepromWith(settings, 1);
  eeprom.resize(kKeyAddress, 0xFF);
  eeprom.insert(eeprom.end(), key.begin(), key.end());
  const uint16_t check = CheckOf(key);
  eeprom.push_back(static_cast<uint8_t>(check & 0xFF));
  eeprom.push_back(static_cast<uint8_t>(check >> 8));
  return eeprom;
}

class Station final : public sim::Station {
 public:
  explicit Station(sim::RadioMedium* medium) : medium_(medium), number_(medium->AddStation(this)) {}

  void OnByte(uint8_t byte, int64_t time_ns) override {
    if (sent_ns >= 0) {
      first_byte_ns = time_ns - medium_->byte_ns() - sent_ns;
      sent_ns = -1;
    }
    if (!decoder_.Push(byte, static_cast<uint32_t>(time_ns / kMs))) {
      return;
    }
    heard.push_back(decoder_.message());
    Message message = decoder_.message();
    if (!signer.Open(&message)) {
      return;
    }
    opened.push_back(message);
    if (signer.greets) {
      AnswerHello(signer.Greeting(message.id), 5);
    } else if (auto answer = server.AnswerTo(message); answer && !silent) {
      signer.Sign(&*answer);
      if (message.opcode == protocol::kHello) {
        AnswerHello(*answer, 3);
      } else {
        Send(*answer);
      }
    }
  }
  void OnTransmitted(int64_t time_ns) override { sent_ns = time_ns; }

  void SendSigned(Message message) {
    signer.Sign(&message);
    Send(message);
  }

  void Send(const Message& message) {
    uint8_t frame[protocol::kMaxFrame];
    medium_->Transmit(number_, {frame, protocol::EncodeFrame(message, frame, sizeof(frame))});
    sent_ns = -1;
  }

  void AnswerHello(const Message& answer, size_t rows) {
    if (coded) {
      SendCoded(answer, rows);
    } else {
      Send(answer);
    }
  }

  void SendCoded(const Message& message, size_t burst) {
    uint8_t frame[protocol::kMaxCoded];
    const size_t size = protocol::EncodeCoded(message, frame);
    for (size_t i = 0; i < burst; ++i) {
      frame[20 + i] ^= 0x55;  // each byte is in another row
    }
    medium_->Transmit(number_, {frame, size});
    sent_ns = -1;
  }

  client::NaiveServer server;
  NaiveSigner signer;
  std::vector<Message> heard;   // as sent
  std::vector<Message> opened;  // what was signed, without that
  bool coded = false;           // the answers to HELLO are, and damaged
  bool silent = false;          // answers HELLO's first step only
  int64_t sent_ns = -1;         // the end of what was sent, until a byte follows
  int64_t first_byte_ns = 0;    // from there to the beginning of that byte

 private:
  sim::RadioMedium* medium_;
  int number_;
  protocol::FrameDecoder decoder_{20};
};

sim::AvrRobotConfig Config(std::vector<uint8_t> eeprom) {
  sim::AvrRobotConfig config;
  config.machine.image = PHEROMONE_SIGNED_AVR_IMAGE;
  config.machine.eeprom = std::move(eeprom);
  config.id = kId;
  return config;
}

struct World {
  explicit World(std::vector<uint8_t> eeprom = EepromWith(NaiveSigner().key))
      : station(&medium), robot(Config(std::move(eeprom)), &medium) {
    protocol::HelloAnswer& hello = station.server.hello;
    hello.protocol_version = protocol::kProtocolVersion;
    hello.epoch = 3;
    hello.pose_unit_10um = 100;
    hello.antenna_distance_mm = 300;
    hello.type_mask = 0x007E;
    hello.slot_ms = 3;
    hello.response_window_ms = 60;
  }

  int64_t now_ms() const { return medium.now_ns() / kMs; }

  void Run(int64_t ms) {
    for (const int64_t end_ms = now_ms() + ms; now_ms() < end_ms;) {
      medium.AdvanceTo((now_ms() + 1) * kMs);
      robot.Step();
    }
  }

  sim::RadioMedium medium{{}};
  Station station;
  sim::AvrRobot robot;
};

TEST(SignedImage, DrivesAsTheServersSignedAnswersTell) {
  World world;
  world.Run(10'000);
  EXPECT_GT(world.robot.true_pose().x_m, 0.5);
  EXPECT_EQ(world.station.heard.size(), world.station.opened.size()) << "one was not signed so";
  EXPECT_EQ(1u, world.station.signer.hellos.size());
  EXPECT_GT(world.station.signer.session.received, 30u);

  protocol::Command halt{kId, 5, protocol::CommandCode::kHalt, {}};
  Message message;
  Encode(halt, &message);
  const auto acks = [&] {
    return std::count_if(world.station.opened.begin(), world.station.opened.end(),
                         [](const Message& it) { return it.opcode == protocol::kCommandAck; });
  };
  world.station.Send(message);
  world.Run(1000);
  EXPECT_EQ(0, acks());
  EXPECT_NE(0, world.robot.wheels().left_mm_s);
  for (int i = 0; i < 10 && acks() == 0; ++i) {  // it may collide with a request
    world.station.SendSigned(message);
    world.Run(370);
  }
  EXPECT_GE(acks(), 1);
  world.Run(1000);
  EXPECT_EQ(0, world.robot.wheels().left_mm_s);

  const sim::AvrMachine& machine = world.robot.machine();
  std::cout << machine.image_size().flash_bytes << " bytes of flash, "
            << machine.image_size().static_ram_bytes << " of RAM, deepest stack "
            << machine.stack_bytes() << " bytes\n";
  EXPECT_LE(machine.image_size().static_ram_bytes + machine.stack_bytes(), 3072u);
}

TEST(SignedImage, JoinsThoughTheAnswersToHelloAreDamaged) {
  World world;
  world.station.coded = true;
  world.Run(10'000);
  EXPECT_EQ(1u, world.station.signer.hellos.size());
  EXPECT_GT(world.station.signer.session.received, 30u);
  EXPECT_GT(world.robot.true_pose().x_m, 0.5);
}

// 62 bytes of DATA take the chip longest to verify, and the first turn begins at once. It may be
// taken until 3 ms after the ROUND, by the robot's clock.
TEST(SignedImage, TakesTheFirstTurnAfterTheLongestRound) {
  for (const bool coded : {false, true}) {
    World world;
    world.Run(3'000);
    world.station.silent = true;
    protocol::Round round;
    round.turn_ms = 34;
    round.turn_bytes = 28;
    round.slot_ms = 3;
    round.answer_count = 10;
    round.turn_count = 10;
    std::fill(round.answers, round.answers + 10, protocol::RoundAnswer{4096, 4096});
    for (uint8_t i = 0; i < 10; ++i) {
      round.turns[i] = static_cast<uint8_t>(kId + i);
    }
    int taken = 0;
    int64_t latest_ns = 0;
    constexpr int kRounds = 40;
    for (int i = 0; i < kRounds; ++i) {
      ++round.number;
      Message message;
      ASSERT_TRUE(Encode(round, &message));
      if (coded) {
        world.station.signer.Sign(&message);
        world.station.SendCoded(message, 6);
      } else {
        world.station.SendSigned(message);
      }
      while (world.station.sent_ns < 0) {
        world.Run(1);
      }
      const size_t heard = world.station.opened.size();
      world.Run(34);
      if (world.station.opened.size() > heard) {
        ++taken;
        latest_ns = std::max(latest_ns, world.station.first_byte_ns);
      }
      world.Run(316);
    }
    std::cout << (coded ? "coded: " : "plain: ") << taken << " of " << kRounds
              << " first turns, the latest " << static_cast<double>(latest_ns) / kMs
              << " ms after the ROUND, 2 ms of which are the modem's\n";
    EXPECT_GE(taken, kRounds - 2);  // the first ones may come in the midst of a request
    EXPECT_NE(0, world.robot.wheels().left_mm_s) << "its answers are in the ROUNDs";
  }
}

TEST(SignedImage, NumbersOfHelloGoOnAfterResetsThatKeepRam) {
  World world;
  world.station.silent = true;
  for (int i = 0; i < 30; ++i) {
    world.Run(300 + 37 * i % 200);
    world.robot.RunAhead((i * 7919 % 1000) * 1000);
    world.robot.Reset(i % 2 == 0 ? sim::AvrMachine::Cause::kWatchdog
                                 : sim::AvrMachine::Cause::kExternal);
  }
  const std::vector<uint16_t>& hellos = world.station.signer.hellos;
  EXPECT_GE(hellos.size(), 20u);
  for (size_t i = 1; i < hellos.size(); ++i) {
    EXPECT_GT(hellos[i], hellos[i - 1]) << i;
  }
  const uint16_t nonce = world.station.signer.client_nonce;
  world.robot.Reset(sim::AvrMachine::Cause::kPowerOn);
  const size_t before = hellos.size();
  world.Run(3'000);
  ASSERT_GT(hellos.size(), before);
  EXPECT_EQ(0, hellos[before]);
  EXPECT_NE(nonce, world.station.signer.client_nonce);
}

TEST(SignedImage, WithoutAValidKeyNothingIsSigned) {
  for (const int damage : {0, 5, 15, 16, 17, -1}) {
    std::vector<uint8_t> eeprom = EepromWith(NaiveSigner().key);
    if (damage < 0) {
      eeprom.resize(kKeyAddress);  // the rest is erased
    } else {
      eeprom[kKeyAddress + static_cast<size_t>(damage)] ^= 0x40;
    }
    World world(eeprom);
    world.Run(1'500);
    ASSERT_FALSE(world.station.heard.empty());
    EXPECT_TRUE(world.station.opened.empty());
    for (const Message& message : world.station.heard) {
      EXPECT_EQ(protocol::kHello, message.opcode);
      EXPECT_EQ(4, message.length);
    }
  }
}

}  // namespace
}  // namespace pheromone::firmware
