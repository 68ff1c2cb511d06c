// Nets as people write them: a TOML file has places, transitions, claims, and instances of nets in
// other files. deploy/examples/nets/ has a complete system.
//
//   Result<petri::Net> bench = LoadSystem("motion.toml", {{"robots", 3}});
//
//   [net]
//   name = "gate"
//
//   [parameters]
//   robots = { value = 4, least = 1, most = 40 }   # or robots = 4
//
//   [[place]]
//   id = "lane"
//   tokens = "{robots}"          # or a number; {robots - 1} and {robots + 1} are possible too
//   box = "RobotWaits{as}"       # optional: a pseudo-box; {as} is the instance's name
//                                # optional too: name, owner, tag, does
//   [[transition]]
//   id = "pass"
//   takes = ["lane", "2 ticket"] # a place, or a weight and a place
//   gives = ["N1.lane"]          # a place of an instance
//   reads = ["open"]
//   inhibited_by = ["closed"]    # optional too: name, owner, tag, does
//
//   [[claim]]
//   id = "few"
//   text = "always lane <= {robots}"     # see server/core/petri/property.h; instead of what an
//                                        # instance claims with the same ID
//
//   [[instance]]
//   net = "gate.toml"            # beside this file
//   as = "N1"                    # its lane is N1.lane; without it, IDs stay as they are
//   with = { lane = "nest" }     # its lane is the place nest of this file or of another instance
//   parameters = { robots = "{robots}" }
//   count = "{robots}"           # instances N11, N12, ...
//   replace = { "a.toml" = "b.toml" }    # in all that it is made of, one file for another
//
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
