// What a request may look at without changing anything: the field as a raster, and what a robot
// would smell somewhere. Both look through a FieldReader, beside the robots.
#pragma once

#include "server/engine/control.h"
#include "server/web/fields.h"
#include "server/web/http.h"

namespace pheromone::web {

/// Cells of an answer, at most: a picture of 2000 x 2000.
constexpr int64_t kMostCells = 4'000'000;

/// pheromone, format = json, csv or png, area_m, nodes_per_cell, pixels_per_cell.
Response ReadField(const engine::Control& control, Fields* fields);

/// pheromone, x_m, y_m, heading_deg: both antennas.
Response ReadSense(const engine::Control& control, Fields* fields);

/// The type that the key `pheromone` names, by number or name. Null, the problem noted, if there is
/// none; also for a blend unless `blends` are welcome.
const field::PheromoneLaw* ReadLaw(const field::FieldConfig& config, bool blends, Fields* fields);

}  // namespace pheromone::web
