// The graph of a net's packed markings: which are known, and what can be fired in each.
//
//   PackedGraph<1> graph(net, layout, eager);
//   graph.InsertFirst(&fired);
//   graph.Unpack(0, &wide);
//   graph.ForEachEnabled(wide, [&](const auto& rule) { ... graph.Successor(key, wide, rule, ...)
//   });
//
// With eager transitions (reduction.h) the states are the settled ones, in which none of these is
// enabled. `wide` is a marking's wide form with guards (layout.h). Not thread-safe.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "server/core/petri/layout.h"
#include "server/core/petri/net.h"
#include "server/core/petri/state_store.h"

namespace pheromone::petri {

template <size_t kWords>
class PackedGraph {
  using Store = StateStore<kWords>;

 public:
  using Key = typename Store::Key;
  using Wide = std::vector<uint64_t>;

  struct Rule {
    const Layout::Rule* of;
    Key change;
    uint32_t transition;
  };

  /// `net` and `layout` are kept by reference.
  PackedGraph(const Net& net, const Layout& layout, const std::vector<uint32_t>& eager)
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
  }

  size_t size() const { return states_.size(); }
  size_t transition_count() const { return net_.transitions.size(); }
  uint64_t bytes() const { return states_.bytes() + sizeof(uint32_t) * came_from_.capacity(); }
  /// What it may need as soon as another state is added.
  uint64_t next_bytes() const {
    return states_.next_bytes() + 2 * sizeof(uint32_t) * came_from_.capacity();
  }
  Wide MakeWide() const {
    Wide wide(layout_.wide_words());
    return wide;
  }
  Key KeyOf(uint32_t state) const { return states_.Get(state); }

  void Unpack(uint32_t state, Wide* wide) const {
    layout_.Unpack(states_.Get(state).data(), wide->data());
    layout_.SetGuards(wide->data());
  }

  auto TokensIn(const Wide& wide) const {
    return [this, &wide](uint32_t place) { return layout_.TokensOf(wide.data(), place); };
  }

  // Those that are enabled in a settled state; false if nothing is.
  template <typename Visit>
  bool ForEachEnabled(const Wide& wide, const Visit& visit) const {
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
  void ForEachEager(Wide wide, const Fire& fire) const {
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

  static void Add(const Rule& rule, Wide* wide) {
    for (const Layout::Change& change : rule.of->changes) {
      (*wide)[change.word] += change.added;
    }
  }

  void Settle(const Wide& wide, Key* key, std::vector<bool>* fired) const {
    ForEachEager(wide, [&](const Rule& rule) {
      *key = Sum(*key, rule.change);
      if (fired != nullptr) {
        (*fired)[rule.transition] = true;
      }
    });
  }

  // After the transition, and the eager ones that it enables.
  Key Successor(const Key& key, const Wide& wide, const Rule& rule,
                std::vector<bool>* fired) const {
    Key next = Sum(key, rule.change);
    if (eager_ != 0) {
      Wide after = wide;
      Add(rule, &after);
      Settle(after, &next, fired);
    }
    return next;
  }

  template <typename Visit>
  void ForEachSuccessor(uint32_t state, Wide* wide, const Visit& visit) const {
    Unpack(state, wide);
    const Key key = states_.Get(state);
    ForEachEnabled(*wide, [&](const Rule& rule) {
      const uint32_t to = states_.Find(Successor(key, *wide, rule, nullptr));
      assert(to != Store::kNone);
      visit(rule.transition, to);
    });
  }

  /// The state that the net begins in, settled.
  void InsertFirst(std::vector<bool>* fired) {
    Key first = {};
    std::copy(layout_.first_key().begin(), layout_.first_key().end(), first.begin());
    Settle(FirstMarking(), &first, fired);
    states_.Insert(first);
    came_from_.push_back(0);
  }

  /// States of `batch`, each reached from the state of `sources` at its place.
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

  /// A shortest way there. A predecessor is found by firing backwards; with eager transitions, that
  /// is remembered.
  std::vector<uint32_t> TraceTo(uint32_t state) const {
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

  /// The steps with the eager ones between them; `from` is the state that they begin in, with the
  /// eager steps to it if it is the first one.
  std::vector<uint32_t> WithEager(uint32_t from, const std::vector<uint32_t>& steps,
                                  bool is_first) const {
    std::vector<uint32_t> all;
    Wide wide = MakeWide();
    const auto settle = [&] {
      Wide settled = wide;
      ForEachEager(wide, [&](const Rule& rule) {
        all.push_back(rule.transition);
        Add(rule, &settled);
      });
      wide = settled;
    };
    if (is_first) {
      wide = FirstMarking();
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

  /// Which transitions are fired in these states.
  std::vector<bool> FiredWithin(const std::vector<uint32_t>& members) const {
    std::vector<bool> fired(net_.transitions.size());
    size_t missing = fired.size();
    Wide wide = MakeWide();
    for (size_t i = 0; i < members.size() && missing != 0; ++i) {
      Unpack(members[i], &wide);
      const auto note = [&](const Rule& rule) {
        missing -= fired[rule.transition] ? 0U : 1U;
        fired[rule.transition] = true;
      };
      ForEachEnabled(wide, [&](const Rule& rule) {
        note(rule);
        if (eager_ != 0) {
          Wide after = wide;
          Add(rule, &after);
          ForEachEager(after, note);
        }
      });
    }
    return fired;
  }

 private:
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

  Wide FirstMarking() const {
    Wide wide = MakeWide();
    layout_.Unpack(layout_.first_key().data(), wide.data());
    layout_.SetGuards(wide.data());
    return wide;
  }

  // Breadth first, the first predecessor is the one that found the state.
  std::pair<uint32_t, uint32_t> FirstPredecessor(uint32_t state) const {
    const Key key = states_.Get(state);
    std::pair<uint32_t, uint32_t> first = {Store::kNone, 0};
    Wide wide = MakeWide();
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
    Wide wide = MakeWide();
    ForEachSuccessor(from, &wide, [&](uint32_t transition, uint32_t to) {
      if (to == state && !first) {
        first = transition;
      }
    });
    assert(first);
    return {from, *first};
  }

  const Net& net_;
  const Layout& layout_;
  Store states_;
  std::vector<Rule> rules_;  // the eager ones first
  size_t eager_ = 0;
  std::vector<uint32_t> came_from_;  // by state, with eager transitions only
};

}  // namespace pheromone::petri
