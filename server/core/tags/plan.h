// A change of the tags' configuration, worked out before it is made: names are compared, numbers
// given and places put on the map without the store, so that the thread that serves robots only
// has to put the result in.
//
//   const Survey survey = store.Look();                  // under the engine's lock
//   Result<Plan> plan = MakePlan(survey, settings);      // without it: 20 000 tags take a while
//   if (store.Check(plan.value()).ok()) store.Take(plan.value());   // under it again
//
// Pure; any thread.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/base/result.h"
#include "server/core/tags/settings.h"
#include "server/core/tags/tag.h"
#include "server/core/tags/tag_map.h"

namespace pheromone::tags {

struct NamedTag {
  uint16_t number = 0;  ///< from 1
  std::string name;
  Tag tag;
  uint64_t hash = 0;  ///< of all the above, as the store last had it
};

/// The names, numbers and places of a store's tags: what only a configuration changes.
struct Directory {
  std::map<std::string, uint16_t, std::less<>> numbers;  ///< by name; also of kept tags
  std::vector<uint8_t> slots;                            ///< by number - 1; 0: a free number
  std::vector<std::optional<Place>> places;              ///< by number - 1; empty: not configured
  size_t configured = 0;                                 ///< how many places there are
  TagMap map;
  std::vector<std::string> privileged_ids;

  /// Null for a number that no configured tag has.
  const Place* PlaceOf(uint16_t number) const;
  std::optional<uint16_t> NumberOf(std::string_view name) const;
  /// Sets places and privileged authors; all tags have their numbers and slots.
  void TakePlaces(const Settings& settings);
};

/// What a plan depends on.
struct Survey {
  std::shared_ptr<const Directory> directory;
  std::vector<uint8_t> used;  ///< slots in use, by number - 1
};

struct Plan {
  std::shared_ptr<const Directory> before;
  std::shared_ptr<const Directory> after;
  std::vector<uint16_t> forgotten;               ///< neither configured nor in use
  std::vector<uint16_t> kept;                    ///< not configured, but in use
  std::vector<std::shared_ptr<NamedTag>> added;  ///< with their hashes
  std::vector<uint16_t> resized;                 ///< they have other slots in `after`
};

/// Errors: those of CheckSettings; no number is left.
Result<Plan> MakePlan(const Survey& survey, const Settings& settings);

/// As in the sum that is a store's hash.
uint64_t HashOf(const NamedTag& it);

}  // namespace pheromone::tags
