#include "server/tags/symbols.h"

#include <limits>

#include "server/base/hash.h"

namespace pheromone::tags {
namespace {

// The bytes of the UTF-8 sequence at the beginning of `text`; 0 if there is no well-formed one.
size_t SequenceLength(std::string_view text) {
  const auto byte = [&](size_t i) {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u;
  };
  const auto continues = [&](size_t i) { return (byte(i) & 0xC0u) == 0x80u; };
  const unsigned first = byte(0);
  if (first < 0x80) {
    return 1;
  }
  if (first >= 0xC2 && first <= 0xDF) {
    return continues(1) ? 2 : 0;
  }
  if (first >= 0xE0 && first <= 0xEF) {
    const bool is_overlong = first == 0xE0 && byte(1) < 0xA0;
    const bool is_surrogate = first == 0xED && byte(1) > 0x9F;
    return continues(1) && continues(2) && !is_overlong && !is_surrogate ? 3 : 0;
  }
  if (first >= 0xF0 && first <= 0xF4) {
    const bool is_overlong = first == 0xF0 && byte(1) < 0x90;
    const bool is_too_large = first == 0xF4 && byte(1) > 0x8F;
    return continues(1) && continues(2) && continues(3) && !is_overlong && !is_too_large ? 4 : 0;
  }
  return 0;
}

uint64_t HashOf(size_t index, const Row& row) {
  return Hash64({'S', index, static_cast<uint64_t>(row.kind), static_cast<uint32_t>(row.robot),
                 static_cast<uint32_t>(row.number), HashText(row.text)});
}

}  // namespace

bool IsPlainUtf8(std::string_view text) {
  while (!text.empty()) {
    const size_t length = SequenceLength(text);
    const auto first = static_cast<unsigned char>(text.front());
    if (length == 0 || first < 0x20 || first == 0x7F) {
      return false;
    }
    text.remove_prefix(length);
  }
  return true;
}

DefineOutcome SymbolTables::CheckText(std::string_view text) const {
  return text.empty() || text.size() > kMaxTextBytes || !IsPlainUtf8(text)
             ? DefineOutcome::kBadValue
             : DefineOutcome::kDone;
}

DefineOutcome SymbolTables::Append(Row row) {
  size_t& of_robot = rows_of_robot_[row.robot];
  if (rows_.size() >= kMaxRows || of_robot >= kMaxRowsOfRobot) {
    return DefineOutcome::kFull;
  }
  ++of_robot;
  switch (row.kind) {
    case RowKind::kRobot:
      ids_.emplace(row.robot, row.text);
      robots_.emplace(row.text, row.robot);
      break;
    case RowKind::kString:
      strings_.emplace(std::pair(row.robot, row.number), row.text);
      numbers_.emplace(std::pair(row.robot, row.text), row.number);
      break;
    case RowKind::kMapping:
      owners_.emplace(row.robot, row.number);
      break;
  }
  hash_ += HashOf(rows_.size(), row);
  bytes_ += sizeof(Row) + row.text.size();
  rows_.push_back(std::move(row));
  return DefineOutcome::kDone;
}

DefineOutcome SymbolTables::DefineRobot(int32_t robot, std::string_view unique_id) {
  if (robot < 1 || CheckText(unique_id) != DefineOutcome::kDone) {
    return DefineOutcome::kBadValue;
  }
  const std::string* const present = UniqueIdOf(robot);
  if (present != nullptr && *present == unique_id) {
    return DefineOutcome::kDone;
  }
  if (present != nullptr || RobotOf(unique_id)) {
    return DefineOutcome::kTaken;
  }
  return Append({RowKind::kRobot, robot, robot, std::string(unique_id)});
}

DefineOutcome SymbolTables::AddRobot(std::string_view unique_id, int32_t* robot) {
  if (const std::optional<int32_t> known = RobotOf(unique_id)) {
    *robot = *known;
    return DefineOutcome::kDone;
  }
  int32_t free = 1;
  for (auto it = ids_.begin(); it != ids_.end() && it->first == free; ++it) {
    ++free;
  }
  *robot = free;
  return DefineRobot(free, unique_id);
}

DefineOutcome SymbolTables::DefineString(int32_t robot, int32_t number, std::string_view text) {
  if (number < 1 || CheckText(text) != DefineOutcome::kDone) {
    return DefineOutcome::kBadValue;
  }
  if (!HasRobot(robot)) {
    return DefineOutcome::kUnknownRobot;
  }
  const auto present = strings_.find({robot, number});
  if (present != strings_.end()) {
    return present->second == text ? DefineOutcome::kDone : DefineOutcome::kTaken;
  }
  return IsMapped(robot) ? DefineOutcome::kTaken
                         : Append({RowKind::kString, robot, number, std::string(text)});
}

DefineOutcome SymbolTables::DefineMapping(int32_t robot, int32_t owner) {
  if (!HasRobot(robot) || !HasRobot(owner)) {
    return DefineOutcome::kUnknownRobot;
  }
  if (robot == owner) {
    return DefineOutcome::kBadValue;
  }
  if (const auto present = owners_.find(robot); present != owners_.end()) {
    return present->second == owner ? DefineOutcome::kDone : DefineOutcome::kTaken;
  }
  const auto own = strings_.lower_bound({robot, std::numeric_limits<int32_t>::min()});
  if (own != strings_.end() && own->first.first == robot) {
    return DefineOutcome::kTaken;
  }
  return Append({RowKind::kMapping, robot, owner, {}});
}

const std::string* SymbolTables::UniqueIdOf(int32_t robot) const {
  const auto found = ids_.find(robot);
  return found != ids_.end() ? &found->second : nullptr;
}

std::optional<int32_t> SymbolTables::RobotOf(std::string_view unique_id) const {
  const auto found = robots_.find(unique_id);
  return found != robots_.end() ? std::optional(found->second) : std::nullopt;
}

int32_t SymbolTables::OwnerOf(int32_t robot) const {
  const auto found = owners_.find(robot);
  return found != owners_.end() ? found->second : robot;
}

const std::string* SymbolTables::StringOf(int32_t robot, int32_t number) const {
  const auto found = strings_.find({OwnerOf(robot), number});
  return found != strings_.end() ? &found->second : nullptr;
}

std::optional<int32_t> SymbolTables::NumberOf(int32_t robot, std::string_view text) const {
  const auto found = numbers_.find({OwnerOf(robot), std::string(text)});
  return found != numbers_.end() ? std::optional(found->second) : std::nullopt;
}

int32_t SymbolTables::FreeNumberOf(int32_t owner) const {
  int32_t free = 1;
  for (auto it = strings_.lower_bound({owner, 1});
       it != strings_.end() && it->first == std::pair(owner, free); ++it) {
    ++free;
  }
  return free;
}

bool SymbolTables::Restore(const Row& row) {
  const size_t before = rows_.size();
  DefineOutcome outcome = DefineOutcome::kBadValue;
  switch (row.kind) {
    case RowKind::kRobot:
      outcome = row.number == row.robot ? DefineRobot(row.robot, row.text) : outcome;
      break;
    case RowKind::kString:
      outcome = DefineString(row.robot, row.number, row.text);
      break;
    case RowKind::kMapping:
      outcome = row.text.empty() ? DefineMapping(row.robot, row.number) : outcome;
      break;
  }
  return outcome == DefineOutcome::kDone && rows_.size() == before + 1;
}

}  // namespace pheromone::tags
