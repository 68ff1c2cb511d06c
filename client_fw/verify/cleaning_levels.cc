#include "client_fw/verify/cleaning_levels.h"

#include <algorithm>

namespace pheromone::verify {
namespace {

constexpr size_t kCheckEvery = size_t{1} << 12;  // steps, limits and progress

}  // namespace

LevelSearch::LevelSearch(CleaningWorld* world, const LevelBounds& bounds, const StartStates& starts,
                         const SearchLimits& limits)
    : world_(world),
      bounds_(bounds),
      starts_(starts),
      limits_(limits),
      keys_(*world, {.soil = true}, starts.soil_percent()),
      moment_(*world, {.soil = true, .leveled = world->all_zones()}, starts.soil_percent()) {}

bool LevelSearch::Run() {
  highest_.assign(world_->zones(), 0);
  bool is_good = true;
  starts_.Each([&](const CleaningState& start) {
    is_good = CheckLevels(start) && GoesOn();
    if (is_good) {
      Keep(start);
      ++unchecked_;
    }
    return is_good;
  });
  while (is_good && !layers_.empty() && layers_.begin()->first < bounds_.horizon) {
    const auto layer = layers_.extract(layers_.begin());
    layer_bytes_ = layer.mapped().bytes();
    max_bytes_ = std::max(max_bytes_, layer_bytes_);
    const StateSet& states = layer.mapped().states;
    const std::vector<uint8_t>& levels = layer.mapped().levels;
    for (size_t number = 0; number < states.size() && is_good; ++number) {
      ++explored_;
      CleaningState state = keys_.Unpack(states[number]);
      std::copy_n(levels.begin() + static_cast<ptrdiff_t>(number * world_->zones()),
                  world_->zones(), state.level.begin());
      state.clock = layer.key();
      is_good = Explore(state);
    }
  }
  return is_good;
}

bool LevelSearch::GoesOn() {
  if (unchecked_ < kCheckEvery) {
    return true;
  }
  unchecked_ = 0;
  size_t bytes = layer_bytes_ + moment_.bytes() + next_.capacity() * sizeof(CleaningSuccessor);
  for (const auto& [time, later] : layers_) {
    bytes += later.bytes();
  }
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
  moment_.Begin(first);
  for (CleaningState state; moment_.Take(&state);) {
    if (!GoesOn()) {
      return false;
    }
    world_->Next(state, &next_);
    steps_ += next_.size();
    unchecked_ += next_.size();
    for (const CleaningSuccessor& next : next_) {
      if (!IsGood(state.clock, next)) {
        return false;
      }
      if (next.step.passed == 0) {
        moment_.Add(next.state);
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
