// The parts of crash_test. Each prints its figures and returns whether it passed.
#pragma once

#include <cstdint>
#include <string>

namespace pheromone::crash {

/// kill -9 of a process that serves random traffic, `rounds` times on one journal, in every second
/// round while it makes a snapshot. `program` is this program, run as the process to be killed.
bool CheckKills(const std::string& program, int rounds, uint64_t seed);
/// That process: serves the journal in the folder `path` and reports on standard output until it is
/// killed.
int ServeUntilKilled(const std::string& path, uint64_t seed);

/// `cuts` simulated power failures, each on a disk of its own that loses or tears unsynced data;
/// then the same with mutants, which must be detected.
bool CheckPowerCuts(int cuts, uint64_t seed);

/// Every truncation and every damaged byte of the last 4 KiB of a journal.
bool CheckBytes(uint64_t seed);

/// Writes and syncs that fail, `runs` times, with a power cut at the end of each.
bool CheckFailures(int runs, uint64_t seed);

/// Snapshots under full load, over this many changes: the recovered state must be the original one.
/// Prints how long the service's lock was held meanwhile.
bool CheckLoad(uint64_t changes, uint64_t seed);

}  // namespace pheromone::crash
