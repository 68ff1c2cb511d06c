#include "server/core/tags/plan.h"

#include <algorithm>
#include <set>

#include "server/base/hash.h"
#include "server/core/tags/symbols.h"

namespace pheromone::tags {

uint64_t HashOf(const NamedTag& it) {
  uint64_t hash =
      Hash64({'T', it.number, HashText(it.name), it.tag.slots().size(), it.tag.generation()});
  for (const Slot& slot : it.tag.slots()) {
    hash = HashStep(hash, slot.lease_end_ms << 16 | slot.generation);
    if (!slot.block.is_empty()) {
      const Words words = ToWords(slot.block);
      for (size_t i = 0; i < words.size(); i += 2) {
        hash = HashStep(hash, uint64_t{static_cast<uint32_t>(words[i])} << 32 |
                                  static_cast<uint32_t>(words[i + 1]));
      }
    }
  }
  return hash;
}

Status CheckSettings(const Settings& settings) {
  if (settings.tags.size() > kMaxTags) {
    return Error{"there are " + std::to_string(settings.tags.size()) + " tags, expected at most " +
                 std::to_string(kMaxTags)};
  }
  std::set<std::string_view> names;
  for (size_t i = 0; i < settings.tags.size(); ++i) {
    const std::string& name = settings.tags[i].name;
    if (name.empty() || name.size() > SymbolTables::kMaxTextBytes || !IsPlainUtf8(name)) {
      return Error{"tag " + std::to_string(i + 1) +
                   " has an invalid name, expected 1 to 255 bytes of UTF-8"};
    }
    if (!names.insert(name).second) {
      return Error{"two tags are named \"" + name + "\""};
    }
  }
  return Ok();
}

const Place* Directory::PlaceOf(uint16_t number) const {
  return number >= 1 && number <= places.size() && places[number - 1u] ? &*places[number - 1u]
                                                                       : nullptr;
}

std::optional<uint16_t> Directory::NumberOf(std::string_view name) const {
  const auto found = numbers.find(name);
  return found != numbers.end() ? std::optional(found->second) : std::nullopt;
}

void Directory::TakePlaces(const Settings& settings) {
  map.Clear();
  places.assign(slots.size(), std::nullopt);
  configured = settings.tags.size();
  for (const TagSettings& it : settings.tags) {
    const uint16_t number = numbers.find(it.name)->second;
    const Place place = {number, it.x_um, it.y_um, it.range_um};
    places[number - 1u] = place;
    map.Add(place);
  }
  privileged_ids = settings.privileged;
}

Result<Plan> MakePlan(const Survey& survey, const Settings& settings) {
  PHEROMONE_TRY_STATUS(CheckSettings(settings));
  Plan plan;
  plan.before = survey.directory;
  auto next = std::make_shared<Directory>();
  next->numbers = survey.directory->numbers;
  next->slots = survey.directory->slots;
  std::set<std::string_view> names;
  for (const TagSettings& it : settings.tags) {
    names.insert(it.name);
  }
  for (const auto& [name, number] : survey.directory->numbers) {
    if (names.count(name) == 0) {
      (survey.used[number - 1u] == 0 ? plan.forgotten : plan.kept).push_back(number);
    }
  }
  if (settings.tags.size() + plan.kept.size() > kMaxTags) {
    return Error{"with " + std::to_string(plan.kept.size()) +
                 " tags that are no longer configured but have blocks, there are more than " +
                 std::to_string(kMaxTags)};
  }
  std::erase_if(next->numbers, [&](const auto& it) {
    const bool goes = names.count(it.first) == 0 && survey.used[it.second - 1u] == 0;
    next->slots[it.second - 1u] = goes ? 0 : next->slots[it.second - 1u];
    return goes;
  });
  size_t free = 0;
  for (const TagSettings& it : settings.tags) {
    if (const std::optional<uint16_t> number = next->NumberOf(it.name)) {
      uint8_t& slots = next->slots[*number - 1u];
      if (slots != it.slots) {
        slots = it.slots;
        plan.resized.push_back(*number);
      }
      continue;
    }
    while (free < next->slots.size() && next->slots[free] != 0) {
      ++free;
    }
    next->slots.resize(std::max(next->slots.size(), free + 1));
    next->slots[free] = it.slots;
    const auto number = static_cast<uint16_t>(free + 1);
    next->numbers.emplace(it.name, number);
    plan.added.push_back(std::make_shared<NamedTag>(NamedTag{number, it.name, Tag(it.slots), 0}));
    plan.added.back()->hash = HashOf(*plan.added.back());
  }
  while (!next->slots.empty() && next->slots.back() == 0) {
    next->slots.pop_back();
  }
  next->TakePlaces(settings);
  plan.after = std::move(next);
  return plan;
}

}  // namespace pheromone::tags
