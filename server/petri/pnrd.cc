#include "server/petri/pnrd.h"

#include <algorithm>
#include <utility>

namespace pheromone::petri {
namespace {

struct NamedPart {
  PnrdPart part;
  const char* name;
};

constexpr NamedPart kParts[] = {{kPnrdIncidence, "incidence matrix"},
                                {kPnrdMarking, "marking"},
                                {kPnrdCandidates, "candidate transitions"},
                                {kPnrdConditions, "conditions"}};

std::string WhyNotMerged(uint8_t tag, uint8_t reader) {
  for (const NamedPart& it : kParts) {
    if ((tag & reader & it.part) != 0) {
      return std::string(it.name) + " on both the tag and the reader, expected on one";
    }
    if (((tag | reader) & it.part) == 0 && it.part != kPnrdConditions) {
      return std::string(it.name) + " neither on the tag nor on the reader, expected on one";
    }
  }
  return "";
}

std::string WhyNotFitting(const PnrdState& state) {
  const Eigen::Index transitions = state.incidence.rows();
  if (state.incidence.cols() != state.marking.size()) {
    return "a marking of " + std::to_string(state.marking.size()) +
           " places, expected as many as the incidence matrix has: " +
           std::to_string(state.incidence.cols());
  }
  const auto wrong = [transitions](uint32_t transition) {
    return static_cast<Eigen::Index>(transition) >= transitions;
  };
  for (const uint32_t candidate : state.candidates) {
    if (wrong(candidate)) {
      return "candidate transition number " + std::to_string(candidate) + ", expected less than " +
             std::to_string(transitions);
    }
  }
  for (const PnrdCondition& condition : state.conditions) {
    if (wrong(condition.transition) || condition.bit > 31) {
      return "condition bit " + std::to_string(condition.bit) + " of transition number " +
             std::to_string(condition.transition) +
             ", expected a bit up to 31 and a transition less than " + std::to_string(transitions);
    }
  }
  return "";
}

bool AreHeld(const PnrdState& state, uint32_t transition, uint32_t held) {
  return std::all_of(
      state.conditions.begin(), state.conditions.end(), [&](const PnrdCondition& condition) {
        return condition.transition != transition || (held >> condition.bit & 1) != 0;
      });
}

}  // namespace

uint8_t PnrdData::parts() const {
  return static_cast<uint8_t>((incidence ? kPnrdIncidence : 0) | (marking ? kPnrdMarking : 0) |
                              (candidates ? kPnrdCandidates : 0) |
                              (conditions ? kPnrdConditions : 0));
}

Result<PnrdState> MergePnrd(const PnrdData& tag, const PnrdData& reader) {
  if (std::string wrong = WhyNotMerged(tag.parts(), reader.parts()); !wrong.empty()) {
    return Error{std::move(wrong)};
  }
  const auto either = [](const auto& a, const auto& b) { return a ? *a : *b; };
  PnrdState state{.incidence = either(tag.incidence, reader.incidence),
                  .marking = either(tag.marking, reader.marking),
                  .candidates = either(tag.candidates, reader.candidates),
                  .conditions = {}};
  if (tag.conditions || reader.conditions) {
    state.conditions = either(tag.conditions, reader.conditions);
  }
  const std::string wrong = WhyNotFitting(state);
  return wrong.empty() ? Result<PnrdState>(std::move(state)) : Error{wrong};
}

PnrdOutcome StepPnrd(const PnrdState& state, PnrdRule rule, uint32_t held) {
  PnrdOutcome outcome{.marking = state.marking};
  std::vector<uint32_t> candidates = state.candidates;
  std::sort(candidates.begin(), candidates.end());
  candidates.erase(std::unique(candidates.begin(), candidates.end()), candidates.end());
  Marking after;
  for (const uint32_t candidate : candidates) {
    // One row of A is A'u for a u of one transition. A place that loses more than it has comes out
    // below 0, which neither rule accepts.
    const Marking result = state.marking + state.incidence.row(candidate).transpose();
    if (AreHeld(state, candidate, held) && IsLegal(result, rule)) {
      outcome.accepted.push_back(candidate);
      after = result;
    }
  }
  if (outcome.accepted.size() == 1) {
    outcome.kind = PnrdOutcome::Kind::kFired;
    outcome.marking = after;
  } else if (outcome.accepted.size() > 1) {
    outcome.kind = PnrdOutcome::Kind::kConflict;
  }
  return outcome;
}

bool IsLegal(const Marking& marking, PnrdRule rule) {
  const bool safe = (marking.array() == 0 || marking.array() == 1).all();
  return safe && (rule == PnrdRule::kSafePlaces || marking.sum() == 1);
}

}  // namespace pheromone::petri
