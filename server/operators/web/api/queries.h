// The requests that read the field: as a raster, and what a robot would sense at a position. Both
// use a FieldReader and do not block robots. And the obstacles as a raster.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "server/formats/maps/field_raster.h"
#include "server/operators/control/control.h"
#include "server/operators/web/api/request_parameters.h"
#include "server/operators/web/http.h"

namespace pheromone::web {

/// Cells of an answer, at most: a picture of 2000 x 2000.
constexpr int64_t kMaxCells = 4'000'000;

struct Format {
  std::string name = "json";  ///< or csv, npy, png
  int pixels_per_cell = 1;    ///< of a png
};

/// The part of the field that a request asks for, and its format.
struct Picture {
  control::FieldView view;  ///< the field to read
  field::PheromoneLaw law;
  Format format;
  maps::RasterExtent extent;
};

/// Parameters: pheromone, format = json, csv, npy or png, area_m, nodes_per_cell, pixels_per_cell.
/// Nothing, with the problem noted, if one of them is invalid.
std::optional<Picture> ReadPicture(control::FieldView view, Parameters* fields);

/// Uses a FieldReader and takes no lock.
Response DrawPicture(const Picture& picture);

/// Where obstacles are, as 1, and 0 elsewhere: format, area_m, nodes_per_cell, pixels_per_cell as
/// of ReadPicture.
Response ReadObstacles(const control::Control& control, Parameters* fields);

/// pheromone, x_m, y_m, heading_deg: both antennas.
Response ReadSense(const control::Control& control, Parameters* fields);

/// The type named by the key `pheromone`, by number or name. Null, with the problem noted, if there
/// is none; also for a blend unless `blends` are permitted.
const field::PheromoneLaw* ReadLaw(const field::FieldConfig& config, bool blends,
                                   Parameters* fields);

}  // namespace pheromone::web
