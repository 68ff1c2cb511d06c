// Any bytes as a tracker's datagram: each line is understood or a fault with words; what is
// understood is within its ranges, and written out again it is understood as the same.

#include <charconv>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>

#include "proto_tests/fuzz/require.h"
#include "server/robots/links/tracker_message.h"

namespace {

using pheromone::fuzz::Require;
using pheromone::links::GpsFix;
using pheromone::links::PoseFix;
using pheromone::links::TrackerFault;
using pheromone::links::TrackerLine;

std::string Decimal(double value) {
  char text[512];
  const auto [end, error] =
      std::to_chars(text, text + sizeof text, value, std::chars_format::fixed);
  Require(error == std::errc());
  return {text, end};
}

bool Within(double value, double limit) {
  return value >= -limit && value <= limit;
}

std::string Written(const TrackerLine& line) {
  const std::string robot = std::string(line.link) + " " + std::to_string(line.id) + " ";
  if (const auto* pose = std::get_if<PoseFix>(&line.fix)) {
    Require(Within(pose->x_m, 1e6) && Within(pose->y_m, 1e6) && Within(pose->heading_deg, 360));
    return "pose " + robot + Decimal(pose->x_m) + " " + Decimal(pose->y_m) + " " +
           Decimal(pose->heading_deg);
  }
  const auto& gps = std::get<GpsFix>(line.fix);
  Require(Within(gps.latitude_deg, 90) && Within(gps.longitude_deg, 180) &&
          Within(gps.course_deg, 360) && Within(gps.height_m.value_or(0), 1e5));
  return "gps " + robot + Decimal(gps.latitude_deg) + " " + Decimal(gps.longitude_deg) + " " +
         Decimal(gps.course_deg) + (gps.height_m ? " " + Decimal(*gps.height_m) : "");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view datagram(reinterpret_cast<const char*>(data), size);
  size_t bytes = 0;
  pheromone::links::ForEachTrackerLine(datagram, [&](std::string_view text) {
    bytes += text.size();
    const auto parsed = pheromone::links::ParseTrackerLine(text);
    if (const auto* fault = std::get_if<TrackerFault>(&parsed)) {
      Require(!TextOf(*fault).empty());
      return;
    }
    const auto& line = std::get<TrackerLine>(parsed);
    Require(line.id >= 1 && line.id <= 254 && !line.link.empty());
    const std::string written = Written(line);
    const auto again = pheromone::links::ParseTrackerLine(written);
    const auto* same = std::get_if<TrackerLine>(&again);
    Require(same != nullptr && same->link == line.link && same->id == line.id &&
            same->fix == line.fix);
  });
  Require(bytes <= size);
  return 0;
}
