// Robots, trails, tags and rates for viewers: from views of the control interface to messages of
// the stream. Those that compare with what was before have a class. One thread at a time.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <boost/json/value.hpp>

#include "server/core/field/geometry.h"
#include "server/formats/foxglove/messages.h"
#include "server/operators/control/control.h"
#include "server/operators/control/stream_counters.h"

namespace pheromone::web {

/// What robots sense: of each client with a known pose, both antennas of each pheromone.
boost::json::value ClientsWithAntennas(const std::vector<control::ClientView>& clients,
                                       const control::FieldView& view);

/// Robots' poses and where they were.
class RobotScenes {
 public:
  static constexpr size_t kMaxTrail = 200;

  std::string Robots(const std::vector<control::ClientView>& clients,
                     const field::FieldConfig& config, uint64_t unix_ns);
  /// Also notes where the robots are.
  std::string Trails(const std::vector<control::ClientView>& clients, uint64_t unix_ns);
  static std::string Transforms(const std::vector<control::ClientView>& clients, uint64_t unix_ns);
  static std::string Goals(const std::vector<control::ClientView>& clients, uint64_t unix_ns);

 private:
  std::map<std::string, uint64_t> seen_ns_;  // robots of late, by name
  std::map<std::string, std::deque<field::PointUm>> trails_;
};

/// Tags, and which of them have changed.
class TagScenes {
 public:
  static std::string Places(const std::vector<control::TagView>& tags, uint64_t unix_ns);
  /// {"version": number, "changed": [names]}; nothing if none has. The first time, all.
  std::optional<std::string> Changes(const std::vector<control::TagView>& tags, bool all);

 private:
  std::map<uint16_t, uint64_t> hashes_;
  uint64_t version_ = 0;
};

/// Where obstacles are: 1, else 0; at most PheromoneRaster::kMaxSide cells a side.
struct ObstacleRaster {
  foxglove::GridLayout layout;
  std::string cells;
};
ObstacleRaster ObstaclesOf(const field::FieldConfig& config);

std::string ObstacleGrid(const field::FieldConfig& config, uint64_t unix_ns);

/// /stats/engine: rates and quantiles since the last call.
class EngineRates {
 public:
  boost::json::value Take(const control::StatusView& status, const StreamCounters* counters,
                          uint64_t now_ms);

 private:
  std::optional<control::StatusView> last_;
  uint64_t last_ms_ = 0;
};

/// {"...": ..., "health": {"healthy": bool, "problem": text or null}}: GET /api/v1/status and it.
boost::json::value StatusWithHealth(const control::StatusView& status);

}  // namespace pheromone::web
