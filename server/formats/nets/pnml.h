// Place/transition nets as PNML (ISO/IEC 15909-2), the exchange format of Petri net tools.
//
//   Result<petri::Net> net = ParsePnml("lab.pnml", bytes);
//   Status written = WriteFile("lab.pnml", ToPnml(net.value()));
//
// The standard knows neither inhibitor nor read arcs; tools write them in three ways (PnmlDialect),
// all of which are read. PIPE's "Default,1", TAPAAL's attributes and the files of 2003 are read
// too. The net is untimed and without priorities: capacities, time, priorities, guards and arcs of
// other kinds, which would change what can happen, are refused; rates are ignored.
//
// Any thread. Errors begin with the name, if possible with the line, and say what was expected.
#pragma once

#include <string>
#include <string_view>

#include "server/base/result.h"
#include "server/core/petri/net.h"

namespace pheromone::nets {

/// How an arc says that it is an inhibitor or read arc.
enum class PnmlDialect {
  kTypeElement,     ///< <type value="inhibitor"/>: PIPE, GreatSPN, TINA
  kTypeAttribute,   ///< <arc type="inhibitor" ...>: TAPAAL
  kArcTypeElement,  ///< <arctype><text>inhibitor</text></arctype>: net type inhibitorptnet, ProM
};

/// The only net of a document, its pages joined. Parallel arcs are one with the sum of the weights;
/// of parallel read or inhibitor arcs, the strictest remains. The net passes petri::CheckNet. IDs
/// of arcs that are not unique are no error but a warning, which is empty otherwise.
Result<petri::Net> ParsePnml(std::string_view name, std::string_view text,
                             std::string* warning = nullptr);

/// ParsePnml returns an equal net: what PNML has no words for, such as owners, is in
/// <toolspecific>. But only kTypeElement has read arcs; the other dialects take and give instead
/// (WithoutReads). A net without read and inhibitor arcs is a standard P/T net in the first two.
/// `net` passes petri::CheckNet.
std::string ToPnml(const petri::Net& net, PnmlDialect dialect = PnmlDialect::kTypeElement);

}  // namespace pheromone::nets
