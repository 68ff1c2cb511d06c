#include "server/operators/ctl/nets/net_commands.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <filesystem>
#include <iostream>

#include "server/base/file.h"
#include "server/base/standard_output.h"
#include "server/core/petri/check.h"
#include "server/formats/nets/core_net.h"
#include "server/formats/nets/dot.h"
#include "server/formats/nets/four_ti_two.h"
#include "server/formats/nets/pnml.h"
#include "server/formats/nets/promela.h"
#include "server/formats/nets/robot_tables.h"
#include "server/formats/nets/system_file.h"
#include "server/operators/ctl/nets/net_report.h"
#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {
namespace {

using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

Result<nets::Parameters> ParametersOf(const std::vector<std::string>& words) {
  nets::Parameters parameters;
  for (const std::string& word : words) {
    const size_t sign = word.find('=');
    const std::string value = sign == std::string::npos ? "" : word.substr(sign + 1);
    int64_t number = 0;
    const auto [end, code] = std::from_chars(value.data(), value.data() + value.size(), number);
    if (value.empty() || code != std::errc() || end != value.data() + value.size()) {
      return Error{"--set: found \"" + word + "\", expected NAME=NUMBER, such as robots=3"};
    }
    parameters[word.substr(0, sign)] = number;
  }
  return parameters;
}

Result<petri::Net> LoadNet(const NetSource& source) {
  const std::string ending = std::filesystem::path(source.path).extension();
  if (ending == ".pnml" || ending == ".xml") {
    if (!source.parameters.empty()) {
      return Error{source.path + ": --set: PNML has no parameters"};
    }
    const Result<std::string> text = ReadFile(source.path);
    if (!text.ok()) {
      return text.error();
    }
    std::string warning;
    Result<petri::Net> net = nets::ParsePnml(source.path, text.value(), &warning);
    if (!warning.empty()) {
      std::cerr << "pheromonectl: warning: " << warning << '\n';
    }
    return net;
  }
  const Result<nets::Parameters> parameters = ParametersOf(source.parameters);
  return parameters.ok() ? nets::LoadSystem(source.path, parameters.value()) : parameters.error();
}

// One line on standard error, once a second, if it is a terminal.
class ProgressLine {
 public:
  bool Tell(uint64_t states, uint64_t expanded) {
    const double seconds = SecondsSince(start_);
    if (isatty(STDERR_FILENO) == 1 && seconds >= next_) {
      next_ = seconds + 1;
      shown_ = true;
      fmt::print(Unescaped(stderr), "\r{} states, {} expanded, {:.0f} states/s ", states, expanded,
                 static_cast<double>(states) / seconds);
    }
    return true;
  }
  ~ProgressLine() {
    if (shown_) {
      std::cerr << '\n';
    }
  }

 private:
  Clock::time_point start_ = Clock::now();
  double next_ = 1;
  bool shown_ = false;
};

struct Checked {
  petri::Net net;
  petri::CheckReport report;
  double seconds = 0;
};

// The exit status of a failure, or 0.
int RunCheck(const NetCheck& check, Checked* checked) {
  Result<petri::Net> loaded = LoadNet(check.source);
  if (!loaded.ok()) {
    return Fail(kUsage, loaded.error());
  }
  checked->net = std::move(loaded).value();
  if (check.no_claims) {
    checked->net.claims.clear();
  }
  for (size_t i = 0; i < check.claims.size(); ++i) {
    checked->net.claims.push_back({"--claim " + std::to_string(i + 1), check.claims[i]});
  }
  petri::CheckOptions options;
  options.reduce = check.reduce;
  options.recurrence = !check.quick;
  options.limits.max_bytes = static_cast<uint64_t>(check.memory_gib * (1 << 30));
  options.limits.max_states = check.max_states.value_or(options.limits.max_states);
  ProgressLine line;
  options.progress = [&](uint64_t states, uint64_t expanded) {
    return line.Tell(states, expanded);
  };
  const Clock::time_point start = Clock::now();
  Result<petri::CheckReport> report = petri::Check(checked->net, options);
  if (!report.ok()) {
    return Fail(kUsage, check.source.path + ": " + report.error());
  }
  checked->report = std::move(report).value();
  checked->seconds = SecondsSince(start);
  return 0;
}

// Without read and inhibitor arcs. The bounds that this needs come from the net's structure or, if
// that does not say, from its markings.
Result<petri::Net> CoreOf(petri::Net net) {
  net.claims.clear();
  petri::CheckOptions options;
  options.recurrence = false;
  PHEROMONE_TRY(const petri::CheckReport report, petri::Check(net, options));
  std::vector<uint32_t> bounds;
  for (const uint64_t bound : report.bounds) {
    const bool is_known = bound <= petri::kMaxTokens;
    bounds.push_back(is_known ? std::max(static_cast<uint32_t>(bound), 1U) : 0);
  }
  return nets::CoreNet(net, bounds);
}

int WriteText(const NetSource& source, const std::string& path, const std::string& text) {
  if (path.empty()) {
    std::cout << text;
    return 0;
  }
  if (const Status other = CheckOutput(path, {source.path}); !other.ok()) {
    return Fail(kUsage, other.error());
  }
  const Status written = WriteFile(path, text);
  return written.ok() ? 0 : Fail(kFailed, written.error());
}

}  // namespace

