// Which of the daemon's threads has a processor first where there are too few: who answers robots
// before who draws pictures. Each of these is for the calling thread alone; where the system
// forbids it, such as a sandbox, all stays as it is. Any thread.
#pragma once

namespace pheromone::daemon {

/// Takes the scheduling class for batch work (SCHED_BATCH) and the nice value 10: whoever answers a
/// robot and wakes up has nine tenths of a processor that both want. Not SCHED_IDLE, whose threads
/// take two hundred times as long where all processors are busy. For threads that take no lock
/// which a robot may wait for: they may be kept from giving it back.
void YieldToOthers();

/// Asks for the shortest turns (0.1 ms), in the class and with the nice value that the thread has:
/// for threads that answer robots. From 6.6 on Linux lets whoever runs have its turn to the end,
/// a millisecond or more, the thread that draws too; from 6.12 on one with shorter turns that wakes
/// up goes before. Older ones do not look at it. Longer turns for the thread that draws were tried,
/// and do not do the same.
void TakeShortTurns();

}  // namespace pheromone::daemon
