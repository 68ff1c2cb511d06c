// Figures as people read them, in the unit that suits their size.
//
//   Duration(7200)  // "2.0 h"
//   Size(3 << 20)   // "3.0 MiB"
#pragma once

#include <string>

namespace pheromone::ctl {

/// "3.2 s", "4 min", "2.5 h", "3.0 d".
std::string Duration(double seconds);

/// "512 B", "1.5 KiB", "3.0 MiB", "2.0 GiB".
std::string Size(double bytes);

}  // namespace pheromone::ctl
