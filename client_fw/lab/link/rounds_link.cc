#include "client_fw/lab/link/rounds_link.h"

#include <algorithm>
#include <cassert>

#include "client_fw/lab/chance.h"

namespace pheromone::lab {

RoundsLink::RoundsLink(size_t robots, const RadioModel& model, uint64_t seed) : seed_(seed) {
  const size_t channels = ChannelsOf(robots, model.robots_per_channel);
  for (size_t i = 0; i < channels; ++i) {
    const size_t on_it = robots / channels + (i < robots % channels ? 1 : 0);
    channels_.push_back(FindMeasured(model.lost_percent, static_cast<int>(on_it)));
    assert(channels_.back() != nullptr);
  }
}

// As if the answer before it had come within a gap before the start.
LinkExchange RoundsLink::First(size_t robot) const {
  const MeasuredChannel& channel = ChannelOf(robot);
  const auto gap_ms =
      static_cast<double>(channel.gaps.At(PheromoneUniform(seed_, robot, 0, kLinkGap)));
  const auto answer_ms =
      static_cast<int64_t>(gap_ms * PheromoneUniform(seed_, robot, 0, kLinkPhase));
  const int64_t age_ms = channel.pose_ages.At(PheromoneUniform(seed_, robot, 0, kLinkAge));
  return {0, std::max<int64_t>(answer_ms - age_ms, 0), answer_ms};
}

LinkExchange RoundsLink::After(size_t robot, const LinkExchange& before) const {
  const MeasuredChannel& channel = ChannelOf(robot);
  const uint64_t number = before.number + 1;
  const int64_t answer_ms =
      before.answer_ms + channel.gaps.At(PheromoneUniform(seed_, robot, number, kLinkGap));
  const int64_t age_ms = channel.pose_ages.At(PheromoneUniform(seed_, robot, number, kLinkAge));
  return {number, std::max(answer_ms - age_ms, before.answer_ms), answer_ms};
}

}  // namespace pheromone::lab
