#include "client_fw/experiments/channel/report.h"

#include <fmt/format.h>

#include <algorithm>

namespace pheromone::swarm {
namespace {

int64_t ToMs(int64_t ns) {
  return ns / 1'000'000;
}

std::string AskingOf(const ChannelExperiment& experiment) {
  return experiment.period_ms == 0 ? "continuously"
                                   : fmt::format("{:g} Hz", 1000.0 / experiment.period_ms);
}

const char* NameOf(Access access) {
  return access == Access::kRounds ? "rounds" : "contention";
}

// What is unusual about it.
std::string OtherOf(const ChannelExperiment& e) {
  if (e.hidden_pairs > 0) {
    return fmt::format("{} hidden", e.hidden_pairs);
  }
  if (e.frame_loss > 0) {
    return fmt::format("{:g} % lost", 100 * e.frame_loss);
  }
  if (e.air != Air{}) {
    return NameOf(e.air);
  }
  if (e.simple > 0) {
    return fmt::format("{} simple", e.simple);
  }
  return e.together ? "together" : "-";
}

// A figure that is meaningless for this row stays empty.
std::string OnlyIf(bool meaningful, double value, int digits) {
  return meaningful ? fmt::format("{:.{}f}", value, digits) : "";
}

// The end of the bin of a link table that holds `ms`.
int64_t BinEnd(int64_t ms) {
  constexpr int64_t kWidthMs = 10;
  constexpr int64_t kEvenUntilMs = 1'000;
  int64_t end_ms = (ms + kWidthMs - 1) / kWidthMs * kWidthMs;
  if (ms > kEvenUntilMs) {
    for (end_ms = kEvenUntilMs; end_ms < ms;) {
      end_ms += end_ms / 10;
    }
  }
  return end_ms;
}

// Of sorted values.
std::string BinsToCsv(const std::string& row, const std::vector<int64_t>& values_ms) {
  std::string csv;
  for (auto from = values_ms.begin(); from != values_ms.end();) {
    const auto to = std::upper_bound(from, values_ms.end(), BinEnd(*from));
    csv += fmt::format("{},{},{},{}\n", row, *from, *(to - 1), to - from);
    from = to;
  }
  return csv;
}

}  // namespace

std::string TableHead() {
  return "robots access     asking       T_t D_s carrier other        |  C_1 bound  goodput "
         "(worst) of C_1 | "
         "delivered "
         "(worst seed, robot)   share |  p50   p99   gap stops\n";
}

std::string ToTableRow(const ChannelSummary& row) {
  const ChannelExperiment& e = row.experiment;
  const bool clocked = e.period_ms != 0;
  return fmt::format(
      "{:6} {:10} {:12} {:3} {:3} {:7} {:12} | {:4.1f} {:5.1f}  {:7.1f} ({:5.1f}) {:4.0f} % | "
      "{:>7} % "
      "({:>5} %, {:>5} %) {:7.2f} | {:4} {:5} {:5} {:5}\n",
      e.robots, NameOf(e.access), AskingOf(e), ToMs(e.timing.turnaround_ns),
      ToMs(e.timing.server_delay_ns), e.timing.carrier_detect ? "yes" : "no", OtherOf(e), row.peak,
      row.ideal, row.goodput, row.worst_goodput, 100 * row.goodput / row.peak,
      OnlyIf(clocked, 100 * row.delivered, 1), OnlyIf(clocked, 100 * row.worst_delivered, 1),
      OnlyIf(clocked, 100 * row.worst_robot_delivered, 1), row.worst_robot_share, row.p50_ms,
      row.p99_ms, row.longest_gap_ms, row.fail_safe_stops);
}

std::string ToCsv(const std::vector<ChannelSummary>& rows) {
  std::string csv =
      "robots,access,simple,period_ms,turnaround_ms,server_delay_ms,carrier_detect,hidden_pairs,"
      "frame_loss_percent,together,seeds,peak_per_s,"
      "bound_per_s,goodput_per_s,worst_goodput_per_s,goodput_percent_of_peak,delivered_percent,"
      "worst_seed_delivered_percent,worst_robot_delivered_percent,worst_robot_of_mean,p50_ms,"
      "p99_ms,longest_gap_ms,fail_safe_stops,time_to_order_ms,pose_age_p50_ms,"
      "requests_per_answer,channel_percent,hash\n";
  for (const ChannelSummary& row : rows) {
    const ChannelExperiment& e = row.experiment;
    const bool clocked = e.period_ms != 0;
    csv += fmt::format(
        "{},{},{},{},{},{},{:d},{},{:g},{:d},{},{:.2f},{:.2f},{:.2f},{:.2f},{:.1f},{},{},{},{:.3f},"
        "{},{},{},{},{},{},{:.3f},{:.1f},{:016x}\n",
        e.robots, NameOf(e.access), e.simple, e.period_ms, ToMs(e.timing.turnaround_ns),
        ToMs(e.timing.server_delay_ns), e.timing.carrier_detect, e.hidden_pairs, 100 * e.frame_loss,
        e.together, row.seeds, row.peak, row.ideal, row.goodput, row.worst_goodput,
        100 * row.goodput / row.peak, OnlyIf(clocked, 100 * row.delivered, 2),
        OnlyIf(clocked, 100 * row.worst_delivered, 2),
        OnlyIf(clocked, 100 * row.worst_robot_delivered, 2), row.worst_robot_share, row.p50_ms,
        row.p99_ms, row.longest_gap_ms, row.fail_safe_stops, row.time_to_order_ms,
        row.pose_age_p50_ms, row.requests_per_answer, 100 * row.utilisation, row.hash);
  }
  return csv;
}

std::string AirToCsv(const std::vector<ChannelSummary>& rows) {
  std::string csv =
      "air,byte_error_percent,burst_bytes,robots,access,turnaround_ms,adapter_ms,seeds,"
      "b1_per_s,goodput_per_s,of_b1,worst_goodput_per_s,worst_robot_of_mean,p99_ms,longest_gap_ms,"
      "fail_safe_stops,hash\n";
  for (const ChannelSummary& row : rows) {
    const ChannelExperiment& e = row.experiment;
    csv += fmt::format(
        "\"{}\",{:g},{:g},{},{},{},{},{},{:.2f},{:.2f},{:.3f},{:.2f},{:.3f},{},{},{},"
        "{:016x}\n",
        NameOf(e.air), 100 * e.air.byte_error, e.air.burst_bytes, e.robots, NameOf(e.access),
        ToMs(e.timing.turnaround_ns), ToMs(e.timing.adapter_ns), row.seeds, row.lossy_bound,
        row.goodput, row.goodput / row.lossy_bound, row.worst_goodput, row.worst_robot_share,
        row.p99_ms, row.longest_gap_ms, row.fail_safe_stops, row.hash);
  }
  return csv;
}

std::string ToJson(const ChannelSummary& row) {
  const ChannelExperiment& e = row.experiment;
  return fmt::format(
      "{{\"access\": \"{}\", \"signed\": {}, \"robots\": {}, \"simple\": {}, \"baud\": {}, "
      "\"turnaround_ms\": {}, \"exchanges_per_s\": {:.2f}, \"share_of_c1\": {:.4f}, "
      "\"delivered\": {}, \"p50_ms\": {}, \"p99_ms\": {}, \"longest_gap_ms\": {}, "
      "\"fail_safe_stops\": {}, \"time_to_order_ms\": {}, \"pose_age_p50_ms\": {}, "
      "\"worst_robot_of_mean\": {:.3f}}}\n",
      NameOf(e.access), e.is_signed, e.robots, e.simple, e.timing.baud,
      ToMs(e.timing.turnaround_ns), row.goodput, row.goodput / row.peak,
      e.period_ms != 0 ? fmt::format("{:.4f}", row.delivered) : "null", row.p50_ms, row.p99_ms,
      row.longest_gap_ms, row.fail_safe_stops, row.time_to_order_ms, row.pose_age_p50_ms,
      row.worst_robot_share);
}

std::string GapsToCsv(const std::vector<ChannelSummary>& rows) {
  constexpr size_t kPoints = 60;
  std::string csv = "access,frame_loss_percent,share,gap_ms\n";
  for (const ChannelSummary& row : rows) {
    const ChannelExperiment& e = row.experiment;
    const bool is_plain = OtherOf(e) == "-";
    if (e.robots != 16 || row.gaps_ms.empty() || !(is_plain || e.frame_loss == 0.05) ||
        e.timing.turnaround_ns != rows.front().experiment.timing.turnaround_ns) {
      continue;
    }
    for (size_t i = 0; i <= kPoints; ++i) {
      const size_t rank = i * (row.gaps_ms.size() - 1) / kPoints;
      csv += fmt::format("{},{:g},{:.4f},{}\n", NameOf(e.access), 100 * e.frame_loss,
                         static_cast<double>(i) / kPoints, row.gaps_ms[rank]);
    }
  }
  return csv;
}

std::string LinkTableToCsv(const std::vector<ChannelSummary>& rows) {
  std::string csv = "lost_percent,robots,figure,from_ms,to_ms,count\n";
  for (const ChannelSummary& row : rows) {
    const std::string name =
        fmt::format("{:g},{}", 100 * row.experiment.frame_loss, row.experiment.robots);
    csv += BinsToCsv(name + ",gap", row.gaps_ms);
    csv += BinsToCsv(name + ",age", row.pose_ages_ms);
  }
  return csv;
}

}  // namespace pheromone::swarm
