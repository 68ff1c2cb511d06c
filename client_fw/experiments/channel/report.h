// The channel experiment as a table for reading and as CSV.
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

/// The rows with damaged bytes, beside their bound B_1.
std::string AirToCsv(const std::vector<ChannelSummary>& rows);

/// One line: a JSON object with the figures of a row.
std::string ToJson(const ChannelSummary& row);

/// The distribution of the gaps between a robot's answers: of 16 robots with the first turnaround,
/// all frames heard and 5 % lost; 61 quantiles for each row of those.
std::string GapsToCsv(const std::vector<ChannelSummary>& rows);

/// What a link has to know that is modelled by measured rounds (client_fw/lab/link): how often gaps
/// and pose ages of so many ms were found, all of each row. Bins are 10 ms wide up to a second,
/// then by a tenth wider than the one before; of each the least and the greatest that was found.
std::string LinkTableToCsv(const std::vector<ChannelSummary>& rows);

}  // namespace pheromone::swarm
