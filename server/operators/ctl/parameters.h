// What a robot's parameter says. The numbers are those of COMMAND 8 and 9 of the
// firmware (client_fw/README.md); of another firmware they may mean something else.
//
//   DescribeParameter(136, 125)   // "battery: 12.5 V"
//   DescribeParameter(133, 4)     // "why it stands: 4 (halted)"
//   DescribeParameter(200, 7)     // "parameter 200: 7"
#pragma once

#include <cstdint>
#include <string>

namespace pheromone::ctl {

std::string DescribeParameter(int64_t number, int64_t value);

}  // namespace pheromone::ctl
