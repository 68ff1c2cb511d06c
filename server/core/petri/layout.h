// How a marking is packed into a few bytes, and how transitions act on it there.
//
// A marking has two forms. The *key* is what is stored: as many bits for each place as its bound
// needs, without the places that P-invariants determine. The *wide* form has all places, and beside
// each a guard bit of 0: with the guards set, one subtraction in a word compares all places in it
// with what a transition needs. Firing is an addition in both forms.
//
//   const Layout layout(net, tokens_at_most, PlaceInvariants(net).flows);
//   layout.Unpack(layout.first_key().data(), wide.data());
//   for (const Layout::Rule& rule : layout.rules())
//     if (layout.IsEnabled(rule, guarded)) { ... key[i] + rule.key_change[i] ... }
//
// Constant after construction; any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/core/petri/flows.h"
#include "server/core/petri/net.h"

namespace pheromone::petri {

class Layout {
 public:
  /// What a transition needs of one word: with `mask` as guards, `need` can be subtracted.
  struct Test {
    uint32_t word;
    uint64_t need;
    uint64_t mask;
  };
  struct Change {
    uint32_t word;
    uint64_t added;     ///< modulo 2^64
    uint64_t overflow;  ///< guards of places that the transition gives to
  };
  struct Rule {
    std::vector<Test> needs;
    std::vector<Test> inhibited_by;  ///< enabled only if none of these can be subtracted
    std::vector<Change> changes;     ///< of the wide form
    std::vector<uint64_t> key_change;
    bool never = false;  ///< needs more tokens than a place can have
  };

  /// A place that an invariant determines by others; its weight there is 1 or -1.
  struct Determined {
    uint32_t place = 0;
    Flow by{};
  };

  static constexpr size_t kMaxKeyWords = 32;

  /// `at_most[p]`: tokens that place p has at most, as far as is known. Where that is too little,
  /// Overflows finds out. `invariants` as from PlaceInvariants.
  /// With more than kMaxKeyWords it is of no use.
  Layout(const Net& net, const std::vector<uint64_t>& at_most, const std::vector<Flow>& invariants);

  size_t key_words() const { return key_words_; }
  size_t key_bytes() const { return key_bytes_; }  ///< of the key's words, the first ones
  size_t wide_words() const { return guards_.size(); }
  const std::vector<uint64_t>& first_key() const { return first_key_; }
  const std::vector<Rule>& rules() const { return rules_; }  ///< by transition

  /// `wide` has wide_words.
  void Unpack(const uint64_t* key, uint64_t* wide) const {
    for (size_t word = 0; word < wide_words(); ++word) {
      wide[word] = base_[word];
    }
    const uint64_t* table = parts_.data();
    for (size_t i = 0; i < 2 * key_bytes_; ++i, table += 16 * wide_words()) {
      const uint64_t* const part = table + (key[i / 16] >> (i % 16 * 4) & 15) * wide_words();
      for (size_t word = 0; word < wide_words(); ++word) {
        wide[word] += part[word];
      }
    }
  }

  void SetGuards(uint64_t* wide) const {
    for (size_t word = 0; word < wide_words(); ++word) {
      wide[word] |= guards_[word];
    }
  }

  /// With guards set.
  static bool IsEnabled(const Rule& rule, const uint64_t* guarded) {
    for (const Test& test : rule.needs) {
      if (((guarded[test.word] - test.need) & test.mask) != test.mask) {
        return false;
      }
    }
    for (const Test& test : rule.inhibited_by) {
      if (((guarded[test.word] - test.need) & test.mask) != 0) {
        return false;
      }
    }
    return true;
  }

  /// Whether a place would have more tokens than there are bits for: its guard is lost. With guards
  /// set.
  static bool Overflows(const Rule& rule, const uint64_t* guarded) {
    for (const Change& change : rule.changes) {
      if ((~(guarded[change.word] + change.added) & change.overflow) != 0) {
        return true;
      }
    }
    return false;
  }

  /// With or without guards.
  uint64_t TokensOf(const uint64_t* wide, uint32_t place) const {
    const Field& field = fields_[place];
    return wide[field.word] >> field.shift & field.most;
  }

  /// How many tokens the bits of a place suffice for.
  uint64_t MostTokens(uint32_t place) const { return fields_[place].most; }

 private:
  struct Field {
    uint32_t word;
    uint32_t shift;
    uint64_t most;
  };

  std::vector<Field> PlaceFields(const std::vector<uint32_t>& places, uint32_t extra_bits,
                                 const std::vector<uint32_t>& bits, size_t* words) const;
  void MakeRules(const Net& net);
  std::vector<std::vector<uint64_t>> AddedBy(const Net& net,
                                             const std::vector<Determined>& determined,
                                             const std::vector<bool>& is_kept);
  void AddParts(const Net& net, const std::vector<std::vector<uint64_t>>& added,
                const std::vector<Field>& key_fields, const std::vector<uint32_t>& bits);
  void AddKeyChanges(const Net& net, const std::vector<bool>& is_kept,
                     const std::vector<Field>& key_fields);

  std::vector<Field> fields_;  // of the wide form, by place
  std::vector<uint64_t> guards_;
  std::vector<uint64_t> base_;
  std::vector<uint64_t>
      parts_;  // what each value of each four bits of the key adds to the wide form
  std::vector<uint64_t> first_key_;
  std::vector<Rule> rules_;
  size_t key_words_ = 0;
  size_t key_bytes_ = 0;
};

}  // namespace pheromone::petri
