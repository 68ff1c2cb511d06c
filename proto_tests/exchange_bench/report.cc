#include "proto_tests/exchange_bench/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "proto_tests/exchange_bench/fail.h"

namespace pheromone::bench {
namespace {

double Milliseconds(std::chrono::nanoseconds time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

double Ms(Quantiles* times, double q) {
  return Milliseconds(times->At(q));
}

// The quantile of each round, in ascending order.
std::vector<double> OfRounds(std::vector<Quantiles>* rounds, double q) {
  std::vector<double> all;
  for (Quantiles& round : *rounds) {
    all.push_back(Ms(&round, q));
  }
  std::sort(all.begin(), all.end());
  return all;
}

// As a field of a CSV file.
std::string Field(const std::string& text) {
  return text.find(',') == std::string::npos ? text : '"' + text + '"';
}

// What an operator may delay an answer by.
constexpr double kMaxDelayMs = 20;

}  // namespace

Report::Report(const std::string& csv_file) {
  if (csv_file.empty()) {
    return;
  }
  csv_.open(csv_file);
  if (!csv_) {
    Fail("cannot write " + csv_file);
  }
  csv_ << "server,load,clients,per_second,echo_per_second,share_of_echo,right,wrong,lost,p50_ms,"
          "p99_ms,p999_ms,late,longest_ms,alone_p99_ms,alone_longest_ms,stops,request_ms,unfed_ms,"
          "request\n";
}

void Report::Add(Row row) {
  std::string rate;
  if (row.per_second > 0) {
    rate = fmt::format(" {:7.0f}/s", row.per_second);
  }
  if (row.echo_per_second > 0) {
    rate += fmt::format(", {:.0f} % of {}'s {:.0f}/s", 100 * row.share_of_echo, row.beside,
                        row.echo_per_second);
  }
  Say(fmt::format(
      "{:9}{}:{}{} p50 {:.3f} ms, p99 {:.3f} ms, p99.9 {:.3f} ms; {} right, {} wrong, "
      "{} lost, {} late",
      row.server, row.load, rate, rate.empty() ? "" : ";", Ms(&row.times, 0.5),
      Ms(&row.times, 0.99), Ms(&row.times, 0.999), row.right, row.wrong, row.lost, row.late));
  Write(&row, ",,,,,");
}

void Report::Add(BesideRow beside) {
  Row* row = &beside.row;
  const double longest = Ms(&row->times, 1);
  const double alone = Ms(&beside.alone, 1);
  const bool held_up = longest > std::max(kMaxDelayMs, 2 * alone) || beside.stops > 0;
  ++beside_;
  held_up_ += held_up ? 1 : 0;
  Say(fmt::format(
      "{:9}{}: longest {:.3f} ms, p99 {:.3f} ms (alone {:.3f} and {:.3f}); {} right, "
      "{} wrong, {} lost, {} late; stopped {} times{}",
      row->server, row->load, longest, Ms(&row->times, 0.99), alone, Ms(&beside.alone, 0.99),
      row->right, row->wrong, row->lost, row->late, beside.stops, held_up ? "; HELD UP" : ""));
  Write(row, fmt::format("{:.4f},{:.4f},{},{:.1f},{},{}", Ms(&beside.alone, 0.99), alone,
                         beside.stops, Milliseconds(beside.request_time), beside.unfed.count(),
                         Field(beside.request)));
}

void Report::Add(RoundsRow row) {
  const auto median = [&](double q) { return OfRounds(&row.rounds, q)[row.rounds.size() / 2]; };
  const std::vector<double> p99 = OfRounds(&row.rounds, 0.99);
  Say(fmt::format(
      "{:9}{}: medians of {} rounds: p50 {:.3f} ms, p99 {:.3f} ms ({:.3f} to {:.3f}), p99.9 {:.3f} "
      "ms; {} right, {} wrong, {} lost, {} late",
      row.server, row.load, row.rounds.size(), median(0.5), median(0.99), p99.front(), p99.back(),
      median(0.999), row.right, row.wrong, row.lost, row.late));
  wrong_ += row.wrong;
  if (csv_.is_open()) {
    csv_ << fmt::format("{},{},{},0,0,0.000,{},{},{},{:.4f},{:.4f},{:.4f},{},{:.4f},,,,,,\n",
                        row.server, Field(row.load), row.clients, row.right, row.wrong, row.lost,
                        median(0.5), median(0.99), median(0.999), row.late, median(1))
         << std::flush;
  }
}

void Report::Write(Row* row, const std::string& more) {
  wrong_ += row->wrong;
  if (csv_.is_open()) {
    csv_ << fmt::format(
                "{},{},{},{:.0f},{:.0f},{:.3f},{},{},{},{:.4f},{:.4f},{:.4f},{},{:.4f},{}\n",
                row->server, Field(row->load), row->clients, row->per_second, row->echo_per_second,
                row->share_of_echo, row->right, row->wrong, row->lost, Ms(&row->times, 0.5),
                Ms(&row->times, 0.99), Ms(&row->times, 0.999), row->late, Ms(&row->times, 1), more)
         << std::flush;
  }
}

void Report::Say(const std::string& line) {
  fmt::print("{}\n", line);
  std::fflush(stdout);
}

}  // namespace pheromone::bench
