// For small functions with many callers: a copy at each of them, which compilers make where they
// take the function for short, costs an AVR more flash than the calls.
//
//   PHEROMONE_OUTLINED void Report(uint16_t event_bit) { ... }
#pragma once

#define PHEROMONE_OUTLINED __attribute__((noinline))
