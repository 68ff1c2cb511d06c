// Exhaustive search through the states of a model that runs the real code.
//
//   struct World { ... };                       // a value: copied for each step
//   const Explored found = Explore(World(), {
//       .key = [](const World& w) { return w.Key(); },
//       .next = [](const World& w, const auto& visit) { ... visit("deliver", successor); ... },
//       .wrong = [](const World& w) { return w.Wrong(); },   // empty: nothing
//   });
//   if (found.verdict == Verdict::kRefuted) // found.trace: the shortest way there
//
// Breadth first, so a trace is a shortest one. Two states of equal key are taken for the same: what
// the key leaves out must not matter to what is checked. `max_states` bounds the number of states,
// and so the memory; beyond it the verdict is kUnknown.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
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
  size_t max_states = 1'000'000;
};

template <typename State>
Explored Explore(const State& first, const Model<State>& model) {
  struct Came {
    size_t from;
    std::string step;
  };
  Explored found;
  std::vector<Came> came;  // by state
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
    if (!is_new) {
      return;
    }
    came.push_back({from, std::move(step)});
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
  found.verdict = !found.wrong.empty() ? Verdict::kRefuted
                  : waiting.empty()    ? Verdict::kProved
                                       : Verdict::kUnknown;
  return found;
}

}  // namespace pheromone::verify
