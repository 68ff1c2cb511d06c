// Which zone a cleaning robot cleans next, by the tags it sees (Tammet, Vain and Kuusik 2006,
// section 4.3).
//
//   CleaningView view{};
//   view.tags[0].cleaned_s = cleaned_s;  // the robot's own zone, then the others that it sees
//   view.count = 1;
//   const CleaningDecision decision = Decide(view, random);
//   if (decision.act == CleaningAct::kMove) ...  // to the zone of view.tags[decision.tag]
//
// The zone cleaned longest ago is next, of those that no robot occupies. If it is the robot's own,
// it cleans; else it goes there and looks again. The paper leaves open what happens between equal
// time stamps: here a robot stays if it may, since robots that go on from equal to equal can wander
// for ever. If all zones in sight are occupied, it waits.
//
// An operator's signs (section 3) go before that: a robot is kept away from a zone as if it were
// occupied for ever, and a zone that is to be cleaned again counts as never cleaned, until it has
// been cleaned later than the sign was written. Neither sign needs to be erased by a robot.
//
// Time stamps are unsigned Unix seconds, 0 for a zone never cleaned; they do not wrap before 2106.
//
// A pure function; any thread, any interrupt.
#pragma once

#include <stdint.h>

namespace pheromone {
namespace client {

/// The robot's own zone and up to 7 others.
constexpr uint8_t kMaxVisibleTags = 8;

struct ZoneTag {
  bool is_occupied;    ///< a robot is cleaning there
  bool is_closed;      ///< a sign keeps robots away
  uint32_t cleaned_s;  ///< when it was cleaned last
  uint32_t wanted_s;   ///< when a sign was written that it is to be cleaned again
};

struct CleaningView {
  ZoneTag tags[kMaxVisibleTags];  ///< the robot's own zone first
  uint8_t count;                  ///< of `tags`, up to kMaxVisibleTags
};

enum class CleaningAct : uint8_t {
  kWait,
  kClean,  ///< the robot's own zone
  kMove,
};

struct CleaningDecision {
  CleaningAct act;
  uint8_t tag;      ///< the place in the view: 0 to clean, another to move there
  uint8_t choices;  ///< how many decisions `pick` chose from; 0 to wait
};

/// `pick` modulo the number of choices decides between other zones of equal time stamp: a random
/// number for a robot, all from 0 to choices - 1 for a proof.
CleaningDecision Decide(const CleaningView& view, uint8_t pick);

}  // namespace client
}  // namespace pheromone
