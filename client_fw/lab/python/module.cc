// pheromone_lab._core: what pheromone_lab (world.py) is made of. Its types are in
// src/pheromone_lab/_core.pyi, which says what each function is for.
//
// The world steps and finds routes without the interpreter's lock; whoever comes meanwhile from
// another thread is refused (Simulation::Turn).
#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client_fw/core/steering/steering.h"
#include "client_fw/lab/behaviour_abi.h"
#include "client_fw/lab/chance.h"
#include "client_fw/lab/python/arrays.h"
#include "client_fw/lab/python/simulation.h"
#include "server/core/field/route.h"

namespace pheromone::lab::python {
namespace {

namespace py = pybind11;
using Turn = Simulation::Turn;

// Arrays of the robots from `first`, by name. In all of them robots are next to each other.
py::dict ArraysOf(const py::object& self, size_t first, size_t count) {
  const Robots& robots = self.cast<Simulation&>().world().robots();
  if (first > robots.count || count > robots.count - first) {
    throw LabError(
        fmt::format("robots {} to {}: there are {}", first, first + count, robots.count));
  }
  const auto view = [&](const auto* data) { return ViewOf(std::span(data + first, count), self); };
  py::dict arrays;
  arrays["x_m"] = view(robots.BelievedX());
  arrays["y_m"] = view(robots.BelievedY());
  arrays["heading_rad"] = view(robots.BelievedHeading());
  arrays["true_x_m"] = view(robots.x_m.data());
  arrays["true_y_m"] = view(robots.y_m.data());
  arrays["true_heading_rad"] = view(robots.heading_rad.data());
  arrays["left_m_s"] = view(robots.left_m_s.data());
  arrays["right_m_s"] = view(robots.right_m_s.data());
  arrays["way_m"] = view(robots.way_m.data());
  arrays["on_map"] = view(robots.on_map.data());
  arrays["contact"] = view(robots.contact.data());
  arrays["site"] = view(robots.site.data());
  arrays["load"] = view(robots.load.data());
  arrays["failed"] = view(robots.failed.data());
  py::list left;
  py::list right;
  for (size_t slot = 0; slot < robots.p_left.size() && !robots.p_left[slot].empty(); ++slot) {
    left.append(view(robots.p_left[slot].data()));
    right.append(view(robots.p_right[slot].data()));
  }
  arrays["p_left"] = py::tuple(left);
  arrays["p_right"] = py::tuple(right);
  return arrays;
}

py::list GroupsOf(const Simulation& simulation) {
  py::list groups;
  for (size_t i = 0; i < simulation.places().size(); ++i) {
    const RobotGroup& group = simulation.world().groups()[i];
    const Simulation::GroupPlace& place = simulation.places()[i];
    py::dict facts;
    facts["name"] = group.name;
    facts["first"] = place.first;
    facts["count"] = place.count;
    facts["driven"] = place.driven;
    facts["senses"] = std::vector<int>(group.senses.begin(), group.senses.end());
    facts["radius_m"] = group.radius_m;
    facts["wheelbase_m"] = group.wheels.wheelbase_m;
    facts["max_speed_m_s"] = group.wheels.max_speed_m_s;
    groups.append(facts);
  }
  return groups;
}

size_t DrivenGroup(const Simulation& simulation, size_t group) {
  if (group >= simulation.places().size() || !simulation.places()[group].driven) {
    throw LabError(fmt::format("group {} is not driven by Python", group));
  }
  return group;
}

void SetActions(Simulation& simulation, size_t group, const py::object& left,
                const py::object& right, const py::object& deposit, const py::object& pheromone,
                const py::object& load, const py::object& sense) {
  const Turn turn(&simulation);
  const size_t first = simulation.places()[DrivenGroup(simulation, group)].first;
  World& world = simulation.world();
  Robots& robots = world.mutable_robots();
  const ActionReader reader(world.groups()[group], first, world.time().step);
  const auto read = [&](std::string_view field, const py::object& value, auto& to) {
    if (!value.is_none()) {
      reader.Read(field, value, to.data() + first);
    }
  };
  simulation.ResetActions(group);  // what is not given is not what was given before
  try {
    read("left", left, robots.want_left_m_s);
    read("right", right, robots.want_right_m_s);
    read("deposit", deposit, robots.want_quanta);
    read("pheromone", pheromone, robots.want_type);
    read("load", load, robots.want_load);
    read("sense", sense, robots.want_sense);
  } catch (...) {
    simulation.ResetActions(group);  // half of them would be others than were meant
    throw;
  }
}

void Step(Simulation& simulation) {
  const Turn turn(&simulation);
  const py::gil_scoped_release others_run;
  simulation.Step();
}

const field::PheromoneLaw& LawOf(const World& world, int type) {
  const field::PheromoneLaw* law = type >= 0 && type <= field::kMaxType
                                       ? world.field().FindLaw(static_cast<uint8_t>(type))
                                       : nullptr;
  if (law == nullptr || law->is_blend()) {
    throw LabError(fmt::format(
        "pheromone: found {}, expected one that the map has and that is no blend", type));
  }
  return *law;
}

// In pheromone units, the top row first; NaN where an obstacle is.
py::array_t<double> LevelsOf(Simulation& simulation, int type) {
  const Turn turn(&simulation);
  const World& world = simulation.world();
  const field::PheromoneLaw& law = LawOf(world, type);
  const field::FieldConfig& config = world.field().config();
  const auto columns = static_cast<size_t>(config.map.columns());
  const auto rows = static_cast<size_t>(config.map.rows());
  py::array_t<double> levels({rows, columns});
  double* const data = levels.mutable_data();
  const py::gil_scoped_release others_run;
  std::fill_n(data, rows * columns, 0.0);
  const auto at = [&](field::NodeIndex node) -> double& {
    return data[(rows - 1 - static_cast<size_t>(node.row)) * columns +
                static_cast<size_t>(node.column)];
  };
  const double unit = static_cast<double>(law.quantum_micro) / 1e6 / field::kLevelsPerQuantum;
  world.field().VisitLevels(
      law.type, world.time().now_ms(),
      [&](field::NodeIndex node, uint32_t level) { at(node) = level * unit; });
  if (config.obstacles) {
    config.obstacles->ForEach(
        [&](field::NodeIndex node) { at(node) = std::numeric_limits<double>::quiet_NaN(); });
  }
  return levels;
}

// Those that there are.
py::dict DictOf(const std::vector<Measure>& measures) {
  py::dict dict;
  for (const auto& [name, value] : measures) {
    if (value) {
      dict[py::str(name)] = *value;
    }
  }
  return dict;
}

py::dict MeasuresOfNow(Simulation& simulation) {
  const Turn turn(&simulation);
  return DictOf(MeasuresOf(simulation.Measured()));
}

py::object ResultAtEnd(Simulation& simulation) {
  const Turn turn(&simulation);
  if (!simulation.result()) {
    return py::none();
  }
  py::dict result = DictOf(MeasuresOf(*simulation.result()));
  result["hash"] = simulation.result()->hash;
  return result;
}

size_t SiteIndex(Simulation& simulation, size_t site) {
  const size_t count = simulation.world().sites().all().size();
  if (site >= count) {
    throw LabError(fmt::format("site: found {}, but there are {}", site, count));
  }
  return site;
}

void MoveSite(Simulation& simulation, size_t site, double x_m, double y_m) {
  const Turn turn(&simulation);
  const World& world = simulation.world();
  const AreaM map = AreaOf(world.field().config().map);
  if (!(x_m >= map.left && x_m <= map.right && y_m >= map.bottom && y_m <= map.top)) {
    throw LabError(fmt::format("site: found ({:g}, {:g}), expected a place on the map", x_m, y_m));
  }
  simulation.world().sites().Move(SiteIndex(simulation, site), x_m, y_m);
}

void SetAmount(Simulation& simulation, size_t site, double amount) {
  const Turn turn(&simulation);
  if (!(amount >= 0 && amount <= 1e12)) {
    throw LabError(fmt::format("amount: found {}, expected 0 to 1e12", amount));
  }
  simulation.world().sites().SetAmount(SiteIndex(simulation, site), amount);
}

void Fail(Simulation& simulation, size_t robot) {
  const Turn turn(&simulation);
  const size_t count = simulation.world().robots().count;
  if (robot >= count) {
    throw LabError(fmt::format("robot: found {}, expected 0 to {}", robot, count - 1));
  }
  simulation.world().Fail(robot);
}

py::array_t<double> Uniform(Simulation& simulation, size_t first, size_t count, uint64_t use) {
  const Turn turn(&simulation);
  const StepTime& time = simulation.world().time();
  py::array_t<double> draws(static_cast<py::ssize_t>(count));
  double* const data = draws.mutable_data();
  for (size_t i = 0; i < count; ++i) {
    data[i] = PheromoneUniform(time.seed, first + i, time.step, use);
  }
  return draws;
}

// A row for each corner.
py::array_t<double> Route(Simulation& simulation, std::pair<double, double> start,
                          std::pair<double, double> goal, double clearance_m) {
  const Turn turn(&simulation);
  if (!(clearance_m >= 0 && clearance_m <= 1000)) {
    throw LabError(fmt::format("clearance_m: found {}, expected 0 to 1000", clearance_m));
  }
  const field::FieldConfig& config = simulation.world().field().config();
  const AreaM map = AreaOf(config.map);
  const auto point = [&](const char* name, const std::pair<double, double>& at) {
    const auto [x_m, y_m] = at;
    if (!(x_m >= map.left && x_m <= map.right && y_m >= map.bottom && y_m <= map.top)) {
      throw LabError(
          fmt::format("{}: found ({:g}, {:g}), expected a place on the map", name, x_m, y_m));
    }
    return field::PointUm{std::llround(x_m * 1e6), std::llround(y_m * 1e6)};
  };
  const field::PointUm from = point("start", start);
  const field::PointUm to = point("goal", goal);
  const auto route = [&] {
    const py::gil_scoped_release others_run;
    return field::FindRoute(config.map, config.obstacles, from, to,
                            std::llround(clearance_m * 1e6));
  }();
  if (!route.ok()) {
    throw LabError("route: " + route.error());
  }
  py::array_t<double> corners({route.value().size(), size_t{2}});
  for (size_t i = 0; i < route.value().size(); ++i) {
    corners.mutable_at(i, 0) = static_cast<double>(route.value()[i].x) / 1e6;
    corners.mutable_at(i, 1) = static_cast<double>(route.value()[i].y) / 1e6;
  }
  return corners;
}

// The law of the core, for arrays.
py::tuple Differential(const py::array_t<int16_t, py::array::c_style>& p_left,
                       const py::array_t<int16_t, py::array::c_style>& p_right, double speed_m_s,
                       double gain) {
  const double gain_8ths = gain * client::kUnitGain;
  if (p_left.ndim() != 1 || p_right.ndim() != 1 || p_left.size() != p_right.size()) {
    throw LabError("p_left, p_right: expected two arrays of the same length");
  }
  if (!(speed_m_s >= 0 && speed_m_s <= client::kMaxSpeedMmS / 1000.0)) {
    throw LabError(fmt::format("speed_m_s: found {}, expected 0 to {}", speed_m_s,
                               client::kMaxSpeedMmS / 1000.0));
  }
  if (!(gain_8ths >= 1 && gain_8ths <= client::kMaxGain)) {
    throw LabError(fmt::format("gain: found {}, expected 0.125 to {}", gain,
                               static_cast<double>(client::kMaxGain) / client::kUnitGain));
  }
  const py::ssize_t count = p_left.size();
  py::array_t<double> left(count);
  py::array_t<double> right(count);
  double* const left_data = left.mutable_data();
  double* const right_data = right.mutable_data();
  const int16_t* const l = p_left.data();
  const int16_t* const r = p_right.data();
  const auto mm_s = static_cast<int16_t>(std::lround(speed_m_s * 1000));
  const auto eighths = static_cast<uint8_t>(std::lround(gain_8ths));
  for (py::ssize_t i = 0; i < count; ++i) {
    const client::WheelSpeeds wheels =
        client::Steer(client::Law::kDifferential, l[i], r[i], mm_s, eighths);
    left_data[i] = wheels.left_mm_s / 1000.0;
    right_data[i] = wheels.right_mm_s / 1000.0;
  }
  return py::make_tuple(left, right);
}

std::unique_ptr<Simulation> Made(const std::string& text, const std::string& name,
                                 const std::optional<std::string>& folder,
                                 const KeyValues& settings, const std::vector<std::string>& drive,
                                 int threads) {
  const py::gil_scoped_release others_run;
  return std::make_unique<Simulation>(
      text, name, folder ? std::optional(std::filesystem::path(*folder)) : std::nullopt, settings,
      drive, threads);
}

std::map<std::string, int> TypesOf(const Simulation& simulation) {
  std::map<std::string, int> types;
  for (const field::PheromoneLaw& law : simulation.world().field().config().pheromones) {
    types[law.name] = law.type;
  }
  return types;
}

// (left, right, bottom, top) of the levels, each of them a node in the middle of its square.
py::tuple ExtentOf(const Simulation& simulation) {
  const field::MapGeometry& map = simulation.world().field().config().map;
  const auto metres = [](int64_t um) { return static_cast<double>(um) / 1e6; };
  const double half = metres(map.cell_um) / 2;
  const field::PointUm last = map.PositionOf({map.columns() - 1, map.rows() - 1});
  return py::make_tuple(metres(map.origin.x) - half, metres(last.x) + half,
                        metres(map.origin.y) - half, metres(last.y) + half);
}

}  // namespace
}  // namespace pheromone::lab::python

