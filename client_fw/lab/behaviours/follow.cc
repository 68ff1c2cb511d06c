#include "client_fw/lab/behaviours/follow.h"

#include <cmath>
#include <vector>

#include "client_fw/core/requests/request_memory.h"
#include "client_fw/core/steering/behaviour.h"

namespace pheromone::lab {
namespace {

client::Parameters Released(const client::Settings& settings) {
  client::Parameters parameters;
  static_cast<client::Settings&>(parameters) = settings;
  parameters.start_released = true;
  return parameters;
}

class FollowBehaviour : public Behaviour {
 public:
  FollowBehaviour(const client::Settings& settings, uint16_t quanta, size_t robots)
      : quanta_(quanta) {
    const client::Behaviour one(Released(settings), &memory_);
    drivers_.reserve(robots);
    for (size_t i = 0; i < robots; ++i) {
      drivers_.emplace_back(one, &memory_);
    }
  }

  Status Act(const PheromoneView& view, const PheromoneActions& actions, size_t first,
             size_t count) override {
    const auto elapsed_ms = static_cast<uint16_t>(std::lround(view.step_s * 1000));
    for (size_t i = first; i < first + count; ++i) {
      client::Behaviour& driver = drivers_[i - view.group_first];
      driver.Advance(elapsed_ms);
      if (view.answered[i] == 0) {
        // as it was
      } else if (view.on_map[i] != 0) {
        driver.OnIntensities(view.p_left[0][i], view.p_right[0][i], view.heading[i]);
      } else {
        driver.OnOffTheMap();
      }
      const client::WheelSpeeds wheels = driver.state().wheels;
      actions.left_m_s[i] = wheels.left_mm_s / 1000.0;
      actions.right_m_s[i] = wheels.right_mm_s / 1000.0;
      actions.quanta[i] = view.on_map[i] != 0 ? quanta_ : uint16_t{0};
    }
    return Ok();
  }

 private:
  const uint16_t quanta_;
  // Of requests and halts, of which there are none: nothing changes it after the constructor.
  client::RequestMemory memory_{};
  std::vector<client::Behaviour> drivers_;
};

}  // namespace

std::shared_ptr<Behaviour> MakeFollow(const client::Settings& settings, uint16_t quanta,
                                      size_t robots) {
  return std::make_shared<FollowBehaviour>(settings, quanta, robots);
}

}  // namespace pheromone::lab
