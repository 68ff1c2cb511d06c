#include "server/core/petri/check.h"

#include <algorithm>

#include "server/core/petri/growth.h"
#include "server/core/petri/layout.h"
#include "server/core/petri/reduction.h"
#include "server/core/petri/structure.h"

namespace pheromone::petri {
namespace {

using Method = Finding::Method;

constexpr size_t kMaxChecked = 10'000;
// What is first supposed of a place without a structural bound; then twice as much, and so on.
constexpr uint64_t kFirstGuess = 1;
// How many tokens are looked at where there is no bound.
constexpr uint64_t kTruncatedAt = 3;
constexpr uint64_t kTruncatedStates = 1'000'000;
constexpr uint64_t kLastGuess = 0xFFFF'FFFF;

class Checker {
 public:
  Checker(const Net& net, const CheckOptions& options) : net_(net), options_(options) {}

  Result<CheckReport> Run() {
    PHEROMONE_TRY_STATUS(CheckNet(net_));
    if (std::max(net_.places.size(), net_.transitions.size()) > kMaxChecked) {
      return Error{"net \"" + net_.name + "\": " + std::to_string(net_.places.size()) +
                   " places and " + std::to_string(net_.transitions.size()) +
                   " transitions, expected " + std::to_string(kMaxChecked) + " at most to check"};
    }
    for (const Claim& claim : net_.claims) {
      Result<Property> property = ParseProperty(net_, claim);
      if (!property.ok()) {
        return Error{"net \"" + net_.name + "\": " + property.error()};
      }
      report_.claims.push_back({std::move(property).value(), {}});
    }
    CheckStructure();
    FindEager();
    PHEROMONE_TRY_STATUS(Search());
    TakeResults();
    if (IsComplete()) {
      AskForRecurrence();
      AskForOvertaking();
    }
    ShortenTraces();
    CopyFindings();
    return std::move(report_);
  }

 private:
  // --- What flows say

  void CheckStructure() {
    report_.invariants = PlaceInvariants(net_);
    report_.place_semiflows = PlaceSemiflows(net_);
    report_.transition_semiflows = TransitionSemiflows(net_);
    report_.bounds = BoundsBy(net_, report_.place_semiflows.flows);
    is_bounded_.reserve(net_.places.size());
    for (const uint64_t bound : report_.bounds) {
      is_bounded_.push_back(bound != kNoBound);
    }
    if (std::all_of(is_bounded_.begin(), is_bounded_.end(), [](bool it) { return it; })) {
      report_.bounded = {Verdict::kProved, Method::kStructural, "P-semiflows name each place"};
      if (std::all_of(report_.bounds.begin(), report_.bounds.end(),
                      [](uint64_t bound) { return bound <= 1; })) {
        report_.safe = {Verdict::kProved, Method::kStructural, "P-semiflows bound each place by 1"};
      }
    }
    for (CheckedClaim& claim : report_.claims) {
      const Property& property = claim.property;
      if (property.kind == Property::Kind::kAlways || property.kind == Property::Kind::kNever) {
        ProveByStructure(&claim);
      }
    }
  }

  void ProveByStructure(CheckedClaim* claim) const {
    const auto all =
        AsConjunction(claim->property.expression, claim->property.kind == Property::Kind::kNever);
    if (!all) {
      return;
    }
    std::string because;
    for (const Comparison& comparison : *all) {
      const auto why = WhyAlways(net_, comparison, report_.place_semiflows.flows);
      if (!why) {
        return;
      }
      if (because.find(*why) == std::string::npos) {
        because += (because.empty() ? "" : "; ") + *why;
      }
    }
    claim->finding = {Verdict::kProved, Method::kStructural, because};
  }

  // --- The search

  static bool IsOfMarkings(const Property& property) {
    return property.kind == Property::Kind::kAlways || property.kind == Property::Kind::kNever ||
           property.kind == Property::Kind::kReachable;
  }

  void FindEager() {
    if (!options_.reduce) {
      return;
    }
    std::vector<uint32_t> places;
    std::vector<uint32_t> transitions;
    for (uint32_t place = 0; place < net_.places.size(); ++place) {
      if (!is_bounded_[place] || report_.bounds[place] > 1) {
        places.push_back(place);
      }
    }
    for (const CheckedClaim& claim : report_.claims) {
      if (claim.finding.verdict != Verdict::kUnknown) {
        continue;
      }
      const std::vector<uint32_t> named = PlacesOf(claim.property.expression);
      places.insert(places.end(), named.begin(), named.end());
      transitions.insert(transitions.end(), claim.property.transitions.begin(),
                         claim.property.transitions.end());
    }
    report_.eager = EagerTransitions(net_, places, transitions);
  }

