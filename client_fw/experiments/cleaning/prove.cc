#include "client_fw/experiments/cleaning/prove.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string_view>
#include <utility>

#include "client_fw/experiments/cleaning/floor.h"
#include "client_fw/experiments/cleaning/proof.h"
#include "client_fw/experiments/cleaning/trace_picture.h"
#include "client_fw/swarm/command.h"
#include "server/base/standard_output.h"

namespace pheromone::swarm {
namespace {

using Clock = std::chrono::steady_clock;
using verify::SearchProgress;
using verify::Verdict;

constexpr size_t kMiB = size_t{1} << 20;

// How far a search is, on standard error: a line that is renewed, or elsewhere one every ten
// seconds.
class ProgressLine {
 public:
  explicit ProgressLine(std::string_view query) : query_(query) {}

  double seconds() const { return std::chrono::duration<double>(Clock::now() - begun_).count(); }

  void Show(const SearchProgress& progress) {
    const double now_s = seconds();
    if (now_s < next_s_) {
      return;
    }
    next_s_ = now_s + (terminal_ ? 0.2 : 10);
    shown_ = true;
    fmt::print(Unescaped(stderr),
               "{}{}: {} of {} known states explored, {} MiB, {:.0f} s, {:.2f} million a second{}",
               terminal_ ? "\r" : "", query_, progress.explored, progress.states,
               progress.bytes / kMiB, now_s, static_cast<double>(progress.explored) / now_s / 1e6,
               terminal_ ? "\x1b[K" : "\n");
  }

  void End() const {
    if (terminal_ && shown_) {
      fmt::print(Unescaped(stderr), "\r\x1b[K");
    }
  }

 private:
  std::string_view query_;
  bool terminal_ = isatty(STDERR_FILENO) != 0;
  Clock::time_point begun_ = Clock::now();
  double next_s_ = terminal_ ? 0.5 : 10;
  bool shown_ = false;
};

std::string Heading(const CleaningFloor& floor) {
  const std::string starts = floor.starts.empty()
                                 ? "from any start"
                                 : fmt::format("from {} start{}", floor.starts.size(),
                                               floor.starts.size() == 1 ? "" : "s");
  return fmt::format("{}: {} zones, {} robot{}, {}, policy \"{}\"\n", floor.name,
                     floor.grid.zones(), floor.limits.robots, floor.limits.robots == 1 ? "" : "s",
                     starts, floor.policy);
}

int StatusOf(const std::vector<ProofAnswer>& answers) {
  int status = 0;
  for (const ProofAnswer& answer : answers) {
    if (answer.result.verdict == Verdict::kRefuted) {
      return kFailed;
    }
    status = answer.result.verdict == Verdict::kUnknown ? kNotDecided : status;
  }
  return status;
}

}  // namespace

int Prove(const ProveOptions& options) {
  const Result<CleaningFloor> loaded = LoadFloor(options.file);
  if (!loaded.ok()) {
    return Fail(loaded.error(), kWrongInput);
  }
  const CleaningFloor& floor = loaded.value();
  const std::vector<ProofQuestion> questions = ProofQuestions(floor);
  for (const std::string& query : options.queries) {
    if (std::none_of(questions.begin(), questions.end(),
                     [&](const ProofQuestion& it) { return it.name == query; })) {
      return Fail(
          fmt::format("{}: query \"{}\" is about two robots or more, found one", floor.name, query),
          kWrongInput);
    }
  }
  fmt::print("{}", Heading(floor));
  std::vector<ProofAnswer> answers;
  std::vector<std::pair<std::string, std::string>> files;
  for (const ProofQuestion& question : questions) {
    if (!options.queries.empty() && std::find(options.queries.begin(), options.queries.end(),
                                              question.name) == options.queries.end()) {
      continue;
    }
    ProgressLine line(question.name);
    verify::SearchLimits search;
    search.max_states = SIZE_MAX;
    search.max_bytes = options.memory_mib * kMiB;
    search.progress = [&](const SearchProgress& progress) {
      line.Show(progress);
      return true;
    };
    const auto forgotten = std::find_if(answers.begin(), answers.end(), [](const auto& it) {
      return it.question.kind == ProofKind::kForgotten;
    });
    ProofAnswer answer =
        Answer(floor, question, search, forgotten != answers.end() ? &*forgotten : nullptr);
    answer.seconds = line.seconds();
    line.End();
    fmt::print("{:9}  {}: {}\n", question.name, Claim(floor, question), Outcome(answer));
    if (answer.result.verdict == Verdict::kUnknown) {
      fmt::print("           the search used up {} MiB; --memory-mib allows it more\n",
                 options.memory_mib);
    }
    if (!answer.result.trace.empty()) {
      fmt::print("{}", verify::TraceText(answer.result));
      files.emplace_back(fmt::format("cleaning-trace-{}.svg", question.name),
                         DrawTrace(floor, answer));
      files.emplace_back(fmt::format("cleaning-trace-{}.txt", question.name),
                         verify::TraceText(answer.result));
    }
    std::fflush(stdout);
    answers.push_back(std::move(answer));
  }
  files.emplace_back("cleaning-proof.csv", AnswersToCsv(answers));
  files.emplace_back("cleaning-proved-zones.csv", ProvedZonesToCsv(floor, answers));
  const int written = options.out.empty() ? 0 : WriteFiles(options.out, files);
  const int status = StatusOf(answers);
  return status != 0 ? status : written;
}

}  // namespace pheromone::swarm
