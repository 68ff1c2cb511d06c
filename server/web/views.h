// The control interface's views as JSON. The names here are the API: they may be added to, and
// neither change nor go as long as it is version 1.
//
// Units are in the names: _m metres, _s seconds, _ms milliseconds, _deg degrees counter-clockwise
// from +x, _bytes. Pheromone is in units. What is not known is null.
#pragma once

#include <string>
#include <vector>

#include <boost/json/value.hpp>

#include "server/engine/control.h"
#include "server/maps/raster.h"

namespace pheromone::web {

boost::json::value ToJson(const engine::StatusView& status);
boost::json::value ToJson(const engine::CaptureView& capture);
boost::json::value ToJson(const std::vector<engine::LinkView>& links);
boost::json::value ToJson(const std::vector<engine::ClientView>& clients);

/// The map, the antennas and the pheromone types.
boost::json::value LawsToJson(const field::FieldConfig& config);

/// A raster of one type: the top row first, null where there are obstacles.
boost::json::value ToJson(const maps::Raster& raster, const field::PheromoneLaw& law,
                          uint64_t field_time_ms);

/// What a node of this type holds at most, in units.
double MaximumOf(const field::PheromoneLaw& law);

inline double Metres(int64_t um) {
  return static_cast<double>(um) / 1e6;
}
inline double Degrees(uint16_t binary_angle) {
  return binary_angle * 360.0 / 65536;
}

}  // namespace pheromone::web
