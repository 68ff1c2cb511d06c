// Scheduling priorities of the daemon's threads: threads that answer robots run before threads that
// draw pictures. Each function applies to the calling thread; if the system forbids it, such as in
// a sandbox, nothing changes. Any thread.
#pragma once

namespace pheromone::daemon {

/// Sets the scheduling class for batch work (SCHED_BATCH) and the nice value 19: a thread that
/// answers robots has 68 times its weight. With 10, the 99th percentile of answer times of
/// 16 robots at 115200 baud during ten pictures a second is twice as long (1.8 against 0.8 ms on
/// two processors). Where other programs keep all processors busy, a picture then takes most of a
/// second. Not SCHED_IDLE, whose threads take two hundred times as long then. Priority alone is not
/// enough: the stream's thread also pauses between pieces of its work
/// (server/operators/web/stream/pacer.h). For threads that take no lock for which a robot may wait,
/// since they may be preempted while holding it.
void YieldToOthers();

/// Requests the shortest time slice (0.1 ms), keeping the class and nice value of the thread: for
/// threads that answer robots, or hold a lock for which these wait. From 6.6 on, Linux lets a
/// running thread finish its slice of a millisecond or more, including the thread that draws;
/// from 6.12 on, a waking thread with a shorter slice preempts it. Older kernels ignore the value.
/// Longer slices for the thread that draws were tried and do not have the same effect.
void TakeShortTurns();

}  // namespace pheromone::daemon
