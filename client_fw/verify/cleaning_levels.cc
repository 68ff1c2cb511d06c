#include "client_fw/verify/cleaning_levels.h"

#include <algorithm>
#include <utility>

namespace pheromone::verify {
namespace {

constexpr size_t kCheckEvery = size_t{1} << 14;  // states, limits and progress

}  // namespace

bool LevelSearch::Run(const std::vector<CleaningState>& starts) {
  highest_.assign(world_->zones(), 0);
  for (const CleaningState& start : starts) {
    if (!CheckLevels(start)) {
      return false;
    }
    Keep(start);
  }
  while (!layers_.empty() && layers_.begin()->first < bounds_.horizon) {
    const auto layer = layers_.extract(layers_.begin());
    max_bytes_ = std::max(max_bytes_, layer.mapped().bytes());
    const StateSet& states = layer.mapped().states;
    const std::vector<uint8_t>& levels = layer.mapped().levels;
    for (size_t number = 0; number < states.size(); ++number) {
      if (explored_++ % kCheckEvery == 0) {
        size_t bytes = layer.mapped().bytes();
        for (const auto& [time, later] : layers_) {
          bytes += later.bytes();
        }
        if (!GoesOn(bytes)) {
          return false;
        }
      }
      CleaningState state = keys_.Unpack(states[number]);
      std::copy_n(levels.begin() + static_cast<ptrdiff_t>(number * world_->zones()),
                  world_->zones(), state.level.begin());
      state.clock = layer.key();
      if (!Explore(state)) {
        return false;
      }
    }
  }
  return true;
}

bool LevelSearch::GoesOn(size_t bytes) {
  max_bytes_ = std::max(max_bytes_, bytes);
  return bytes <= limits_.max_bytes && states_ <= limits_.max_states &&
         (!limits_.progress || limits_.progress({explored_, states_, bytes}));
}

void LevelSearch::Keep(const CleaningState& state) {
  const auto layer = layers_.try_emplace(state.clock, keys_.words()).first;
  const auto [number, is_new] = layer->second.states.Insert(keys_.Pack(state).key.data());
  std::vector<uint8_t>& levels = layer->second.levels;
  const size_t zones = world_->zones();
  if (is_new) {
    ++states_;
    levels.insert(levels.end(), state.level.begin(),
                  state.level.begin() + static_cast<ptrdiff_t>(zones));
    return;
  }
  uint8_t* const kept = &levels[number * zones];
  for (size_t zone = 0; zone < zones; ++zone) {
    kept[zone] = std::max(kept[zone], state.level[zone]);
  }
}

// All that may happen at the time of a state.
bool LevelSearch::Explore(const CleaningState& first) {
  moment_.assign(1, first);
  while (!moment_.empty()) {
    const CleaningState state = moment_.back();
    moment_.pop_back();
    world_->Next(state, &next_);
    steps_ += next_.size();
    for (const CleaningSuccessor& next : next_) {
      if (!IsGood(state.clock, next)) {
        return false;
      }
      if (next.step.passed == 0) {
        moment_.push_back(next.state);
      } else if (next.state.clock < bounds_.horizon) {
        Keep(next.state);
      }
    }
    if (next_.empty()) {
      wrong_ = "nothing can happen any more";
      wrong_time_ = state.clock;
      return false;
    }
  }
  return true;
}

bool LevelSearch::IsGood(int time, const CleaningSuccessor& next) {
  wrong_ = world_->Wrong(next.state);
  wrong_time_ = time;
  return wrong_.empty() && (next.step.action != CleaningAction::kSoils || CheckLevels(next.state));
}

bool LevelSearch::CheckLevels(const CleaningState& state) {
  for (size_t zone = 0; zone < world_->zones(); ++zone) {
    highest_[zone] = std::max<int>(highest_[zone], state.level[zone]);
    if (state.level[zone] >= bounds_.below) {
      wrong_ = "zone " + std::to_string(zone + 1) + " is soiled to " +
               std::to_string(state.level[zone]) + " %";
      wrong_zone_ = zone;
      return false;
    }
  }
  return true;
}

}  // namespace pheromone::verify
