// The requests about virtual RFID tags.
#include <algorithm>
#include <cstddef>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "server/daemon/live_control.h"
#include "server/engine/tags_component.h"

namespace pheromone::daemon {
namespace {

const tags::Store& TagsOf(const engine::Engine& engine) {
  return engine::FindIn<engine::TagsComponent>(engine.components())->store();
}

control::TagView ViewOf(const tags::Store& store, const tags::NamedTag& tag, uint64_t now_ms) {
  control::TagView view{.content = tag};
  if (const tags::Place* const place = store.PlaceOf(tag.number)) {
    view.place = *place;
  }
  for (size_t i = 0; i < tag.tag.slots().size(); ++i) {
    const tags::Slot& slot = tag.tag.slots()[i];
    if (store.IsPrivileged(slot.block.author)) {
      view.privileged.push_back(static_cast<uint8_t>(i));
    }
    const uint64_t left_ms = slot.lease_end_ms - std::min(slot.lease_end_ms, now_ms);
    view.lease_s.push_back(static_cast<double>(left_ms) / 1e3);
  }
  return view;
}

}  // namespace

void LiveControl::CountTags(const engine::Engine& engine, control::StatusView* status) {
  const tags::Store& store = TagsOf(engine);
  status->tags = store.figures();
  status->tag_counters = store.counters();
}

control::TagPage LiveControl::GetTags(uint16_t first) const {
  return parts_.service->Inspect([&](const engine::Engine& engine) {
    const tags::Store& store = TagsOf(engine);
    const uint64_t now_ms = parts_.now_ms();
    control::TagPage page;
    size_t number = std::max<size_t>(first, 1);
    for (; number <= store.last_number() && page.tags.size() < kTagsAtOnce; ++number) {
      if (const tags::NamedTag* const tag = store.Find(static_cast<uint16_t>(number))) {
        page.tags.push_back(ViewOf(store, *tag, now_ms));
      }
    }
    if (number <= store.last_number()) {
      page.next = static_cast<uint16_t>(number);
    }
    return page;
  });
}

std::optional<uint16_t> LiveControl::FindTag(std::string_view name) const {
  return parts_.service->Inspect(
      [&](const engine::Engine& engine) { return TagsOf(engine).NumberOf(name); });
}

control::SymbolPage LiveControl::GetSymbols(size_t first) const {
  return parts_.service->Inspect([&](const engine::Engine& engine) {
    const std::vector<tags::Row>& rows = TagsOf(engine).symbols().rows();
    const size_t begin = std::min(first, rows.size());
    const size_t end = std::min(begin + kRowsAtOnce, rows.size());
    return control::SymbolPage{
        {rows.begin() + static_cast<ptrdiff_t>(begin), rows.begin() + static_cast<ptrdiff_t>(end)},
        rows.size()};
  });
}

void LiveControl::ChangeTags(const engine::TagsChanged& change, Done done) {
  std::vector<engine::Outgoing> out;
  const Result<uint64_t> applied = parts_.service->Submit(engine::ToEvent(change), &out);
  parts_.router->Deliver(out);
  DoneIfDurable(applied.ok() ? Ok() : Status(Error{applied.error()}), std::move(done));
}

}  // namespace pheromone::daemon
