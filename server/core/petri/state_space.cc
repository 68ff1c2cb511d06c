#include "server/core/petri/state_space.h"

#include <algorithm>

#include "server/core/petri/components.h"
#include "server/core/petri/overtaking.h"
#include "server/core/petri/packed_graph.h"

namespace pheromone::petri {
namespace {

constexpr size_t kBatch = 64;
constexpr uint64_t kStatesPerProgress = uint64_t{1} << 16;

template <size_t kWords>
class PackedStateSpace final : public StateSpace {
  using Graph = PackedGraph<kWords>;
  using Key = typename Graph::Key;
  using Wide = typename Graph::Wide;
  using Rule = typename Graph::Rule;

 public:
  PackedStateSpace(const Net& net, const Layout& layout, const std::vector<uint32_t>& eager)
      : net_(net), layout_(layout), graph_(net, layout, eager) {
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
    Wide seen = graph_.MakeWide();
    std::vector<Key> batch;
    std::vector<uint32_t> sources;  // of the batch
    std::vector<uint64_t> hashes;
    Wide wide = graph_.MakeWide();
    graph_.InsertFirst(&found.fired);
    uint64_t next_progress = kStatesPerProgress;
    bool truncated = false;
    uint32_t from = 0;
    while (from < graph_.size() && found.end == Explored::End::kComplete) {
      batch.clear();
      sources.clear();
      for (; from < graph_.size() && batch.size() < kBatch && found.end == Explored::End::kComplete;
           ++from) {
        graph_.Unpack(from, &wide);
        Note(wide, from, goals, &seen, &found);
        const Key key = graph_.KeyOf(from);
        const bool any = graph_.ForEachEnabled(wide, [&](const Rule& rule) {
          found.fired[rule.transition] = true;
          ++found.transitions;
          if (!Layout::Overflows(*rule.of, wide.data())) {
            batch.push_back(graph_.Successor(key, wide, rule, &found.fired));
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
      graph_.Insert(batch, sources, &hashes);
      if (graph_.next_bytes() > limits.max_bytes) {
        found.end = Explored::End::kMemory;
      } else if (graph_.size() >= limits.max_states) {
        found.end = Explored::End::kStates;
      } else if (from >= next_progress) {
        next_progress = from + kStatesPerProgress;
        if (progress && !progress(graph_.size(), from)) {
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
    found.states = graph_.size();
    found.bytes = graph_.bytes();
    return found;
  }

  std::vector<uint32_t> TraceTo(uint32_t state) const override { return graph_.TraceTo(state); }

  Recurrence FindRecurrence(const SearchLimits& limits) const override {
    Recurrence found;
    found.dies_at.resize(net_.transitions.size());
    const auto everywhere = [](const Wide&) { return true; };
    bool first_is_terminal = false;
    uint64_t terminal = 0;  // components that are never left
    found.complete = FindComponents(
        graph_, limits, everywhere, [&](const std::vector<uint32_t>& members, bool leaves) {
          ++found.components;
          if (leaves) {
            return;
          }
          ++terminal;
          const uint32_t least = *std::min_element(members.begin(), members.end());
          first_is_terminal = first_is_terminal || least == 0;
          const std::vector<bool> lives = graph_.FiredWithin(members);
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
    return OvertakingSearch<Graph>(graph_, property).Find(limits);
  }

 private:
  void Note(const Wide& wide, uint32_t state, const std::vector<Expression>& goals, Wide* seen,
            Explored* found) const {
    for (size_t word = 0; word < wide.size(); ++word) {
      (*seen)[word] |= wide[word];
    }
    for (const uint32_t place : counted_) {
      found->most[place] = std::max(found->most[place], layout_.TokensOf(wide.data(), place));
    }
    for (size_t goal = 0; goal < goals.size(); ++goal) {
      if (!found->reached[goal] && Holds(goals[goal], graph_.TokensIn(wide))) {
        found->reached[goal] = state;
      }
    }
  }

  static bool IsDone(const Explored& found) {
    return found.reached.empty() ? found.deadlock.has_value()
                                 : std::all_of(found.reached.begin(), found.reached.end(),
                                               [](const auto& state) { return state.has_value(); });
  }

  void NoteOverflow(const Rule& rule, uint32_t state, const Wide& wide, Explored* found) const {
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

  const Net& net_;
  const Layout& layout_;
  Graph graph_;
  std::vector<uint32_t> counted_;  // places with more than one bit
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
  return layout.key_words() <= Layout::kMaxKeyWords
             ? std::make_unique<PackedStateSpace<32>>(net, layout, eager)
             : nullptr;
}

}  // namespace pheromone::petri
