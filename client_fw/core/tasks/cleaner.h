// A cleaning robot: it goes from zone to zone, each with a tag in its middle, and cleans the one
// that was cleaned longest ago, as Decide (cleaning.h) says, after Tammet, Vain and Kuusik 2006,
// section 4. Its zones are the tags in range of where it stands; it knows no others.
//
//   Cleaner cleaner(CleanerParameters(), id, boot_counter);
//   Robot<Board, Drive, Cleaner> robot(...);                // robot.h calls it, as Task
//
// What it leaves on a tag, and understands if another robot of any make has left it:
//
//   the tag, <base>occupiedBy, a robot    leased: until then nobody else cleans there
//   the tag, <base>cleanedBy, a robot     when that was is the block's time, by the server's clock
//
// and what an operator may write there, to stay:
//
//   the tag, <base>keepAway, anything     nobody goes there to clean
//   the tag, <base>cleanAgain, anything   whoever cleans there has to do so after the block's time
//
// To claim a zone it writes the first on condition that nobody has written on the tag since it was
// read, so that of two robots one gets it. Cleaning over, it writes the second into the same slot,
// on condition that its own claim is still there: stamp and release are one. Before its lease ends
// it stops cleaning, whatever happens. After a reset it goes on with a claim of its own.
//
// It needs a number and strings of its own (SYMBOL), which it defines first; predicates of other
// robots are resolved when they are met. No I/O, nothing allocated; one loop.
#pragma once

#include <stdint.h>

#include "client_fw/core/base/moment.h"
#include "client_fw/core/conversation.h"
#include "client_fw/core/medium/backoff.h"
#include "client_fw/core/requests/tag_data.h"
#include "client_fw/core/requests/tag_exchange.h"
#include "client_fw/core/steering/steering.h"
#include "client_fw/core/tasks/cleaning.h"
#include "protocol/tag_messages.h"

namespace pheromone {
namespace client {

/// What comes before "occupiedBy", "cleanedBy", "keepAway" and "cleanAgain".
constexpr char kCleaningBase[] = "http://robots.org/cleaning#";

struct CleanerParameters {
  uint16_t cleaning_ms = 10000;  ///< how long a zone takes
  uint16_t lease_s = 20;         ///< of a claim: longer than that
  uint16_t arrived_mm = 100;     ///< from the tag, to be in its zone
};

/// Other defaults than a follower's: a robot that senses nothing has not lost a trail, and half of
/// its turns are for tags.
inline void PrepareForCleaning(Parameters* parameters) {
  parameters->lost_after_ms = 0;
  parameters->fail_safe_ms = 1000;
}

class Cleaner {
 public:
  Cleaner(const CleanerParameters& parameters, uint8_t id, uint16_t boot_counter)
      : parameters_(parameters), random_(static_cast<uint8_t>(id + 101u), boot_counter), id_(id) {}

  // What Robot asks of a Task.
  void Step(Moment now_ms, const Odometry* odometry, Conversation* conversation);

  /// Zero unless the conversation lets the robot drive.
  WheelSpeeds Wheels(const Conversation& conversation) const;
  /// It has the zone for itself, and cleans it: the brush is where a robot's load is.
  bool HoldsLoad() const { return is_cleaning(); }
  bool is_cleaning() const { return phase_ == Phase::kCleaning; }
  /// The tag whose zone it cleans, or goes to; 0: none.
  uint16_t target() const { return target_; }
  /// Zones cleaned to the end, and stamped.
  uint32_t cleaned() const { return cleaned_; }
  /// Claims that another robot was faster with, or that ended before cleaning did.
  uint32_t lost_claims() const { return lost_claims_; }

 private:
  enum class Phase : uint8_t {
    kNaming,   // its own number, then its strings
    kLooking,  // which tags are in range
    kReading,  // their blocks
    kResolving,
    kMoving,
    kClaiming,
    kCleaning,
    kStamping,
    kTidying,  // its own stamp of before goes
    kPausing,
  };
  // Our strings, by their places after first_string_, and predicates that others write. What a
  // predicate means is one of them, too: kBase is any other.
  enum Term : uint8_t { kBase, kOccupiedBy, kCleanedBy, kKeepAway, kCleanAgain };

