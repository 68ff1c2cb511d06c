#include "server/core/petri/compose.h"

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "server/core/petri/claim_names.h"

namespace pheromone::petri {
namespace {

std::string NameOf(const Instance& instance) {
  return instance.as.empty() ? "net \"" + instance.net.name + '"'
                             : "instance \"" + instance.as + '"';
}

void TakeIfEmpty(const std::string& from, std::string* to) {
  if (to->empty()) {
    *to = from;
  }
}

std::string PrefixedName(const std::string& as, const std::string& name) {
  return as.empty() || name.empty() ? name : as + ": " + name;
}

class Whole {
 public:
  explicit Whole(std::string name) { net_.name = std::move(name); }

  Status Add(const Instance& instance) {
    PHEROMONE_TRY_STATUS(CheckNet(instance.net));
    for (const auto& [from, to] : instance.with) {
      if (PlaceOf(instance.net, from) == instance.net.places.size()) {
        return Error{NameOf(instance) + " binds \"" + from + "\", expected a place of net \"" +
                     instance.net.name + '"'};
      }
    }
    Renaming names;
    std::vector<uint32_t> numbers;
    for (const Place& place : instance.net.places) {
      PHEROMONE_TRY(const uint32_t number, AddPlace(instance, place));
      numbers.push_back(number);
      names[place.id] = net_.places[number].id;
    }
    for (const Transition& transition : instance.net.transitions) {
      names[transition.id] = AddTransition(instance, transition, numbers);
    }
    for (const Claim& claim : instance.net.claims) {
      const std::string id = PrefixedId(instance.as, claim.id);
      if (!claim_ids_.insert(id).second) {
        return Error{"claim \"" + id + "\" of " + NameOf(instance) +
                     " is given twice, expected another ID"};
      }
      net_.claims.push_back({id, RenameIn(claim.text, names)});
    }
    return Ok();
  }

  Result<Net> Take() && {
    for (size_t place = 0; place < parts_.size(); ++place) {
      if (!parts_[place].exists) {
        return Error{"net \"" + net_.name + "\": " + parts_[place].by + " binds a place to \"" +
                     net_.places[place].id + "\", which no instance has"};
      }
    }
    PHEROMONE_TRY_STATUS(CheckNet(net_));
    return std::move(net_);
  }

 private:
  // What is known of a place of the whole.
  struct Part {
    bool exists = false;  // not only bound to
    bool own = false;     // of an instance that does not share it
    std::string by{};     // the first instance that has it, in words
    std::string giver{};  // of its tokens
  };

  Result<uint32_t> AddPlace(const Instance& instance, const Place& place) {
    const auto bound = instance.with.find(place.id);
    const bool is_bound = bound != instance.with.end();
    const bool is_box = !is_bound && !place.box.empty();
    const std::string id = is_bound ? bound->second
                           : is_box ? place.box
                                    : PrefixedId(instance.as, place.id);
    const auto [at, is_new] = numbers_.try_emplace(id, static_cast<uint32_t>(net_.places.size()));
    if (is_new) {
      net_.places.push_back({.id = id});
      parts_.push_back({.by = NameOf(instance)});
    }
    Place& whole = net_.places[at->second];
    Part& part = parts_[at->second];
    if (!is_bound && !is_box) {
      if (part.own) {
        return Error{"place \"" + id + "\" is both in " + part.by + " and in " + NameOf(instance) +
                     ", expected it to be bound in one, or a box"};
      }
      part.own = true;
    }
    part.exists = part.exists || !is_bound;
    if (place.tokens != 0 && !part.giver.empty() && place.tokens != whole.tokens) {
      return Error{"place \"" + id + "\" has " + std::to_string(whole.tokens) + " tokens in " +
                   part.giver + " and " + std::to_string(place.tokens) + " in " + NameOf(instance) +
                   ", expected them in one, or the same in both"};
    }
    if (place.tokens != 0) {
      whole.tokens = place.tokens;
      part.giver = NameOf(instance);
    }
    TakeIfEmpty(place.box.empty() ? "" : id, &whole.box);
    TakeIfEmpty(is_bound || is_box ? place.name : PrefixedName(instance.as, place.name),
                &whole.name);
    TakeIfEmpty(place.owner, &whole.owner);
    TakeIfEmpty(place.tag, &whole.tag);
    TakeIfEmpty(place.does, &whole.does);
    return at->second;
  }

  const std::string& AddTransition(const Instance& instance, const Transition& transition,
                                   const std::vector<uint32_t>& numbers) {
    Transition& added = net_.transitions.emplace_back(transition);
    added.id = PrefixedId(instance.as, transition.id);
    added.name = PrefixedName(instance.as, transition.name);
    for (auto* arcs : {&added.takes, &added.gives, &added.reads, &added.inhibitors}) {
      for (Arc& arc : *arcs) {
        arc.place = numbers[arc.place];
      }
    }
    return added.id;
  }

  Net net_;
  std::vector<Part> parts_{};                            // by place
  std::unordered_map<std::string, uint32_t> numbers_{};  // of places, by ID
  std::unordered_set<std::string> claim_ids_{};
};

}  // namespace

Result<Net> Compose(std::string name, const std::vector<Instance>& instances) {
  Whole whole(std::move(name));
  for (const Instance& instance : instances) {
    PHEROMONE_TRY_STATUS(whole.Add(instance));
  }
  return std::move(whole).Take();
}

std::string PrefixedId(std::string_view as, std::string_view id) {
  std::string prefixed(as);
  prefixed.append(as.empty() ? "" : ".").append(id);
  return prefixed;
}

}  // namespace pheromone::petri
