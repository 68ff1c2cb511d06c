// A record of a Petri net on a tag (protocol/net_record.h), in words.
#pragma once

#include <string>

#include "server/core/tags/block.h"

namespace pheromone::ctl {

/// "transitions 2, 8, 15", "green for 15; ...", "robot presents itself ..."; or what is wrong with
/// it. The block is a record.
std::string RecordText(const tags::Block& block);

}  // namespace pheromone::ctl
