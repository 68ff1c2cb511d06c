#include "client_fw/experiments/cleaning/floor.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "server/base/file.h"
#include "server/config/document.h"
#include "server/config/reader.h"

namespace pheromone::swarm {
namespace {

using config::Problems;
using config::TableReader;
using config::Value;
using verify::CleaningLimits;

constexpr int kMaxZones = verify::kMaxZones;
constexpr int kMaxMm = 500'000;
constexpr int kMaxHorizon = 60'000;
constexpr int kDefaultRate = 5;

// Variants of what robots do: the firmware's, and faults that a proof has to find.
struct Policy {
  std::string_view name;
  bool CleaningLimits::*fault;
};
constexpr std::array<Policy, 3> kPolicies = {{
    {"firmware", nullptr},
    {"moves-between-equals", &CleaningLimits::moves_between_equals},
    {"claims-unconditionally", &CleaningLimits::claims_unconditionally},
}};

const Value& EmptyTable() {
  static const Value empty;
  return empty;
}

class FloorReader {
 public:
  FloorReader(const Value& root, std::string_view name) : root_(root), problems_(name) {}

  Result<CleaningFloor> Read() {
    TableReader(root_, "", &problems_).AllowOnly({"floor", "zone", "robots", "soil"});
    ReadZones();
    ReadRobots();
    ReadSoil();
    if (problems_.empty()) {
      Check();
    }
    if (!problems_.empty()) {
      return Error{problems_.Text()};
    }
    return std::move(floor_);
  }

 private:
  TableReader Section(std::string_view key) {
    const Value* table = root_.Find(key);
    if (table != nullptr && table->kind != Value::Kind::kTable) {
      TableReader(root_, "", &problems_).Expected(key, *table, "a table");
      table = nullptr;
    }
    return {table != nullptr ? *table : EmptyTable(), std::string(key), &problems_};
  }

  int zones() const { return floor_.grid.zones(); }