  // What is known of a tag: `is_read` as of its generation.
  struct Zone {
    uint16_t tag;
    uint16_t generation;
    int16_t dx_mm;  // from where the robot looked
    int16_t dy_mm;
    bool is_seen;  // in this look
    bool is_read;
    ZoneTag signs;       // occupied: by another robot
    uint8_t claim_slot;  // our own claim, or kNoSlot
    uint16_t claim_generation;
    uint8_t stamp_slot;  // our own stamp, or kNoSlot
    uint16_t stamp_generation;
  };
  // What a predicate of another robot means.
  struct Known {
    int32_t author;
    int32_t name_space;
    int32_t number;
    Term meaning;
  };
  enum : uint8_t {
    kZones = kMaxVisibleTags,
    kKnown = 8,
    kStrings = kCleanedBy + 1,
    kPredicates = kCleanAgain,
  };

  void Act(Conversation* conversation, uint16_t passed_ms);
  void OnAnswer(Conversation* conversation);
  void OnRefusal(protocol::Reason reason, Conversation* conversation);
  void Go(Phase phase);

  void AskForName(Conversation* conversation);
  static const char* TextOf(uint8_t term);
  const char* OwnString() const;
  void AskForString(int32_t robot, int32_t number, Conversation* conversation);
  void OnName();
  void NextStrings();
  void Look(uint16_t after, Conversation* conversation);
  void OnLook(Conversation* conversation);
  Zone* PlaceOf(const Zone& seen);
  void ForgetUnseen();
  void ReadNext(Conversation* conversation);
  void Read(uint8_t slot, Conversation* conversation);
  void OnRead(Conversation* conversation);
  int32_t Word(protocol::TagWord word) const;
  bool Understand(Term* meaning) const;
  void Note(Term meaning, Conversation* conversation);
  void Resolve(Conversation* conversation);
  void OnResolved(Conversation* conversation);
  void Choose();
  void Move(const Conversation& conversation);
  void Write(Term predicate, uint8_t slot, uint16_t expected, uint16_t lease_s,
             Conversation* conversation);
  void Claim(Conversation* conversation);
  void Pause();
  void PutChange(uint8_t slot, uint16_t expected);
  void Ask(uint8_t opcode, uint8_t length, Conversation* conversation);
  const uint8_t* answer() const { return exchange_.message.data; }
  static int16_t Limited(int32_t mm);
  static uint16_t DistanceMm(int16_t dx_mm, int16_t dy_mm);
  static int16_t FromHere(int16_t from_there_mm, int32_t there_mm, int32_t here_mm);
  bool IsAt(const Zone& zone) const;

  CleanerParameters parameters_;
  Random random_;
  uint8_t id_;
  Phase phase_ = Phase::kNaming;
  bool asked_ = false;    // exchange_ is under way
  uint8_t name_ = 0;      // kNaming: 0 the robot's number, then the strings
  bool defined_ = false;  // kNaming: the string is to be read back
  uint8_t zone_count_ = 0;
  uint8_t reading_ = 0;                // kReading: of zones_
  bool goes_on_ = false;               // kReading: beyond the tag's first block
  uint8_t part_ = 0;                   // kResolving: 0 the namespace, 1 the number
  uint8_t matched_[kPredicates] = {};  // kResolving: characters of each predicate met so far
  uint8_t next_known_ = 0;
  uint8_t moving_to_ = 0;  // kMoving: of zones_
  uint8_t claim_slot_ = 0;
  uint16_t claim_generation_ = 0;
  uint16_t target_ = 0;
  int32_t first_string_ = 1;
  int32_t number_ = 0;  // of this robot, as an author
  uint32_t now_ms_ = 0;
  uint32_t since_ms_ = 0;    // of this phase
  uint32_t claimed_ms_ = 0;  // when the claim was asked for
  uint16_t cleaning_left_ms_ = 0;
  uint16_t pause_ms_ = 0;
  uint32_t cleaned_ = 0;
  uint32_t lost_claims_ = 0;
  Pose pose_ = Pose{0, 0, 0};
  WheelSpeeds wheels_ = WheelSpeeds{0, 0};
  Pose looked_from_ = Pose{0, 0, 0};
  uint8_t block_[kBlockSize] = {};  // DATA of the last answer to READ
  Zone zones_[kZones] = {};
  Known known_[kKnown] = {};
  TagExchange exchange_;
};

}  // namespace client
}  // namespace pheromone