  // Goal 0 is a place with two tokens; then those of the claims.
  void MakeGoals() {
    Expression unsafe{.kind = Expression::Kind::kOr};
    for (uint32_t place = 0; place < net_.places.size(); ++place) {
      if (report_.bounds[place] > 1) {
        Expression& part = unsafe.parts.emplace_back();
        part.comparison.terms = {{place, -1}};
        part.comparison.bound = -2;
      }
    }
    goals_ = {std::move(unsafe)};
    for (CheckedClaim& claim : report_.claims) {
      if (IsOfMarkings(claim.property) && claim.finding.verdict == Verdict::kUnknown) {
        goal_of_.push_back(goals_.size());
        goals_.push_back(GoalOf(claim.property));
      } else {
        goal_of_.push_back(0);
      }
    }
  }

  static Expression GoalOf(const Property& property) {
    if (property.kind != Property::Kind::kAlways) {
      return property.expression;
    }
    return {.kind = Expression::Kind::kNot, .parts = {property.expression}};
  }

  Status Search() {
    MakeGoals();
    std::vector<uint64_t> at_most = report_.bounds;
    std::vector<uint64_t> weights(net_.places.size());
    for (const Transition& transition : net_.transitions) {
      for (const auto* arcs :
           {&transition.takes, &transition.gives, &transition.reads, &transition.inhibitors}) {
        for (const Arc& arc : *arcs) {
          weights[arc.place] = std::max<uint64_t>(weights[arc.place], arc.weight);
        }
      }
    }
    for (size_t place = 0; place < at_most.size(); ++place) {
      if (!is_bounded_[place]) {
        at_most[place] =
            std::max({kFirstGuess, weights[place], uint64_t{net_.places[place].tokens}});
      }
    }
    for (;;) {
      at_most_ = at_most;
      layout_ = std::make_unique<Layout>(net_, at_most, report_.invariants.flows);
      space_ = MakeStateSpace(net_, *layout_, report_.eager);
      if (space_ == nullptr) {
        return Error{"net \"" + net_.name + "\": a marking needs " +
                     std::to_string(layout_->key_bytes() * 8) + " bits, expected 2048 at most"};
      }
      report_.key_bytes = layout_->key_bytes();
      SearchLimits limits = options_.limits;
      if (report_.bounded.verdict == Verdict::kRefuted) {
        limits.truncates = true;
        limits.max_states = std::min(limits.max_states, kTruncatedStates);
      }
      report_.explored = space_->Explore(goals_, limits, options_.progress);
      const Explored& explored = report_.explored;
      if (explored.end != Explored::End::kOverflow) {
        return Ok();
      }
      if (FindGrowthOnWay()) {
        for (size_t place = 0; place < at_most.size(); ++place) {
          at_most[place] =
              is_bounded_[place] ? at_most[place] : std::max(at_most[place], kTruncatedAt);
        }
        continue;  // for what a part of the markings refutes
      }
      for (size_t place = 0; place < at_most.size(); ++place) {
        if (!is_bounded_[place] && at_most[place] >= kLastGuess) {
          return Ok();  // neither bounded by what can be counted, nor seen to grow
        }
        if (!is_bounded_[place]) {
          at_most[place] = std::min(at_most[place] * 2 + 1, kLastGuess);
        }
      }
    }
  }

  // Whether the net is unbounded, by the way to the overflow and, the first time, random ways.
  bool FindGrowthOnWay() {
    std::vector<uint32_t> way = space_->TraceTo(report_.explored.overflow_state);
    way.push_back(report_.explored.overflow_transition);
    std::optional<Growth> growth = FindGrowth(net_, way);
    if (!growth && !has_walked_) {
      growth = WalkToGrowth(net_);
    }
    has_walked_ = true;
    if (!growth) {
      return false;
    }
    report_.bounded = {Verdict::kRefuted, Method::kPartial,
                       net_.places[growth->place].id + " grows each time that the cycle is fired"};
    report_.bounded.trace = std::move(growth->way);
    report_.bounded.cycle = std::move(growth->cycle);
    report_.bounded.is_shortest = false;
    report_.safe = report_.bounded;
    return true;
  }

  bool IsComplete() const { return report_.explored.end == Explored::End::kComplete; }

