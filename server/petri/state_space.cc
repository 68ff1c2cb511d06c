#include "server/petri/state_space.h"

#include <algorithm>
#include <cassert>
#include <unordered_map>
#include <utility>

#include "server/petri/state_store.h"

namespace pheromone::petri {
namespace {

constexpr size_t kBatch = 64;
constexpr uint64_t kStatesPerProgress = uint64_t{1} << 16;

template <size_t kWords>
class PackedStateSpace final : public StateSpace {
  using Store = StateStore<kWords>;
  using Key = typename Store::Key;

 public:
  PackedStateSpace(const Net& net, const Layout& layout, const std::vector<uint32_t>& eager)
      : net_(net), layout_(layout), states_(layout.key_bytes()) {
    std::vector<bool> is_eager(net.transitions.size());
    const auto add = [&](uint32_t transition) {
      const Layout::Rule& rule = layout.rules()[transition];
      if (rule.never) {
        return;
      }
      Rule& packed = rules_.emplace_back(Rule{&rule, {}, transition});
      std::copy(rule.key_change.begin(), rule.key_change.end(), packed.change.begin());
    };
    for (const uint32_t transition : eager) {
      is_eager[transition] = true;
      add(transition);
    }
    eager_ = rules_.size();
    for (uint32_t transition = 0; transition < net.transitions.size(); ++transition) {
      if (!is_eager[transition]) {
        add(transition);
      }
    }
    for (uint32_t place = 0; place < net.places.size(); ++place) {
      if (layout.MostTokens(place) > 1) {
        counted_.push_back(place);
      }
    }
  }

  Explored Explore(const std::vector<Expression>& goals, const SearchLimits& limits,
                   const Progress& progress) override {
    Explored found;
    found.reached.resize(goals.size());
    found.fired.resize(net_.transitions.size());
    found.most.resize(net_.places.size());
    std::vector<uint64_t> seen(layout_.wide_words());
    std::vector<Key> batch;
    std::vector<uint32_t> sources;  // of the batch
    std::vector<uint64_t> hashes;
    std::vector<uint64_t> wide(layout_.wide_words());
    Key first = {};
    std::copy(layout_.first_key().begin(), layout_.first_key().end(), first.begin());
    layout_.Unpack(first.data(), wide.data());
    layout_.SetGuards(wide.data());
    Settle(wide, &first, &found.fired);
    states_.Insert(first);
    came_from_.push_back(0);
    uint64_t next_progress = kStatesPerProgress;
    bool truncated = false;
    uint32_t from = 0;
    while (from < states_.size() && found.end == Explored::End::kComplete) {
      batch.clear();
      sources.clear();
      for (;
           from < states_.size() && batch.size() < kBatch && found.end == Explored::End::kComplete;
           ++from) {
        Unpack(from, &wide);
        Note(wide, from, goals, &seen, &found);
        const Key key = states_.Get(from);
        const bool any = ForEachEnabled(wide, [&](const Rule& rule) {
          found.fired[rule.transition] = true;
          ++found.transitions;
          if (!Layout::Overflows(*rule.of, wide.data())) {
            batch.push_back(Successor(key, wide, rule, &found.fired));
            sources.push_back(from);
          } else if (limits.truncates) {
            truncated = true;
          } else {
            NoteOverflow(rule, from, wide, &found);
          }
        });
        if (!any && !found.deadlock) {
          found.deadlock = from;
        }
        if (limits.stops_at_first && IsDone(found)) {
          found.end = Explored::End::kGivenUp;
        }
      }
      if (found.end != Explored::End::kComplete) {
        break;
      }
      Insert(batch, sources, &hashes);
      if (states_.next_bytes() + 2 * sizeof(came_from_[0]) * came_from_.capacity() >
          limits.max_bytes) {
        found.end = Explored::End::kMemory;
      } else if (states_.size() >= limits.max_states) {
        found.end = Explored::End::kStates;
      } else if (from >= next_progress) {
        next_progress = from + kStatesPerProgress;
        if (progress && !progress(states_.size(), from)) {
          found.end = Explored::End::kGivenUp;
        }
      }
    }
    if (truncated && found.end == Explored::End::kComplete) {
      found.end = Explored::End::kTruncated;
    }
    for (uint32_t place = 0; place < net_.places.size(); ++place) {
      found.most[place] = std::max(
          found.most[place], layout_.TokensOf(seen.data(), place) != 0 ? uint64_t{1} : uint64_t{0});
    }
    found.states = states_.size();
    found.bytes = states_.bytes() + sizeof(came_from_[0]) * came_from_.capacity();
    return found;
  }

