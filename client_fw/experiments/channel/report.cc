#include "client_fw/experiments/channel/report.h"

#include <fmt/format.h>

#include <algorithm>

#include "server/chart/panels.h"

namespace pheromone::swarm {
namespace {

constexpr double kMaxLatencyMs = 1000;  // of the picture

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
  if (e.simple > 0) {
    return fmt::format("{} simple", e.simple);
  }
  return e.together ? "together" : "-";
}

// A figure that is meaningless for this row stays empty.
std::string OnlyIf(bool meaningful, double value, int digits) {
  return meaningful ? fmt::format("{:.{}f}", value, digits) : "";
}

bool SameTiming(const ChannelTiming& a, const ChannelTiming& b) {
  return a.turnaround_ns == b.turnaround_ns && a.server_delay_ns == b.server_delay_ns;
}

struct Figure {
  const char* label;
  const char* colour;
  bool carrier_detect;
  chart::Mark (*of)(const ChannelSummary& row);
};

chart::Mark Goodput(const ChannelSummary& row) {
  return {0, row.goodput, row.worst_goodput, row.goodput};
}
chart::Mark Bound(const ChannelSummary& row) {
  return {0, row.ideal};
}
chart::Mark Median(const ChannelSummary& row) {
  return {0, static_cast<double>(row.p50_ms)};
}
chart::Mark Tail(const ChannelSummary& row) {
  return {0, static_cast<double>(row.p99_ms)};
}

constexpr const char* kWith = "#2166ac";
constexpr const char* kWithPale = "#92c5de";
constexpr const char* kWithout = "#b2182b";
constexpr const char* kWithoutPale = "#f4a582";

constexpr const char* kFullWith = "with carrier detect (latency: median)";
constexpr const char* kFullWithout = "without";
constexpr const char* kPaleWith = "its bound (latency: 99th percentile)";
constexpr const char* kPaleWithout = "bound without";

chart::Panel PanelOf(const std::vector<const ChannelSummary*>& rows, const std::string& title,
                     const std::string& y_label, const std::vector<Figure>& figures) {
  chart::Panel panel;
  panel.title = title;
  panel.x_label = "robots";
  panel.y_label = y_label;
  for (const Figure& figure : figures) {
    chart::Series series{figure.label, figure.colour, {}};
    for (const ChannelSummary* row : rows) {
      if (row->experiment.timing.carrier_detect == figure.carrier_detect) {
        series.marks.push_back(figure.of(*row));
        series.marks.back().x = row->experiment.robots;
      }
    }
    panel.series.push_back(series);
  }
  return panel;
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

std::string ToJson(const ChannelSummary& row) {
  const ChannelExperiment& e = row.experiment;
  return fmt::format(
      "{{\"access\": \"{}\", \"robots\": {}, \"simple\": {}, \"baud\": {}, "
      "\"turnaround_ms\": {}, \"exchanges_per_s\": {:.2f}, \"share_of_c1\": {:.4f}, "
      "\"delivered\": {}, \"p50_ms\": {}, \"p99_ms\": {}, \"longest_gap_ms\": {}, "
      "\"fail_safe_stops\": {}, \"time_to_order_ms\": {}, \"pose_age_p50_ms\": {}, "
      "\"worst_robot_of_mean\": {:.3f}}}\n",
      NameOf(e.access), e.robots, e.simple, e.timing.baud, ToMs(e.timing.turnaround_ns),
      row.goodput, row.goodput / row.peak,
      e.period_ms != 0 ? fmt::format("{:.4f}", row.delivered) : "null", row.p50_ms, row.p99_ms,
      row.longest_gap_ms, row.fail_safe_stops, row.time_to_order_ms, row.pose_age_p50_ms,
      row.worst_robot_share);
}

std::string DrawChannelPicture(const std::vector<ChannelSummary>& rows) {
  std::vector<ChannelTiming> timings;
  for (const ChannelSummary& row : rows) {
    const ChannelTiming& timing = row.experiment.timing;
    if (std::none_of(timings.begin(), timings.end(),
                     [&](const ChannelTiming& known) { return SameTiming(known, timing); })) {
      timings.push_back(timing);
    }
  }
  std::vector<chart::Panel> panels;
  for (const ChannelTiming& timing : timings) {
    std::vector<const ChannelSummary*> shown;
    for (const ChannelSummary& row : rows) {
      if (row.experiment.period_ms != 0 && row.experiment.hidden_pairs == 0 &&
          SameTiming(row.experiment.timing, timing)) {
        shown.push_back(&row);
      }
    }
    if (shown.empty()) {
      continue;
    }
    const std::string title = fmt::format("T_t {} ms, D_s {} ms", ToMs(timing.turnaround_ns),
                                          ToMs(timing.server_delay_ns));
    panels.push_back(PanelOf(shown, fmt::format("{}; C_1 = {:.1f}/s", title, shown.front()->peak),
                             "answers a second",
                             {{kPaleWith, kWithPale, true, Bound},
                              {kPaleWithout, kWithoutPale, false, Bound},
                              {kFullWith, kWith, true, Goodput},
                              {kFullWithout, kWithout, false, Goodput}}));
    panels.push_back(PanelOf(shown, title, "from due to answered, ms",
                             {{kPaleWith, kWithPale, true, Tail},
                              {kPaleWithout, kWithoutPale, false, Tail},
                              {kFullWith, kWith, true, Median},
                              {kFullWithout, kWithout, false, Median}}));
    panels.back().y_most = kMaxLatencyMs;
  }
  return chart::DrawPanels("How many robots a channel can serve: one request every 200 ms", panels,
                           {.columns = 4});
}

std::string DrawRoundsPicture(const std::vector<ChannelSummary>& rows) {
  constexpr double kMaxGapMs = 3000;
  constexpr size_t kPoints = 60;
  std::vector<int64_t> turnarounds;
  for (const ChannelSummary& row : rows) {
    const int64_t ns = row.experiment.timing.turnaround_ns;
    if (std::find(turnarounds.begin(), turnarounds.end(), ns) == turnarounds.end()) {
      turnarounds.push_back(ns);
    }
  }
  const auto is_plain = [](const ChannelExperiment& e) { return OtherOf(e) == "-"; };
  std::vector<chart::Panel> panels;
  for (const int64_t turnaround_ns : turnarounds) {
    chart::Panel rate;
    rate.title = fmt::format("T_t = {} ms", ToMs(turnaround_ns));
    rate.x_label = "robots";
    rate.y_label = "answers a second";
    chart::Panel gap;
    gap.title = rate.title;
    gap.x_label = rate.x_label;
    gap.y_label = "longest gap between answers, ms";
    gap.y_most = kMaxGapMs;
    rate.series = {{"C_1: one exchange after the other", "#999999", {}},
                   {"contention", kWithout, {}},
                   {"rounds", kWith, {}},
                   {"bound of contention", kWithoutPale, {}}};
    gap.series = {{"contention", kWithout, {}}, {"rounds", kWith, {}}};
    for (const ChannelSummary& row : rows) {
      const ChannelExperiment& e = row.experiment;
      if (!is_plain(e) || e.timing.turnaround_ns != turnaround_ns) {
        continue;
      }
      const size_t which = e.access == Access::kRounds ? 1 : 0;
      const auto x = static_cast<double>(e.robots);
      const auto longest = static_cast<double>(row.longest_gap_ms);
      if (which == 1) {
        rate.series[0].marks.push_back({x, row.peak});
        rate.series[3].marks.push_back({x, row.ideal});
      }
      rate.series[which + 1].marks.push_back({x, row.goodput, row.worst_goodput, row.goodput});
      gap.series[which].marks.push_back({x, longest});
    }
    panels.push_back(rate);
    panels.push_back(gap);
  }
  chart::Panel cdf;
  cdf.title = fmt::format("16 robots, T_t = {} ms", ToMs(turnarounds.front()));
  cdf.x_label = "gap between a robot's answers, ms";
  cdf.y_label = "share of gaps up to that";
  const auto add = [&](const ChannelSummary& row, const std::string& label, const char* colour) {
    chart::Series series{label, colour, {}};
    for (size_t i = 0; i <= kPoints && !row.gaps_ms.empty(); ++i) {
      const size_t rank = i * (row.gaps_ms.size() - 1) / kPoints;
      const auto ms = static_cast<double>(row.gaps_ms[rank]);
      if (ms <= kMaxGapMs) {
        series.marks.push_back({ms, static_cast<double>(i) / kPoints});
      }
    }
    cdf.series.push_back(series);
  };
  for (const ChannelSummary& row : rows) {
    const ChannelExperiment& e = row.experiment;
    if (e.robots != 16 || e.timing.turnaround_ns != turnarounds.front()) {
      continue;
    }
    const bool rounds = e.access == Access::kRounds;
    if (is_plain(e)) {
      add(row, rounds ? "rounds" : "contention", rounds ? kWith : kWithout);
    } else if (e.frame_loss == 0.05) {
      add(row, rounds ? "rounds, 5 % lost" : "contention, 5 % lost",
          rounds ? kWithPale : kWithoutPale);
    }
  }
  panels.push_back(cdf);
  return chart::DrawPanels("Rounds and contention: one request every 200 ms from each robot",
                           panels, {.columns = 3});
}

}  // namespace pheromone::swarm
