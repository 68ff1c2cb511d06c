// How requests are refused.
#pragma once

#include "protocol/messages.h"

namespace pheromone::engine {

/// The ERROR that refuses `message`; with its seq, if protocol::IsMutating says that it has one.
protocol::Message ErrorMessage(const protocol::Message& message, protocol::Reason reason);

}  // namespace pheromone::engine