  std::vector<uint32_t> TraceTo(uint32_t state) const override {
    std::vector<uint32_t> steps;
    while (state != 0) {
      const auto [from, transition] =
          eager_ == 0 ? FirstPredecessor(state) : RememberedPredecessor(state);
      steps.push_back(transition);
      state = from;
    }
    std::reverse(steps.begin(), steps.end());
    return WithEager(0, steps, true);
  }

  Recurrence FindRecurrence(const SearchLimits& limits) const override {
    Recurrence found;
    found.dies_at.resize(net_.transitions.size());
    const auto everywhere = [](const std::vector<uint64_t>&) { return true; };
    bool first_is_terminal = false;
    uint64_t terminal = 0;  // components that are never left
    found.complete =
        FindComponents(limits, everywhere, [&](const std::vector<uint32_t>& members, bool leaves) {
          ++found.components;
          if (leaves) {
            return;
          }
          ++terminal;
          const uint32_t least = *std::min_element(members.begin(), members.end());
          first_is_terminal = first_is_terminal || least == 0;
          const std::vector<bool> lives = FiredWithin(members);
          for (size_t transition = 0; transition < lives.size(); ++transition) {
            std::optional<uint32_t>& dies = found.dies_at[transition];
            if (!lives[transition] && (!dies || least < *dies)) {
              dies = least;
            }
          }
        });
    found.reversible = found.complete && terminal == 1 && first_is_terminal;
    return found;
  }

  Overtaking FindOvertaking(const Property& property, const SearchLimits& limits) const override {
    Overtaking found;
    found.most = 0;
    std::vector<bool> counts(net_.transitions.size());
    for (const uint32_t transition : property.transitions) {
      counts[transition] = true;
    }
    const auto holds = [&](const std::vector<uint64_t>& wide) {
      return Holds(property.expression, TokensIn(wide));
    };
    // The most firings from each state on.
    std::vector<uint32_t> most(states_.size());
    std::vector<bool> is_member(states_.size());
    std::vector<uint64_t> wide(layout_.wide_words());
    std::optional<uint32_t> best;
    std::vector<uint64_t> other(layout_.wide_words());
    const auto is_inside = [&](uint32_t state) {
      Unpack(state, &other);
      return holds(other);
    };
    found.complete = FindComponents(limits, holds, [&](const std::vector<uint32_t>& members, bool) {
      for (const uint32_t member : members) {
        is_member[member] = true;
      }
      uint32_t value = 0;
      for (const uint32_t member : members) {
        ForEachSuccessor(member, &wide, [&](uint32_t transition, uint32_t to) {
          const uint32_t once = counts[transition] ? 1 : 0;
          if (is_member[to]) {
            if (once != 0 && found.most) {
              found.most.reset();
              found.trace = TraceTo(member);
              found.cycle = {transition};
              AddWayWithin(is_member, to, member, &found.cycle);
            }
          } else {
            value = std::max(value, once + (is_inside(to) ? most[to] : 0));
          }
        });
      }
      for (const uint32_t member : members) {
        is_member[member] = false;
        most[member] = value;
        if (found.most &&
            (!best || value > *found.most || (value == *found.most && member < *best))) {
          found.most = value;
          best = member;
        }
      }
    });
    if (found.most && best && *found.most > 0) {
      found.trace = TraceTo(*best);
      std::vector<uint32_t> steps;
      AddLongestWay(*best, most, counts, holds, &steps);
      const std::vector<uint32_t> rest = WithEager(*best, steps, false);
      found.trace.insert(found.trace.end(), rest.begin(), rest.end());
    }
    return found;
  }

