#include "server/tags/store.h"

#include <algorithm>
#include <cassert>

#include "server/base/hash.h"

namespace pheromone::tags {
namespace {

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

uint64_t HashOf(const std::pair<std::string, uint8_t>& robot, int32_t author) {
  return Hash64({'A', HashText(robot.first), robot.second, static_cast<uint32_t>(author)});
}

}  // namespace

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

// --- Configuration

Status Store::Check(const Settings& settings) const {
  Status good = CheckSettings(settings);
  if (!good.ok()) {
    return good;
  }
  size_t kept = 0;  // of tags that are not in `settings`
  std::set<std::string_view> names;
  for (const TagSettings& it : settings.tags) {
    names.insert(it.name);
    const std::optional<uint16_t> number = NumberOf(it.name);
    if (!number) {
      continue;
    }
    const std::vector<Slot>& slots = Find(*number)->tag.slots();
    for (size_t i = it.slots; i < slots.size(); ++i) {
      if (!slots[i].block.is_empty()) {
        return Error{"tag \"" + it.name + "\" has a block in slot " + std::to_string(i) +
                     ", and would have only " + std::to_string(it.slots) +
                     " slots; erase that block first"};
      }
    }
  }
  for (const std::shared_ptr<NamedTag>& it : tags_) {
    kept += it != nullptr && it->tag.used() > 0 && names.count(it->name) == 0;
  }
  if (settings.tags.size() + kept > kMaxTags) {
    return Error{"with " + std::to_string(kept) +
                 " tags that are no longer configured but have blocks, there are more than " +
                 std::to_string(kMaxTags)};
  }
  return Ok();
}

void Store::Configure(const Settings& settings) {
  std::set<std::string_view> names;
  for (const TagSettings& it : settings.tags) {
    names.insert(it.name);
  }
  for (size_t i = 0; i < tags_.size(); ++i) {
    if (tags_[i] != nullptr && tags_[i]->tag.used() == 0 && names.count(tags_[i]->name) == 0) {
      TakeOut(*tags_[i]);
      numbers_.erase(tags_[i]->name);
      tags_[i] = nullptr;
    }
  }
  size_t free = 0;
  for (const TagSettings& it : settings.tags) {
    if (numbers_.count(it.name) == 0) {
      while (free < tags_.size() && tags_[free] != nullptr) {
        ++free;
      }
      tags_.resize(std::max(tags_.size(), free + 1));
      const auto number = static_cast<uint16_t>(free + 1);
      tags_[free] = std::make_shared<NamedTag>(NamedTag{number, it.name, Tag(it.slots), 0});
      numbers_.emplace(it.name, number);
      Settle(*tags_[free]);
    }
    const uint16_t number = numbers_.find(it.name)->second;
    if (Find(number)->tag.slots().size() != it.slots) {
      NamedTag& tag = Unsettle(number);
      tag.tag.Resize(it.slots);
      Settle(tag);
    }
  }
  while (!tags_.empty() && tags_.back() == nullptr) {
    tags_.pop_back();
  }
  TakePlaces(settings);
}

// All are there.
void Store::TakePlaces(const Settings& settings) {
  map_.Clear();
  places_.assign(tags_.size(), std::nullopt);
  configured_ = settings.tags.size();
  for (const TagSettings& it : settings.tags) {
    const uint16_t number = numbers_.find(it.name)->second;
    const Place place = {number, it.x_um, it.y_um, it.range_um};
    places_[number - 1u] = place;
    map_.Add(place);
  }
  privileged_ids_ = settings.privileged;
  FindPrivileged();
}

void Store::FindPrivileged() {
  privileged_.clear();
  for (const std::string& unique_id : privileged_ids_) {
    if (const std::optional<int32_t> robot = symbols_.RobotOf(unique_id)) {
      privileged_.push_back(*robot);
    }
  }
  std::sort(privileged_.begin(), privileged_.end());
}

// --- Tags

const Place* Store::PlaceOf(uint16_t number) const {
  return number >= 1 && number <= places_.size() && places_[number - 1u] ? &*places_[number - 1u]
                                                                         : nullptr;
}

const NamedTag* Store::Find(uint16_t number) const {
  return number >= 1 && number <= tags_.size() ? tags_[number - 1u].get() : nullptr;
}

std::optional<uint16_t> Store::NumberOf(std::string_view name) const {
  const auto found = numbers_.find(name);
  return found != numbers_.end() ? std::optional(found->second) : std::nullopt;
}

void Store::TakeOut(const NamedTag& tag) {
  hash_ -= tag.hash;
  sums_.slots -= tag.tag.slots().size();
  sums_.blocks -= tag.tag.used();
  sums_.leased -= tag.tag.leased();
  if (const std::optional<uint64_t> expiry = tag.tag.NextExpiry()) {
    leases_.erase({*expiry, tag.number});
  }
}

NamedTag& Store::Unsettle(uint16_t number) {
  std::shared_ptr<NamedTag>& it = tags_[number - 1u];
  TakeOut(*it);
  if (it.use_count() > 1) {
    it = std::make_shared<NamedTag>(*it);
  }
  return *it;
}

void Store::Settle(NamedTag& tag) {
  tag.hash = HashOf(tag);
  hash_ += tag.hash;
  sums_.slots += tag.tag.slots().size();
  sums_.blocks += tag.tag.used();
  sums_.leased += tag.tag.leased();
  if (const std::optional<uint64_t> expiry = tag.tag.NextExpiry()) {
    leases_.emplace(*expiry, tag.number);
  }
}

Written Store::Write(uint16_t number, const WriteRequest& request, uint64_t now_ms, int64_t utc_s) {
  NamedTag& it = Unsettle(number);
  const Written written = it.tag.Write(request, now_ms, PolicyAt(utc_s));
  Settle(it);
  if (written.outcome == WriteOutcome::kDone) {
    ++counters_.writes;
    counters_.dropped += written.dropped;
  }
  return written;
}

Written Store::TryWrite(uint16_t number, const WriteRequest& request, uint64_t now_ms,
                        int64_t utc_s) const {
  Tag copy = Find(number)->tag;
  return copy.Write(request, now_ms, PolicyAt(utc_s));
}

WriteOutcome Store::Erase(uint16_t number, uint8_t slot, int32_t author,
                          std::optional<uint16_t> expected) {
  NamedTag& it = Unsettle(number);
  const WriteOutcome outcome = it.tag.Erase(slot, author, expected, PolicyAt(0));
  Settle(it);
  return outcome;
}

void Store::Clear(uint16_t number, uint8_t slot) {
  const int32_t author = Find(number)->tag.slots()[slot].block.author;
  if (author != 0) {
    Erase(number, slot, author, {});  // as the author itself would
  }
}

void Store::Expire(uint64_t now_ms, size_t most) {
  for (; most > 0 && !leases_.empty() && leases_.begin()->first <= now_ms; --most) {
    NamedTag& it = Unsettle(leases_.begin()->second);
    const size_t before = it.tag.used();
    it.tag.Expire(now_ms);
    counters_.expired += before - it.tag.used();
    Settle(it);
  }
}

std::optional<uint64_t> Store::NextExpiry() const {
  return leases_.empty() ? std::nullopt : std::optional(leases_.begin()->first);
}

Figures Store::figures() const {
  Figures figures = sums_;
  figures.configured = configured_;
  figures.unconfigured = numbers_.size() - configured_;
  figures.definitions = symbols_.rows().size();
  return figures;
}

// --- Symbols and authors

DefineOutcome Store::Define(const Row& row) {
  const DefineOutcome outcome = symbols_.Define(row);
  if (row.kind == RowKind::kRobot && outcome == DefineOutcome::kDone) {
    FindPrivileged();
  }
  return outcome;
}

DefineOutcome Store::AddRobot(std::string_view unique_id, int32_t* robot) {
  const DefineOutcome outcome = symbols_.AddRobot(unique_id, robot);
  if (outcome == DefineOutcome::kDone) {
    FindPrivileged();
  }
  return outcome;
}

std::optional<int32_t> Store::AuthorOn(const std::string& link, uint8_t id) const {
  const auto found = authors_.find({link, id});
  return found != authors_.end() ? std::optional(found->second) : std::nullopt;
}

void Store::SetAuthorOn(const std::string& link, uint8_t id, int32_t author) {
  const auto [it, is_new] = authors_.try_emplace({link, id}, author);
  if (!is_new) {
    hash_ -= HashOf(it->first, it->second);
    it->second = author;
  }
  hash_ += HashOf(it->first, author);
}

}  // namespace pheromone::tags