  void ReadZones() {
    const TableReader section = Section("floor");
    section.AllowOnly({"columns", "rows", "zone_m", "rates_percent", "closed"});
    const Value* const zones = root_.Find("zone");
    CleaningGrid& grid = floor_.grid;
    grid.zone_m =
        static_cast<double>(
            section.Scaled("zone_m", config::kMetresToMm, 200, 20'000, 1'000).value_or(1'000)) /
        1000;
    if (zones != nullptr) {
      section.Without({"columns", "rows", "rates_percent"}, "[[zone]]",
                      "each zone's own table to say it");
      ReadOwnZones(*zones);
    } else {
      grid.columns = static_cast<int>(section.Integer("columns", 1, kMaxZones, 4).value_or(4));
      grid.rows = static_cast<int>(section.Integer("rows", 1, kMaxZones, 3).value_or(3));
      if (grid.zones() > kMaxZones) {
        section.Report("rows", fmt::format("found {} x {} zones, expected at most {}", grid.columns,
                                           grid.rows, kMaxZones));
        grid.columns = grid.rows = 1;
      }
      LayGrid(section);
    }
    for (const int zone : ZoneNumbers(section, "closed", section.Find("closed"))) {
      floor_.limits.closed |= uint64_t{1} << zone;
    }
  }

  void LayGrid(const TableReader& section) {
    CleaningGrid& grid = floor_.grid;
    floor_.limits.columns = grid.columns;
    floor_.limits.rows = grid.rows;
    std::vector<CleaningZone> own;
    own.reserve(static_cast<size_t>(grid.zones()));
    for (int zone = 0; zone < grid.zones(); ++zone) {
      own.push_back({.x_m = grid.CentreX(zone),
                     .y_m = grid.CentreY(zone),
                     .range_m = grid.RangeOf(zone),
                     .rate_percent = kDefaultRate});
    }
    const Value* const rates = section.Find("rates_percent");
    if (rates != nullptr && rates->kind == Value::Kind::kArray) {
      if (rates->items.size() != own.size()) {
        section.Report("rates_percent",
                       fmt::format("found {} numbers, expected one for each of {} zones",
                                   rates->items.size(), own.size()));
        return;
      }
      for (size_t i = 0; i < own.size(); ++i) {
        own[i].rate_percent = Percent(section, "rates_percent", rates->items[i]);
      }
    } else if (rates != nullptr) {
      for (CleaningZone& zone : own) {
        zone.rate_percent = Percent(section, "rates_percent", *rates);
      }
    }
    grid.own = std::move(own);
  }

  static int Percent(const TableReader& section, std::string_view key, const Value& value) {
    if (value.kind != Value::Kind::kInteger || value.integer < 0 ||
        value.integer > verify::kFullPercent) {
      section.Expected(key, value, "a whole number from 0 to 100");
      return 0;
    }
    return static_cast<int>(value.integer);
  }

  void ReadOwnZones(const Value& zones) {
    const TableReader root(root_, "", &problems_);
    if (zones.kind != Value::Kind::kArray || zones.items.empty() ||
        zones.items.size() > static_cast<size_t>(kMaxZones)) {
      root.Expected("zone", zones, fmt::format("1 to {} tables [[zone]]", kMaxZones));
      return;
    }
    std::vector<const Value*> beside;
    for (size_t i = 0; i < zones.items.size(); ++i) {
      const TableReader zone(zones.items[i], fmt::format("zone[{}]", i + 1), &problems_);
      zone.AllowOnly({"x_m", "y_m", "range_m", "rate_percent", "beside"});
      const bool has_place = zone.Find("x_m") != nullptr || zone.Find("y_m") != nullptr;
      beside.push_back(zone.Find("beside"));
      floor_.has_places = floor_.has_places && has_place && beside.back() == nullptr;
      if (!has_place && beside.back() == nullptr) {
        zone.Missing("x_m", "its place, x_m and y_m, or the zones beside it");
      }
      const int64_t half_mm = std::llround(floor_.grid.zone_m * 500);  // so that robots stay on it
      const auto metres = [&](std::string_view key, std::optional<int64_t> fallback) {
        return static_cast<double>(
                   zone.Scaled(key, config::kMetresToMm, half_mm, kMaxMm, fallback).value_or(0)) /
               1000;
      };
      const std::optional<int64_t> nowhere =
          has_place ? std::nullopt : std::optional<int64_t>(half_mm);
      const double range_m = kRangeOfZone * floor_.grid.zone_m;
      floor_.grid.own.push_back(
          {.x_m = metres("x_m", nowhere),
           .y_m = metres("y_m", nowhere),
           .range_m = metres("range_m", std::llround(range_m * 1000)),
           .rate_percent = static_cast<int>(
               zone.Integer("rate_percent", 0, verify::kFullPercent, kDefaultRate).value_or(0))});
    }
    for (size_t i = 0; i < zones.items.size(); ++i) {
      const TableReader zone(zones.items[i], fmt::format("zone[{}]", i + 1), &problems_);
      floor_.limits.neighbours.push_back(beside[i] != nullptr ? Beside(zone, *beside[i])
                                                              : InSight(static_cast<int>(i)));
    }
  }

  std::vector<uint8_t> Beside(const TableReader& zone, const Value& value) {
    std::vector<uint8_t> all;
    for (const int number : ZoneNumbers(zone, "beside", &value)) {
      all.push_back(static_cast<uint8_t>(number));
    }
    return all;
  }

  // Whose tags are in range of a robot in the middle of a zone.
  std::vector<uint8_t> InSight(int zone) const {
    const CleaningGrid& grid = floor_.grid;
    std::vector<uint8_t> all;
    for (int other = 0; other < zones(); ++other) {
      const double distance_m = std::hypot(grid.CentreX(other) - grid.CentreX(zone),
                                           grid.CentreY(other) - grid.CentreY(zone));
      const auto in_mm = [](double metres) { return std::llround(1000 * metres); };
      if (other != zone && in_mm(distance_m) <= in_mm(grid.RangeOf(other))) {
        all.push_back(static_cast<uint8_t>(other));
      }
    }
    return all;
  }

  // From 0; none if the value is null.
  std::vector<int> ZoneNumbers(const TableReader& section, std::string_view key,
                               const Value* value) {
    std::vector<int> numbers;
    const std::string expected = fmt::format("numbers of zones, 1 to {}, such as [2, 3]", zones());
    if (value != nullptr && value->kind != Value::Kind::kArray) {
      section.Expected(key, *value, expected);
    } else if (value != nullptr) {
      for (const Value& item : value->items) {
        if (item.kind != Value::Kind::kInteger || item.integer < 1 || item.integer > zones()) {
          section.Expected(key, item, expected);
        } else {
          numbers.push_back(static_cast<int>(item.integer - 1));
        }
      }
    }
    return numbers;
  }

  void ReadRobots() {
    const TableReader robots = Section("robots");
    robots.AllowOnly(
        {"count", "starts", "clean_units", "move_units", "wait_units", "lease_units", "policy"});
    CleaningLimits& limits = floor_.limits;
    limits.robots = static_cast<int>(
        robots.Integer("count", 1, static_cast<int64_t>(verify::kMaxCleaners), 2).value_or(1));
    std::tie(limits.clean_min, limits.clean_max) = Units(robots, "clean_units", 5);
    std::tie(limits.move_min, limits.move_max) = Units(robots, "move_units", 1);
    limits.wait =
        static_cast<int>(robots.Integer("wait_units", 1, verify::kMaxUnits, 1).value_or(1));
    limits.lease =
        static_cast<int>(robots
                             .Integer("lease_units", 0, verify::kMaxUnits,
                                      std::min(3 * limits.clean_max + 1, verify::kMaxUnits))
                             .value_or(1));
    std::vector<std::string_view> names;
    names.reserve(std::size(kPolicies));
    for (const Policy& policy : kPolicies) {
      names.push_back(policy.name);
    }
    const Policy& policy = kPolicies[robots.OneOf("policy", names, 0).value_or(0)];
    floor_.policy = policy.name;
    if (policy.fault != nullptr) {
      limits.*policy.fault = true;
    }
    ReadStarts(robots);
  }

  // 5, or [5, 6] for any time from one to the other.
  static std::pair<int, int> Units(const TableReader& table, std::string_view key, int fallback) {
    const Value* const value = table.Find(key);
    const auto is_time = [](const Value& it) {
      return it.kind == Value::Kind::kInteger && it.integer >= 1 && it.integer <= verify::kMaxUnits;
    };
    if (value == nullptr) {
      return {fallback, fallback};
    }
    if (is_time(*value)) {
      const auto time = static_cast<int>(value->integer);
      return {time, time};
    }
    if (value->kind == Value::Kind::kArray && value->items.size() == 2 &&
        is_time(value->items[0]) && is_time(value->items[1]) &&
        value->items[0].integer <= value->items[1].integer) {
      return {static_cast<int>(value->items[0].integer), static_cast<int>(value->items[1].integer)};
    }
    table.Expected(key, *value,
                   fmt::format("a whole number from 1 to {}, or the least and the most of them, "
                               "such as [5, 6]",
                               verify::kMaxUnits));
    return {fallback, fallback};
  }

  void ReadStarts(const TableReader& robots) {
    const Value* const starts = robots.Find("starts");
    if (starts == nullptr) {
      return;
    }
    const auto count = static_cast<size_t>(floor_.limits.robots);
    const std::string expected =
        fmt::format("lists of {} zones that robots start in, such as [[{}]]", count,
                    count == 1   ? "1"
                    : count == 2 ? "1, 2"
                                 : "1, 2, ...");
    if (starts->kind != Value::Kind::kArray || starts->items.empty()) {
      robots.Expected("starts", *starts, expected);
      return;
    }
    for (const Value& start : starts->items) {
      if (start.kind != Value::Kind::kArray || start.items.size() != count) {
        robots.Expected("starts", start, expected);
        continue;
      }
      std::vector<uint8_t> zones;
      for (const int zone : ZoneNumbers(robots, "starts", &start)) {
        if ((floor_.limits.closed >> zone & 1) != 0) {
          robots.Report("starts", fmt::format("found zone {}, which is closed", zone + 1));
        }
        zones.push_back(static_cast<uint8_t>(zone));
      }
      floor_.starts.push_back(zones);
    }
  }

  void ReadSoil() {
    const TableReader soil = Section("soil");
    soil.AllowOnly({"step_units", "unit_s", "dirty_percent", "clean_percent", "start_percent",
                    "limit_percent", "horizon_units"});
    const auto integer = [&](std::string_view key, int least, int most, int fallback) {
      return static_cast<int>(soil.Integer(key, least, most, fallback).value_or(fallback));
    };
    floor_.limits.soiling_step = integer("step_units", 1, verify::kMaxUnits, verify::kSoilingStep);
    floor_.dirty = {integer("dirty_percent", 0, 100, 80), integer("clean_percent", 1, 100, 30)};
    floor_.kept = {integer("start_percent", 0, 100, 20), integer("limit_percent", 1, 100, 51)};
    floor_.horizon = integer("horizon_units", 1, kMaxHorizon, 240);
    floor_.unit_ms = soil.Scaled("unit_s", config::kSecondsToMs, 10, 3'600'000, 3'000).value_or(1);
    if (floor_.kept.start >= floor_.kept.below) {
      soil.Report("start_percent", fmt::format("found {}, expected less than limit_percent, {}",
                                               floor_.kept.start, floor_.kept.below));
    }
  }

  void Check() {
    for (const CleaningZone& zone : floor_.grid.own) {
      floor_.limits.rates_percent.push_back(zone.rate_percent);
    }
    const std::string wrong = verify::WhatIsWrong(floor_.limits);
    if (!wrong.empty()) {
      TableReader(root_, "", &problems_)
          .Report(wrong.starts_with("zone ") ? "zone" : "robots", wrong);
    }
    const uint64_t all = (uint64_t{1} << zones()) - 1;
    if ((floor_.limits.closed & all) == all) {
      Section("floor").Report("closed", "found all zones, expected one that robots may clean");
    }
  }

  const Value& root_;
  Problems problems_;
  CleaningFloor floor_;
};

}  // namespace

Result<CleaningFloor> ParseFloor(std::string_view text, std::string_view name) {
  PHEROMONE_TRY(const Value root, config::ParseDocument(text, name));
  PHEROMONE_TRY(CleaningFloor floor, FloorReader(root, name).Read());
  floor.name = std::filesystem::path(name).stem().string();
  return floor;
}

Result<CleaningFloor> LoadFloor(const std::string& path) {
  PHEROMONE_TRY(const std::string text, ReadFile(path, config::kMaxText));
  return ParseFloor(text, path);
}

Result<CleaningExperiment> ExperimentOf(const CleaningFloor& floor,
                                        const CleaningExperiment& base) {
  if (!floor.has_places) {
    return Error{floor.name +
                 ": a floor whose zones say what is beside them can be proved only; expected x_m, "
                 "y_m and range_m of each zone"};
  }
  if (floor.policy != kPolicies[0].name) {
    return Error{fmt::format("{}: policy \"{}\" can be proved only; robots have \"{}\"", floor.name,
                             floor.policy, kPolicies[0].name)};
  }
  if (floor.limits.lease == 0) {
    return Error{floor.name + ": lease_units = 0 can be proved only; robots always have a lease"};
  }
  CleaningExperiment experiment = base;
  experiment.grid = floor.grid;
  experiment.closed = floor.limits.closed;
  experiment.robots = floor.limits.robots;
  if (!floor.starts.empty()) {
    experiment.starts.assign(floor.starts.front().begin(), floor.starts.front().end());
  }
  experiment.cleaning_ms = floor.limits.clean_max * floor.unit_ms;
  experiment.lease_s = (floor.limits.lease * floor.unit_ms + 999) / 1000;
  experiment.soil = {.start_percent = static_cast<double>(floor.kept.start),
                     .unit_ms = floor.unit_ms,
                     .threshold_percent = static_cast<double>(floor.kept.below),
                     .step_units = floor.limits.soiling_step};
  return experiment;
}

}  // namespace pheromone::swarm
