#include "server/core/petri/property.h"

#include <algorithm>
#include <charconv>
#include <map>

#include "server/core/petri/claim_scanner.h"

namespace pheromone::petri {
namespace {

constexpr int64_t kMaxNumber = 1'000'000'000;
constexpr int kMaxDepth = 200;

// Terms of both sides, those of the right one negated; `bound` is what numbers add up to on the
// right less those on the left.
struct Sum {
  std::map<uint32_t, int64_t> terms;
  int64_t number = 0;
};

class Parser {
 public:
  Parser(const Net& net, const Claim& claim) : net_(net), claim_(claim), scanner_(claim.text) {}

  Result<Property> Parse() {
    Property property{.id = claim_.id, .text = claim_.text};
    if (Word("always")) {
      property.kind = Property::Kind::kAlways;
    } else if (Word("never")) {
      property.kind = Property::Kind::kNever;
    } else if (Word("reachable")) {
      property.kind = Property::Kind::kReachable;
    } else if (Word("live")) {
      property.kind = Property::Kind::kLive;
    } else if (Word("overtaken")) {
      property.kind = Property::Kind::kOvertaken;
    } else if (Word("deadlock-free")) {
      property.kind = Property::Kind::kDeadlockFree;
    } else if (Word("reversible")) {
      property.kind = Property::Kind::kReversible;
    } else {
      Expected("always, never, reachable, live, deadlock-free, reversible or overtaken");
    }
    if (property.kind == Property::Kind::kOvertaken) {
      Needs("at");
      Needs("most");
      property.at_most = static_cast<uint32_t>(TakeNumber());
      Needs("by");
    }
    if (property.kind == Property::Kind::kLive || property.kind == Property::Kind::kOvertaken) {
      property.transitions = TakeTransitions();
    }
    if (property.kind == Property::Kind::kOvertaken) {
      Needs("while");
    }
    if (property.kind != Property::Kind::kLive && property.kind != Property::Kind::kDeadlockFree &&
        property.kind != Property::Kind::kReversible) {
      property.expression = TakeOr();
    }
    if (scanner_.token().kind != TokenKind::kEnd) {
      Expected("and, or, or the end");
    }
    if (!error_.empty()) {
      return Error{error_};
    }
    return property;
  }

 private:
  bool Is(std::string_view word) const {
    return scanner_.token().kind != TokenKind::kQuoted && scanner_.token().text == word;
  }

  bool Word(std::string_view word) {
    const bool is = Is(word);
    if (is) {
      scanner_.Next();
    }
    return is;
  }

  void Needs(std::string_view word) {
    if (!Word(word)) {
      Expected("\"" + std::string(word) + "\"");
    }
  }

  void Expected(const std::string& what) {
    if (!error_.empty()) {
      return;
    }
    const Token& token = scanner_.token();
    error_ = "claim \"" + claim_.id + "\", column " + std::to_string(token.column) + ": found " +
             (token.kind == TokenKind::kEnd   ? "the end"
              : token.kind == TokenKind::kBad ? "a quotation mark without its end"
                                              : "\"" + std::string(token.text) + "\"") +
             ", expected " + what;
  }

  int64_t TakeNumber() {
    const std::string_view text = scanner_.token().text;
    int64_t number = 0;
    const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (scanner_.token().kind != TokenKind::kNumber || code != std::errc() || number > kMaxNumber) {
      Expected("a number from 0 to " + std::to_string(kMaxNumber));
      return 0;
    }
    scanner_.Next();
    return number;
  }

  std::vector<uint32_t> TakeTransitions() {
    std::vector<uint32_t> found;
    do {
      const Token& token = scanner_.token();
      const size_t number = TransitionOf(net_, token.text);
      if ((token.kind != TokenKind::kName && token.kind != TokenKind::kQuoted) ||
          number == net_.transitions.size()) {
        Expected("the ID of a transition");
        return found;
      }
      found.push_back(static_cast<uint32_t>(number));
      scanner_.Next();
    } while (scanner_.token().kind != TokenKind::kEnd && !Is("while"));
    return found;
  }