 private:
  struct Rule {
    const Layout::Rule* of;
    Key change;
    uint32_t transition;
  };

  struct Frame {
    uint32_t state;
    uint32_t low;
    size_t first_target;  // those before it are done
    bool leaves;
  };

  static Key Sum(const Key& key, const Key& change) {
    Key sum;
    for (size_t i = 0; i < kWords; ++i) {
      sum[i] = key[i] + change[i];
    }
    return sum;
  }

  static Key Difference(const Key& key, const Key& change) {
    Key difference;
    for (size_t i = 0; i < kWords; ++i) {
      difference[i] = key[i] - change[i];
    }
    return difference;
  }

  void Unpack(uint32_t state, std::vector<uint64_t>* wide) const {
    layout_.Unpack(states_.Get(state).data(), wide->data());
    layout_.SetGuards(wide->data());
  }

  auto TokensIn(const std::vector<uint64_t>& wide) const {
    return [this, &wide](uint32_t place) { return layout_.TokensOf(wide.data(), place); };
  }

  // Those that are enabled in a settled state; false if nothing is.
  template <typename Visit>
  bool ForEachEnabled(const std::vector<uint64_t>& wide, const Visit& visit) const {
    bool any = false;
    for (size_t i = eager_; i < rules_.size(); ++i) {
      if (Layout::IsEnabled(*rules_[i].of, wide.data())) {
        any = true;
        visit(rules_[i]);
      }
    }
    return any;
  }

  // Fires eager transitions until none is enabled; `fire(rule)` is told. They commute, so that the
  // order does not matter. `wide` is the state's, with guards.
  template <typename Fire>
  void ForEachEager(std::vector<uint64_t> wide, const Fire& fire) const {
    for (bool any = true; any;) {
      any = false;
      for (size_t i = 0; i < eager_; ++i) {
        while (Layout::IsEnabled(*rules_[i].of, wide.data())) {
          any = true;
          Add(rules_[i], &wide);
          fire(rules_[i]);
        }
      }
    }
  }

  static void Add(const Rule& rule, std::vector<uint64_t>* wide) {
    for (const Layout::Change& change : rule.of->changes) {
      (*wide)[change.word] += change.added;
    }
  }

  void Settle(const std::vector<uint64_t>& wide, Key* key, std::vector<bool>* fired) const {
    ForEachEager(wide, [&](const Rule& rule) {
      *key = Sum(*key, rule.change);
      if (fired != nullptr) {
        (*fired)[rule.transition] = true;
      }
    });
  }

  // After the transition, and the eager ones that it enables.
  Key Successor(const Key& key, const std::vector<uint64_t>& wide, const Rule& rule,
                std::vector<bool>* fired) const {
    Key next = Sum(key, rule.change);
    if (eager_ != 0) {
      std::vector<uint64_t> after = wide;
      Add(rule, &after);
      Settle(after, &next, fired);
    }
    return next;
  }

  template <typename Visit>
  void ForEachSuccessor(uint32_t state, std::vector<uint64_t>* wide, const Visit& visit) const {
    Unpack(state, wide);
    const Key key = states_.Get(state);
    ForEachEnabled(*wide, [&](const Rule& rule) {
      const uint32_t to = states_.Find(Successor(key, *wide, rule, nullptr));
      assert(to != Store::kNone);
      visit(rule.transition, to);
    });
  }

