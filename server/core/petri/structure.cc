#include "server/core/petri/structure.h"

#include <algorithm>

namespace pheromone::petri {
namespace {

// What firing the transition adds to the comparison's sum.
int64_t EffectOn(const Comparison& comparison, const Transition& transition) {
  const auto weight_of = [&](uint32_t place) -> int64_t {
    const auto found =
        std::lower_bound(comparison.terms.begin(), comparison.terms.end(), place,
                         [](const Comparison::Term& term, uint32_t at) { return term.place < at; });
    return found != comparison.terms.end() && found->place == place ? found->weight : 0;
  };
  int64_t sum = 0;
  for (const Arc& arc : transition.gives) {
    sum += weight_of(arc.place) * arc.weight;
  }
  for (const Arc& arc : transition.takes) {
    sum -= weight_of(arc.place) * arc.weight;
  }
  return sum;
}

bool HoldsInitially(const Net& net, const Comparison& comparison) {
  return Holds(comparison, [&](uint32_t place) { return net.places[place].tokens; });
}

// Whether a multiple of the flow is at least as large as the comparison's sum, and small enough.
bool IsBelow(const Comparison& comparison, const Flow& flow, int64_t value) {
  // The flow times a / b is enough; all are small numbers, or the proof is not worth having.
  int64_t a = 0;
  int64_t b = 1;
  for (const Comparison::Term& term : comparison.terms) {
    if (term.weight <= 0) {
      continue;
    }
    const auto found =
        std::lower_bound(flow.terms.begin(), flow.terms.end(), term.place,
                         [](const FlowTerm& it, uint32_t at) { return it.index < at; });
    if (found == flow.terms.end() || found->index != term.place || term.weight > kMaxTokens ||
        found->weight > kMaxTokens) {
      return false;
    }
    if (term.weight * b > a * found->weight) {
      a = term.weight;
      b = found->weight;
    }
  }
  int64_t most = 0;
  return !__builtin_mul_overflow(value, a, &most) && most / b <= comparison.bound;
}

}  // namespace

std::string TextOf(const Net& net, const Flow& flow) {
  std::string text;
  for (const FlowTerm& term : flow.terms) {
    const int64_t size = term.weight < 0 ? -term.weight : term.weight;
    text += term.weight < 0 ? (text.empty() ? "-" : " - ") : (text.empty() ? "" : " + ");
    text += (size == 1 ? "" : std::to_string(size) + " * ") + net.places[term.index].id;
  }
  return text + " = " + std::to_string(ValueOf(net, flow));
}

std::optional<std::vector<Comparison>> AsConjunction(const Expression& expression, bool negated) {
  switch (expression.kind) {
    case Expression::Kind::kComparison: {
      Comparison it = expression.comparison;
      if (!negated) {
        return std::vector{it};
      }
      if (it.sign == Comparison::Sign::kAtMost) {  // s > b, that is -s <= -b - 1
        for (Comparison::Term& term : it.terms) {
          term.weight = -term.weight;
        }
        it.bound = -it.bound - 1;
      } else {
        it.sign = it.sign == Comparison::Sign::kEqual ? Comparison::Sign::kNotEqual
                                                      : Comparison::Sign::kEqual;
      }
      return std::vector{it};
    }
    case Expression::Kind::kNot:
      return AsConjunction(expression.parts[0], !negated);
    case Expression::Kind::kAnd:
    case Expression::Kind::kOr:
      break;
  }
  if ((expression.kind == Expression::Kind::kAnd) == negated) {
    return std::nullopt;
  }
  std::vector<Comparison> all;
  for (const Expression& part : expression.parts) {
    const auto some = AsConjunction(part, negated);
    if (!some) {
      return std::nullopt;
    }
    all.insert(all.end(), some->begin(), some->end());
  }
  return all;
}

std::optional<std::string> WhyAlways(const Net& net, const Comparison& comparison,
                                     const std::vector<Flow>& semiflows) {
  if (comparison.sign == Comparison::Sign::kNotEqual || !HoldsInitially(net, comparison)) {
    return std::nullopt;
  }
  bool never_changes = true;
  bool never_rises = true;
  for (const Transition& transition : net.transitions) {
    const int64_t effect = EffectOn(comparison, transition);
    never_changes = never_changes && effect == 0;
    never_rises = never_rises && effect <= 0;
  }
  if (never_changes) {
    return "no transition changes the sum";
  }
  if (comparison.sign != Comparison::Sign::kAtMost) {
    return std::nullopt;
  }
  if (never_rises) {
    return "no transition raises the sum";
  }
  for (const Flow& flow : semiflows) {
    if (IsBelow(comparison, flow, ValueOf(net, flow))) {
      return "P-invariant " + TextOf(net, flow);
    }
  }
  return std::nullopt;
}

}  // namespace pheromone::petri
