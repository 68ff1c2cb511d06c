// An attacker on a radio channel, who has no key: of the protocol it knows the frames. It hears
// everything, also while it sends, keeps all of it, and sends when it likes.
//
//   Attacker attacker(/*seed=*/1, &medium);
//   for (...) { medium.AdvanceTo(...); attacker.Step(); }        // every millisecond
//   attacker.set_way(Attacker::Way::kJams);
//
// It sends what was heard, now or at any time before, as it was, with another ID, opcode, signature
// or bit, or in the order of a whole session; requests, commands, answers, ROUNDs and HELLOs of its
// own, without a signature, with one that is guessed, or with one that was heard. When it jams, it
// sends over others; otherwise in the silence between them, in turns, in openings, and directly
// after a request or before a ROUND. One thread; the same seed gives the same bytes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "client_fw/sim/radio_medium.h"
#include "protocol/decoder.h"
#include "protocol/messages.h"

namespace pheromone::attack {

/// In what it forges; the server never says it.
constexpr int16_t kForgedIntensity = 12'345;
constexpr int16_t kForgedArgument = -4321;

class Attacker final : public sim::Station {
 public:
  enum class Way : uint8_t { kListens, kSneaks, kJams };

  Attacker(uint64_t seed, sim::RadioMedium* medium);

  void OnByte(uint8_t byte, int64_t time_ns) override;
  void OnTransmitted(int64_t /*time_ns*/) override {}
  void Step();

  void set_way(Way way) { way_ = way; }
  /// By what they are.
  const std::map<std::string, int>& sent() const { return sent_; }

 private:
  using Bytes = std::vector<uint8_t>;
  using Message = protocol::Message;

  class Transmitter final : public sim::Station {
   public:
    void OnByte(uint8_t /*byte*/, int64_t /*time_ns*/) override {}
    void OnTransmitted(int64_t /*time_ns*/) override {}
  };
  struct Planned {
    int64_t at_ns;
    Bytes bytes;
  };

  void OnFrame(const Message& message);
  void OnRequest(const Message& request);
  void OnRound(const protocol::Round& round);
  void Plan(int64_t after_ns, Bytes bytes);
  void Send(const Bytes& bytes);

  Bytes Anything();
  Bytes Recorded(size_t newest);
  Bytes NextOfSession();
  Bytes Changed();
  Bytes RecordedCommand();
  Bytes Request(uint8_t id);
  Bytes Command();
  Bytes Answer(uint8_t id);
  Bytes ForgedRound(uint8_t number, const protocol::Round& like);
  Bytes Dressed(const char* what, Message message);

  uint32_t Draw(uint32_t below) { return static_cast<uint32_t>(random_() % below); }
  bool Chance(double probability) {
    return static_cast<double>(random_() >> 11) * 0x1p-53 < probability;
  }
  uint8_t AnyId();

  sim::RadioMedium* medium_;
  Transmitter transmitter_;
  int ear_;
  int number_;
  std::mt19937_64 random_;
  Way way_ = Way::kListens;
  protocol::FrameDecoder decoder_{20};
  Bytes burst_;  // since the last silence
  bool has_frame_ = false;
  int64_t last_byte_ns_ = 0;
  std::vector<Bytes> bursts_;                         // with a frame in it, as it was on the air
  std::vector<Message> messages_;                     // all
  std::vector<Message> commands_;                     // of them
  std::map<std::pair<uint8_t, bool>, Message> last_;  // by ID, and whether it is the server's
  protocol::Round round_;                             // the last one
  size_t session_ = 0;  // what is next of a session that is repeated, in bursts_
  int session_left_ = 0;
  std::deque<Planned> planned_;
  std::map<std::string, int> sent_;
};

}  // namespace pheromone::attack
