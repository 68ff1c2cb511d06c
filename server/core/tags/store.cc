#include "server/core/tags/store.h"

#include <algorithm>
#include <cassert>

#include "server/base/hash.h"

namespace pheromone::tags {
namespace {

uint64_t HashOf(const std::pair<std::string, uint8_t>& robot, int32_t author) {
  return Hash64({'A', HashText(robot.first), robot.second, static_cast<uint32_t>(author)});
}

}  // namespace

// --- Configuration

Status Store::Check(const Settings& settings) const {
  const Result<Plan> plan = MakePlan(Look(), settings);
  return plan.ok() ? Check(plan.value()) : plan.error();
}

void Store::Configure(const Settings& settings) {
  Take(MakePlan(Look(), settings).value());
}

bool Store::IsCurrent(const Plan& plan) const {
  const auto is_used = [this](uint16_t number) { return used_[number - 1u] > 0; };
  return plan.before == directory_ &&
         std::none_of(plan.forgotten.begin(), plan.forgotten.end(), is_used) &&
         std::all_of(plan.kept.begin(), plan.kept.end(), is_used);
}

Status Store::Check(const Plan& plan) const {
  for (const uint16_t number : plan.resized) {
    const NamedTag& it = *Find(number);
    const size_t next = plan.after->slots[number - 1u];
    for (size_t i = next; i < it.tag.slots().size(); ++i) {
      if (!it.tag.slots()[i].block.is_empty()) {
        return Error{"tag \"" + it.name + "\" has a block in slot " + std::to_string(i) +
                     ", and would have only " + std::to_string(next) +
                     " slots; erase that block first"};
      }
    }
  }
  return Ok();
}

void Store::Take(const Plan& plan) {
  assert(IsCurrent(plan) && Check(plan).ok());
  for (const uint16_t number : plan.forgotten) {
    TakeOut(*tags_[number - 1u]);
    tags_[number - 1u] = nullptr;
  }
  for (const uint16_t number : plan.resized) {
    NamedTag& tag = Unsettle(number);
    tag.tag.Resize(plan.after->slots[number - 1u]);
    Settle(tag);
  }
  const size_t numbers = plan.after->slots.size();
  tags_.resize(std::max(tags_.size(), numbers));
  used_.resize(std::max(used_.size(), numbers));
  for (const std::shared_ptr<NamedTag>& it : plan.added) {
    tags_[it->number - 1u] = it;
    hash_ += it->hash;
    sums_.slots += it->tag.slots().size();
  }
  tags_.resize(numbers);
  used_.resize(numbers);
  directory_ = plan.after;
  FindPrivileged();
}

void Store::FindPrivileged() {
  privileged_.clear();
  for (const std::string& unique_id : directory_->privileged_ids) {
    if (const std::optional<int32_t> robot = symbols_.RobotOf(unique_id)) {
      privileged_.push_back(*robot);
    }
  }
  std::sort(privileged_.begin(), privileged_.end());
}

// --- Tags

const NamedTag* Store::Find(uint16_t number) const {
  return number >= 1 && number <= tags_.size() ? tags_[number - 1u].get() : nullptr;
}

void Store::TakeOut(const NamedTag& tag) {
  hash_ -= tag.hash;
  sums_.slots -= tag.tag.slots().size();
  sums_.blocks -= used_[tag.number - 1u];
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
  const size_t used = tag.tag.used();
  used_[tag.number - 1u] = static_cast<uint8_t>(used);
  sums_.blocks += used;
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
  figures.configured = directory_->configured;
  figures.unconfigured = directory_->numbers.size() - directory_->configured;
  figures.definitions = symbols_.rows().size();
  return figures;
}

// --- Symbols and authors

DefineOutcome Store::Define(const Row& row, const Maker& maker) {
  const DefineOutcome outcome = symbols_.Define(row, maker);
  if (row.kind == RowKind::kRobot && outcome == DefineOutcome::kDone) {
    FindPrivileged();
  }
  return outcome;
}

DefineOutcome Store::AddRobot(std::string_view unique_id, int32_t* robot, const Maker& maker) {
  const DefineOutcome outcome = symbols_.AddRobot(unique_id, robot, maker);
  if (outcome == DefineOutcome::kDone) {
    FindPrivileged();
  }
  return outcome;
}

// A block uses its author, all strings of the one whose strings that uses, and the robots that it
// is about.
std::set<int32_t> Store::UsedBeside(const Maker& maker) const {
  std::set<int32_t> used;
  for (size_t i = 0; i < tags_.size(); ++i) {
    if (used_[i] == 0) {
      continue;
    }
    for (const Slot& slot : tags_[i]->tag.slots()) {
      const Block& block = slot.block;
      if (!block.is_empty()) {
        used.insert(block.author);
      }
      for (const Term& term : {block.subject, block.object}) {
        if (term.is(TypeCode::kRobot)) {
          used.insert(term.value);
        }
      }
    }
  }
  return symbols_.UsedBeside(maker, std::move(used));
}

size_t Store::CountForgettable(const Maker& maker) const {
  const std::set<int32_t> used = UsedBeside(maker);
  size_t count = 0;
  for (size_t i = 0; i < symbols_.rows().size(); ++i) {
    const bool is_its = symbols_.makers()[i] == maker;
    count += static_cast<size_t>(is_its && used.count(symbols_.rows()[i].robot) == 0);
  }
  return count;
}

void Store::Forget(const Maker& maker) {
  SymbolTables rest = symbols_.Without(maker, UsedBeside(maker));
  if (const auto frozen = frozen_symbols_.lock(); frozen && !*frozen) {
    *frozen = std::move(symbols_);
  }
  symbols_ = std::move(rest);
  for (auto it = authors_.begin(); it != authors_.end();) {
    if (symbols_.HasRobot(it->second)) {
      ++it;
    } else {
      hash_ -= HashOf(it->first, it->second);
      it = authors_.erase(it);
    }
  }
  FindPrivileged();
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
