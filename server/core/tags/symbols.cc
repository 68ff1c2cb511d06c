#include "server/core/tags/symbols.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>

#include "server/base/hash.h"
#include "server/base/utf8.h"

namespace pheromone::tags {
namespace {

constexpr std::array<std::string_view, 3> kRowKindNames = {"robot", "string", "mapping"};

bool IsText(std::string_view text) {
  return !text.empty() && text.size() <= SymbolTables::kMaxTextBytes && IsPlainUtf8(text);
}

uint64_t HashOf(size_t index, const Row& row, const Maker& maker) {
  return Hash64({'S', index, static_cast<uint64_t>(row.kind), static_cast<uint32_t>(row.robot),
                 static_cast<uint32_t>(row.number), HashText(row.text), HashText(maker.link),
                 maker.id});
}

}  // namespace

std::string_view NameOf(RowKind kind) {
  const size_t at = static_cast<size_t>(kind) - 1;
  assert(at < kRowKindNames.size());
  return kRowKindNames[at];
}

std::optional<RowKind> RowKindNamed(std::string_view name) {
  const auto* const found = std::find(kRowKindNames.begin(), kRowKindNames.end(), name);
  return found != kRowKindNames.end()
             ? std::optional(static_cast<RowKind>(found - kRowKindNames.begin() + 1))
             : std::nullopt;
}

bool IsPlainUtf8(std::string_view text) {
  while (!text.empty()) {
    const Utf8Character it = FirstCharacter(text);
    if (it.state != Utf8Character::kValid || it.code_point < 0x20 || it.code_point == 0x7F) {
      return false;
    }
    text.remove_prefix(it.bytes);
  }
  return true;
}

// Whether the table has exactly this row.
bool SymbolTables::Has(const Row& row) const {
  switch (row.kind) {
    case RowKind::kRobot: {
      const auto found = ids_.find(row.robot);
      return found != ids_.end() && found->second == row.text;
    }
    case RowKind::kString: {
      const auto found = strings_.find({row.robot, row.number});
      return found != strings_.end() && found->second == row.text;
    }
    case RowKind::kMapping: {
      const auto found = owners_.find(row.robot);
      return found != owners_.end() && found->second == row.number;
    }
  }
  return false;
}

DefineOutcome SymbolTables::CheckRobot(const Row& row) const {
  if (row.robot < 1 || row.number != row.robot || !IsText(row.text)) {
    return DefineOutcome::kBadValue;
  }
  return HasRobot(row.robot) || RobotOf(row.text) ? DefineOutcome::kTaken : DefineOutcome::kDone;
}

DefineOutcome SymbolTables::CheckString(const Row& row) const {
  if (row.number < 1 || !IsText(row.text)) {
    return DefineOutcome::kBadValue;
  }
  if (!HasRobot(row.robot)) {
    return DefineOutcome::kUnknownRobot;
  }
  const bool is_bound = strings_.count({row.robot, row.number}) > 0;
  return is_bound || IsMapped(row.robot) ? DefineOutcome::kTaken : DefineOutcome::kDone;
}

DefineOutcome SymbolTables::CheckMapping(const Row& row) const {
  if (row.robot == row.number || !row.text.empty()) {
    return DefineOutcome::kBadValue;
  }
  if (!HasRobot(row.robot) || !HasRobot(row.number)) {
    return DefineOutcome::kUnknownRobot;
  }
  const auto own = strings_.lower_bound({row.robot, std::numeric_limits<int32_t>::min()});
  const bool has_strings = own != strings_.end() && own->first.first == row.robot;
  return has_strings || IsMapped(row.robot) ? DefineOutcome::kTaken : DefineOutcome::kDone;
}

DefineOutcome SymbolTables::TryDefine(const Row& row, const Maker& maker) const {
  if (Has(row)) {
    return DefineOutcome::kDone;
  }
  const DefineOutcome outcome = row.kind == RowKind::kRobot    ? CheckRobot(row)
                                : row.kind == RowKind::kString ? CheckString(row)
                                                               : CheckMapping(row);
  if (outcome != DefineOutcome::kDone) {
    return outcome;
  }
  const auto of_robot = rows_of_robot_.find(row.robot);
  if (rows_.size() >= kMaxRows ||
      (maker.is_robot() && rows_of_makers_ >= kMaxRows - kReservedRows) ||
      (of_robot != rows_of_robot_.end() && of_robot->second >= kMaxRowsOfRobot)) {
    return DefineOutcome::kFull;
  }
  const auto of_maker = rows_of_maker_.find(maker);
  return of_maker != rows_of_maker_.end() && of_maker->second >= kMaxRowsOfMaker
             ? DefineOutcome::kMakerFull
             : DefineOutcome::kDone;
}

DefineOutcome SymbolTables::Define(const Row& row, const Maker& maker) {
  const DefineOutcome outcome = TryDefine(row, maker);
  if (outcome == DefineOutcome::kDone && !Has(row)) {
    Append(row, maker);
  }
  return outcome;
}

void SymbolTables::Append(const Row& row, const Maker& maker) {
  if (maker.is_robot()) {
    ++rows_of_maker_[maker];
    ++rows_of_makers_;
  }
  ++rows_of_robot_[row.robot];
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
  hash_ += HashOf(rows_.size(), row, maker);
  encoded_bytes_ += 1 + 4 + 4 + 4 + row.text.size() + 4 + maker.link.size() + 1;
  rows_.push_back(row);
  makers_.push_back(maker);
}

std::set<int32_t> SymbolTables::UsedBeside(const Maker& maker, std::set<int32_t> used) const {
  for (size_t i = 0; i < rows_.size(); ++i) {
    if (makers_[i] != maker) {
      used.insert(rows_[i].robot);
    }
  }
  // Whose strings they use; a robot that is mapped to has its own mapping, and so on.
  const std::vector<int32_t> begin(used.begin(), used.end());
  for (int32_t robot : begin) {
    for (auto it = owners_.find(robot); it != owners_.end() && used.insert(it->second).second;
         it = owners_.find(it->second)) {
    }
  }
  return used;
}

SymbolTables SymbolTables::Without(const Maker& maker, const std::set<int32_t>& used) const {
  SymbolTables rest;
  for (size_t i = 0; i < rows_.size(); ++i) {
    if (makers_[i] != maker || used.count(rows_[i].robot) > 0) {
      rest.Append(rows_[i], makers_[i]);
    }
  }
  return rest;
}

DefineOutcome SymbolTables::AddRobot(std::string_view unique_id, int32_t* robot,
                                     const Maker& maker) {
  if (const std::optional<int32_t> known = RobotOf(unique_id)) {
    *robot = *known;
    return DefineOutcome::kDone;
  }
  int32_t free = 1;
  for (auto it = ids_.begin(); it != ids_.end() && it->first == free; ++it) {
    ++free;
  }
  *robot = free;
  return Define({RowKind::kRobot, free, free, std::string(unique_id)}, maker);
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

bool SymbolTables::Restore(const Row& row, const Maker& maker) {
  const size_t before = rows_.size();
  return Define(row, maker) == DefineOutcome::kDone && rows_.size() == before + 1;
}

}  // namespace pheromone::tags
