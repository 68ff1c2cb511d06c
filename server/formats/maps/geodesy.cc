#include "server/formats/maps/geodesy.h"

#include <cassert>
#include <cmath>
#include <memory>
#include <string>

#include <GeographicLib/LocalCartesian.hpp>

#include "server/base/format.h"

namespace pheromone::maps {
namespace {

constexpr double kMaxHeightM = 100'000;
constexpr double kStepsPerDegree = 65536.0 / 360.0;

// Written so that NaN is out of range.
bool Within(double number, double most) {
  return std::abs(number) <= most;
}

}  // namespace

struct LocalFrame::Projection {
  GeographicLib::LocalCartesian cartesian;
};

// The library throws for a latitude beyond 90 degrees only.
LocalFrame::LocalFrame(const Wgs84& datum)
    : datum_(datum),
      projection_(std::make_shared<Projection>(Projection{GeographicLib::LocalCartesian(
          datum.latitude_deg, datum.longitude_deg, datum.height_m)})) {}

Result<LocalFrame> LocalFrame::At(const Wgs84& datum) {
  const auto wrong = [](const char* what, double found, const char* expected) {
    return Error{std::string("datum: found the ") + what + ' ' + FormatNumber(found) +
                 ", expected " + expected};
  };
  if (!Within(datum.latitude_deg, 90)) {
    return wrong("latitude", datum.latitude_deg, "-90 to 90 degrees");
  }
  if (!Within(datum.longitude_deg, 180)) {
    return wrong("longitude", datum.longitude_deg, "-180 to 180 degrees");
  }
  if (!Within(datum.height_m, kMaxHeightM)) {
    return wrong("height", datum.height_m, "-100000 to 100000 metres");
  }
  return LocalFrame(datum);
}

EastNorthUp LocalFrame::ToLocal(const Wgs84& place) const {
  EastNorthUp local;
  projection_->cartesian.Forward(place.latitude_deg, place.longitude_deg, place.height_m,
                                 local.east_m, local.north_m, local.up_m);
  return local;
}

uint16_t HeadingFromCompass(double compass_deg) {
  assert(std::isfinite(compass_deg));
  const double within_turn =
      std::remainder(compass_deg, 360.0);  // exact, so that turns cost nothing
  const long long steps = std::llround((90.0 - within_turn) * kStepsPerDegree);
  return static_cast<uint16_t>(steps & 0xFFFF);
}

}  // namespace pheromone::maps
