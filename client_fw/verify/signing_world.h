// A robot and the server on a signed link, and an attacker without a key who has the air to
// himself: the real ends of client_fw/core/signing and server/robots/signing. He hears every frame,
// keeps it, and gives to each end whatever he likes, whenever and as often as he likes: so the
// network loses, delays, repeats and reorders. He also changes whom a frame is from or for and what
// it says it is, and takes signatures off. The robot loses power or is reset, the server is
// restarted. An insider has the group's key besides, as any other robot of the link has.
//
// What an end accepts has to be what the other one has sent, in this order, and once.
//
// Left out of Key: tags and nonces, which follow from the rest.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "client_fw/core/signing/signing.h"
#include "protocol/frame.h"
#include "protocol/signing.h"
#include "server/robots/signing/signing.h"

namespace pheromone::verify {

/// Ends that are to be refuted.
enum class SigningMutant : uint8_t {
  kNone,
  kServerForgetsCounters,  ///< each frame leaves the counter as it was
  kRobotForgetsCounters,
  kNonceAgain,           ///< the server has one for all sessions
  kSessionAfterRestart,  ///< the server goes on with the session, and begins to count anew
  kNumberAgain,          ///< after a warm reset the robot's HELLOs begin at 0
  kTakesUnsigned,        ///< the server does
  kGroupKeyToOne,        ///< the robot takes a COMMAND of its own under the group's key
  kGroupKeyOfOne,        ///< the server takes a request under the group's key
};

/// How often each may happen.
struct SigningLimits {
  int greetings = 2;  ///< first HELLOs of the robot
  int answers = 3;    ///< of the server to them
  int requests = 2;
  int commands = 2;
  int to_all = 1;
  int power_losses = 0;
  int warm_resets = 0;
  int restarts = 0;
  bool insider = false;
  SigningMutant mutant = SigningMutant::kNone;
};

class SigningWorld {
 public:
  explicit SigningWorld(const SigningLimits& limits);

  std::string Key() const;
  /// Empty, or what was accepted that should not have been.
  const std::string& Wrong() const { return wrong_; }

  using Visit = std::function<void(std::string step, SigningWorld successor)>;
  void Next(const Visit& visit) const;

 private:
  /// On the air, and so in the attacker's memory.
  struct Heard {
    protocol::Message message;
    int content = 0;   ///< of a request or a COMMAND: its number; 0: of HELLO and its answer
    int greeting = 0;  ///< of what session it is; of HELLO and its answer: of what HELLO
    int counter = 0;
    bool operator<(const Heard& other) const;
  };
  /// What is known of an end's session, for Key.
  struct Session {
    int greeting = 0;  ///< 0: none
    int sent = 0;
    int heard = 0;
  };

  void PowerUp();
  void Greet();
  void Request();
  bool Command(uint8_t id);
  void Restart();
  void Say(Heard heard);
  bool GiveToServer(const Heard& heard);
  bool GiveToRobot(const Heard& heard);
  bool TakeGreeting(const Heard& heard);
  void Accept(const Heard& heard, const protocol::Message& message, std::vector<int>* accepted);
  std::vector<Heard> MadeOf(const Heard& heard) const;
  std::vector<Heard> MadeByInsider() const;
  bool IsOfGroup(const protocol::Message& message, protocol::MacUse use, int heard) const;

  SigningLimits left_;
  signing::Signing server_;
  signing::Signing fresh_;  // as it was when the present session began
  client::Signing robot_;
  signing::Key group_ = {};  // the group's key, as given to the robot
  uint16_t nonce_ = 0;
  uint16_t number_ = 0;
  int contents_ = 0;
  int nonces_ = 0;  // that the server has drawn
  int hellos_ = 0;
  int awaited_ = 0;  // the HELLO of which the robot awaits the answer
  int to_all_ = 0;
  int to_all_heard_ = 0;
  int greeted_ = 0;  // the last HELLO that the server has answered
  Session of_robot_;
  Session current_;
  Session next_;
  std::vector<Heard> air_;
  std::vector<int> by_server_;  // the contents that it has accepted, in order
  std::vector<int> by_robot_;
  std::vector<int> by_robot_of_all_;
  std::string wrong_;
};

}  // namespace pheromone::verify
