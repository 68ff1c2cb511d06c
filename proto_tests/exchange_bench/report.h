// The results of exchange_bench: a readable line as soon as it is available, and a row of a CSV
// file.
#pragma once

#include <chrono>
#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "proto_tests/exchange_bench/quantiles.h"

namespace pheromone::bench {

struct Row {
  std::string server;  ///< "volatile" or "durable"; "none": the machine without it
  std::string load;    ///< "SENSE on 16 ptys at 9600 baud"
  int clients = 0;
  double per_second = 0;  ///< 0: paced
  /// Of the same sockets without the engine, or with `beside`; 0: not measured.
  double echo_per_second = 0;
  double share_of_echo = 0;
  uint64_t right = 0;
  uint64_t wrong = 0;
  uint64_t lost = 0;
  uint64_t late = 0;  ///< of the lost: answered after they were abandoned
  Quantiles times = {};
  std::string beside = "the bare echo";  ///< what is compared with
};

/// A robot's results during an operator's requests and without them, in the same run.
struct BesideRow {
  Row row;                                ///< beside the operator
  Quantiles alone = {};                   ///< the same robot's times right before
  uint64_t stops = 0;                     ///< how often its fail-safe had to stop it
  std::string request;                    ///< the result of the operator's request: "done"
  std::chrono::nanoseconds request_time;  ///< the longest, if it was made more than once
  std::chrono::milliseconds unfed;        ///< the longest that the watchdog had to wait
};

/// Answer times of several rounds.
struct RoundsRow {
  std::string server;
  std::string load;
  int clients = 0;
  uint64_t right = 0;
  uint64_t wrong = 0;
  uint64_t lost = 0;
  uint64_t late = 0;
  std::vector<Quantiles> rounds = {};
};

class Report {
 public:
  /// `csv_file` may be empty.
  explicit Report(const std::string& csv_file);

  void Add(Row row);
  void Add(BesideRow beside);
  /// The medians of the rounds' quantiles; of the 99th percentile also the least and the greatest.
  void Add(RoundsRow row);
  /// A readable line only.
  static void Say(const std::string& line);

  /// Answers that were wrong, in all rows.
  uint64_t wrong() const { return wrong_; }
  /// Rows beside an operator, and those in which the longest answer took more than 20 ms and twice
  /// the longest of the robot alone, or the fail-safe had to stop it.
  uint64_t beside() const { return beside_; }
  uint64_t held_up() const { return held_up_; }

 private:
  void Write(Row* row, const std::string& more);

  std::ofstream csv_;
  uint64_t wrong_ = 0;
  uint64_t beside_ = 0;
  uint64_t held_up_ = 0;
};

}  // namespace pheromone::bench
