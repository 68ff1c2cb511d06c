// Formats an event of the journal as CSV, JSON Lines or plain text.
//
//   std::cout << kCsvHeader << '\n' << InCsv(record) << '\n';
//   std::cout << InJson(record) << '\n';      // {"sequence":7,"event":"deposit",...}
//
// Requests have coordinates as the robot sent them, in pose units (x, y) and in its own frame;
// observations and edits have map coordinates in micrometres (x_um, y_um). Headings are binary
// angles, 65 536 per turn. `link` is the index of the link in the configuration, from 0.
#pragma once

#include <string>
#include <string_view>

#include "server/store/journal/format.h"

namespace pheromone::journal {

constexpr std::string_view kCsvHeader =
    "sequence,field_time_ms,utc_ms,event,link,robot,pheromone,seq,x,y,heading,x_um,y_um,value,code";

/// A value that an event does not have is an empty column, and is omitted from JSON.
std::string InCsv(const Record& record);
std::string InJson(const Record& record);
/// "deposit link=0 robot=7 ...".
std::string InWords(const Record& record);

}  // namespace pheromone::journal
