#include "client_fw/experiments/trails/report.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

namespace pheromone::swarm {
namespace {

const char* NameOf(BenchTrail trail) {
  return trail == BenchTrail::kA ? "A" : "B";
}

const char* CodeOf(petri::Advice advice) {
  return advice == petri::Advice::kA ? "01" : advice == petri::Advice::kB ? "10" : "00";
}

}  // namespace

bool IsSoundByRobots(const TrailsRun& run) {
  return run.collisions == 0 && run.bumps == 0 && run.robot_exceptions == 0 &&
         run.ledger.refusals() == 0;
}

// A deposit counts for the robot once it knows; at the end one may be on its way to it.
bool IsSound(const TrailsRun& run) {
  const uint64_t known = run.ledger.deposits().size();
  return IsSoundByRobots(run) && run.server.exceptions == 0 && known <= run.server.deposits &&
         run.server.deposits <= known + 1 &&
         (known != run.server.deposits || run.ledger.deposited() == run.server.deposited);
}

std::string ToTable(const TrailsRun& run) {
  const TrailsSummary summary = Summarise(run);
  std::string text = fmt::format(
      "{} robots, {:.0f} s: {} round trips, {:.0f} an hour\n"
      "choices: {} A, {} B; in the last quarter {:.0f} % B of {}{}\n"
      "deposits: {} of {} units, as heard on the air\n",
      run.robots, static_cast<double>(run.duration_ms) / 1000, run.ledger.trips(),
      summary.trips_per_hour, summary.choices[0], summary.choices[1], 100 * summary.late_share_b,
      summary.late_choices,
      summary.locked_on_b   ? ": locked in on the long trail"
      : summary.locked_on_a ? ": locked in on the short trail"
                            : "",
      run.ledger.deposits().size(), run.ledger.deposited());
  text += fmt::format("          {} of {} by the robots that can be asked\n", run.own_deposits,
                      run.own_deposited);
  if (run.server.records > 0) {  // else it is a daemon's account
    text += fmt::format("          {} of {} by the environment; taken from the source: {}\n",
                        run.server.deposits, run.server.deposited, run.server.taken);
  }
  text += fmt::format("exceptions: {} of robots, {} refused records", run.robot_exceptions,
                      run.ledger.refusals());
  text += run.server.records > 0
              ? fmt::format(", {} of the environment; of {} records {} repeated\n",
                            run.server.exceptions, run.server.records, run.server.repeats)
              : "\n";
  if (std::isfinite(run.least_gap_m) && run.least_gap_m != 0) {
    text += fmt::format(
        "collisions: {}, bumps: {}; closest: {:.0f} mm from rim to rim; fail-safe stops: {}; "
        "fullest channel in use {:.0f} %\n",
        run.collisions, run.bumps, 1000 * run.least_gap_m, run.fail_safe_stops,
        100 * run.utilisation);
  }
  return text;
}

std::string DepositsToCsv(const TrailsRun& run) {
  std::string csv = "robot,trail,chosen_s,stored_s,home_s,amount\n";
  for (const TrailsTrip& trip : run.ledger.deposits()) {
    csv += fmt::format(
        "{},{},{:.1f},{:.1f},{},{}\n", trip.robot + 1, NameOf(trip.trail),
        static_cast<double>(trip.chosen_ms) / 1000, static_cast<double>(trip.stored_ms) / 1000,
        trip.home_ms < 0 ? std::string()
                         : fmt::format("{:.1f}", static_cast<double>(trip.home_ms) / 1000),
        trip.amount);
  }
  return csv;
}

std::string SamplesToCsv(const std::vector<TrailsSample>& samples) {
  std::string csv = "time_s,concentration_a,concentration_b,advice,robots_on_a,robots_on_b\n";
  for (const TrailsSample& sample : samples) {
    csv +=
        fmt::format("{:.1f},{:.3f},{:.3f},{},{},{}\n", static_cast<double>(sample.time_ms) / 1000,
                    static_cast<double>(sample.concentration_milli[0]) / 1000,
                    static_cast<double>(sample.concentration_milli[1]) / 1000,
                    CodeOf(sample.advice), sample.robots_on[0], sample.robots_on[1]);
  }
  return csv;
}

std::string MarksToCsv(const std::vector<StoryMark>& marks) {
  std::string csv = "time_s,what\n";
  for (const StoryMark& mark : marks) {
    csv += fmt::format("{:.1f},\"{}\"\n", static_cast<double>(mark.time_ms) / 1000, mark.label);
  }
  return csv;
}

std::string BenchToCsv(const TrailsBench& bench, const std::vector<sim::PlanePose>& robots) {
  // Within an area: from its entrances to its tag, and to its exits.
  struct Part {
    int line;
    const char* from;
    const char* to;
  };
  constexpr std::array<Part, 10> kAreas = {{{kNestLine, "N1", "P"},
                                            {kTrailAOut, "P", "N5"},
                                            {kTrailBOut, "P", "N6"},
                                            {kTrailABack, "N2", "P"},
                                            {kTrailBBack, "N3", "P"},
                                            {kHomeLine, "P", "N4"},
                                            {kTrailAOut, "S1", "Src"},
                                            {kTrailBOut, "S2", "Src"},
                                            {kTrailABack, "Src", "S3"},
                                            {kTrailBBack, "Src", "S4"}}};
  std::string csv = "what,number,name,x_m,y_m,value\n";
  const auto add = [&](const char* what, size_t number, std::string_view name, double x_m,
                       double y_m, const std::string& value = {}) {
    csv += fmt::format("{},{},{},{:.3f},{:.3f},{}\n", what, number, name, x_m, y_m, value);
  };
  const auto add_line = [&](const char* what, size_t number, int line, double from_m, double to_m) {
    const char* const name = line == kNestLine || line == kHomeLine      ? "nest"
                             : line == kTrailAOut || line == kTrailABack ? "a"
                                                                         : "b";
    for (const sim::PlanePose& pose : bench.PlacesOn(line, from_m, to_m, 0.1)) {
      add(what, number, name, pose.x_m, pose.y_m);
    }
  };
  for (size_t i = 0; i < kAreas.size(); ++i) {
    const Part& part = kAreas[i];
    add_line("area", i + 1, part.line, bench.AlongOf(part.line, *bench.FindTag(part.from)),
             bench.AlongOf(part.line, *bench.FindTag(part.to)));
  }
  for (const auto& [type, line] : bench.lines) {
    add_line("line", static_cast<size_t>(type), type, 0, field::LengthOf(line.path) / 1e6);
  }
  for (size_t i = 0; i < bench.tags.size(); ++i) {
    const BenchTag& tag = bench.tags[i];
    const std::string& name = tag.name;
    const bool is_entrance =
        name == "N1" || name == "N2" || name == "N3" || name == "S1" || name == "S2";
    add(is_entrance                    ? "entrance"
        : name == "P" || name == "Src" ? "tag"
                                       : "exit",
        i + 1, name, tag.x_m, tag.y_m);
  }
  for (size_t i = 0; i < robots.size(); ++i) {
    add("robot", i + 1, "", robots[i].x_m, robots[i].y_m, fmt::format("{:g}", kBenchRobotRadiusM));
  }
  return csv;
}

}  // namespace pheromone::swarm
