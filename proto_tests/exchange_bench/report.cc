#include "proto_tests/exchange_bench/report.h"

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>

namespace pheromone::bench {
namespace {

double Milliseconds(std::chrono::nanoseconds time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

}  // namespace

Report::Report(const std::string& csv_file) {
  if (csv_file.empty()) {
    return;
  }
  csv_.open(csv_file);
  if (!csv_) {
    fmt::print(stderr, "exchange_bench: cannot write {}\n", csv_file);
    std::exit(1);
  }
  csv_ << "server,load,clients,per_second,echo_per_second,share_of_echo,right,wrong,lost,p50_ms,"
          "p99_ms,p999_ms\n";
}

void Report::Add(Row row) {
  wrong_ += row.wrong;
  std::string rate;
  if (row.per_second > 0) {
    rate = fmt::format(" {:7.0f}/s", row.per_second);
  }
  if (row.echo_per_second > 0) {
    rate += fmt::format(", {:.0f} % of the bare echo's {:.0f}/s", 100 * row.share_of_echo,
                        row.echo_per_second);
  }
  const double p50 = Milliseconds(row.times.At(0.5));
  const double p99 = Milliseconds(row.times.At(0.99));
  const double p999 = Milliseconds(row.times.At(0.999));
  Say(
      fmt::format("{:9}{}:{}{} p50 {:.3f} ms, p99 {:.3f} ms, p99.9 {:.3f} ms; {} right, {} wrong, "
                  "{} lost",
                  row.server, row.load, rate, rate.empty() ? "" : ";", p50, p99, p999, row.right,
                  row.wrong, row.lost));
  if (csv_.is_open()) {
    csv_ << fmt::format("{},{},{},{:.0f},{:.0f},{:.3f},{},{},{},{:.4f},{:.4f},{:.4f}\n", row.server,
                        row.load, row.clients, row.per_second, row.echo_per_second,
                        row.share_of_echo, row.right, row.wrong, row.lost, p50, p99, p999)
         << std::flush;
  }
}

void Report::Say(const std::string& line) {
  fmt::print("{}\n", line);
  std::fflush(stdout);
}

}  // namespace pheromone::bench