int CheckNetFile(const NetCheck& check) {
  Checked checked;
  if (const int failed = RunCheck(check, &checked); failed != 0) {
    return failed;
  }
  std::cout << (check.json ? JsonOfReport(checked.net, checked.report, checked.seconds)
                           : TextOfReport(checked.net, checked.report, checked.seconds));
  return AllProved(checked.report) ? 0 : kFailed;
}

int DrawNet(const NetCheck& check, const std::string& id, const std::string& output) {
  if (id.empty()) {
    const Result<petri::Net> net = LoadNet(check.source);
    return net.ok() ? WriteText(check.source, output, nets::DotOfNet(net.value()))
                    : Fail(kUsage, net.error());
  }
  Checked checked;
  if (const int failed = RunCheck(check, &checked); failed != 0) {
    return failed;
  }
  const petri::Finding* const finding = FindingNamed(checked.report, id);
  if (finding == nullptr) {
    return Fail(kUsage, "--trace: found \"" + id +
                            "\", expected a name that net check prints, such as deadlock-free");
  }
  if (!finding->trace) {
    return Fail(kFailed, check.source.path + ": there is no trace of \"" + id + "\"");
  }
  std::vector<uint32_t> steps = *finding->trace;
  steps.insert(steps.end(), finding->cycle.begin(), finding->cycle.end());
  return WriteText(check.source, output, nets::DotOfTrace(checked.net, steps));
}

int ExportNet(const NetExport& to) {
  Result<petri::Net> net = LoadNet(to.source);
  if (net.ok() && to.core) {
    net = CoreOf(net.value());
  }
  if (!net.ok()) {
    return Fail(kUsage, net.error());
  }
  if (to.format == "pnml") {
    return WriteText(to.source, to.output, nets::ToPnml(net.value()));
  }
  if (to.format == "promela") {
    const Result<std::string> text = nets::ToPromela(net.value(), {});
    return text.ok() ? WriteText(to.source, to.output, text.value()) : Fail(kUsage, text.error());
  }
  if (to.output.empty()) {
    return Fail(kUsage, "--format 4ti2 writes three files; expected --output NAME");
  }
  const nets::FourTiTwoProject files = nets::ToFourTiTwo(net.value(), nets::SemiflowsOf::kPlaces);
  for (const auto& [ending, text] :
       {std::pair{".mat", &files.mat}, {".sign", &files.sign}, {".rel", &files.rel}}) {
    if (const int failed = WriteText(to.source, to.output + ending, *text); failed != 0) {
      return failed;
    }
  }
  return 0;
}

int WriteRobotTables(const NetSource& source, const std::string& output) {
  const Result<petri::Net> net = LoadNet(source);
  if (!net.ok()) {
    return Fail(kUsage, net.error());
  }
  const Result<nets::RobotTables> robot = nets::MakeRobotTables(net.value());
  if (!robot.ok()) {
    return Fail(kUsage, source.path + ": " + robot.error());
  }
  const std::string file = std::filesystem::path(source.path).filename();
  return WriteText(source, output, nets::HeaderOf(robot.value(), file));
}

}  // namespace pheromone::ctl