  Method MethodOfSearch() const {
    return !IsComplete()           ? Method::kPartial
           : report_.eager.empty() ? Method::kExhaustive
                                   : Method::kReduced;
  }

  std::string WhyIncomplete() const {
    if (report_.bounded.verdict == Verdict::kRefuted) {
      return "the net is unbounded";
    }
    switch (report_.explored.end) {
      case Explored::End::kMemory:
        return "out of the memory that was granted";
      case Explored::End::kStates:
        return "as many states as were granted";
      case Explored::End::kGivenUp:
        return "interrupted";
      case Explored::End::kOverflow:
        return net_.places[report_.explored.overflow_place].id + " has too many tokens to count";
      case Explored::End::kTruncated:
      case Explored::End::kComplete:
        break;
    }
    return "";
  }

  // `reached`: a state that refutes it.
  Finding FindingOf(const std::optional<uint32_t>& reached) const {
    if (reached) {
      Finding finding{Verdict::kRefuted, MethodOfSearch(), ""};
      finding.trace = space_->TraceTo(*reached);
      finding.is_shortest = report_.eager.empty() && report_.bounded.verdict != Verdict::kRefuted;
      return finding;
    }
    if (IsComplete()) {
      return {Verdict::kProved, MethodOfSearch(), ""};
    }
    return {Verdict::kUnknown, Method::kPartial, WhyIncomplete()};
  }

  void TakeResults() {
    const Explored& explored = report_.explored;
    report_.deadlock_free = FindingOf(explored.deadlock);
    if (report_.bounded.verdict == Verdict::kUnknown) {
      report_.bounded = FindingOf(std::nullopt);
    }
    if (report_.safe.verdict == Verdict::kUnknown) {
      report_.safe = FindingOf(explored.reached[0]);
    }
    for (size_t i = 0; i < report_.claims.size(); ++i) {
      if (goal_of_[i] == 0) {
        continue;
      }
      CheckedClaim& claim = report_.claims[i];
      claim.finding = FindingOf(explored.reached[goal_of_[i]]);
      if (claim.property.kind == Property::Kind::kReachable &&
          claim.finding.verdict != Verdict::kUnknown) {
        claim.finding.verdict =
            claim.finding.verdict == Verdict::kProved ? Verdict::kRefuted : Verdict::kProved;
      }
    }
    if (IsComplete()) {
      if (report_.eager.empty()) {
        report_.bounds = explored.most;
      }
      for (uint32_t transition = 0; transition < net_.transitions.size(); ++transition) {
        if (!explored.fired[transition]) {
          report_.dead.push_back(transition);
        }
      }
      report_.quasi_live = {report_.dead.empty() ? Verdict::kProved : Verdict::kRefuted,
                            MethodOfSearch(), ""};
    } else {
      const bool all = std::all_of(explored.fired.begin(), explored.fired.end(),
                                   [](bool fired) { return fired; });
      report_.quasi_live = {all ? Verdict::kProved : Verdict::kUnknown, Method::kPartial,
                            all ? "" : WhyIncomplete()};
      for (CheckedClaim& claim : report_.claims) {
        if (!IsOfMarkings(claim.property)) {
          claim.finding = {Verdict::kUnknown, Method::kPartial, WhyIncomplete()};
        }
      }
      report_.live = {Verdict::kUnknown, Method::kPartial, WhyIncomplete()};
      report_.reversible = report_.live;
    }
  }

  // --- What the graph says

  bool AsksForLiveness() const {
    return options_.recurrence ||
           std::any_of(report_.claims.begin(), report_.claims.end(), [](const CheckedClaim& it) {
             return it.property.kind == Property::Kind::kLive ||
                    it.property.kind == Property::Kind::kReversible;
           });
  }

  Finding DiesAt(const std::optional<uint32_t>& state, uint32_t transition) const {
    Finding finding = FindingOf(state);
    if (state) {
      finding.because = net_.transitions[transition].id + " can never be fired after this";
    }
    return finding;
  }

