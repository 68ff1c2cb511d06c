#include "client_fw/experiments/cleaning/report.h"

#include <fmt/format.h>

#include <algorithm>

namespace pheromone::swarm {
namespace {

double InSeconds(int64_t ms) {
  return static_cast<double>(ms) / 1000;
}

// The figures of one zone.
struct ZoneFigures {
  int cleanings = 0;
  int64_t gap_ms = 0;
  double highest_percent = 0;
};

ZoneFigures FiguresOf(const CleaningExperiment& experiment, const CleaningRun& run, int zone) {
  ZoneFigures figures;
  figures.cleanings = static_cast<int>(
      std::count_if(run.cleanings.begin(), run.cleanings.end(),
                    [=](const Cleaning& it) { return it.zone == zone && it.is_done; }));
  figures.gap_ms = WorstGapMs(zone, run.cleanings, experiment.duration_ms);
  figures.highest_percent = HighestPercent(
      SoilOf(experiment.grid, experiment.soil, zone, run.cleanings, experiment.duration_ms));
  return figures;
}

}  // namespace

std::string ToTable(const CleaningExperiment& experiment, const CleaningRun& run) {
  std::string table = "zone  rate  cleanings  longest gap, s  highest soil\n";
  for (int zone = 0; zone < experiment.grid.zones(); ++zone) {
    if (experiment.IsClosed(zone)) {
      table += fmt::format("{:4}  closed\n", zone + 1);
      continue;
    }
    const ZoneFigures figures = FiguresOf(experiment, run, zone);
    table += fmt::format(
        "{:4}  {:2} %  {:9}  {:14.1f}  {:10.0f} %{}\n", zone + 1, experiment.grid.RatePercent(zone),
        figures.cleanings, InSeconds(figures.gap_ms), figures.highest_percent,
        figures.highest_percent >= experiment.soil.threshold_percent ? "  threshold reached" : "");
  }
  const CleaningSummary summary = Summarise(experiment, run);
  const double ideal_s = experiment.IdealCycleSeconds();
  table += fmt::format(
      "\n{} cleanings; a robot needs {:.1f} s for each, with the way there and what it asks\n"
      "longest gap {:.1f} s (zone {}), mean {:.1f} s; an ideal cycle takes {:.1f} s: {:.2f} of it\n"
      "channel {:.0f} % busy, {} requests for tags, {} claims lost, {} fail-safe stops\n"
      "two robots cleaned one zone: {}\n",
      summary.done, summary.turn_s, summary.worst_gap_s, summary.worst_zone + 1, summary.mean_gap_s,
      ideal_s, summary.worst_gap_s / ideal_s, 100 * run.utilisation, run.tag_requests,
      run.lost_claims, run.fail_safe_stops,
      run.together_ms == 0 ? "never" : fmt::format("for {:.3f} s", InSeconds(run.together_ms)));
  if (run.misplaced != 0) {
    table += fmt::format("cleaned another zone than the one claimed: {} times\n", run.misplaced);
  }
  return table;
}

std::string ZonesToCsv(const CleaningExperiment& experiment, const CleaningRun& run) {
  std::string csv = "zone,x_m,y_m,rate_percent,cleanings,longest_gap_s,highest_percent\n";
  for (int zone = 0; zone < experiment.grid.zones(); ++zone) {
    if (experiment.IsClosed(zone)) {
      continue;
    }
    const ZoneFigures figures = FiguresOf(experiment, run, zone);
    csv += fmt::format("{},{:g},{:g},{},{},{:.3f},{:g}\n", zone + 1, experiment.grid.CentreX(zone),
                       experiment.grid.CentreY(zone), experiment.grid.RatePercent(zone),
                       figures.cleanings, InSeconds(figures.gap_ms), figures.highest_percent);
  }
  return csv;
}

std::string CleaningsToCsv(const CleaningRun& run) {
  std::string csv = "zone,robot,begin_s,end_s,done\n";
  for (const Cleaning& cleaning : run.cleanings) {
    csv += fmt::format("{},{},{:.3f},{:.3f},{}\n", cleaning.zone + 1, cleaning.robot + 1,
                       InSeconds(cleaning.begin_ms), InSeconds(cleaning.end_ms),
                       cleaning.is_done ? 1 : 0);
  }
  return csv;
}

std::string SoilToCsv(const CleaningExperiment& experiment, const CleaningRun& run) {
  std::string csv = "zone,time_s,percent\n";
  for (int zone = 0; zone < experiment.grid.zones(); ++zone) {
    if (experiment.IsClosed(zone)) {
      continue;
    }
    for (const SoilStep& step :
         SoilOf(experiment.grid, experiment.soil, zone, run.cleanings, experiment.duration_ms)) {
      csv += fmt::format("{},{:.3f},{:g}\n", zone + 1, InSeconds(step.time_ms), step.percent);
    }
  }
  return csv;
}

std::string TracksToCsv(const CleaningExperiment& experiment, const CleaningRun& run) {
  std::string csv = "robot,time_s,x_m,y_m\n";
  for (size_t robot = 0; robot < run.tracks.size(); ++robot) {
    int64_t ms = 0;
    for (const sim::PlanePose& pose : run.tracks[robot]) {
      csv += fmt::format("{},{:g},{:.3f},{:.3f}\n", robot + 1, InSeconds(ms), pose.x_m, pose.y_m);
      ms += experiment.sample_ms;
    }
  }
  return csv;
}

}  // namespace pheromone::swarm