  void Note(const std::vector<uint64_t>& wide, uint32_t state, const std::vector<Expression>& goals,
            std::vector<uint64_t>* seen, Explored* found) const {
    for (size_t word = 0; word < wide.size(); ++word) {
      (*seen)[word] |= wide[word];
    }
    for (const uint32_t place : counted_) {
      found->most[place] = std::max(found->most[place], layout_.TokensOf(wide.data(), place));
    }
    for (size_t goal = 0; goal < goals.size(); ++goal) {
      if (!found->reached[goal] && Holds(goals[goal], TokensIn(wide))) {
        found->reached[goal] = state;
      }
    }
  }

  static bool IsDone(const Explored& found) {
    return found.reached.empty() ? found.deadlock.has_value()
                                 : std::all_of(found.reached.begin(), found.reached.end(),
                                               [](const auto& state) { return state.has_value(); });
  }

  void NoteOverflow(const Rule& rule, uint32_t state, const std::vector<uint64_t>& wide,
                    Explored* found) const {
    if (found->end == Explored::End::kOverflow) {
      return;
    }
    found->end = Explored::End::kOverflow;
    found->overflow_state = state;
    found->overflow_transition = rule.transition;
    const Transition& it = net_.transitions[rule.transition];
    for (const Arc& arc : it.gives) {
      uint64_t tokens = layout_.TokensOf(wide.data(), arc.place) + arc.weight;
      for (const Arc& taken : it.takes) {
        tokens -= taken.place == arc.place ? taken.weight : 0;
      }
      if (tokens > layout_.MostTokens(arc.place)) {
        found->overflow_place = arc.place;
      }
    }
  }

  void Insert(const std::vector<Key>& batch, const std::vector<uint32_t>& sources,
              std::vector<uint64_t>* hashes) {
    hashes->clear();
    for (const Key& key : batch) {
      hashes->push_back(states_.Prefetch(key));
    }
    for (const uint64_t hash : *hashes) {
      states_.PrefetchKey(hash);
    }
    for (size_t i = 0; i < batch.size(); ++i) {
      if (states_.Insert(batch[i]).second && eager_ != 0) {
        came_from_.push_back(sources[i]);
      }
    }
  }

  // Breadth first, the first predecessor is the one that found the state.
  std::pair<uint32_t, uint32_t> FirstPredecessor(uint32_t state) const {
    const Key key = states_.Get(state);
    std::pair<uint32_t, uint32_t> first = {Store::kNone, 0};
    std::vector<uint64_t> wide(layout_.wide_words());
    for (const Rule& rule : rules_) {
      const uint32_t from = states_.Find(Difference(key, rule.change));
      if (from >= std::min(first.first, state)) {
        continue;
      }
      Unpack(from, &wide);
      ForEachEnabled(wide, [&](const Rule& enabled) {
        if (&enabled == &rule) {
          first = {from, rule.transition};
        }
      });
    }
    assert(first.first != Store::kNone);
    return first;
  }

  std::pair<uint32_t, uint32_t> RememberedPredecessor(uint32_t state) const {
    const uint32_t from = came_from_[state];
    std::optional<uint32_t> first;
    std::vector<uint64_t> wide(layout_.wide_words());
    ForEachSuccessor(from, &wide, [&](uint32_t transition, uint32_t to) {
      if (to == state && !first) {
        first = transition;
      }
    });
    assert(first);
    return {from, *first};
  }

  // The steps with the eager ones between them; `from` is the state that they begin in, with the
  // eager steps to it if it is the first one.
  std::vector<uint32_t> WithEager(uint32_t from, const std::vector<uint32_t>& steps,
                                  bool is_first) const {
    std::vector<uint32_t> all;
    std::vector<uint64_t> wide(layout_.wide_words());
    const auto settle = [&] {
      std::vector<uint64_t> settled = wide;
      ForEachEager(wide, [&](const Rule& rule) {
        all.push_back(rule.transition);
        Add(rule, &settled);
      });
      wide = settled;
    };
    if (is_first) {
      layout_.Unpack(layout_.first_key().data(), wide.data());
      layout_.SetGuards(wide.data());
      settle();
    } else {
      Unpack(from, &wide);
    }
    for (const uint32_t step : steps) {
      const auto rule = std::find_if(rules_.begin(), rules_.end(),
                                     [&](const Rule& it) { return it.transition == step; });
      all.push_back(step);
      Add(*rule, &wide);
      settle();
    }
    return all;
  }

