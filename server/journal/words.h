// An event of the journal as named values: a line of a table, or of JSON Lines, or words.
//
//   std::cout << kCsvHeader << '\n' << InCsv(record) << '\n';
//   std::cout << InJson(record) << '\n';      // {"sequence":7,"event":"deposit",...}
//
// Requests have coordinates as the robot sent them, in the map's pose unit (x, y) and in its own
// frame; what was observed or edited has them in micrometres on the map (x_um, y_um). Headings are
// binary angles, 65 536 a turn. `link` counts the configuration's links from 0.
#pragma once

#include <string>
#include <string_view>

#include "server/journal/format.h"

namespace pheromone::journal {

constexpr std::string_view kCsvHeader =
    "sequence,field_time_ms,utc_ms,event,link,robot,pheromone,seq,x,y,heading,x_um,y_um,value,code";

/// A value that an event has not is an empty column, and is left out of JSON.
std::string InCsv(const Record& record);
std::string InJson(const Record& record);
/// "deposit link=0 robot=7 ...".
std::string InWords(const Record& record);

}  // namespace pheromone::journal
