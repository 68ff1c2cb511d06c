#include "server/formats/maps/geodesy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace pheromone::maps {
namespace {

LocalFrame FrameAt(const Wgs84& datum) {
  return LocalFrame::At(datum).value();
}

// Through geocentric coordinates by hand, in long double: X = (nu + h) cos(lat) cos(lon), ... and
// the rotation into the datum's horizon (IOGP Guidance Note 7-2, EPSG methods 9602 and 9836).
struct Geocentric {
  long double x, y, z;
};

constexpr long double kDegree = std::numbers::pi_v<long double> / 180;
constexpr long double kSemiMajor = 6378137.0L;
constexpr long double kFlattening = 1 / 298.257223563L;
constexpr long double kEccentricity2 = kFlattening * (2 - kFlattening);

Geocentric ToGeocentric(const Wgs84& place) {
  const long double lat = place.latitude_deg * kDegree;
  const long double lon = place.longitude_deg * kDegree;
  const long double nu = kSemiMajor / std::sqrt(1 - kEccentricity2 * std::sin(lat) * std::sin(lat));
  const long double h = place.height_m;
  return {(nu + h) * std::cos(lat) * std::cos(lon), (nu + h) * std::cos(lat) * std::sin(lon),
          ((1 - kEccentricity2) * nu + h) * std::sin(lat)};
}

EastNorthUp ByHand(const Wgs84& datum, const Wgs84& place) {
  const Geocentric from = ToGeocentric(datum);
  const Geocentric to = ToGeocentric(place);
  const long double x = to.x - from.x;
  const long double y = to.y - from.y;
  const long double z = to.z - from.z;
  const long double lat = datum.latitude_deg * kDegree;
  const long double lon = datum.longitude_deg * kDegree;
  return {static_cast<double>(-x * std::sin(lon) + y * std::cos(lon)),
          static_cast<double>(-x * std::sin(lat) * std::cos(lon) -
                              y * std::sin(lat) * std::sin(lon) + z * std::cos(lat)),
          static_cast<double>(x * std::cos(lat) * std::cos(lon) +
                              y * std::cos(lat) * std::sin(lon) + z * std::sin(lat))};
}

// The worked example of IOGP Guidance Note 7-2, EPSG method 9837, printed to the millimetre.
TEST(Geodesy, ThePublishedTopocentricExampleComesOut) {
  const LocalFrame frame = FrameAt({55, 5, 200});
  const Wgs84 place{53 + 48 / 60.0 + 33.82 / 3600, 2 + 7 / 60.0 + 46.38 / 3600, 73};
  const EastNorthUp local = frame.ToLocal(place);
  // The example's degrees are given to 0.01", which is 0.2 m.
  EXPECT_NEAR(local.east_m, -189'013.869, 0.2);
  EXPECT_NEAR(local.north_m, -128'642.040, 0.2);
  EXPECT_NEAR(local.up_m, -4'220.171, 0.02);
}

TEST(Geodesy, LocalCoordinatesAgreeWithThoseWorkedOutByHand) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int i = 0; i < 2000; ++i) {
    const Wgs84 datum{89.8 * unit(random), 180 * unit(random), 3000 * unit(random)};
    const Wgs84 place{datum.latitude_deg + 0.1 * unit(random),  // some 10 km
                      datum.longitude_deg + 0.1 * unit(random), 3000 * unit(random)};
    const EastNorthUp expected = ByHand(datum, place);
    const EastNorthUp local = FrameAt(datum).ToLocal(place);
    EXPECT_NEAR(local.east_m, expected.east_m, 1e-7);
    EXPECT_NEAR(local.north_m, expected.north_m, 1e-7);
    EXPECT_NEAR(local.up_m, expected.up_m, 1e-7);
  }
}

// Without formulas: a degree of latitude at the equator is 110 574.4 m along the ground and a
// degree of longitude 111 319.5 m (NIMA TR8350.2); a hundredth of it is flat to a millimetre.
TEST(Geodesy, XIsEastAndYIsNorth) {
  const LocalFrame equator = FrameAt({0, 30, 0});
  EXPECT_NEAR(equator.ToLocal({0, 30.01, 0}).east_m, 1113.195, 0.002);
  EXPECT_NEAR(equator.ToLocal({0, 30.01, 0}).north_m, 0, 1e-6);
  EXPECT_NEAR(equator.ToLocal({0.01, 30, 0}).north_m, 1105.744, 0.002);
  EXPECT_NEAR(equator.ToLocal({0.01, 30, 0}).east_m, 0, 1e-6);
}

TEST(Geodesy, APlaceAcrossTheDateLineIsNear) {
  EXPECT_NEAR(FrameAt({0, 179.995, 0}).ToLocal({0, -179.995, 0}).east_m, 1113.195, 0.002);
}

TEST(Geodesy, ADatumThatIsNoPlaceIsRefused) {
  EXPECT_EQ(LocalFrame::At({90.5, 0, 0}).error(),
            "datum: found the latitude 90.5, expected -90 to 90 degrees");
  EXPECT_EQ(LocalFrame::At({0, -181, 0}).error(),
            "datum: found the longitude -181, expected -180 to 180 degrees");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(LocalFrame::At({nan, 0, 0}).ok());
  EXPECT_FALSE(LocalFrame::At({0, nan, 0}).ok());
  EXPECT_FALSE(LocalFrame::At({0, 0, std::numeric_limits<double>::infinity()}).ok());
}

TEST(Geodesy, CompassHeadingsTurnTheOtherWayAndStartAtNorth) {
  EXPECT_EQ(HeadingFromCompass(90), 0);       // east is +x
  EXPECT_EQ(HeadingFromCompass(0), 16384);    // north is +y
  EXPECT_EQ(HeadingFromCompass(270), 32768);  // west
  EXPECT_EQ(HeadingFromCompass(180), 49152);  // south
  EXPECT_EQ(HeadingFromCompass(45), 8192);
  EXPECT_EQ(HeadingFromCompass(-270), 0);
  EXPECT_EQ(HeadingFromCompass(360e6 + 90), 0);
  EXPECT_EQ(HeadingFromCompass(90.0001), 0);  // rounds across the turn
  EXPECT_EQ(HeadingFromCompass(90.004), 65535);
}

TEST(Geodesy, EveryHeadingHasItsCompassDirection) {
  for (uint32_t heading = 0; heading < 65536; ++heading) {
    ASSERT_EQ(HeadingFromCompass(90 - heading * 360.0 / 65536), heading);
  }
}

}  // namespace
}  // namespace pheromone::maps
