// The requests about virtual RFID tags.
#include <algorithm>
#include <cstddef>
#include <optional>
#include <string_view>

#include "server/daemon/live_control.h"
#include "server/operators/control/engine_views.h"

namespace pheromone::daemon {
control::TagPage LiveControl::GetTags(uint16_t first) const {
  return parts_.service->Inspect([&](const engine::Engine& engine) {
    return control::TagsOf(engine, first, parts_.now_ms());
  });
}

std::optional<uint16_t> LiveControl::FindTag(std::string_view name) const {
  return parts_.service->Inspect(
      [&](const engine::Engine& engine) { return engine.tags().NumberOf(name); });
}

control::SymbolPage LiveControl::GetSymbols(size_t first) const {
  return parts_.service->Inspect([&](const engine::Engine& engine) {
    const tags::SymbolTables& symbols = engine.tags().symbols();
    const size_t total = symbols.rows().size();
    const auto begin = static_cast<ptrdiff_t>(std::min(first, total));
    const auto end = static_cast<ptrdiff_t>(std::min(std::min(first, total) + kRowsAtOnce, total));
    return control::SymbolPage{{symbols.rows().begin() + begin, symbols.rows().begin() + end},
                               {symbols.makers().begin() + begin, symbols.makers().begin() + end},
                               total};
  });
}

void LiveControl::ChangeTags(const engine::TagsChanged& change, Done done) {
  if (!Forwards(change, done)) {
    Submit(change, done);
  }
}

}  // namespace pheromone::daemon
