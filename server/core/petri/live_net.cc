#include "server/core/petri/live_net.h"

#include <algorithm>
#include <string>
#include <utility>

#include "server/base/hash.h"

namespace pheromone::petri {
namespace {

constexpr uint16_t kMost = 0xFFFF;

const Arc* ArcOf(const std::vector<Arc>& arcs, uint32_t place) {
  const auto found =
      std::find_if(arcs.begin(), arcs.end(), [&](const Arc& arc) { return arc.place == place; });
  return found != arcs.end() ? &*found : nullptr;
}

}  // namespace

std::string_view TextOf(Refusal refusal) {
  switch (refusal) {
    case Refusal::kNotEnabled:
      return "the net does not permit it";
    case Refusal::kNoTicket:
      return "it has not presented itself there";
    case Refusal::kVersion:
      return "a record of an unknown version";
    case Refusal::kCrc:
      return "a record with a wrong CRC";
    case Refusal::kKind:
      return "a record that is not a robot's";
    case Refusal::kHash:
      return "a record of another net";
    case Refusal::kValue:
      return "a record of an unknown action";
  }
  return "";
}

LiveNet::LiveNet(std::shared_ptr<const LiveRules> rules) : rules_(std::move(rules)) {
  for (const Place& place : rules_->settings.net.places) {
    state_.marking.push_back(static_cast<int32_t>(place.tokens));
  }
  state_.source_left = rules_->settings.source;
  state_.tags.resize(rules_->tags.size());
}

// --- Firing

// As petri::IsEnabled; but a token too many for a place does not come into it.
bool LiveNet::CanFire(uint32_t transition) const {
  const Transition& it = rules_->settings.net.transitions[transition];
  const auto has = [&](const Arc& arc) {
    return state_.marking[arc.place] >= static_cast<int32_t>(arc.weight);
  };
  const auto fits = [&](const Arc& arc) {
    const Arc* const taken = ArcOf(it.takes, arc.place);
    return int64_t{state_.marking[arc.place]} + arc.weight -
               (taken != nullptr ? taken->weight : 0) <=
           kMaxTokens;
  };
  return std::all_of(it.takes.begin(), it.takes.end(), has) &&
         std::all_of(it.reads.begin(), it.reads.end(), has) &&
         std::none_of(it.inhibitors.begin(), it.inhibitors.end(), has) &&
         std::all_of(it.gives.begin(), it.gives.end(), fits);
}

void LiveNet::Fire(uint32_t transition, int32_t robot, uint64_t now_ms,
                   std::vector<Firing>* fired) {
  const Transition& it = rules_->settings.net.transitions[transition];
  for (const Arc& arc : it.takes) {
    state_.marking[arc.place] -= static_cast<int32_t>(arc.weight);
  }
  for (const Arc& arc : it.gives) {
    state_.marking[arc.place] += static_cast<int32_t>(arc.weight);
  }
  ++state_.counts.firings;
  state_.last_firing_ms = now_ms;
  fired->push_back({transition, robot});
}

// All or nothing.
bool LiveNet::FireFor(size_t tag, const RobotSays& says, uint64_t now_ms,
                      std::vector<Firing>* fired) {
  const LiveRules::AtTag& rules = rules_->tags[tag];
  const std::vector<uint32_t>& its = rules.by_action[static_cast<size_t>(says.action)];
  const auto enabled = [&] {
    return std::find_if(its.begin(), its.end(), [&](uint32_t it) { return CanFire(it); });
  };
  if (const auto found = enabled(); found != its.end()) {
    Fire(*found, says.robot, now_ms, fired);
    return true;
  }
  for (const uint32_t silent : rules.silent) {
    if (!CanFire(silent)) {
      continue;
    }
    const State before = state_;
    const size_t fired_before = fired->size();
    Fire(silent, says.robot, now_ms, fired);
    if (const auto found = enabled(); found != its.end()) {
      Fire(*found, says.robot, now_ms, fired);
      return true;
    }
    state_ = before;
    fired->resize(fired_before);
  }
  return false;
}

// What moves with the tokens; the amount that is granted.
uint16_t LiveNet::Carry(const RobotSays& says) {
  switch (says.action) {
    case LiveAction::kTake: {
      uint16_t granted = says.amount;
      if (rules_->settings.has_source) {
        granted = static_cast<uint16_t>(std::min<uint32_t>(granted, state_.source_left));
        state_.source_left -= granted;
      }
      state_.counts.taken += granted;
      return granted;
    }
    case LiveAction::kStoreA:
    case LiveAction::kStoreB:
      (says.action == LiveAction::kStoreA ? state_.pending_a : state_.pending_b) = says.amount;
      ++state_.counts.deposits;
      state_.counts.deposited += says.amount;
      return says.amount;
    default:
      return 0;
  }
}

// --- Robots

namespace {

template <typename Acks>
auto PlaceIn(Acks& acks, int32_t robot) {
  return std::lower_bound(acks.begin(), acks.end(), robot,
                          [](const LiveAck& it, int32_t number) { return it.robot < number; });
}

}  // namespace

const LiveAck* LiveNet::FindRobot(int32_t robot) const {
  const auto found = PlaceIn(state_.robots, robot);
  return found != state_.robots.end() && found->robot == robot ? &*found : nullptr;
}

void LiveNet::Answer(size_t tag, const LiveAck& ack) {
  state_.tags[tag].last = ack;
  const auto at = PlaceIn(state_.robots, ack.robot);
  if (at != state_.robots.end() && at->robot == ack.robot) {
    *at = ack;
  } else {
    state_.robots.insert(at, ack);
  }
}

LiveOutcome LiveNet::Take(size_t tag, const RobotSays& says, uint64_t now_ms,
                          std::vector<Firing>* fired) {
  if (const LiveAck* const known = FindRobot(says.robot)) {
    const auto behind = static_cast<uint8_t>(known->seq - says.seq);
    if (behind <= kOutOfDate) {
      ++state_.counts.records;
      ++state_.counts.repeats;
      state_.tags[tag].last = behind == 0 ? *known : state_.tags[tag].last;
      return behind == 0 ? known->outcome : LiveOutcome::kNone;
    }
  }
  LiveTagState& here = state_.tags[tag];
  const bool has_ticket = says.action != LiveAction::kPass || here.waiting.robot == says.robot;
  if (!has_ticket || !FireFor(tag, says, now_ms, fired)) {
    Refuse(
        {now_ms, static_cast<uint8_t>(tag), says.robot, says.seq, static_cast<uint8_t>(says.action),
         has_ticket ? Refusal::kNotEnabled : Refusal::kNoTicket},
        true);
    Answer(tag, state_.tags[tag].last);
    return LiveOutcome::kRefused;
  }
  ++state_.counts.records;
  const LiveAck ack{says.robot, says.seq, LiveOutcome::kAccepted, Carry(says)};
  Answer(tag, ack);
  if (says.action == LiveAction::kPresent) {
    here.waiting = ack;
  } else if (says.action == LiveAction::kPass) {
    here.waiting = {};
  }
  return LiveOutcome::kAccepted;
}

void LiveNet::Refuse(const LiveException& what, bool has_seq) {
  ++state_.counts.records;
  ++state_.counts.exceptions;
  if (has_seq) {
    state_.tags[what.tag].last = {what.robot, what.seq, LiveOutcome::kRefused, 0};
  }
  if (state_.exceptions.size() == kKeptExceptions) {
    state_.exceptions.erase(state_.exceptions.begin());
  }
  state_.exceptions.push_back(what);
}

// --- The environment

Advice LiveNet::Advised() const {
  for (const Advice advice : {Advice::kA, Advice::kB}) {
    const std::optional<uint32_t> place = rules_->advice[static_cast<size_t>(advice)];
    if (place && state_.marking[*place] > 0) {
      return advice;
    }
  }
  return Advice::kAny;
}

Advice LiveNet::Computed(uint64_t now_ms) const {
  return AdviceAt(rules_->settings.evaporation(), state_.trails, rules_->settings.dead_band_milli,
                  now_ms);
}

bool LiveNet::Holds(const LiveRules::Environment& it, uint64_t now_ms) const {
  switch (it.when) {
    case LiveRules::When::kEnabled:
    case LiveRules::When::kAdd:
      return true;
    case LiveRules::When::kAdvise:
      return Computed(now_ms) == it.what;
    case LiveRules::When::kAdviseAnew:
      return Computed(now_ms) == it.what && Advised() != it.what;
  }
  return false;
}

void LiveNet::Settle(uint64_t now_ms, std::vector<Firing>* fired) {
  for (int i = 0; i < kMaxFirings; ++i) {
    const auto found =
        std::find_if(rules_->environment.begin(), rules_->environment.end(),
                     [&](const auto& it) { return CanFire(it.transition) && Holds(it, now_ms); });
    if (found == rules_->environment.end()) {
      return;
    }
    Fire(found->transition, 0, now_ms, fired);
    if (found->when == LiveRules::When::kAdd) {
      const bool is_a = found->what == Advice::kA;
      Deposit(rules_->settings.evaporation(),
              std::exchange(is_a ? state_.pending_a : state_.pending_b, uint16_t{0}), now_ms,
              is_a ? &state_.trails.a : &state_.trails.b);
    }
  }
}

LiveSigns LiveNet::SignsAt(size_t tag) const {
  const LiveRules::AtTag& rules = rules_->tags[tag];
  const LiveTagState& it = state_.tags[tag];
  LiveSigns signs;
  signs.green = rules.green && state_.marking[*rules.green] > 0 && it.waiting.robot != 0;
  signs.advice = rules.has_advice ? Advised() : Advice::kAny;
  signs.ack = signs.green ? it.waiting : it.last;
  if (rules.has_source) {
    signs.left = rules_->settings.has_source
                     ? static_cast<uint16_t>(std::min<uint32_t>(state_.source_left, kMost))
                     : kMost;
  }
  return signs;
}

std::optional<uint64_t> LiveNet::NextChange(uint64_t now_ms) const {
  if (!rules_->advises_anew) {
    return std::nullopt;
  }
  return petri::NextChange(rules_->settings.evaporation(), state_.trails,
                           rules_->settings.dead_band_milli, Advised(), now_ms,
                           rules_->settings.period_ms);
}

// --- Configuration and state

void LiveNet::Adopt(std::shared_ptr<const LiveRules> rules, uint64_t now_ms) {
  const LiveSettings& before = rules_->settings;
  const LiveSettings& after = rules->settings;
  if (before.evaporation() != after.evaporation()) {
    for (Trail* const trail : {&state_.trails.a, &state_.trails.b}) {
      *trail = {ConcentrationAt(before.evaporation(), *trail, now_ms), now_ms};
    }
  }
  if (before.has_source != after.has_source || before.source != after.source) {
    state_.source_left = after.source;
  }
  rules_ = std::move(rules);
}

uint64_t LiveNet::Hash() const {
  return Hash64({'N', HashText(rules_->settings.name), HashFields(state_)});
}

void LiveNet::Save(ByteWriter* writer) const {
  EncodeFields(state_, writer);
}

void LiveNet::Restore(ByteReader* reader) {
  DecodeFields(reader, &state_);
  if (reader->ok()) {
    reader->Check(CheckState());
  }
}

Status LiveNet::CheckState() const {
  PHEROMONE_TRY_STATUS(CheckFields(state_, "net \"" + rules_->settings.name + "\""));
  const auto is_token_count = [](int32_t tokens) {
    return tokens >= 0 && tokens <= static_cast<int32_t>(kMaxTokens);
  };
  const auto is_tag = [&](const auto& it) { return it.tag < rules_->tags.size(); };
  const auto in_order = [](const LiveAck& one, const LiveAck& next) {
    return one.robot >= next.robot;
  };
  const bool fits = state_.marking.size() == rules_->settings.net.places.size() &&
                    state_.tags.size() == rules_->tags.size() &&
                    state_.exceptions.size() <= kKeptExceptions &&
                    std::all_of(state_.marking.begin(), state_.marking.end(), is_token_count) &&
                    std::all_of(state_.exceptions.begin(), state_.exceptions.end(), is_tag) &&
                    std::adjacent_find(state_.robots.begin(), state_.robots.end(), in_order) ==
                        state_.robots.end();
  return fits ? Ok() : Error{"net \"" + rules_->settings.name + "\": not a state of this net"};
}

}  // namespace pheromone::petri
