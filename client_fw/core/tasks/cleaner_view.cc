// What a cleaning robot tells and reads: its number and strings, the tags in range and what is on
// them. The other part is cleaner.cc.
#include "client_fw/core/tasks/cleaner.h"
#include "client_fw/core/tasks/robot_name.h"
#include "protocol/byte_order.h"

namespace pheromone {
namespace client {
namespace {

using protocol::GetI32;
using protocol::GetU16;
using protocol::kNoSlot;
using protocol::PutI32;
using protocol::PutU16;
using protocol::SymbolKind;

constexpr uint8_t kNotMet = 255;

uint8_t LengthOf(const char* text) {
  uint8_t length = 0;
  while (text[length] != 0) {
    ++length;
  }
  return length;
}

// How much of base + predicate has been met after `text`, of which `matched` was before; kNotMet if
// it differs.
uint8_t Match(const char* predicate, uint8_t matched, const uint8_t* text, uint8_t length) {
  const uint8_t base = static_cast<uint8_t>(sizeof(kCleaningBase) - 1);
  const uint8_t whole = static_cast<uint8_t>(base + LengthOf(predicate));
  for (uint8_t i = 0; i < length; ++i) {
    if (matched >= whole) {
      return kNotMet;
    }
    const char wanted = matched < base ? kCleaningBase[matched] : predicate[matched - base];
    if (static_cast<char>(text[i]) != wanted) {
      return kNotMet;
    }
    ++matched;
  }
  return matched;
}

bool IsWhole(const char* predicate, uint8_t matched) {
  return matched == sizeof(kCleaningBase) - 1 + LengthOf(predicate);
}

}  // namespace

// --- Numbers and strings

void Cleaner::AskForName(Conversation* conversation) {
  uint8_t* const data = exchange_.message.data;
  const int32_t string = first_string_ + name_ - 1;
  if (defined_) {
    AskForString(number_, string, conversation);
    return;
  }
  uint8_t length = kSymbolText;
  if (name_ == 0) {
    length = PutRobotName("cleaner-", id_, data);
  } else {
    data[kSymbolKind] = static_cast<uint8_t>(SymbolKind::kString);
    PutI32(data + kSymbolNumber, string);
    for (const char* text = OwnString(); *text != 0; ++text) {
      data[length++] = static_cast<uint8_t>(*text);
    }
  }
  Ask(protocol::kSymbol, length, conversation);
}

const char* Cleaner::TextOf(uint8_t term) {
  return term == kBase         ? kCleaningBase
         : term == kOccupiedBy ? "occupiedBy"
         : term == kCleanedBy  ? "cleanedBy"
         : term == kKeepAway   ? "keepAway"
                               : "cleanAgain";
}

const char* Cleaner::OwnString() const {
  return TextOf(static_cast<uint8_t>(name_ - 1));
}

void Cleaner::AskForString(int32_t robot, int32_t number, Conversation* conversation) {
  uint8_t* const data = exchange_.message.data;
  data[kResolveKind] = static_cast<uint8_t>(SymbolKind::kString);
  PutI32(data + kResolveRobot, robot);
  PutI32(data + kResolveNumber, number);
  data[kResolveOffset] = 0;
  Ask(protocol::kResolve, kResolveSize, conversation);
}

// A string is read back: SYMBOL is the one change whose length nothing tells.
void Cleaner::OnName() {
  if (name_ == 0) {
    number_ = GetI32(answer() + kDefinedNumber);
    name_ = 1;
    return;
  }
  defined_ = !defined_;
  if (defined_) {
    return;
  }
  const char* const text = OwnString();
  bool same = answer()[kResolvedLength] == LengthOf(text);
  for (uint8_t i = 0; same && text[i] != 0; ++i) {
    same = static_cast<char>(answer()[kResolvedText + i]) == text[i];
  }
  if (!same) {
    NextStrings();
  } else if (name_++ == kStrings) {
    Go(Phase::kLooking);
  }
}

void Cleaner::NextStrings() {
  first_string_ += kStrings;
  name_ = 1;
  defined_ = false;
}

// --- What is on the tags

void Cleaner::Look(uint16_t after, Conversation* conversation) {
  PutU16(exchange_.message.data + kScanAfter, after);
  Ask(protocol::kScan, kScanSize, conversation);
}

void Cleaner::OnLook(Conversation* conversation) {
  const uint8_t* row = answer() + kScannedRows;
  const uint8_t* const end = answer() + exchange_.message.length;
  const int32_t unit_10um = conversation->pose_unit_10um();
  uint16_t tag = 0;
  for (; row != end; row += kScannedRowSize) {
    tag = GetU16(row + kRowTag);
    Zone seen = Zone();
    seen.tag = tag;
    seen.dx_mm = Limited(protocol::GetI16(row + kRowDx) * unit_10um / 100);
    seen.dy_mm = Limited(protocol::GetI16(row + kRowDy) * unit_10um / 100);
    Zone* const zone = PlaceOf(seen);
    if (zone == nullptr) {
      continue;
    }
    if (zone->tag != tag) {
      *zone = seen;
    }
    zone->is_read = zone->is_read && zone->generation == GetU16(row + kRowGeneration);
    zone->is_seen = true;
    zone->dx_mm = seen.dx_mm;
    zone->dy_mm = seen.dy_mm;
  }
  if (answer()[kScannedMore] != 0 && tag != 0) {
    Look(tag, conversation);
    return;
  }
  looked_from_ = pose_;
  ForgetUnseen();
  if (zone_count_ == 0) {
    Pause();
  } else {
    Go(Phase::kReading);
  }
}

// Where it is in zones_ or may be put: of more than there is room for, the nearest are kept. Null:
// nowhere.
Cleaner::Zone* Cleaner::PlaceOf(const Zone& seen) {
  Zone* worst = nullptr;
  uint16_t worst_mm = DistanceMm(seen.dx_mm, seen.dy_mm);
  for (uint8_t i = 0; i < zone_count_; ++i) {
    Zone* const zone = &zones_[i];
    if (zone->tag == seen.tag) {
      return zone;
    }
    const uint16_t mm = zone->is_seen ? DistanceMm(zone->dx_mm, zone->dy_mm) : UINT16_MAX;
    if (mm > worst_mm) {
      worst = zone;
      worst_mm = mm;
    }
  }
  return zone_count_ < kZones ? &zones_[zone_count_++] : worst;
}

void Cleaner::ForgetUnseen() {
  uint8_t kept = 0;
  for (uint8_t i = 0; i < zone_count_; ++i) {
    if (zones_[i].is_seen) {
      zones_[kept++] = zones_[i];
    }
  }
  zone_count_ = kept;
}

void Cleaner::ReadNext(Conversation* conversation) {
  while (reading_ < zone_count_ && zones_[reading_].is_read) {
    ++reading_;
  }
  if (reading_ == zone_count_) {
    Choose();
    return;
  }
  goes_on_ = false;
  Read(0, conversation);
}

void Cleaner::Read(uint8_t slot, Conversation* conversation) {
  PutU16(exchange_.message.data + kReadTag, zones_[reading_].tag);
  exchange_.message.data[kReadSlot] = slot;
  Ask(protocol::kTagRead, kReadSize, conversation);
}

void Cleaner::OnRead(Conversation* conversation) {
  for (uint8_t i = 0; i < kBlockSize; ++i) {
    block_[i] = answer()[i];
  }
  Zone& zone = zones_[reading_];
  const uint16_t generation = GetU16(block_ + kBlockTagGeneration);
  if (!goes_on_) {
    zone.generation = generation;
    zone.signs = ZoneTag();
    zone.claim_slot = kNoSlot;
    zone.stamp_slot = kNoSlot;
  } else if (zone.generation != generation) {
    goes_on_ = false;  // it has changed on the way: once more
    Read(0, conversation);
    return;
  }
  if (block_[kBlockSlot] == kNoSlot) {
    zone.is_read = true;
    return;
  }
  Term meaning = kBase;
  if (Understand(&meaning)) {
    Note(meaning, conversation);
  } else {
    part_ = Word(protocol::kWordPredicateNamespace) == 0 ? 1 : 0;
    for (uint8_t& matched : matched_) {
      matched = 0;
    }
    Go(Phase::kResolving);
  }
}

int32_t Cleaner::Word(protocol::TagWord word) const {
  return GetI32(&block_[kBlockWords + 4 * word]);
}

// False if what the block's predicate means has yet to be asked.
bool Cleaner::Understand(Term* meaning) const {
  const int32_t author = Word(protocol::kWordAuthor);
  const int32_t name_space = Word(protocol::kWordPredicateNamespace);
  const int32_t predicate = Word(protocol::kWordPredicate);
  if (Word(protocol::kWordSubjectNamespace) != protocol::kTypeTag ||
      Word(protocol::kWordSubject) != zones_[reading_].tag) {
    return true;  // not about this zone
  }
  if (author == number_ && name_space == first_string_ + kBase) {
    *meaning = predicate == first_string_ + kOccupiedBy  ? kOccupiedBy
               : predicate == first_string_ + kCleanedBy ? kCleanedBy
                                                         : kBase;
    return true;
  }
  for (const Known& known : known_) {
    if (known.author == author && known.name_space == name_space && known.number == predicate) {
      *meaning = known.meaning;
      return true;
    }
  }
  return false;
}

// Takes the block in, and goes on to the next.
void Cleaner::Note(Term meaning, Conversation* conversation) {
  Zone& zone = zones_[reading_];
  const bool own = Word(protocol::kWordAuthor) == number_;
  if (meaning == kOccupiedBy && own) {
    zone.claim_slot = block_[kBlockSlot];
    zone.claim_generation = GetU16(block_ + kBlockSlotGeneration);
  } else if (meaning == kOccupiedBy) {
    zone.signs.is_occupied = true;
  } else if (meaning == kKeepAway) {
    zone.signs.is_closed = true;
  } else if (meaning != kBase) {
    const bool is_stamp = meaning == kCleanedBy;
    const uint32_t time_s = static_cast<uint32_t>(Word(protocol::kWordTime));
    uint32_t& latest_s = is_stamp ? zone.signs.cleaned_s : zone.signs.wanted_s;
    latest_s = time_s > latest_s ? time_s : latest_s;
    if (own && is_stamp) {
      zone.stamp_slot = block_[kBlockSlot];
      zone.stamp_generation = GetU16(block_ + kBlockSlotGeneration);
    }
  }
  phase_ = Phase::kReading;
  if (block_[kBlockNext] == kNoSlot) {
    zone.is_read = true;
    return;
  }
  goes_on_ = true;
  Read(block_[kBlockNext], conversation);
}

void Cleaner::Resolve(Conversation* conversation) {
  AskForString(Word(protocol::kWordAuthor),
               Word(part_ == 0 ? protocol::kWordPredicateNamespace : protocol::kWordPredicate),
               conversation);
}

void Cleaner::OnResolved(Conversation* conversation) {
  const uint8_t length = answer()[kResolvedLength];
  for (uint8_t i = 0; i < kPredicates; ++i) {
    matched_[i] = length > protocol::kMaxResolvedText
                      ? kNotMet  // longer than any of ours
                      : Match(TextOf(static_cast<uint8_t>(kOccupiedBy + i)), matched_[i],
                              answer() + kResolvedText, length);
  }
  if (part_ == 0) {
    part_ = 1;
    return;
  }
  Known& known = known_[next_known_];
  next_known_ = static_cast<uint8_t>((next_known_ + 1u) % kKnown);
  known.author = Word(protocol::kWordAuthor);
  known.name_space = Word(protocol::kWordPredicateNamespace);
  known.number = Word(protocol::kWordPredicate);
  known.meaning = kBase;
  for (uint8_t i = 0; i < kPredicates; ++i) {
    if (IsWhole(TextOf(static_cast<uint8_t>(kOccupiedBy + i)), matched_[i])) {
      known.meaning = static_cast<Term>(kOccupiedBy + i);
    }
  }
  Note(known.meaning, conversation);
}

}  // namespace client
}  // namespace pheromone
