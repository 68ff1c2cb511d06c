#include "server/operators/ctl/tags/tag_data.h"

#include <algorithm>

#include <boost/json/serialize.hpp>

#include "server/operators/ctl/json_read.h"

namespace pheromone::ctl {
namespace {

namespace json = boost::json;

int32_t WordAt(const json::value& value, std::string_view key) {
  return static_cast<int32_t>(NumberAt(value, key));
}

tags::Term TermAt(const json::value& value, std::string_view key) {
  const json::array& words = ItemsAt(value, key);
  const auto word = [&](size_t i) {
    return i < words.size() && words[i].is_int64() ? static_cast<int32_t>(words[i].get_int64()) : 0;
  };
  return {word(0), word(1)};
}

WrittenSlot SlotOf(const json::value& value) {
  WrittenSlot slot;
  slot.slot = static_cast<uint8_t>(CountAt(value, "slot"));
  slot.generation = static_cast<uint16_t>(CountAt(value, "generation"));
  if (At(value, "lease_s").is_number()) {
    slot.lease_s = NumberAt(value, "lease_s");
  }
  slot.privileged = FlagAt(value, "privileged");
  slot.block = {WordAt(value, "author"), static_cast<uint32_t>(CountAt(value, "time_s")),
                TermAt(value, "subject"), TermAt(value, "predicate"), TermAt(value, "object")};
  return slot;
}

TagData TagOf(const json::value& value) {
  TagData tag;
  tag.name = TextAt(value, "name");
  tag.number = static_cast<uint16_t>(CountAt(value, "number"));
  tag.configured = FlagAt(value, "configured");
  tag.x_m = NumberAt(value, "x_m");
  tag.y_m = NumberAt(value, "y_m");
  tag.range_m = NumberAt(value, "range_m");
  tag.slots = CountAt(value, "slots");
  tag.used = CountAt(value, "used");
  tag.generation = static_cast<uint16_t>(CountAt(value, "generation"));
  for (const json::value& block : ItemsAt(value, "blocks")) {
    tag.blocks.push_back(SlotOf(block));
  }
  return tag;
}

// Calls `take` with each item of a list that comes in pages.
template <typename Take>
int ForEachItem(const ServerOptions& options, const std::string& target, std::string_view list,
                Take&& take) {
  for (std::string first;;) {
    const JsonReply page = CallJson(options, "GET", "/api/v1/" + target + first);
    if (page.exit_status != 0) {
      return page.exit_status;
    }
    for (const json::value& item : ItemsAt(page.value, list)) {
      take(item);
    }
    if (At(page.value, "next").is_null()) {
      return 0;
    }
    first = (target.find('?') == std::string::npos ? "?first=" : "&first=") +
            std::to_string(CountAt(page.value, "next"));
  }
}

}  // namespace

int FetchTags(const ServerOptions& options, bool with_contents, std::vector<TagData>* tags) {
  return ForEachItem(options, with_contents ? "tags?contents=1" : "tags", "tags",
                     [&](const json::value& item) { tags->push_back(TagOf(item)); });
}

int FetchTag(const ServerOptions& options, const std::string& name, TagData* tag) {
  std::vector<TagData> all;
  if (const int failed = FetchTags(options, false, &all); failed != 0) {
    return failed;
  }
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const TagData& it) { return it.name == name; });
  if (found == all.end()) {
    return Fail(kFailed, "there is no tag \"" + name + "\"; pheromonectl tags list shows them");
  }
  const JsonReply page =
      CallJson(options, "GET", "/api/v1/tags?contents=1&first=" + std::to_string(found->number));
  if (page.exit_status != 0) {
    return page.exit_status;
  }
  const json::array& items = ItemsAt(page.value, "tags");
  *tag = items.empty() ? *found : TagOf(items.front());
  return tag->name == name ? 0 : Fail(kFailed, "tag \"" + name + "\" has just been removed");
}

int FetchTables(const ServerOptions& options, tags::SymbolTables* tables) {
  bool is_good = true;
  const int failed = ForEachItem(options, "symbols", "rows", [&](const json::value& item) {
    const auto kind = tags::RowKindNamed(TextAt(item, "kind"));
    is_good = is_good && kind &&
              tables->Restore(
                  {*kind, WordAt(item, "robot"), WordAt(item, "number"), TextAt(item, "text")}, {});
  });
  return failed != 0 || is_good ? failed
                                : Fail(kFailed, "the server's symbol tables contradict themselves");
}

int PostChange(const ServerOptions& options, const json::object& change) {
  return Call(options, "POST", "/api/v1/tags", json::serialize(change)).exit_status;
}

json::object WriteOf(const std::string& tag, const tags::Block& block) {
  return {{"action", "write"},
          {"tag", tag},
          {"author", block.author},
          {"time_s", block.time_s},
          {"block", json::array{block.subject.space, block.subject.value, block.predicate.space,
                                block.predicate.value, block.object.space, block.object.value}}};
}

int DefineRows(const ServerOptions& options, const tags::SymbolTables& tables, size_t first) {
  for (size_t i = first; i < tables.rows().size(); ++i) {
    const tags::Row& row = tables.rows()[i];
    const json::object body{{"action", "define"},
                            {"kind", tags::NameOf(row.kind)},
                            {"robot", row.robot},
                            {"number", row.number},
                            {"text", row.text}};
    if (const int failed = PostChange(options, body); failed != 0) {
      return failed;
    }
  }
  return 0;
}

}  // namespace pheromone::ctl
