#include "server/formats/ros/names.h"

#include <algorithm>
#include <cmath>

namespace pheromone::ros {

int8_t LevelOf(double part) {
  const double level = std::clamp(std::round(part * kFullLevel), 1.0, double{kFullLevel});
  return part > 0 ? static_cast<int8_t>(level) : int8_t{0};
}

std::string TopicPart(std::string_view name) {
  std::string part;
  for (const char c : name) {
    const bool is_digit = c >= '0' && c <= '9';
    const bool is_letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    if (is_digit && part.empty()) {
      part = "n";
    }
    if (is_digit || is_letter || part.empty() || part.back() != '_') {
      part += is_digit || is_letter ? c : '_';
    }
  }
  return part.empty() ? "n" : part;
}

const std::string& TopicNames::PartOf(const std::string& name) {
  const auto [found, is_new] = parts_.emplace(name, TopicPart(name));
  std::string& part = found->second;
  if (is_new) {
    const std::string stem = part + (part.back() == '_' ? "" : "_");
    for (int number = 2; !taken_.insert(part).second; ++number) {
      part = stem + std::to_string(number);
    }
  }
  return part;
}

void TopicNames::Forget(const std::string& name) {
  if (const auto found = parts_.find(name); found != parts_.end()) {
    taken_.erase(found->second);
    parts_.erase(found);
  }
}

TopicNames PheromoneNames() {
  return TopicNames({"obstacles", "markers", "halt"});
}

}  // namespace pheromone::ros
