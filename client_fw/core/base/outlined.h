// What costs an AVR more flash than a call.
//
// A copy of a small function at each of its callers, which compilers make where they take it for
// short:
//
//   PHEROMONE_OUTLINED void Report(uint16_t event_bit) { ... }
//
// The address in each access to an object, four bytes instead of two by a pointer: where there is
// only one object, GCC puts its address into the function instead of the argument.
//
//   PHEROMONE_BY_POINTER void Rounds::Advance(uint16_t elapsed_ms) { ... }
#pragma once

#define PHEROMONE_OUTLINED __attribute__((noinline))
#ifdef __clang__
#define PHEROMONE_BY_POINTER PHEROMONE_OUTLINED
#else
#define PHEROMONE_BY_POINTER __attribute__((noinline, noclone))
#endif
