// Whether a configuration is valid. The reader of configuration files returns only valid ones; this
// is for those from elsewhere, such as a journal, whose bytes are not trusted.
#pragma once

#include "server/base/result.h"
#include "server/core/engine/event.h"

namespace pheromone::engine {

/// Errors: values that would break the arithmetic or exceed memory and time: outside the bounds of
/// their fields (EngineConfig::Fields), or inconsistent. Whether a running state can change to it
/// is checked by Engine::CheckConfig.
Status CheckValues(const EngineConfig& config);

}  // namespace pheromone::engine
