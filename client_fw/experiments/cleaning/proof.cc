#include "client_fw/experiments/cleaning/proof.h"

#include <fmt/format.h>

#include <algorithm>

namespace pheromone::swarm {
namespace {

using verify::CleaningResult;
using verify::Verdict;

constexpr double kMiB = 1 << 20;

const char* NameOf(Verdict verdict) {
  return verdict == Verdict::kProved    ? "proved"
         : verdict == Verdict::kRefuted ? "refuted"
                                        : "unknown";
}

// The worst zone of one of a result's lists.
struct Worst {
  int value = 0;
  size_t zone = 0;
};

Worst WorstOf(const std::vector<int>& values) {
  if (values.empty()) {
    return {};
  }
  const auto worst = std::max_element(values.begin(), values.end());
  return {*worst, static_cast<size_t>(worst - values.begin())};
}

std::string Figure(const ProofAnswer& answer) {
  const CleaningResult& result = answer.result;
  switch (answer.question.kind) {
    case ProofKind::kClean:
      return fmt::format(", at the latest after {} units", result.longest);
    case ProofKind::kBounded:
      return "";
    case ProofKind::kForEver: {
      const Worst worst = WorstOf(result.levels);
      return fmt::format(", at most {} % (zone {})", worst.value, worst.zone + 1);
    }
    case ProofKind::kForgotten:
    case ProofKind::kCrash: {
      const Worst worst = WorstOf(result.gaps);
      return fmt::format(", no zone waits longer than {} units (zone {})", worst.value,
                         worst.zone + 1);
    }
  }
  return "";
}

}  // namespace

std::vector<ProofQuestion> ProofQuestions(const CleaningFloor& floor) {
  std::vector<ProofQuestion> questions = {{ProofKind::kClean, "clean"},
                                          {ProofKind::kBounded, "bounded"},
                                          {ProofKind::kForgotten, "forgotten"},
                                          {ProofKind::kForEver, "for-ever"}};
  if (floor.limits.robots > 1) {
    questions.push_back({ProofKind::kCrash, "crash"});
  }
  return questions;
}

ProofAnswer Answer(const CleaningFloor& floor, const ProofQuestion& question,
                   const verify::SearchLimits& search, const ProofAnswer* forgotten) {
  verify::CleaningLimits limits = floor.limits;
  limits.reduced = true;
  ProofAnswer answer{question, {}, 0};
  switch (question.kind) {
    case ProofKind::kClean:
      answer.result = verify::CheckCleanAfter(limits, floor.starts, floor.dirty, search);
      break;
    case ProofKind::kBounded:
      answer.result = verify::CheckLevels(limits, floor.starts, floor.kept, floor.horizon, search);
      break;
    case ProofKind::kForEver:
      answer.result = verify::CheckLevelsForEver(
          limits, floor.starts, floor.kept,
          forgotten != nullptr ? forgotten->result
                               : verify::ProveCleaning(limits, floor.starts, search),
          search);
      break;
    case ProofKind::kCrash:
      limits.crashes = 1;
      answer.result = verify::ProveCleaning(limits, floor.starts, search);
      break;
    case ProofKind::kForgotten:
      answer.result = verify::ProveCleaning(limits, floor.starts, search);
      break;
  }
  return answer;
}

std::string Claim(const CleaningFloor& floor, const ProofQuestion& question) {
  switch (question.kind) {
    case ProofKind::kClean:
      return fmt::format("from {} % all zones come below {} %", floor.dirty.start,
                         floor.dirty.below);
    case ProofKind::kBounded:
      return fmt::format("from {} % all zones stay below {} % until {} units", floor.kept.start,
                         floor.kept.below, floor.horizon);
    case ProofKind::kForEver:
      return fmt::format("from {} % all zones stay below {} % for ever", floor.kept.start,
                         floor.kept.below);
    case ProofKind::kForgotten:
      return "robots never meet in a zone, and no zone is forgotten";
    case ProofKind::kCrash:
      return "robots never meet, and no zone is forgotten, even if a robot breaks down";
  }
  return "";
}

std::string Outcome(const ProofAnswer& answer) {
  const CleaningResult& result = answer.result;
  std::string text = NameOf(result.verdict);
  if (result.verdict == Verdict::kProved) {
    text += Figure(answer);
  } else if (result.verdict == Verdict::kRefuted) {
    text += fmt::format(": {}, {}", result.wrong,
                        result.repeats_from != 0
                            ? fmt::format("from {} units on for ever", result.wrong_time)
                            : fmt::format("after {} units", result.wrong_time));
  }
  return fmt::format("{} ({} states, {:.0f} MiB, {:.1f} s)", text, result.states,
                     static_cast<double>(result.bytes) / kMiB, answer.seconds);
}

std::string AnswersToCsv(const std::vector<ProofAnswer>& answers) {
  std::string csv = "query,verdict,units,percent,zone,states,steps,bytes,seconds\n";
  for (const ProofAnswer& answer : answers) {
    const CleaningResult& result = answer.result;
    std::string units;
    std::string percent;
    std::string zone;
    if (result.verdict == Verdict::kRefuted) {
      units = std::to_string(result.wrong_time);
    } else if (result.verdict == Verdict::kProved && !result.levels.empty()) {
      percent = std::to_string(WorstOf(result.levels).value);
      zone = std::to_string(WorstOf(result.levels).zone + 1);
    } else if (result.verdict == Verdict::kProved && !result.gaps.empty()) {
      units = std::to_string(WorstOf(result.gaps).value);
      zone = std::to_string(WorstOf(result.gaps).zone + 1);
    } else if (result.verdict == Verdict::kProved && answer.question.kind == ProofKind::kClean) {
      units = std::to_string(result.longest);
    }
    csv += fmt::format("{},{},{},{},{},{},{},{},{:.2f}\n", answer.question.name,
                       NameOf(result.verdict), units, percent, zone, result.states, result.steps,
                       result.bytes, answer.seconds);
  }
  return csv;
}

std::string ProvedZonesToCsv(const CleaningFloor& floor, const std::vector<ProofAnswer>& answers) {
  std::string csv = "zone,x_m,y_m,rate_percent,gap_units,crash_gap_units,highest_percent\n";
  const auto column = [&](ProofKind kind, size_t zone) -> std::string {
    for (const ProofAnswer& answer : answers) {
      const CleaningResult& it = answer.result;
      const std::vector<int>& values = kind == ProofKind::kForEver ? it.levels : it.gaps;
      if (answer.question.kind == kind && it.verdict == Verdict::kProved && !values.empty()) {
        return std::to_string(values[zone]);
      }
    }
    return "";
  };
  for (int zone = 0; zone < floor.grid.zones(); ++zone) {
    const auto at = static_cast<size_t>(zone);
    csv += fmt::format("{},{:g},{:g},{},{},{},{}\n", zone + 1, floor.grid.CentreX(zone),
                       floor.grid.CentreY(zone), floor.grid.RatePercent(zone),
                       column(ProofKind::kForgotten, at), column(ProofKind::kCrash, at),
                       column(ProofKind::kForEver, at));
  }
  return csv;
}

}  // namespace pheromone::swarm
