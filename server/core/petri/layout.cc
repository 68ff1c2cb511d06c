#include "server/core/petri/layout.h"

#include <algorithm>
#include <bit>
#include <map>
#include <optional>

namespace pheromone::petri {
namespace {

constexpr uint32_t kWordBits = 64;
constexpr uint32_t kMaxBits = 32;

// Solves invariants for places, the widest first, one place each.
std::vector<Layout::Determined> Solve(const std::vector<Flow>& invariants,
                                      const std::vector<uint32_t>& bits) {
  std::vector<std::map<uint32_t, int64_t>> rows;
  for (const Flow& flow : invariants) {
    std::map<uint32_t, int64_t>& row = rows.emplace_back();
    for (const FlowTerm& term : flow.terms) {
      row[term.index] = term.weight;
    }
  }
  std::vector<std::optional<uint32_t>> solved(rows.size());
  for (size_t i = 0; i < rows.size(); ++i) {
    std::optional<uint32_t> pivot;
    for (const auto& [place, weight] : rows[i]) {
      if ((weight == 1 || weight == -1) && (!pivot || bits[place] > bits[*pivot])) {
        pivot = place;
      }
    }
    if (!pivot) {
      continue;
    }
    solved[i] = pivot;
    for (size_t other = 0; other < rows.size(); ++other) {
      const auto found = other == i ? rows[other].end() : rows[other].find(*pivot);
      if (found == rows[other].end()) {
        continue;
      }
      const int64_t times = found->second * rows[i].at(*pivot);
      std::map<uint32_t, int64_t> sum = rows[other];
      bool fits = true;
      for (const auto& [place, weight] : rows[i]) {
        int64_t product = 0;
        fits = fits && !__builtin_mul_overflow(times, weight, &product) &&
               !__builtin_sub_overflow(sum[place], product, &sum[place]);
      }
      if (!fits) {
        solved[i].reset();  // the others stay as they are: each of them is still an invariant
        break;
      }
      std::erase_if(sum, [](const auto& term) { return term.second == 0; });
      rows[other] = std::move(sum);
    }
  }
  std::vector<Layout::Determined> found;
  std::vector<bool> is_determined(bits.size());
  for (size_t i = 0; i < rows.size(); ++i) {
    if (solved[i]) {
      is_determined[*solved[i]] = true;
    }
  }
  for (size_t i = 0; i < rows.size(); ++i) {
    const bool by_others =
        solved[i] && std::none_of(rows[i].begin(), rows[i].end(), [&](const auto& term) {
          return term.first != *solved[i] && is_determined[term.first];
        });
    if (!solved[i]) {
      continue;
    }
    if (!by_others) {
      is_determined[*solved[i]] = false;
      continue;
    }
    Layout::Determined it{*solved[i], {}};
    for (const auto& [place, weight] : rows[i]) {
      it.by.terms.push_back({place, weight});
    }
    found.push_back(std::move(it));
  }
  return found;
}

uint32_t BitsFor(uint64_t most) {
  return std::clamp<uint32_t>(static_cast<uint32_t>(std::bit_width(most)), 1, kMaxBits);
}

uint64_t MostIn(uint32_t bits) {
  return (uint64_t{1} << bits) - 1;
}

}  // namespace

std::vector<Layout::Field> Layout::PlaceFields(const std::vector<uint32_t>& places,
                                               uint32_t extra_bits,
                                               const std::vector<uint32_t>& bits,
                                               size_t* words) const {
  std::vector<Field> fields(bits.size());
  std::vector<uint32_t> used;  // bits of each word
  size_t first = 0;            // words before it are full
  for (const uint32_t place : places) {
    const uint32_t needed = bits[place] + extra_bits;
    while (first < used.size() && used[first] == kWordBits) {
      ++first;
    }
    size_t word = first;
    while (word < used.size() && used[word] + needed > kWordBits) {
      ++word;
    }
    if (word == used.size()) {
      used.push_back(0);
    }
    fields[place] = {static_cast<uint32_t>(word), used[word], MostIn(bits[place])};
    used[word] += needed;
  }
  *words = used.size();
  return fields;
}

Layout::Layout(const Net& net, const std::vector<uint64_t>& at_most,
               const std::vector<Flow>& invariants) {
  std::vector<uint32_t> bits;
  bits.reserve(net.places.size());
  for (size_t place = 0; place < net.places.size(); ++place) {
    bits.push_back(BitsFor(std::max<uint64_t>(at_most[place], net.places[place].tokens)));
  }
  std::vector<uint32_t> all(net.places.size());
  for (uint32_t place = 0; place < all.size(); ++place) {
    all[place] = place;
  }
  size_t wide_words = 0;
  fields_ = PlaceFields(all, 1, bits, &wide_words);
  guards_.resize(wide_words);
  base_.resize(wide_words);
  for (const uint32_t place : all) {
    guards_[fields_[place].word] |= (fields_[place].most + 1) << fields_[place].shift;
  }

  const std::vector<Determined> determined = Solve(invariants, bits);
  std::vector<bool> is_kept(net.places.size(), true);
  for (const Determined& it : determined) {
    is_kept[it.place] = false;
  }
  std::vector<uint32_t> kept;
  std::copy_if(all.begin(), all.end(), std::back_inserter(kept),
               [&](uint32_t place) { return is_kept[place]; });
  const std::vector<Field> key_fields = PlaceFields(kept, 0, bits, &key_words_);
  key_words_ = std::max<size_t>(key_words_, 1);
  uint32_t last_bits = 0;
  first_key_.resize(key_words_);
  for (const uint32_t place : kept) {
    const Field& field = key_fields[place];
    first_key_[field.word] |= uint64_t{net.places[place].tokens} << field.shift;
    if (field.word + 1 == key_words_) {
      last_bits = std::max(last_bits, field.shift + bits[place]);
    }
  }
  key_bytes_ = 8 * (key_words_ - 1) + std::max<size_t>((last_bits + 7) / 8, 1);

  if (key_words_ > kMaxKeyWords) {
    return;  // of no use
  }
  AddParts(net, AddedBy(net, determined, is_kept), key_fields, bits);
  MakeRules(net);
  AddKeyChanges(net, is_kept, key_fields);
}

// By kept place: what one token adds to the wide form, in its own field and in those of the places
// that it determines. The sum of all is exact, so it may be taken modulo 2^64.
std::vector<std::vector<uint64_t>> Layout::AddedBy(const Net& net,
                                                   const std::vector<Determined>& determined,
                                                   const std::vector<bool>& is_kept) {
  std::vector<std::vector<uint64_t>> added(net.places.size());
  for (size_t place = 0; place < net.places.size(); ++place) {
    if (is_kept[place]) {
      added[place].resize(wide_words());
      added[place][fields_[place].word] += uint64_t{1} << fields_[place].shift;
    }
  }
  for (const Determined& it : determined) {
    const Field& field = fields_[it.place];
    int64_t sign = 1;
    for (const FlowTerm& term : it.by.terms) {
      sign = term.index == it.place ? term.weight : sign;
    }
    uint64_t value = 0;
    for (const FlowTerm& term : it.by.terms) {
      value += static_cast<uint64_t>(term.weight) * net.places[term.index].tokens;
      if (term.index != it.place) {
        added[term.index][field.word] += static_cast<uint64_t>(-sign * term.weight) << field.shift;
      }
    }
    base_[field.word] += static_cast<uint64_t>(sign) * value << field.shift;
  }
  return added;
}

void Layout::AddParts(const Net& net, const std::vector<std::vector<uint64_t>>& added,
                      const std::vector<Field>& key_fields, const std::vector<uint32_t>& bits) {
  parts_.resize(2 * key_bytes_ * 16 * wide_words());
  for (size_t place = 0; place < net.places.size(); ++place) {
    if (added[place].empty()) {
      continue;
    }
    const Field& field = key_fields[place];
    for (uint32_t bit = 0; bit < bits[place]; ++bit) {
      const uint32_t at = field.word * kWordBits + field.shift + bit;
      for (uint64_t value = 0; value < 16; ++value) {
        if ((value >> at % 4 & 1) == 0) {
          continue;
        }
        for (size_t word = 0; word < wide_words(); ++word) {
          parts_[(uint64_t{at} / 4 * 16 + value) * wide_words() + word] += added[place][word]
                                                                           << bit;
        }
      }
    }
  }
}

void Layout::AddKeyChanges(const Net& net, const std::vector<bool>& is_kept,
                           const std::vector<Field>& key_fields) {
  for (Rule& rule : rules_) {
    rule.key_change.resize(key_words_);
  }
  for (size_t t = 0; t < net.transitions.size(); ++t) {
    const auto add = [&](const Arc& arc, uint64_t sign) {
      if (is_kept[arc.place]) {
        rules_[t].key_change[key_fields[arc.place].word] += sign * arc.weight
                                                            << key_fields[arc.place].shift;
      }
    };
    for (const Arc& arc : net.transitions[t].gives) {
      add(arc, 1);
    }
    for (const Arc& arc : net.transitions[t].takes) {
      add(arc, ~uint64_t{0});
    }
  }
}

void Layout::MakeRules(const Net& net) {
  for (const Transition& transition : net.transitions) {
    Rule& rule = rules_.emplace_back();
    std::map<uint32_t, uint64_t> needed;  // by place: the most that any arc needs
    for (const auto* arcs : {&transition.takes, &transition.reads}) {
      for (const Arc& arc : *arcs) {
        needed[arc.place] = std::max<uint64_t>(needed[arc.place], arc.weight);
      }
    }
    const auto add = [&](std::vector<Test>* tests, uint32_t place, uint64_t weight) {
      const Field& field = fields_[place];
      auto found = std::find_if(tests->begin(), tests->end(),
                                [&](const Test& test) { return test.word == field.word; });
      if (found == tests->end()) {
        found = tests->insert(found, {field.word, 0, 0});
      }
      found->need |= weight << field.shift;
      found->mask |= (field.most + 1) << field.shift;
    };
    for (const auto& [place, weight] : needed) {
      if (weight > fields_[place].most) {
        rule.never = true;
      } else {
        add(&rule.needs, place, weight);
      }
    }
    for (const Arc& arc : transition.inhibitors) {
      if (arc.weight <= fields_[arc.place].most) {
        add(&rule.inhibited_by, arc.place, arc.weight);
      }
    }
    std::map<uint32_t, Change> changes;  // by word
    const auto change = [&](const Arc& arc) -> Change& {
      Change& it = changes[fields_[arc.place].word];
      it.word = fields_[arc.place].word;
      return it;
    };
    for (const Arc& arc : transition.gives) {
      Change& it = change(arc);
      it.added += uint64_t{arc.weight} << fields_[arc.place].shift;
      it.overflow |= (fields_[arc.place].most + 1) << fields_[arc.place].shift;
    }
    for (const Arc& arc : transition.takes) {
      change(arc).added -= uint64_t{arc.weight} << fields_[arc.place].shift;
    }
    for (const auto& [word, it] : changes) {
      rule.changes.push_back(it);
    }
  }
}

}  // namespace pheromone::petri
