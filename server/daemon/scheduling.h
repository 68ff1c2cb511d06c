// Scheduling priorities of the daemon's threads: threads that answer robots run before threads that
// draw pictures. Each function applies to the calling thread; if the system forbids it, such as in
// a sandbox, nothing changes. Any thread.
#pragma once

namespace pheromone::daemon {

/// Sets the scheduling class for batch work (SCHED_BATCH) and the nice value 10: a thread that
/// answers robots then gets nine tenths of a processor that both want. Not SCHED_IDLE, whose
/// threads take two hundred times as long when all processors are busy. For threads that take no
/// lock for which a robot may wait, since they may be preempted while holding it.
void YieldToOthers();

/// Requests the shortest time slice (0.1 ms), keeping the class and nice value of the thread: for
/// threads that answer robots. From 6.6 on, Linux lets a running thread finish its slice of a
/// millisecond or more, including the thread that draws; from 6.12 on, a waking thread with a
/// shorter slice preempts it. Older kernels ignore the value. Longer slices for the thread that
/// draws were tried and do not have the same effect.
void TakeShortTurns();

}  // namespace pheromone::daemon
