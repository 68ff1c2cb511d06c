// pheromone-experiments sweep: path following against one parameter at a time.
#include "client_fw/swarm/command.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "client_fw/experiments/commands.h"
#include "client_fw/experiments/sweep/experiment.h"
#include "server/base/number_check.h"

namespace pheromone::swarm {
namespace {

struct SweepOptions {
  std::vector<std::string> parameters;
  Curve curve = Curve::kSquare;
  int seeds = 10;
  std::string out;
};

// The paper's law stands still when balanced: it would only stretch the axes.
std::vector<Contender> Swept() {
  std::vector<Contender> contenders = ContendersOf(TunedDifferential(), TunedFuzzy());
  contenders.erase(contenders.begin());
  return contenders;
}

int RunSweeps(const SweepOptions& options) {
  std::vector<SweepPoint> all;
  for (const Sweep& sweep : Sweeps()) {
    const std::vector<std::string>& wanted = options.parameters;
    if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), sweep.name) == wanted.end()) {
      continue;
    }
    size_t done = 0;
    const std::vector<SweepPoint> points =
        RunSweep(sweep, Swept(), options.curve, options.seeds,
                 [&] { ShowProgress(fmt::format("{}: point {}", sweep.name, ++done)); });
    all.insert(all.end(), points.begin(), points.end());
  }
  ShowProgress("");
  const std::string csv = ToCsv(all);
  fmt::print("{}", csv);
  if (options.out.empty()) {
    return 0;
  }
  return WriteFiles(options.out, {{"laws-sweep.csv", csv}});
}

}  // namespace

void AddSweepCommand(CLI::App* app, int* status) {
  static const std::map<std::string, Curve> curves = {
      {"line", Curve::kLine},     {"circle", Curve::kCircle}, {"s-curve", Curve::kSCurve},
      {"spiral", Curve::kSpiral}, {"eight", Curve::kEight},   {"square", Curve::kSquare}};
  std::vector<std::string> names;
  for (const Sweep& sweep : Sweeps()) {
    names.push_back(sweep.name);
  }
  auto options = std::make_shared<SweepOptions>();
  CLI::App* command = app->add_subcommand(
      "sweep",
      "Path following against one parameter at a time, in virtual time; prints a table as CSV");
  command->add_option("--parameter", options->parameters, "The parameter to vary (default: all)")
      ->check(CLI::IsMember(names));
  command->add_option("--curve", options->curve, "The curve to follow (default: square)")
      ->transform(OneOf(curves))
      ->type_name("NAME");
  command->add_option("--seeds", options->seeds, "Runs per point (default: 10)")
      ->check(WholeNumber(1, 10'000));
  command->add_option("--out", options->out, "Folder for laws-sweep.csv");
  command->callback([options, status] { *status = RunSweeps(*options); });
}

}  // namespace pheromone::swarm
