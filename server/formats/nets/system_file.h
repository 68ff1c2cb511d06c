// Nets as people write them: a TOML file has places, transitions, claims, and instances of nets in
// other files. deploy/examples/nets/ has a complete system.
//
//   Result<petri::Net> bench = LoadSystem("motion.toml", {{"robots", 3}});
//
// deploy/man/pheromone-net.5 has the format.
// How places are joined, and what boxes are for, is in server/core/petri/compose.h.
//
// Errors are lines FILE:LINE:COLUMN: KEY: what was found, and what was expected. Unknown keys are
// errors. Any thread.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "server/base/result.h"
#include "server/core/petri/net.h"
#include "server/formats/nets/placeholders.h"

namespace pheromone::nets {

/// `chosen` parameters replace the file's values, within the file's bounds.
Result<petri::Net> LoadSystem(const std::filesystem::path& path, const Parameters& chosen = {});

/// The same from a text; `name` is for errors, and instances' files are looked up in `folder`.
Result<petri::Net> ParseSystem(std::string_view name, std::string_view text,
                               const Parameters& chosen = {},
                               const std::filesystem::path& folder = ".");

}  // namespace pheromone::nets