PYBIND11_MODULE(_core, m) {
  using namespace pheromone::lab;          // NOLINT
  using namespace pheromone::lab::python;  // NOLINT
  py::register_exception<LabError>(m, "LabError", PyExc_ValueError);
  PYBIND11_NUMPY_DTYPE(PheromoneSite, x_m, y_m, radius_m, amount, quality, is_food);
  m.attr("UNIT") = int{pheromone::client::kIntensityUnit};
  m.attr("NO_CONTACT") = int{kPheromoneNoContact};
  m.attr("ROBOT_CONTACT") = int{kPheromoneRobotContact};
  m.attr("WALL_CONTACT") = int{kPheromoneWallContact};
  m.def("differential", &Differential, py::arg("p_left").noconvert(),
        py::arg("p_right").noconvert(), py::arg("speed_m_s"), py::arg("gain") = 1.0);
  py::class_<Simulation>(m, "Simulation")
      .def(py::init(&Made), py::arg("text"), py::arg("name"), py::arg("folder"),
           py::arg("settings"), py::arg("drive"), py::arg("threads"))
      .def("step", &Step)
      .def("set_actions", &SetActions, py::arg("group"), py::arg("left"), py::arg("right"),
           py::arg("deposit"), py::arg("pheromone"), py::arg("load"), py::arg("sense"))
      .def("arrays", &ArraysOf, py::arg("first"), py::arg("count"))
      .def("groups", &GroupsOf)
      .def("types", &TypesOf)
      .def("sites",
           [](const py::object& self) {
             return ViewOf(self.cast<Simulation&>().world().sites().all(), self);
           })
      .def("site_names", [](const Simulation& it) { return it.scenario().site_names; })
      .def("warnings",
           [](const Simulation& it) {
             std::vector<std::string> texts;
             for (const pheromone::config::Warning& warning : it.scenario().warnings) {
               texts.push_back(warning.text);
             }
             return texts;
           })
      .def("extent", &ExtentOf)
      .def("levels", &LevelsOf, py::arg("type"))
      .def("measures", &MeasuresOfNow)
      .def("result", &ResultAtEnd)
      .def("hash",
           [](Simulation& it) {
             const Turn turn(&it);
             return it.world().Hash();
           })
      .def("uniform", &Uniform, py::arg("first"), py::arg("count"), py::arg("use"))
      .def("move_site", &MoveSite, py::arg("site"), py::arg("x_m"), py::arg("y_m"))
      .def("set_amount", &SetAmount, py::arg("site"), py::arg("amount"))
      .def("fail", &Fail, py::arg("robot"))
      .def("route", &Route, py::arg("start"), py::arg("goal"), py::arg("clearance_m"))
      .def_property_readonly("steps", [](const Simulation& it) { return it.world().time().step; })
      .def_property_readonly("step_ms",
                             [](const Simulation& it) { return it.world().time().step_ms; })
      .def_property_readonly("seed", [](const Simulation& it) { return it.world().time().seed; })
      .def_property_readonly("duration_ms",
                             [](const Simulation& it) { return it.scenario().duration_ms; });
}
