// Whether a configuration can be run at all. The reader of configuration files makes only such;
// this is for those that come from elsewhere, such as a journal whose bytes may be anybody's.
#pragma once

#include "server/base/result.h"
#include "server/engine/event.h"

namespace pheromone::engine {

/// What would break the arithmetic, or reach beyond what memory and time allow: the bounds of each
/// field (EngineConfig::Fields), and what one field has to do with another. Not whether a running
/// state can follow: that is Engine::CheckConfig.
Status CheckValues(const EngineConfig& config);

}  // namespace pheromone::engine
