#include "client_fw/sim/pioneer_models.h"

#include <algorithm>
#include <array>

namespace pheromone::sim {
namespace {

constexpr PioneerModel Model(std::string_view subclass, double distance_mm, double diff_conv_per_mm,
                             int max_speed_mm_s, int length_mm) {
  PioneerModel model;
  model.subclass = subclass;
  model.distance_mm = distance_mm;
  model.diff_conv_per_mm = diff_conv_per_mm;
  model.max_speed_mm_s = max_speed_mm_s;
  model.width_mm = 425;
  model.length_mm = length_mm;
  return model;
}

constexpr std::array<PioneerModel, 3> kModels = {
    Model("p3dx", 0.485, 0.0056, 1000, 511),
    Model("p3dx-sh", 1.0, 0.0056, 1000, 511),
    Model("peoplebot-sh", 1.0, 0.006, 750, 513),
};

// For ASCII, independent of the locale.
char Lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

}  // namespace

std::span<const PioneerModel> PioneerModels() {
  return kModels;
}

const PioneerModel* FindPioneerModel(std::string_view subclass) {
  const auto same = [](char a, char b) { return Lower(a) == Lower(b); };
  for (const PioneerModel& model : kModels) {
    if (std::equal(subclass.begin(), subclass.end(), model.subclass.begin(), model.subclass.end(),
                   same)) {
      return &model;
    }
  }
  return nullptr;
}

}  // namespace pheromone::sim
