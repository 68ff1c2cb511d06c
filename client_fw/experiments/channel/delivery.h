// Which of a robot's requests were answered in time, measured from outside: by the arrival of
// answers and a fixed clock, independently of the robot's own counters.
//
//   DeliveryRecord record(
//       {.period_ms = 200, .deadline_ms = 500, .from_ms = 5000, .to_ms = 65'000});
//   record.StartClock(120);                     // requests are due at 120, 320, 520 ...
//   record.OnAnswer(151);                       // 31 ms after it was due
//   record.Finish();
//   record.delivered(), record.due();
//
// An answer belongs to the first request that became due after the answer before it. Those that
// became due in between are lost: the robot has one request at a time, and skips requests that it
// could not send in their period. Only if an answer arrives while none is due, because the robot's
// period has shifted relative to the fixed clock, does it count for the latest lost one within the
// deadline. Only requests due from `from_ms` on, and whose deadline is not after `to_ms`, count;
// gaps are measured from `from_ms` to `to_ms`. Times in ms. One thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace pheromone::swarm {

class DeliveryRecord {
 public:
  struct Rules {
    int64_t period_ms = 200;
    int64_t deadline_ms = 500;
    int64_t from_ms = 0;
    int64_t to_ms = 0;
  };

  explicit DeliveryRecord(const Rules& rules);

  /// Requests are due at `ms` and every period after it, whatever was due by an earlier clock.
  void StartClock(int64_t ms);
  /// An answer arrived at `ms`, not before the previous one.
  void OnAnswer(int64_t ms);
  /// Counts requests that are still due as lost. To be called once, at the end.
  void Finish();

  int64_t due() const { return due_; }
  int64_t delivered() const { return delivered_; }
  /// Answers between from_ms and to_ms.
  int64_t answers() const { return answers_; }
  int64_t longest_gap_ms() const { return longest_gap_ms_; }
  /// From the moment a request was due to its answer, in ms; one for each answer that belonged to a
  /// request, in time or not.
  const std::vector<int64_t>& latencies_ms() const { return latencies_ms_; }

 private:
  bool Counts(int64_t due_ms) const;
  void PassOver(int64_t until_ms);
  void MakeGood(int64_t ms);

  Rules rules_;
  bool clock_runs_ = false;
  int64_t next_due_ms_ = 0;       // of the request that the next answer belongs to
  std::vector<int64_t> lost_ms_;  // due, and passed over
  std::vector<int64_t> latencies_ms_;
  int64_t last_answer_ms_;
  int64_t due_ = 0;
  int64_t delivered_ = 0;
  int64_t answers_ = 0;
  int64_t longest_gap_ms_ = 0;
};

}  // namespace pheromone::swarm
