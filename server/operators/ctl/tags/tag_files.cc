#include "server/operators/ctl/tags/tag_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include <boost/json/serialize.hpp>

#include "server/core/tags/tag.h"
#include "server/formats/rdf/fact.h"
#include "server/formats/rdf/rdf_file.h"
#include "server/operators/ctl/tags/import_plan.h"
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

// A fact without the IRI that a file gives it: two are equal if they say the same.
using Value = std::tuple<std::string, std::string, uint32_t, std::string, std::string, std::string,
                         std::string>;

Value ValueOf(const tags::Fact& fact) {
  return {fact.tag,       fact.robot_id,    fact.time_s,         fact.subject,
          fact.predicate, fact.object.text, fact.object.datatype};
}

// What the tags have, as facts: makers number and split the same IRI differently.
std::set<Value> ValuesOn(const Knowledge& knowledge) {
  std::set<Value> values;
  for (const TagData& tag : knowledge.tags) {
    for (const WrittenSlot& slot : tag.blocks) {
      const Result<tags::Fact> fact =
          tags::FactOf({tag.name, slot.block}, knowledge.tables, knowledge.naming);
      if (fact.ok()) {  // what is none, such as the record of a net, is not what a file has
        values.insert(ValueOf(fact.value()));
      }
    }
  }
  return values;
}

// The facts that no tag has, each once, as a block tells them: an integer is an int, and so on.
Result<std::vector<tags::Fact>> NewFacts(const Knowledge& knowledge,
                                         const std::vector<tags::Fact>& facts) {
  tags::SymbolTables tables = knowledge.tables;
  PHEROMONE_TRY(const std::vector<tags::TagBlock> blocks,
                tags::BlocksOf(facts, knowledge.naming, &tables));
  std::set<Value> known = ValuesOn(knowledge);
  std::vector<tags::Fact> fresh;
  for (const tags::TagBlock& block : blocks) {
    PHEROMONE_TRY(tags::Fact fact, tags::FactOf(block, tables, knowledge.naming));
    if (known.insert(ValueOf(fact)).second) {
      fresh.push_back(std::move(fact));
    }
  }
  return fresh;
}

// The facts that are to be written, in this order: the tags' drop policy then puts each where it
// was planned.
struct Choice {
  std::vector<tags::Fact> facts;
  size_t unfit = 0;
};

// Reports what does not fit on a tag, and why.
void ChooseOn(const TagData& tag, const std::vector<tags::Fact>& facts, int64_t utc_s,
              Choice* choice) {
  std::vector<PresentSlot> slots(tag.slots);
  for (const WrittenSlot& it : tag.blocks) {
    const bool is_protected = it.lease_s || it.privileged;
    slots[it.slot] = {
        is_protected ? PresentSlot::Content::kProtected : PresentSlot::Content::kDroppable,
        tags::AgeKey(it.block, utc_s)};
  }
  std::vector<ImportedFact> imported;
  for (size_t i = 0; i < facts.size(); ++i) {
    if (facts[i].tag == tag.name) {
      tags::Block block;
      block.time_s = facts[i].time_s;
      imported.push_back({i, tags::AgeKey(block, utc_s)});
    }
  }
  const ImportPlan plan = PlanImport(slots, imported);
  for (const PlannedWrite& it : plan.writes) {
    choice->facts.push_back(facts[it.index]);
  }
  choice->unfit += plan.unfit;
  if (plan.unfit > 0) {
    fmt::print(stderr, "pheromonectl: tag \"{}\": {} of {} new facts did not fit: {} {}\n",
               tag.name, plan.unfit, imported.size(),
               tag.slots == 1 ? "its only slot" : fmt::format("its {} slots", tag.slots),
               plan.all_protected
                   ? "are all leased or of privileged authors, and erased by those only"
                   : "have later ones, or are leased or of privileged authors");
  }
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
  const Result<std::vector<tags::Fact>> fresh = NewFacts(knowledge, read.value().facts);
  if (!fresh.ok()) {
    return Fail(kUsage, file.path + ": " + fresh.error());
  }
  Choice choice;
  const int64_t utc_s = static_cast<int64_t>(std::time(nullptr));
  for (const TagData& tag : knowledge.tags) {
    ChooseOn(tag, fresh.value(), utc_s, &choice);
  }
  const size_t known = knowledge.tables.rows().size();
  const Result<std::vector<tags::TagBlock>> blocks =
      tags::BlocksOf(choice.facts, knowledge.naming, &knowledge.tables);
  if (!blocks.ok()) {
    return Fail(kUsage, file.path + ": " + blocks.error());
  }
  if (const int failed = DefineRows(options, knowledge.tables, known); failed != 0) {
    return failed;
  }
  std::map<std::string, uint16_t> generations;  // as each write leaves them
  for (const TagData& tag : knowledge.tags) {
    generations[tag.name] = tag.generation;
  }
  size_t written = 0;
  for (const tags::TagBlock& it : blocks.value()) {
    json::object change = WriteOf(it.tag, it.block);
    change["expected"] = generations[it.tag];  // what a robot has written meanwhile is not dropped
    const int failed = PostChange(options, change);
    if (failed != 0 && failed != kFailed) {
      return failed;
    }
    if (failed == 0) {
      ++written;
      ++generations[it.tag];
    }
  }
  const size_t refused = blocks.value().size() - written;
  const size_t there = read.value().facts.size() - fresh.value().size();
  if (options.json) {
    fmt::print("{}\n", json::serialize(json::object{{"written", written},
                                                    {"there", there},
                                                    {"unfit", choice.unfit},
                                                    {"refused", refused},
                                                    {"ignored", read.value().ignored}}));
  } else {
    fmt::print(
        "{} facts written, {} were there, {} did not fit, {} refused; {} other triples ignored\n",
        written, there, choice.unfit, refused, read.value().ignored);
  }
  return choice.unfit + refused == 0 ? 0 : kFailed;
}

}  // namespace pheromone::ctl
