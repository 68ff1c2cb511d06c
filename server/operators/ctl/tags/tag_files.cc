#include "server/operators/ctl/tags/tag_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include <boost/json/serialize.hpp>

#include "server/formats/rdf/fact.h"
#include "server/formats/rdf/rdf_file.h"
#include "server/operators/ctl/tags/tag_data.h"

namespace pheromone::ctl {
namespace {

namespace json = boost::json;

// Nothing: by the file's ending, or, without a file, N-Triples.
Result<std::optional<RdfFormat>> FormatOf(const TagFile& file) {
  if (!file.format.empty()) {
    const Result<RdfFormat> format = RdfFormatNamed(file.format);
    return format.ok() ? Result<std::optional<RdfFormat>>(format.value()) : format.error();
  }
  return file.path.empty() ? std::optional(RdfFormat::kNTriples) : std::nullopt;
}

// All that is needed to tell blocks as facts, and back.
struct Knowledge {
  std::vector<TagData> tags;
  tags::SymbolTables tables;
  tags::Naming naming;
};

int Fetch(const ServerOptions& options, Knowledge* knowledge) {
  if (const int failed = FetchTags(options, true, &knowledge->tags); failed != 0) {
    return failed;
  }
  for (const TagData& tag : knowledge->tags) {
    knowledge->naming.tags.Add(tag.number, tag.name);
  }
  return FetchTables(options, &knowledge->tables);
}

const TagData* Find(const Knowledge& knowledge, const std::string& name) {
  const auto found = std::find_if(knowledge.tags.begin(), knowledge.tags.end(),
                                  [&](const TagData& tag) { return tag.name == name; });
  return found != knowledge.tags.end() ? &*found : nullptr;
}

bool IsThere(const TagData& tag, const tags::Block& block) {
  return std::any_of(tag.blocks.begin(), tag.blocks.end(),
                     [&](const WrittenSlot& slot) { return slot.block == block; });
}

}  // namespace

int ExportTags(const ServerOptions& options, const TagFile& file,
               const std::vector<std::string>& names) {
  const Result<std::optional<RdfFormat>> format = FormatOf(file);
  if (!format.ok()) {
    return Fail(kUsage, format.error());
  }
  Knowledge knowledge;
  if (const int failed = Fetch(options, &knowledge); failed != 0) {
    return failed;
  }
  std::vector<tags::TagBlock> blocks;
  for (const std::string& name : names) {
    if (Find(knowledge, name) == nullptr) {
      return Fail(kFailed, "there is no tag \"" + name + "\"; pheromonectl tags list shows them");
    }
  }
  for (const TagData& tag : knowledge.tags) {
    if (names.empty() || std::find(names.begin(), names.end(), tag.name) != names.end()) {
      for (const WrittenSlot& slot : tag.blocks) {
        blocks.push_back({tag.name, slot.block});
      }
    }
  }
  const Result<tags::Facts> facts = tags::FactsOf(blocks, knowledge.tables, knowledge.naming);
  if (!facts.ok()) {
    return Fail(kFailed, facts.error());
  }
  if (const size_t skipped = facts.value().skipped; skipped > 0) {
    fmt::print(stderr, "pheromonectl: left out {} block{} of unknown types\n", skipped,
               skipped == 1 ? "" : "s");
  }
  if (!file.path.empty()) {
    const Status saved = SaveRdf(file.path, facts.value().facts, knowledge.naming, format.value());
    return saved.ok() ? 0 : Fail(kFailed, saved.error());
  }
  const Result<std::string> text = WriteRdf(facts.value().facts, *format.value(), knowledge.naming);
  if (!text.ok()) {
    return Fail(kFailed, text.error());
  }
  fmt::print("{}", text.value());
  return 0;
}

int ImportTags(const ServerOptions& options, const TagFile& file) {
  const Result<std::optional<RdfFormat>> format = FormatOf(file);
  if (!format.ok()) {
    return Fail(kUsage, format.error());
  }
  Knowledge knowledge;
  if (const int failed = Fetch(options, &knowledge); failed != 0) {
    return failed;
  }
  const Result<RdfContents> read = LoadRdf(file.path, format.value(), knowledge.naming);
  if (!read.ok()) {
    return Fail(kUsage, read.error());
  }
  for (const tags::Fact& fact : read.value().facts) {
    if (Find(knowledge, fact.tag) == nullptr) {
      return Fail(kFailed, file.path + ": a fact is written on tag \"" + fact.tag +
                               "\", expected one of this server (pheromonectl tags list)");
    }
  }
  const size_t known = knowledge.tables.rows().size();
  const Result<std::vector<tags::TagBlock>> blocks =
      tags::BlocksOf(read.value().facts, knowledge.naming, &knowledge.tables);
  if (!blocks.ok()) {
    return Fail(kUsage, file.path + ": " + blocks.error());
  }
  if (const int failed = DefineRows(options, knowledge.tables, known); failed != 0) {
    return failed;
  }
  // The oldest first: if a tag has no room for all, the latest remain.
  std::vector<tags::TagBlock> ordered = blocks.value();
  std::stable_sort(ordered.begin(), ordered.end(),
                   [](const tags::TagBlock& a, const tags::TagBlock& b) {
                     return a.block.time_s < b.block.time_s;
                   });
  size_t written = 0;
  size_t there = 0;
  for (const tags::TagBlock& it : ordered) {
    if (IsThere(*Find(knowledge, it.tag), it.block)) {
      ++there;
    } else if (const int failed = PostChange(options, WriteOf(it.tag, it.block)); failed != 0) {
      return Fail(failed,
                  fmt::format("{} of {} facts were written before that", written, ordered.size()));
    } else {
      ++written;
    }
  }
  if (options.json) {
    fmt::print("{}\n",
               json::serialize(json::object{
                   {"written", written}, {"there", there}, {"ignored", read.value().ignored}}));
  } else {
    fmt::print("{} facts written, {} were there, {} other triples ignored\n", written, there,
               read.value().ignored);
  }
  return 0;
}

}  // namespace pheromone::ctl
