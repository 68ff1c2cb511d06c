#include "server/operators/ctl/tags/tag_commands.h"

#include <fmt/format.h>

#include <utility>

#include <boost/json/serialize.hpp>

#include "server/base/format.h"
#include "server/formats/rdf/sentence.h"
#include "server/operators/ctl/json_read.h"
#include "server/operators/ctl/table.h"
#include "server/operators/ctl/tags/record_text.h"
#include "server/operators/ctl/tags/tag_data.h"
#include "server/operators/ctl/units.h"

namespace pheromone::ctl {
namespace {

namespace json = boost::json;

// "2006-01-28 14:20:00", UTC.
std::string TimeText(uint32_t time_s) {
  return UtcText(time_s, "%Y-%m-%d %H:%M:%S");
}

std::string AuthorText(int32_t author, const tags::SymbolTables& tables) {
  const std::string* const unique_id = tables.UniqueIdOf(author);
  return unique_id != nullptr ? *unique_id : std::to_string(author);
}

std::string ProtectionText(const WrittenSlot& slot) {
  return slot.lease_s ? "for " + Duration(*slot.lease_s) : slot.privileged ? "always" : "-";
}

json::object SentenceToJson(const TagData& tag, const WrittenSlot& slot,
                            const tags::SymbolTables& tables) {
  const tags::Block& block = slot.block;
  json::object sentence{
      {"tag", tag.name},
      {"slot", slot.slot},
      {"generation", slot.generation},
      {"author", block.author},
      {"author_id", AuthorText(block.author, tables)},
      {"time_s", block.time_s},
      {"lease_s", slot.lease_s ? json::value(*slot.lease_s) : json::value(nullptr)},
      {"privileged", slot.privileged}};
  if (block.is_net_record()) {
    sentence["record"] = RecordText(block);
  } else {
    sentence["subject"] = tags::SubjectText(block.subject, block.author, tables);
    sentence["predicate"] = tags::ObjectText(block.predicate, block.author, tables);
    sentence["object"] = tags::ObjectText(block.object, block.author, tables);
  }
  return sentence;
}

std::string SentenceText(const tags::Block& block, const tags::SymbolTables& tables) {
  return block.is_net_record() ? RecordText(block) : tags::SentenceOf(block, tables);
}

void PrintJson(const json::value& value) {
  fmt::print("{}\n", json::serialize(value));
}

// Tells a reader of JSON that a change is made; `failed` is its exit status, and is returned.
int Finish(const ServerOptions& options, int failed) {
  if (failed == 0 && options.json) {
    PrintJson(json::object{{"done", true}});
  }
  return failed;
}

// The author and the sentence in numbers, with the rows that these need at the server.
int Prepare(const ServerOptions& options, const TagNote& note, tags::Block* block) {
  tags::SymbolTables tables;
  if (const int failed = FetchTables(options, &tables); failed != 0) {
    return failed;
  }
  const size_t known = tables.rows().size();
  int32_t author = 0;
  const tags::DefineOutcome added = tables.AddRobot(note.author, &author);
  if (added == tags::DefineOutcome::kFull) {
    return Fail(kFailed, "the symbol tables have no room for the author \"" + note.author + "\"");
  }
  if (added != tags::DefineOutcome::kDone) {
    return Fail(kUsage, "the author is \"" + note.author +
                            "\", expected 1 to 255 bytes of UTF-8 without control characters");
  }
  const Result<tags::Block> parsed = tags::ParseSentence(note.sentence, author, &tables);
  if (!parsed.ok()) {
    return Fail(kUsage, parsed.error());
  }
  *block = parsed.value();
  return DefineRows(options, tables, known);
}

struct Example {
  std::string key;
  std::string value;
};

// What is printed of a term is one text for each value: an IRI may also be given in full.
bool IsText(const std::string& printed, const std::string& asked) {
  const bool is_iri = asked.size() > 2 && asked.front() == '<' && asked.back() == '>';
  const std::string_view iri = is_iri ? std::string_view(asked).substr(1, asked.size() - 2) : asked;
  return printed == asked || printed == tags::IriText(iri);
}

bool Agrees(const Example& example, const TagData& tag, const tags::Block& block,
            const tags::SymbolTables& tables) {
  const auto object = [&](const tags::Term& term) {
    return tags::ObjectText(term, block.author, tables);
  };
  if (example.key == "tag") {
    return tag.name == example.value;
  }
  if (example.key == "robot") {
    return std::to_string(block.author) == example.value ||
           AuthorText(block.author, tables) == example.value;
  }
  if (block.is_net_record()) {
    return false;
  }
  if (example.key == "subject") {
    return IsText(tags::SubjectText(block.subject, block.author, tables), example.value);
  }
  return IsText(object(example.key == "predicate" ? block.predicate : block.object), example.value);
}

// KEY=VALUE; nothing if it is none, which is reported.
bool ParseExample(const std::string& text, Example* example) {
  const size_t end = text.find('=');
  *example = {text.substr(0, end), end == std::string::npos ? "" : text.substr(end + 1)};
  for (const std::string_view key : {"robot", "subject", "predicate", "object", "tag"}) {
    if (end != std::string::npos && example->key == key) {
      return true;
    }
  }
  Fail(kUsage, "found \"" + text +
                   "\", expected robot=, subject=, predicate=, object= or tag= with a value");
  return false;
}

}  // namespace

int ListTags(const ServerOptions& options) {
  std::vector<TagData> all;
  if (const int failed = FetchTags(options, false, &all); failed != 0) {
    return failed;
  }
  if (options.json) {
    json::array list;
    for (const TagData& tag : all) {
      list.push_back(json::object{{"name", tag.name},
                                  {"number", tag.number},
                                  {"configured", tag.configured},
                                  {"x_m", tag.x_m},
                                  {"y_m", tag.y_m},
                                  {"range_m", tag.range_m},
                                  {"slots", tag.slots},
                                  {"used", tag.used},
                                  {"generation", tag.generation}});
    }
    PrintJson(json::object{{"tags", std::move(list)}});
    return 0;
  }
  std::vector<std::vector<std::string>> rows{{"TAG", "NUMBER", "PLACE", "RANGE", "USED"}};
  for (const TagData& tag : all) {
    rows.push_back(
        {tag.name, std::to_string(tag.number),
         tag.configured ? fmt::format("{:.2f} {:.2f} m", tag.x_m, tag.y_m) : "not configured",
         tag.configured ? fmt::format("{:g} m", tag.range_m) : "-",
         fmt::format("{} of {}", tag.used, tag.slots)});
  }
  PrintTable(rows);
  return 0;
}

int ShowTag(const ServerOptions& options, const std::string& name) {
  TagData tag;
  tags::SymbolTables tables;
  if (const int failed = FetchTag(options, name, &tag); failed != 0) {
    return failed;
  }
  if (const int failed = FetchTables(options, &tables); failed != 0) {
    return failed;
  }
  json::array list;
  std::vector<std::vector<std::string>> rows{{"SLOT", "AUTHOR", "TIME", "PROTECTED", "SENTENCE"}};
  for (const WrittenSlot& slot : tag.blocks) {
    list.push_back(SentenceToJson(tag, slot, tables));
    rows.push_back({std::to_string(slot.slot), AuthorText(slot.block.author, tables),
                    TimeText(slot.block.time_s), ProtectionText(slot),
                    SentenceText(slot.block, tables)});
  }
  if (options.json) {
    PrintJson(json::object{{"tag", tag.name},
                           {"number", tag.number},
                           {"slots", tag.slots},
                           {"generation", tag.generation},
                           {"blocks", std::move(list)}});
  } else if (tag.blocks.empty()) {
    fmt::print("nothing is written on it; it has {} slots\n", tag.slots);
  } else {
    PrintTable(rows);
  }
  return 0;
}

int WriteTag(const ServerOptions& options, const TagNote& note) {
  TagData tag;
  if (const int failed = FetchTag(options, note.tag, &tag); failed != 0) {
    return failed;
  }
  // Looked at before anything is defined, which is for ever.
  if (note.slot && static_cast<uint64_t>(*note.slot) >= tag.slots) {
    return Fail(kFailed, fmt::format("tag \"{}\": the slot is {}, expected 0 to {}", note.tag,
                                     *note.slot, tag.slots - 1));
  }
  tags::Block block;
  if (const int failed = Prepare(options, note, &block); failed != 0) {
    return failed;
  }
  json::object change = WriteOf(note.tag, block);
  change["replace"] = note.replace;
  change["lease_s"] = note.lease_s;
  if (note.slot) {
    change["slot"] = *note.slot;
  }
  return Finish(options, PostChange(options, change));
}

int EraseTag(const ServerOptions& options, const std::string& name, std::optional<int> slot) {
  TagData tag;
  if (const int failed = FetchTag(options, name, &tag); failed != 0) {
    return failed;
  }
  std::vector<int> slots;
  if (slot) {
    slots.push_back(*slot);
  } else {
    for (const WrittenSlot& it : tag.blocks) {
      slots.push_back(it.slot);
    }
  }
  for (const int it : slots) {
    const int failed = PostChange(options, {{"action", "erase"}, {"tag", name}, {"slot", it}});
    if (failed != 0) {
      return failed;
    }
  }
  return Finish(options, 0);
}

int ForgetSymbols(const ServerOptions& options, const tags::Maker& maker) {
  json::object body{{"action", "forget"}};
  if (maker.is_robot()) {
    body["link"] = maker.link;
    body["id"] = maker.id;
  }
  return Finish(options, PostChange(options, body));
}

int FindOnTags(const ServerOptions& options, const std::vector<std::string>& examples) {
  std::vector<Example> all(examples.size());
  for (size_t i = 0; i < examples.size(); ++i) {
    if (!ParseExample(examples[i], &all[i])) {
      return kUsage;
    }
  }
  std::vector<TagData> contents;
  tags::SymbolTables tables;
  if (const int failed = FetchTags(options, true, &contents); failed != 0) {
    return failed;
  }
  if (const int failed = FetchTables(options, &tables); failed != 0) {
    return failed;
  }
  json::array list;
  std::vector<std::vector<std::string>> rows{{"TAG", "SLOT", "AUTHOR", "TIME", "SENTENCE"}};
  for (const TagData& tag : contents) {
    for (const WrittenSlot& slot : tag.blocks) {
      bool agrees = true;
      for (const Example& example : all) {
        agrees = agrees && Agrees(example, tag, slot.block, tables);
      }
      if (agrees) {
        list.push_back(SentenceToJson(tag, slot, tables));
        rows.push_back({tag.name, std::to_string(slot.slot), AuthorText(slot.block.author, tables),
                        TimeText(slot.block.time_s), SentenceText(slot.block, tables)});
      }
    }
  }
  if (options.json) {
    PrintJson(json::object{{"blocks", std::move(list)}});
  } else {
    PrintTable(rows);
  }
  return 0;
}

}  // namespace pheromone::ctl
