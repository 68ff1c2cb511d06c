// Place/transition nets as PNML (ISO/IEC 15909-2), the exchange format of Petri net tools.
//
//   Result<petri::Net> net = ParsePnml("lab.pnml", bytes);
//   Status written = WriteFile("lab.pnml", ToPnml(net.value()));
//
// The standard knows neither inhibitor nor read arcs; tools write them in three ways, all of which
// are read: <type value="inhibitor"/> (PIPE, GreatSPN, TINA), which is the one that is written;
// <arc type="inhibitor" ...> (TAPAAL); and <arctype><text>inhibitor</text></arctype>, of the net
// type inhibitorptnet (ProM). PIPE's "Default,1", TAPAAL's attributes and the files of 2003 are
// read too. The net is untimed and without priorities: capacities, time, priorities, guards and
// arcs of other kinds, which would change what can happen, are refused; rates are ignored.
//
// Any thread. Errors begin with the name, if possible with the line, and say what was expected.
#pragma once

#include <string>
#include <string_view>

#include "server/base/result.h"
#include "server/core/petri/net.h"

namespace pheromone::nets {

/// The only net of a document, its pages joined. Parallel arcs are one with the sum of the weights;
/// of parallel read or inhibitor arcs, the strictest remains. The net passes petri::CheckNet. IDs
/// of arcs that are not unique are no error but a warning, which is empty otherwise.
Result<petri::Net> ParsePnml(std::string_view name, std::string_view text,
                             std::string* warning = nullptr);

/// ParsePnml returns an equal net: what PNML has no words for, such as owners, is in
/// <toolspecific>. A net without read and inhibitor arcs is a standard P/T net. `net` passes
/// petri::CheckNet.
std::string ToPnml(const petri::Net& net);

}  // namespace pheromone::nets
