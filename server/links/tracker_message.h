// What an external tracker says, as text: an overhead camera that knows the map, or a satellite
// receiver on the robot. One line for each robot seen, any number of lines to a datagram:
//
//   pose LINK ID X_M Y_M HEADING_DEG
//   gps LINK ID LATITUDE_DEG LONGITUDE_DEG COURSE_DEG [HEIGHT_M]
//
//   pose radio-a 7 2.35 0.9 -90
//   gps radio-a 8 47.37690 8.54170 181.5 408
//
// LINK and ID are the robot's key. X and Y are metres on the map, HEADING degrees
// counter-clockwise from +x. LATITUDE and LONGITUDE are WGS-84, COURSE degrees clockwise from
// north, HEIGHT above the ellipsoid. Numbers are plain decimals (`-1.5`, no exponent, no plus
// sign). Words are separated by blanks or tabs; lines end with LF or CR LF, the last one with
// nothing if it likes. Empty lines are skipped.
//
// Pure, and for the bytes of strangers: whatever comes is a line or a fault. Any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <variant>

namespace pheromone::links {

/// Where a robot is on the map.
struct PoseFix {
  double x_m = 0;          ///< within 1000 km
  double y_m = 0;          ///< likewise
  double heading_deg = 0;  ///< -360 to 360
  bool operator==(const PoseFix&) const = default;
};

/// Where a robot is on the Earth.
struct GpsFix {
  double latitude_deg = 0;         ///< -90 to 90
  double longitude_deg = 0;        ///< -180 to 180
  double course_deg = 0;           ///< -360 to 360
  std::optional<double> height_m;  ///< within 100 km; without one, on the map's ground
  bool operator==(const GpsFix&) const = default;
};

struct TrackerLine {
  std::string_view link;  ///< points into the text that was parsed
  uint8_t id = 0;         ///< 1-254
  std::variant<PoseFix, GpsFix> fix;
};

enum class TrackerFault : uint8_t {
  kUnknownKind,   ///< neither pose nor gps
  kWordCount,     ///< too few words, or too many
  kBadId,         ///< no whole number from 1 to 254
  kBadNumber,     ///< not a plain decimal number
  kOutOfRange,    ///< a number beyond its range
  kTooManyLines,  ///< beyond kMostTrackerLines of a datagram
  kUnknownLink,   ///< not configured
  kNoDatum,       ///< a place on the Earth, but the map is nowhere on it
};
constexpr size_t kTrackerFaults = 8;
constexpr size_t kMostTrackerLines = 1024;

/// "a number that is no plain decimal", and so on.
std::string_view TextOf(TrackerFault fault);

/// Reads one line, which has no line end. Links are not looked up here.
std::variant<TrackerLine, TrackerFault> ParseTrackerLine(std::string_view line);

/// Calls `visit(std::string_view line)` for each line of a datagram that is not empty.
template <typename Visit>
void ForEachTrackerLine(std::string_view datagram, Visit&& visit) {
  while (!datagram.empty()) {
    const size_t end = datagram.find('\n');
    std::string_view line = datagram.substr(0, end);
    datagram.remove_prefix(end == std::string_view::npos ? datagram.size() : end + 1);
    if (line.ends_with('\r')) {
      line.remove_suffix(1);
    }
    if (line.find_first_not_of(" \t") != std::string_view::npos) {
      visit(line);
    }
  }
}

}  // namespace pheromone::links
