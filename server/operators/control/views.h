// The views of the control interface as JSON. The keys are part of the API: within version 1, keys
// may be added, but not changed or removed.
//
// Units are in the names: _m metres, _s seconds, _ms milliseconds, _deg degrees counter-clockwise
// from +x, _bytes. Pheromone is in units. What is not known is null.
#pragma once

#include <string>
#include <vector>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/value.hpp>

#include "server/base/units.h"
#include "server/formats/maps/raster.h"
#include "server/operators/control/control.h"

namespace pheromone::web {

boost::json::value ToJson(const control::StatusView& status);
boost::json::value ToJson(const control::CaptureView& capture);
boost::json::value ToJson(const control::ClusterView& cluster);
boost::json::value ToJson(const std::vector<control::LinkView>& links);
boost::json::value ToJson(const std::vector<control::TrackerView>& trackers);
boost::json::value ToJson(const control::ConfigView& config);
boost::json::value ToJson(const std::vector<control::ClientView>& clients);

/// The map, the antennas and the pheromone types.
boost::json::value LawsToJson(const field::FieldConfig& config);

/// The predefined paths as they were configured: curves, not nodes. `config` names the pheromones.
boost::json::value PathsToJson(const std::vector<field::Path>& paths,
                               const field::FieldConfig& config);

/// What the numbers of a raster are, for one type, and where its cells are; or the latter alone.
boost::json::object DescribeRaster(const maps::Raster& raster, const field::PheromoneLaw& law,
                                   uint64_t field_time_ms);
boost::json::object DescribeRaster(const maps::Raster& raster);

/// The numbers of a raster: the top row first, null where there are obstacles.
boost::json::array RowsOf(const maps::Raster& raster);

/// The maximum content of a node of this type, in units.
double MaximumOf(const field::PheromoneLaw& law);

}  // namespace pheromone::web
