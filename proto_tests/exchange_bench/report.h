// What exchange_bench has measured: a line for people as soon as it is there, and a row of a CSV
// file.
#pragma once

#include <cstdint>
#include <fstream>
#include <string>

#include "proto_tests/exchange_bench/quantiles.h"

namespace pheromone::bench {

struct Row {
  std::string server;  ///< "volatile" or "durable"; "none": the machine without it
  std::string load;    ///< "SENSE on 16 ptys at 9600 baud"
  int clients = 0;
  double per_second = 0;       ///< 0: paced
  double echo_per_second = 0;  ///< of the same sockets without the engine; 0: not measured
  double share_of_echo = 0;
  uint64_t right = 0;
  uint64_t wrong = 0;
  uint64_t lost = 0;
  Quantiles times = {};
};

class Report {
 public:
  /// `csv_file` may be empty.
  explicit Report(const std::string& csv_file);

  void Add(Row row);
  /// A line for people only.
  static void Say(const std::string& line);

  /// Answers that were wrong, in all rows.
  uint64_t wrong() const { return wrong_; }

 private:
  std::ofstream csv_;
  uint64_t wrong_ = 0;
};

}  // namespace pheromone::bench