  void AskForRecurrence() {
    if (!AsksForLiveness()) {
      return;
    }
    const Recurrence recurrence = space_->FindRecurrence(options_.limits);
    const Finding unknown{Verdict::kUnknown, Method::kPartial,
                          "out of the memory that was granted"};
    report_.components = recurrence.components;
    report_.reversible = {recurrence.reversible ? Verdict::kProved : Verdict::kRefuted,
                          MethodOfSearch(), ""};
    const bool begins_eagerly = std::any_of(
        report_.eager.begin(), report_.eager.end(),
        [&](uint32_t transition) { return IsEnabled(net_, transition, InitialMarking(net_)); });
    if (recurrence.reversible && begins_eagerly) {
      // What can always be reached again is the marking that they lead to.
      report_.reversible = {Verdict::kUnknown, Method::kReduced, "the reduced search cannot tell"};
    }
    report_.live = {Verdict::kProved, MethodOfSearch(), ""};
    for (uint32_t transition = 0; transition < net_.transitions.size(); ++transition) {
      if (recurrence.dies_at[transition]) {
        if (report_.not_live.empty()) {
          report_.live = DiesAt(recurrence.dies_at[transition], transition);
        }
        report_.not_live.push_back(transition);
      }
    }
    if (!recurrence.complete) {
      report_.live = unknown;
      report_.reversible = unknown;
      report_.not_live.clear();
    }
    for (CheckedClaim& claim : report_.claims) {
      if (claim.property.kind != Property::Kind::kLive) {
        continue;
      }
      claim.finding = {Verdict::kProved, MethodOfSearch(), ""};
      for (const uint32_t transition : claim.property.transitions) {
        if (recurrence.dies_at[transition] && claim.finding.verdict == Verdict::kProved) {
          claim.finding = DiesAt(recurrence.dies_at[transition], transition);
        }
      }
      if (!recurrence.complete) {
        claim.finding = unknown;
      }
    }
  }

  void AskForOvertaking() {
    for (CheckedClaim& claim : report_.claims) {
      if (claim.property.kind != Property::Kind::kOvertaken) {
        continue;
      }
      const Overtaking found = space_->FindOvertaking(claim.property, options_.limits);
      claim.finding = {Verdict::kProved, MethodOfSearch(), ""};
      if (!found.complete) {
        claim.finding = {Verdict::kUnknown, Method::kPartial, "out of the memory that was granted"};
      } else if (!found.most) {
        claim.finding.verdict = Verdict::kRefuted;
        claim.finding.because = "without bound";
      } else {
        claim.finding.because = "at most " + std::to_string(*found.most);
        claim.finding.verdict =
            *found.most > claim.property.at_most ? Verdict::kRefuted : Verdict::kProved;
      }
      if (claim.finding.verdict == Verdict::kRefuted) {
        claim.finding.trace = found.trace;
        claim.finding.cycle = found.cycle;
        claim.finding.is_shortest = false;
      }
    }
  }

  void CopyFindings() {
    for (CheckedClaim& claim : report_.claims) {
      if (claim.property.kind == Property::Kind::kDeadlockFree) {
        claim.finding = report_.deadlock_free;
      } else if (claim.property.kind == Property::Kind::kReversible) {
        claim.finding = report_.reversible;
      }
    }
  }

  // --- Traces

  // After a reduced search: once more without, for what was refuted.
  void ShortenTraces() {
    if (report_.eager.empty() || report_.bounded.verdict == Verdict::kRefuted) {
      return;
    }
    Shorten(nullptr, &report_.deadlock_free);
    Shorten(&goals_[0], &report_.safe);
    for (size_t i = 0; i < report_.claims.size(); ++i) {
      if (goal_of_[i] != 0) {
        Shorten(&goals_[goal_of_[i]], &report_.claims[i].finding);
      }
    }
  }

  void Shorten(const Expression* goal, Finding* finding) const {
    if (!finding->trace || finding->is_shortest || !finding->cycle.empty()) {
      return;
    }
    const Layout layout(net_, at_most_, report_.invariants.flows);
    const auto space = MakeStateSpace(net_, layout, {});
    SearchLimits limits = options_.limits;
    limits.stops_at_first = true;
    const Explored explored =
        space->Explore(goal == nullptr ? std::vector<Expression>() : std::vector{*goal}, limits,
                       options_.progress);
    const auto& reached = goal == nullptr ? explored.deadlock : explored.reached[0];
    if (reached) {
      finding->trace = space->TraceTo(*reached);
      finding->is_shortest = true;
    }
  }

  const Net& net_;
  const CheckOptions& options_;
  CheckReport report_;
  std::vector<bool> is_bounded_;  // by structure
  std::vector<uint64_t> at_most_;
  bool has_walked_ = false;
  std::vector<Expression> goals_;
  std::vector<size_t> goal_of_;  // by claim; 0: none
  std::unique_ptr<Layout> layout_;
  std::unique_ptr<StateSpace> space_;
};

}  // namespace

Result<CheckReport> Check(const Net& net, const CheckOptions& options) {
  return Checker(net, options).Run();
}

}  // namespace pheromone::petri
