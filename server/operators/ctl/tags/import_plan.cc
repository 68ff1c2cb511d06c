#include "server/operators/ctl/tags/import_plan.h"

#include <algorithm>

namespace pheromone::ctl {

ImportPlan PlanImport(const std::vector<PresentSlot>& slots, std::vector<ImportedFact> facts) {
  using Content = PresentSlot::Content;
  std::vector<size_t> free;  // the empty ones, then those that may be dropped, the oldest first
  for (size_t i = 0; i < slots.size(); ++i) {
    if (slots[i].content != Content::kProtected) {
      free.push_back(i);
    }
  }
  const auto is_empty = [&](size_t i) { return slots[i].content == Content::kEmpty; };
  std::stable_sort(free.begin(), free.end(), [&](size_t a, size_t b) {
    return is_empty(a) != is_empty(b) ? is_empty(a)
                                      : !is_empty(a) && slots[a].time_key < slots[b].time_key;
  });
  std::stable_sort(facts.begin(), facts.end(), [](const ImportedFact& a, const ImportedFact& b) {
    return a.time_key > b.time_key;
  });
  ImportPlan plan;
  plan.all_protected = free.empty();
  for (const ImportedFact& fact : facts) {
    const size_t next = plan.writes.size();
    if (next < free.size() &&
        (is_empty(free[next]) || slots[free[next]].time_key < fact.time_key)) {
      plan.writes.push_back({fact.index, free[next]});
    } else {
      ++plan.unfit;
    }
  }
  return plan;
}

}  // namespace pheromone::ctl
