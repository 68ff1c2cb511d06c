// What is claimed of a net's reachable markings, as text.
//
//   always   EXPRESSION                in each of them
//   never    EXPRESSION                in none
//   reachable EXPRESSION               in at least one
//   live     TRANSITION ...            from each of them, each can be fired sooner or later
//   deadlock-free                      in each of them something is enabled
//   reversible                         from each of them, the first one can be reached
//   overtaken at most N by TRANSITION ... while EXPRESSION
//                                      as long as the expression holds, these are fired N times at
//                                      most
//
// An expression compares sums, and joins comparisons by `and`, `or`, `not` and parentheses:
//
//   always area_A + area_B <= 1 and not (red = 1 and green = 1)
//   never 2 * full - empty > 3
//
// Names are IDs of places, or in quotes if they are not words of letters, digits, _ . and -.
// Comparisons: <= < = != >= >.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"
#include "server/core/petri/net.h"

namespace pheromone::petri {

/// sum of weight * tokens - bound, compared with 0.
struct Comparison {
  enum class Sign { kAtMost, kEqual, kNotEqual };  // the others are these, turned round

  struct Term {
    uint32_t place;
    int64_t weight;
  };

  std::vector<Term> terms;  ///< by rising place
  Sign sign = Sign::kAtMost;
  int64_t bound = 0;
};

/// A tree: `parts` are empty for a comparison.
struct Expression {
  enum class Kind { kComparison, kAnd, kOr, kNot };

  Kind kind = Kind::kComparison;
  Comparison comparison{};
  std::vector<Expression> parts{};
};

struct Property {
  enum class Kind { kAlways, kNever, kReachable, kLive, kDeadlockFree, kReversible, kOvertaken };

  std::string id;
  std::string text;
  Kind kind = Kind::kAlways;
  Expression expression{};
  std::vector<uint32_t> transitions{};  ///< of kLive and kOvertaken
  uint32_t at_most = 0;                 ///< of kOvertaken
};

/// Errors name the claim, the column, what was found and what was expected.
Result<Property> ParseProperty(const Net& net, const Claim& claim);

/// `tokens_of(place)`: how many tokens a place has.
template <typename TokensOf>
bool Holds(const Comparison& comparison, const TokensOf& tokens_of) {
  int64_t sum = -comparison.bound;
  for (const Comparison::Term& term : comparison.terms) {
    sum += term.weight * static_cast<int64_t>(tokens_of(term.place));
  }
  switch (comparison.sign) {
    case Comparison::Sign::kAtMost:
      return sum <= 0;
    case Comparison::Sign::kEqual:
      return sum == 0;
    case Comparison::Sign::kNotEqual:
      return sum != 0;
  }
  return false;
}

template <typename TokensOf>
bool Holds(const Expression& expression, const TokensOf& tokens_of) {
  const auto holds = [&](const Expression& part) { return Holds(part, tokens_of); };
  switch (expression.kind) {
    case Expression::Kind::kComparison:
      return Holds(expression.comparison, tokens_of);
    case Expression::Kind::kAnd:
      return std::all_of(expression.parts.begin(), expression.parts.end(), holds);
    case Expression::Kind::kOr:
      return std::any_of(expression.parts.begin(), expression.parts.end(), holds);
    case Expression::Kind::kNot:
      return !holds(expression.parts[0]);
  }
  return false;
}

/// The places that it names, rising.
std::vector<uint32_t> PlacesOf(const Expression& expression);

}  // namespace pheromone::petri
