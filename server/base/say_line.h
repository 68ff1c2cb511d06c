// Lines for the operator of a program that must not wait: one that drives robots, or follows them.
//
//   SayLine(400, "drives");        // "     0.4 s  drives"
//
// Any thread.
#pragma once

#include <cstdint>
#include <string>

namespace pheromone {

/// Writes a line to standard output, if that does not block: a terminal that was stopped with
/// Ctrl-S, a reader that does not read or a full disk must not hold up a robot that drives. Lines
/// are lost then. In front is the time since the start.
void SayLine(int64_t now_ms, const std::string& text);

}  // namespace pheromone