  std::vector<bool> FiredWithin(const std::vector<uint32_t>& members) const {
    std::vector<bool> fired(net_.transitions.size());
    size_t missing = fired.size();
    std::vector<uint64_t> wide(layout_.wide_words());
    for (size_t i = 0; i < members.size() && missing != 0; ++i) {
      Unpack(members[i], &wide);
      const auto note = [&](const Rule& rule) {
        missing -= fired[rule.transition] ? 0U : 1U;
        fired[rule.transition] = true;
      };
      ForEachEnabled(wide, [&](const Rule& rule) {
        note(rule);
        if (eager_ != 0) {
          std::vector<uint64_t> after = wide;
          Add(rule, &after);
          ForEachEager(after, note);
        }
      });
    }
    return fired;
  }

  // Tarjan's algorithm on the states that are inside. Components come in such an order that those
  // that can be reached from one come before it; `leaves`: another one can be reached. False if the
  // memory does not suffice.
  template <typename Inside, typename Take>
  bool FindComponents(const SearchLimits& limits, const Inside& inside, const Take& take) const {
    constexpr uint32_t kDone = Store::kNone;
    constexpr uint32_t kOutside = kDone - 1;
    const uint64_t bytes = states_.bytes() + 4 * states_.size();
    if (bytes > limits.max_bytes) {
      return false;
    }
    std::vector<uint32_t> order(states_.size());  // 0: not yet seen
    std::vector<uint32_t> open;                   // states whose component is not known
    std::vector<Frame> frames;
    std::vector<uint32_t> targets;  // of the states in `frames`
    std::vector<uint32_t> members;
    std::vector<uint64_t> wide(layout_.wide_words());
    uint32_t count = 0;
    const auto enter = [&](uint32_t state) {
      Unpack(state, &wide);
      if (!inside(wide)) {
        order[state] = kOutside;
        return;
      }
      order[state] = ++count;
      open.push_back(state);
      frames.push_back({state, count, targets.size(), false});
      ForEachSuccessor(state, &wide, [&](uint32_t, uint32_t to) { targets.push_back(to); });
    };
    for (uint32_t root = 0; root < states_.size(); ++root) {
      if (order[root] == 0) {
        enter(root);
      }
      while (!frames.empty()) {
        Frame& frame = frames.back();
        if (targets.size() > frame.first_target) {
          const uint32_t to = targets.back();
          if (order[to] == 0) {
            enter(to);
            if (order[to] == kOutside) {
              targets.pop_back();
            }
            continue;  // it is looked at again afterwards
          }
          targets.pop_back();
          if (order[to] == kDone) {
            frame.leaves = true;
          } else if (order[to] != kOutside) {
            frame.low = std::min(frame.low, order[to]);
          }
          continue;
        }
        if (bytes + 4 * (open.capacity() + targets.capacity()) + sizeof(Frame) * frames.capacity() >
            limits.max_bytes) {
          return false;
        }
        const Frame done = frame;
        frames.pop_back();
        if (done.low < order[done.state]) {
          frames.back().low = std::min(frames.back().low, done.low);
          frames.back().leaves = frames.back().leaves || done.leaves;
          continue;
        }
        members.clear();
        uint32_t member = 0;
        do {
          member = open.back();
          open.pop_back();
          order[member] = kDone;
          members.push_back(member);
        } while (member != done.state);
        take(members, done.leaves);
      }
    }
    return true;
  }