  Expression TakeOr() {
    return TakeParts(Expression::Kind::kOr, "or", [this] {
      return TakeParts(Expression::Kind::kAnd, "and", [this] { return TakeNot(); });
    });
  }

  template <typename TakePart>
  Expression TakeParts(Expression::Kind kind, std::string_view word, const TakePart& take) {
    Expression first = take();
    if (!Is(word)) {
      return first;
    }
    Expression all{.kind = kind};
    all.parts.push_back(std::move(first));
    while (error_.empty() && Word(word)) {
      all.parts.push_back(take());
    }
    return all;
  }

  Expression TakeNot() {
    if (++depth_ > kMaxDepth) {
      Expected("at most " + std::to_string(kMaxDepth) + " parentheses and \"not\" in each other");
    }
    Expression found;
    if (!error_.empty()) {
    } else if (Word("not")) {
      found.kind = Expression::Kind::kNot;
      found.parts.push_back(TakeNot());
    } else if (Word("(")) {
      found = TakeOr();
      Needs(")");
    } else {
      found.comparison = TakeComparison();
    }
    --depth_;
    return found;
  }

  Comparison TakeComparison() {
    Sum sum = TakeSum();
    const std::string sign(scanner_.token().text);
    if (scanner_.token().kind != TokenKind::kSign ||
        (sign != "<=" && sign != "<" && sign != "=" && sign != "!=" && sign != ">=" &&
         sign != ">")) {
      Expected("<=, <, =, !=, >= or >");
      return {};
    }
    scanner_.Next();
    const Sum right = TakeSum();
    for (const auto& [place, weight] : right.terms) {
      sum.terms[place] -= weight;
    }
    Comparison found;
    found.bound = right.number - sum.number;
    found.sign = sign == "="    ? Comparison::Sign::kEqual
                 : sign == "!=" ? Comparison::Sign::kNotEqual
                                : Comparison::Sign::kAtMost;
    const int64_t turn = sign[0] == '>' ? -1 : 1;
    for (const auto& [place, weight] : sum.terms) {
      if (weight != 0) {
        found.terms.push_back({place, turn * weight});
      }
    }
    found.bound = turn * found.bound - (sign == "<" || sign == ">" ? 1 : 0);
    return found;
  }

  Sum TakeSum() {
    Sum sum;
    int64_t sign = Word("-") ? -1 : 1;
    do {
      int64_t factor = sign;
      if (scanner_.token().kind == TokenKind::kNumber) {
        factor *= TakeNumber();
        if (!Word("*")) {
          sum.number += factor;
          continue;
        }
      }
      const Token& token = scanner_.token();
      const size_t place = PlaceOf(net_, token.text);
      if ((token.kind != TokenKind::kName && token.kind != TokenKind::kQuoted) ||
          place == net_.places.size()) {
        Expected("the ID of a place");
        return sum;
      }
      sum.terms[static_cast<uint32_t>(place)] += factor;
      scanner_.Next();
    } while (error_.empty() && TakePlusOrMinus(&sign));
    return sum;
  }

  bool TakePlusOrMinus(int64_t* sign) {
    *sign = Is("-") ? -1 : 1;
    return Word("+") || Word("-");
  }

  const Net& net_;
  const Claim& claim_;
  ClaimScanner scanner_;
  std::string error_;
  int depth_ = 0;
};

void AddPlaces(const Expression& expression, std::vector<uint32_t>* places) {
  for (const Comparison::Term& term : expression.comparison.terms) {
    places->push_back(term.place);
  }
  for (const Expression& part : expression.parts) {
    AddPlaces(part, places);
  }
}

}  // namespace

Result<Property> ParseProperty(const Net& net, const Claim& claim) {
  return Parser(net, claim).Parse();
}

std::vector<uint32_t> PlacesOf(const Expression& expression) {
  std::vector<uint32_t> places;
  AddPlaces(expression, &places);
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  return places;
}

}  // namespace pheromone::petri
