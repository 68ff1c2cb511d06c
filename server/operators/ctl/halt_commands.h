// pheromonectl halt, resume: of all robots, and what became of each. Prints what was done, and
// returns the exit status (server_call.h).
#pragma once

#include <string>

#include <boost/json/array.hpp>
#include <boost/json/value.hpp>

#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {

/// Halts all robots, and waits a few seconds until all that are heard were seen to stand. kFailed:
/// a link is down, or a robot moves on or is silent; they are named.
int HaltAll(const ServerOptions& options);

/// Tells every robot that is heard to resume, and waits for its acknowledgement. kFailed: one has
/// not, or is silent; they are named.
int ResumeAll(const ServerOptions& options);

struct HaltedLinks {
  std::string text;  ///< lines
  bool all_told = true;
};
/// Where the robots were told: the server's answer, and the `cluster` of its status, which may be
/// null.
HaltedLinks DescribeHaltedLinks(const boost::json::value& answer,
                                const boost::json::value& cluster);

/// "8: 4 driving, 2 halted, 2 off the map".
std::string CountStates(const boost::json::array& clients);
/// "robot 7 on radio-a has been silent for 12 s".
std::string SilenceOf(const boost::json::value& client);
/// "halted (by an operator)".
std::string DescribeState(const boost::json::value& client);

}  // namespace pheromone::ctl
