// A figure in SVG as PDF, as rsvg-convert (Debian: librsvg2-bin) makes it: lines stay lines, text
// stays text.
//
//   Result<std::string> pdf = SvgToPdf(svg);
//
// Runs that program, as found in PATH, and waits for it; what it complains of goes to standard
// error. Errors: it is not installed, or fails.
#pragma once

#include <string>
#include <string_view>

#include "server/base/result.h"

namespace pheromone::ctl {

Result<std::string> SvgToPdf(std::string_view svg);

}  // namespace pheromone::ctl
