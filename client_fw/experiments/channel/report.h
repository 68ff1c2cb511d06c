// The channel experiment as a table for reading, as CSV and as a picture.
#pragma once

#include <string>
#include <vector>

#include "client_fw/experiments/channel/experiment.h"

namespace pheromone::swarm {

/// A line of headings, then one line per row, in columns for a terminal.
std::string TableHead();
std::string ToTableRow(const ChannelSummary& row);

/// A header line, then one line per row; numbers with fixed digits.
std::string ToCsv(const std::vector<ChannelSummary>& rows);

/// One line: a JSON object with the figures of a row.
std::string ToJson(const ChannelSummary& row);

/// An SVG of the periodic rows without hidden stations: for each timing, answers a second against
/// the number of robots, beside the bound, and the latency.
std::string DrawChannelPicture(const std::vector<ChannelSummary>& rows);

/// An SVG of rounds beside contention: answers a second and the longest gap against the number of
/// robots, for each turnaround; the distribution of the gaps of 16 robots, also with lost frames.
std::string DrawRoundsPicture(const std::vector<ChannelSummary>& rows);

}  // namespace pheromone::swarm
