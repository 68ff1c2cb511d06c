// What a request may look at without changing anything: the field as a raster, and what a robot
// would smell somewhere. Both look through a FieldReader, beside the robots.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "server/engine/control.h"
#include "server/maps/field_raster.h"
#include "server/web/fields.h"
#include "server/web/http.h"

namespace pheromone::web {

/// Cells of an answer, at most: a picture of 2000 x 2000.
constexpr int64_t kMostCells = 4'000'000;

/// What a request wants to see of the field, and how.
struct Picture {
  engine::FieldView view;  ///< the field as it is looked at
  field::PheromoneLaw law;
  std::string format;
  maps::RasterExtent extent;
  int pixels_per_cell = 1;
};

/// pheromone, format = json, csv or png, area_m, nodes_per_cell, pixels_per_cell. Nothing, the
/// problem noted, if one of them is not as it should be.
std::optional<Picture> ReadPicture(engine::FieldView view, Fields* fields);

/// Looks through a FieldReader, beside robots and operators, and takes no lock.
Response DrawPicture(const Picture& picture);

/// pheromone, x_m, y_m, heading_deg: both antennas.
Response ReadSense(const engine::Control& control, Fields* fields);

/// The type that the key `pheromone` names, by number or name. Null, the problem noted, if there is
/// none; also for a blend unless `blends` are welcome.
const field::PheromoneLaw* ReadLaw(const field::FieldConfig& config, bool blends, Fields* fields);

}  // namespace pheromone::web
