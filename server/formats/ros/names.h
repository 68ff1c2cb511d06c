// What topics and cells of ROS 2 are called and mean, live (client_fw/ros2) and in bags alike.
//
//   TopicNames pheromones = PheromoneNames();
//   "/pheromone/" + pheromones.PartOf("no-go area");     // "/pheromone/no_go_area"
//   "/pheromone/" + pheromones.PartOf("no go area");     // "/pheromone/no_go_area_2"
//   LevelOf(0.5);                                        // 49
//
// A pheromone's cells are 0 to 98 of its maximum, so that a viewer's palette for costs has room for
// its two special values, and -1, unknown, where an obstacle is. Obstacles are 0 or 100.
//
// Functions of their arguments, any thread; a TopicNames belongs to one.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>

namespace pheromone::ros {

constexpr int kFullLevel = 98;
constexpr int8_t kObstacle = 100;
constexpr int8_t kUnknown = -1;

constexpr std::string_view kObstaclesTopic = "/pheromone/obstacles";

/// `part` of the maximum; at least 1 where there is something.
int8_t LevelOf(double part);

/// A name as a part of a topic: other characters than letters, digits and '_' become '_', of which
/// ROS allows no two in a row, and 'n' comes before a digit.
std::string TopicPart(std::string_view name);

/// Gives each name a part of its own: the second of two that become the same ends in "_2".
class TopicNames {
 public:
  /// Parts that no name gets.
  explicit TopicNames(std::set<std::string> taken = {}) : taken_(std::move(taken)) {}

  const std::string& PartOf(const std::string& name);
  /// Another name may get its part.
  void Forget(const std::string& name);

 private:
  std::set<std::string> taken_;
  std::map<std::string, std::string> parts_;  // by name
};

/// Below /pheromone, where there are other topics.
TopicNames PheromoneNames();

}  // namespace pheromone::ros
