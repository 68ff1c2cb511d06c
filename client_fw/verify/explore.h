// Exhaustive search through the states of a model that runs the real code.
//
//   struct World { ... };                       // a value: copied for each step
//   const Explored found = Explore(World(), {
//       .key = [](const World& w) { return w.Key(); },
//       .next = [](const World& w, const auto& visit) { ... visit("deliver", successor); ... },
//       .wrong = [](const World& w) { return w.Wrong(); },   // empty: nothing
//       .finished = [](const World& w) { return w.Finished(); },
//       .must_finish = [](const World& w) { return !w.GaveUp(); },
//   });
//   if (found.verdict == Verdict::kRefuted) // found.trace: the shortest way there
//
// Proved is that no state is wrong and, with `finished`, that a finished one can be reached from
// every state that must_finish. Breadth first, so a trace is a shortest one. Two states of equal
// key are taken for the same: what the key leaves out must not matter to what is checked.
// `max_states` bounds the number of states, and so the memory; beyond it the verdict is kUnknown.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <numeric>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

namespace pheromone::verify {

enum class Verdict { kProved, kRefuted, kUnknown };

struct Explored {
  Verdict verdict = Verdict::kUnknown;
  size_t states = 0;
  size_t transitions = 0;
  std::string wrong{};               ///< what is wrong in the last state of `trace`
  std::vector<std::string> trace{};  ///< the steps to it
};

template <typename State>
struct Model {
  using Visit = std::function<void(std::string step, State successor)>;

  std::function<std::string(const State&)> key;
  std::function<void(const State&, const Visit&)> next;
  std::function<std::string(const State&)> wrong;
  std::function<bool(const State&)> finished{};  ///< empty: no state must finish
  std::function<bool(const State&)> must_finish{};
  size_t max_states = 1'000'000;
};

/// Adds to `states` all from which one of them can be reached, by the steps from[i] to to[i].
inline void AddPredecessors(const std::vector<uint32_t>& from, const std::vector<uint32_t>& to,
                            std::vector<bool>* states) {
  std::vector<uint32_t> begin(states->size() + 1);  // of the predecessors of each state
  for (const uint32_t state : to) {
    ++begin[state + 1];
  }
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<uint32_t> next = begin;
  std::vector<uint32_t> predecessors(to.size());
  for (size_t step = 0; step < to.size(); ++step) {
    predecessors[next[to[step]]++] = from[step];
  }
  std::vector<size_t> waiting;
  for (size_t state = 0; state < states->size(); ++state) {
    if ((*states)[state]) {
      waiting.push_back(state);
    }
  }
  while (!waiting.empty()) {
    const size_t state = waiting.back();
    waiting.pop_back();
    for (uint32_t i = begin[state]; i < begin[state + 1]; ++i) {
      if (!(*states)[predecessors[i]]) {
        (*states)[predecessors[i]] = true;
        waiting.push_back(predecessors[i]);
      }
    }
  }
}

template <typename State>
Explored Explore(const State& first, const Model<State>& model) {
  struct Came {
    size_t from = 0;
    std::string step;
  };
  Explored found;
  std::vector<Came> came;        // by state
  std::vector<bool> can_finish;  // by state, as the next
  std::vector<bool> must_finish;
  std::vector<uint32_t> steps_from;
  std::vector<uint32_t> steps_to;
  std::unordered_map<std::string, size_t> known;
  std::deque<std::pair<size_t, State>> waiting;

  const auto trace_to = [&](size_t state) {
    std::vector<std::string> trace;
    for (; state != 0; state = came[state].from) {
      trace.insert(trace.begin(), came[state].step);
    }
    return trace;
  };
  // False if the search is over.
  const auto add = [&](size_t from, std::string step, State state) {
    const auto [place, is_new] = known.try_emplace(model.key(state), came.size());
    if (model.finished) {
      steps_from.push_back(static_cast<uint32_t>(from));
      steps_to.push_back(static_cast<uint32_t>(place->second));
    }
    if (!is_new) {
      return;
    }
    came.push_back({from, std::move(step)});
    if (model.finished) {
      can_finish.push_back(model.finished(state));
      must_finish.push_back(model.must_finish(state));
    }
    const std::string wrong = model.wrong(state);
    if (!wrong.empty() && found.wrong.empty()) {
      found.wrong = wrong;
      found.trace = trace_to(place->second);
    }
    waiting.emplace_back(place->second, std::move(state));
  };

  add(0, "", first);
  while (!waiting.empty() && found.wrong.empty() && known.size() <= model.max_states) {
    const auto [from, state] = std::move(waiting.front());
    waiting.pop_front();
    model.next(state, [&, from = from](std::string step, State successor) {
      ++found.transitions;
      if (found.wrong.empty()) {
        add(from, std::move(step), std::move(successor));
      }
    });
  }
  found.states = known.size();
  if (model.finished && waiting.empty() && found.wrong.empty()) {
    AddPredecessors(steps_from, steps_to, &can_finish);
    for (size_t state = 0; state < came.size() && found.wrong.empty(); ++state) {
      if (must_finish[state] && !can_finish[state]) {
        found.wrong = "cannot finish";
        found.trace = trace_to(state);
      }
    }
  }
  found.verdict = !found.wrong.empty() ? Verdict::kRefuted
                  : waiting.empty()    ? Verdict::kProved
                                       : Verdict::kUnknown;
  return found;
}

}  // namespace pheromone::verify
