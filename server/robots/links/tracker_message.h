// The text messages of an external tracker, such as an overhead camera or a satellite receiver on
// the robot: one line for each robot, any number of lines in a datagram:
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
// sign). Words are separated by blanks or tabs; lines end with LF or CR LF, which is optional after
// the last one. Empty lines are skipped.
//
// Pure, and safe for untrusted input: any text is either a valid line or a fault. Any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <variant>

namespace pheromone::links {

/// The pose of a robot on the map.
struct PoseFix {
  double x_m = 0;          ///< within 1000 km
  double y_m = 0;          ///< likewise
  double heading_deg = 0;  ///< -360 to 360
  bool operator==(const PoseFix&) const = default;
};

/// The geographic position of a robot.
struct GpsFix {
  double latitude_deg = 0;         ///< -90 to 90
  double longitude_deg = 0;        ///< -180 to 180
  double course_deg = 0;           ///< -360 to 360
  std::optional<double> height_m;  ///< within 100 km; without it, that of the map's plane
  bool operator==(const GpsFix&) const = default;
};

struct TrackerLine {
  std::string_view link;  ///< points into the text that was parsed
  uint8_t id = 0;         ///< 1-254
  std::variant<PoseFix, GpsFix> fix;
};

enum class TrackerFault : uint8_t {
  kUnknownKind,   ///< unknown message, expected pose or gps
  kWordCount,     ///< wrong number of fields
  kBadId,         ///< not a whole number from 1 to 254
  kBadNumber,     ///< not a plain decimal number
  kOutOfRange,    ///< a number out of range
  kTooManyLines,  ///< beyond kMaxTrackerLines of a datagram
  kUnknownLink,   ///< not configured
  kNoDatum,       ///< a geographic position, but the map has no datum
  kNoHello,       ///< the robot has not said HELLO
};
constexpr size_t kTrackerFaults = 9;
constexpr size_t kMaxTrackerLines = 1024;

/// "not a plain decimal number", and so on.
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
