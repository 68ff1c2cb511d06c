#include "client_fw/experiments/trails/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "server/core/engine/engine.h"
#include "server/formats/nets/system_file.h"

namespace pheromone::swarm {
namespace {

constexpr std::string_view kNest = "nest";  // the place where all robots are at first
constexpr double kLeftOf = 100;             // 1/100 is left when a lifetime is over
constexpr double kLocked = 0.9;

Result<petri::LiveSettings> SettingsOf(const TrailsBench& bench) {
  const std::vector<petri::LiveSettings>& nets = bench.config.engine.nets;
  if (nets.size() != 1) {
    return Error{fmt::format("{} has {} [[net]], expected one", bench.name, nets.size())};
  }
  return nets.front();
}

petri::Place* NestOf(petri::Net* net) {
  const auto found = std::find_if(net->places.begin(), net->places.end(),
                                  [](const petri::Place& place) { return place.id == kNest; });
  return found == net->places.end() ? nullptr : &*found;
}

}  // namespace

Result<TrailsRules> RulesOf(const TrailsBench& bench) {
  PHEROMONE_TRY(petri::LiveSettings settings, SettingsOf(bench));
  const petri::Place* const nest = NestOf(&settings.net);
  if (nest == nullptr) {
    return Error{fmt::format("{}: net {} has no place \"{}\", where robots are at first",
                             bench.name, settings.name, kNest)};
  }
  return TrailsRules{.robots = static_cast<int>(nest->tokens),
                     .law = settings.law,
                     .rate_milli = settings.rate_milli,
                     .dead_band_milli = settings.dead_band_milli,
                     .has_source = settings.has_source,
                     .source = settings.source};
}

Result<engine::EngineConfig> ConfigWith(const TrailsBench& bench, const TrailsRules& rules) {
  PHEROMONE_TRY(petri::LiveSettings settings, SettingsOf(bench));
  if (rules.exploring) {
    Result<petri::Net> net = nets::LoadSystem(bench.folder / "nets/pheromone_exploring.toml");
    if (!net.ok()) {
      return net.error();
    }
    settings.net = std::move(net).value();
    settings.net.claims.clear();
  }
  petri::Place* const nest = NestOf(&settings.net);
  if (nest == nullptr) {
    return Error{fmt::format("{}: net {} has no place \"{}\", where robots are at first",
                             bench.name, settings.name, kNest)};
  }
  nest->tokens = static_cast<uint32_t>(rules.robots);
  settings.law = rules.law;
  settings.rate_milli = rules.rate_milli;
  settings.dead_band_milli = rules.dead_band_milli;
  settings.has_source = rules.has_source;
  settings.source = rules.source;
  engine::EngineConfig config = bench.config.engine;
  config.nets = {std::move(settings)};
  return config;
}

uint32_t RateForLifetime(petri::EvaporationLaw law, double amount, double lifetime_s) {
  using petri::EvaporationLaw;
  double rate = 0;
  switch (law) {
    case EvaporationLaw::kE1:
      rate = amount * amount / (2 * lifetime_s);
      break;
    case EvaporationLaw::kE2:
      rate = amount * std::log(kLeftOf) / lifetime_s;
      break;
    case EvaporationLaw::kE3:
      rate = amount / lifetime_s;
      break;
    case EvaporationLaw::kE4:
      rate = amount * amount / lifetime_s;
      break;
    case EvaporationLaw::kExponential:
      rate = std::log(kLeftOf) / lifetime_s;
      break;
    case EvaporationLaw::kCounter:
      break;
  }
  return static_cast<uint32_t>(std::lround(1000 * rate));
}

const petri::LiveNet* NetIn(const engine::Engine& engine) {
  const auto& nets = engine.nets().nets();
  return nets.empty() ? nullptr : &nets.begin()->second.net;
}

TrailsSample SampleOf(const engine::Engine& engine, uint64_t now_ms) {
  TrailsSample sample{.time_ms = static_cast<int64_t>(now_ms)};
  if (const petri::LiveNet* const net = NetIn(engine)) {
    const petri::Evaporation evaporation = net->rules().settings.evaporation();
    sample.concentration_milli = {ConcentrationAt(evaporation, net->trails().a, now_ms),
                                  ConcentrationAt(evaporation, net->trails().b, now_ms)};
    sample.advice = net->Advised();
    sample.source_left = net->source_left();
  }
  return sample;
}

void TrailsRun::CountOwn(const client::NetRobot& robot) {
  const client::NetCounters& counters = robot.counters();
  own_deposits += counters.stored[0] + counters.stored[1];
  own_deposited += counters.amount[0] + counters.amount[1];
  robot_exceptions += counters.exceptions;
}

TrailsSummary Summarise(const TrailsRun& run) {
  TrailsSummary summary;
  const int64_t late_ms = run.duration_ms - run.duration_ms / 4;
  uint64_t late_b = 0;
  for (const TrailsChoice& choice : run.ledger.choices()) {
    ++summary.choices[static_cast<size_t>(choice.trail)];
    if (choice.time_ms >= late_ms) {
      ++summary.late_choices;
      late_b += choice.trail == BenchTrail::kB ? 1 : 0;
    }
  }
  if (summary.late_choices > 0) {
    summary.late_share_b = static_cast<double>(late_b) / static_cast<double>(summary.late_choices);
    summary.locked_on_a = summary.late_share_b <= 1 - kLocked;
    summary.locked_on_b = summary.late_share_b >= kLocked;
  }
  if (run.duration_ms > 0) {
    summary.trips_per_hour =
        static_cast<double>(run.ledger.trips()) * 3.6e6 / static_cast<double>(run.duration_ms);
  }
  return summary;
}

}  // namespace pheromone::swarm