  // A shortest way between two states of a component.
  void AddWayWithin(const std::vector<bool>& is_member, uint32_t from, uint32_t to,
                    std::vector<uint32_t>* trace) const {
    std::unordered_map<uint32_t, std::pair<uint32_t, uint32_t>> came;  // from, transition
    std::vector<uint32_t> found = {from};
    std::vector<uint64_t> wide(layout_.wide_words());
    came[from] = {from, 0};
    for (size_t i = 0; i < found.size() && !came.contains(to); ++i) {
      ForEachSuccessor(found[i], &wide, [&](uint32_t transition, uint32_t next) {
        if (is_member[next] && came.try_emplace(next, found[i], transition).second) {
          found.push_back(next);
        }
      });
    }
    std::vector<uint32_t> way;
    for (uint32_t state = to; state != from; state = came.at(state).first) {
      way.push_back(came.at(state).second);
    }
    trace->insert(trace->end(), way.rbegin(), way.rend());
  }

  // From `state` on, a way with the most counted firings.
  template <typename Inside>
  void AddLongestWay(uint32_t state, const std::vector<uint32_t>& most,
                     const std::vector<bool>& counts, const Inside& inside,
                     std::vector<uint32_t>* trace) const {
    std::vector<uint64_t> wide(layout_.wide_words());
    std::vector<uint64_t> other(layout_.wide_words());
    for (uint32_t left = most[state]; left != 0; left = most[state]) {
      // Within a component nothing counts: the way out of it is searched breadth first.
      std::unordered_map<uint32_t, std::pair<uint32_t, uint32_t>> came;
      std::vector<uint32_t> found = {state};
      came[state] = {state, 0};
      std::optional<std::pair<uint32_t, uint32_t>> out;  // the state before it, and the transition
      uint32_t after = 0;
      bool goes_on = true;
      for (size_t i = 0; i < found.size() && !out; ++i) {
        ForEachSuccessor(found[i], &wide, [&](uint32_t transition, uint32_t to) {
          Unpack(to, &other);
          const uint32_t beyond = inside(other) ? most[to] : 0;
          if (out) {
          } else if (counts[transition] && beyond + 1 == left) {
            out = {found[i], transition};
            after = to;
            goes_on = beyond != 0;
          } else if (!counts[transition] && beyond == left &&
                     came.try_emplace(to, found[i], transition).second) {
            found.push_back(to);
          }
        });
      }
      assert(out);
      std::vector<uint32_t> way = {out->second};
      for (uint32_t at = out->first; at != state; at = came.at(at).first) {
        way.push_back(came.at(at).second);
      }
      trace->insert(trace->end(), way.rbegin(), way.rend());
      state = after;
      if (!goes_on) {
        return;
      }
    }
  }

  const Net& net_;
  const Layout& layout_;
  Store states_;
  std::vector<Rule> rules_;  // the eager ones first
  size_t eager_ = 0;
  std::vector<uint32_t> came_from_;  // by state, with eager transitions only
  std::vector<uint32_t> counted_;    // places with more than one bit
};

}  // namespace

std::unique_ptr<StateSpace> MakeStateSpace(const Net& net, const Layout& layout,
                                           const std::vector<uint32_t>& eager) {
  switch (layout.key_words()) {
    case 1:
      return std::make_unique<PackedStateSpace<1>>(net, layout, eager);
    case 2:
      return std::make_unique<PackedStateSpace<2>>(net, layout, eager);
    case 3:
      return std::make_unique<PackedStateSpace<3>>(net, layout, eager);
    case 4:
      return std::make_unique<PackedStateSpace<4>>(net, layout, eager);
    default:
      break;
  }
  // The others take the next size; the words that they do not need are 0 and not stored.
  if (layout.key_words() <= 8) {
    return std::make_unique<PackedStateSpace<8>>(net, layout, eager);
  }
  return layout.key_words() <= 32 ? std::make_unique<PackedStateSpace<32>>(net, layout, eager)
                                  : nullptr;
}

}  // namespace pheromone::petri
