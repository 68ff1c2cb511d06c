#include "server/formats/rdf/fact.h"

#include <utility>

#include "server/base/format.h"
#include "server/base/hash.h"
#include "server/base/percent.h"
#include "server/formats/rdf/iri.h"
#include "server/formats/rdf/lexical.h"

namespace pheromone::tags {
namespace {

constexpr size_t kMostShownBytes = 80;
constexpr size_t kShortHash = 8;

// The triple alone: time, robot and tag are in the IRI anyway.
std::string HashOf(const Block& block) {
  const Words words = ToWords(block);
  uint64_t hash = 0;
  for (size_t i = 2; i < words.size(); ++i) {
    hash = HashStep(hash, static_cast<uint32_t>(words[i]));
  }
  return HexText(hash).substr(kShortHash);
}

std::string EventIri(const TagBlock& written, const std::string& robot_id, const Naming& naming) {
  return naming.base + "event/" + PercentEncode(written.tag) + "/" + PercentEncode(robot_id) + "/" +
         UtcText(written.block.time_s, "%Y%m%dT%H%M%SZ") + "/" + HashOf(written.block);
}

Result<Block> AddBlock(const Fact& fact, int32_t author, const Naming& naming,
                       SymbolTables* tables) {
  PHEROMONE_TRY(const Term subject, TermOf({fact.subject, {}}, "subject", author, naming, tables));
  PHEROMONE_TRY(const Term predicate,
                TermOf({fact.predicate, {}}, "predicate", author, naming, tables));
  PHEROMONE_TRY(const Term object, TermOf(fact.object, "object", author, naming, tables));
  const Block block{.author = author,
                    .time_s = fact.time_s,
                    .subject = subject,
                    .predicate = predicate,
                    .object = object};
  const Status good = CheckBlock(block);
  return good.ok() ? Result<Block>(block) : good.error();
}

}  // namespace

std::string Quote(std::string_view text) {
  if (text.size() <= kMostShownBytes) {
    return "\"" + std::string(text) + "\"";
  }
  size_t end = kMostShownBytes;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0u) == 0x80u) {
    --end;
  }
  return "\"" + std::string(text.substr(0, end)) + "...\" of " + std::to_string(text.size()) +
         " bytes";
}

Result<Fact> FactOf(const TagBlock& written, const SymbolTables& tables, const Naming& naming) {
  const Block& block = written.block;
  PHEROMONE_TRY_STATUS(CheckBlock(block));
  if (block.is_net_record()) {
    return Error{"the block is a record of a Petri net, expected a fact"};
  }
  if (!IsKnownType(block.object)) {
    return Error{"the object is of type " + std::to_string(block.object.space) +
                 ", expected a type that RDF can represent"};
  }
  const std::string* const robot_id = tables.UniqueIdOf(block.author);
  if (robot_id == nullptr) {
    return Error{"the author is " + std::to_string(block.author) +
                 ", expected a number of the robot table"};
  }
  return Fact{.event = EventIri(written, *robot_id, naming),
              .tag = written.tag,
              .robot_id = *robot_id,
              .time_s = block.time_s,
              .subject = NodeOf(block.subject, block.author, tables, naming).text,
              .predicate = NodeOf(block.predicate, block.author, tables, naming).text,
              .object = NodeOf(block.object, block.author, tables, naming)};
}

Result<Facts> FactsOf(std::span<const TagBlock> blocks, const SymbolTables& tables,
                      const Naming& naming) {
  Facts all;
  for (const TagBlock& written : blocks) {
    if (written.block.is_empty()) {
      continue;
    }
    if (written.block.is_net_record() || !IsKnownType(written.block.object)) {
      ++all.skipped;
      continue;
    }
    Result<Fact> fact = FactOf(written, tables, naming);
    if (!fact.ok()) {
      return Error{"tag " + Quote(written.tag) + ": " + fact.error()};
    }
    all.facts.push_back(std::move(fact).value());
  }
  return all;
}

Status CheckFact(const Fact& fact, const Naming& naming) {
  if (fact.tag.empty()) {
    return Error{"the name of the tag is empty, expected at least one character"};
  }
  const size_t id_bytes = fact.robot_id.size();
  if (id_bytes == 0 || id_bytes > SymbolTables::kMaxTextBytes || !IsPlainUtf8(fact.robot_id)) {
    return Error{"the robot's unique ID is " + Quote(fact.robot_id) +
                 ", expected 1 to 255 bytes of UTF-8"};
  }
  SymbolTables scratch;  // the rest does not depend on what the tables have
  int32_t author = 0;
  scratch.AddRobot(fact.robot_id, &author);
  const Result<Block> block = AddBlock(fact, author, naming, &scratch);
  return block.ok() ? Ok() : block.error();
}

Result<std::vector<TagBlock>> BlocksOf(std::span<const Fact> facts, const Naming& naming,
                                       SymbolTables* tables) {
  SymbolTables next = *tables;
  std::vector<TagBlock> blocks;
  blocks.reserve(facts.size());
  for (const Fact& fact : facts) {
    int32_t author = 0;
    const DefineOutcome outcome = next.AddRobot(fact.robot_id, &author);
    if (outcome != DefineOutcome::kDone) {
      return Error{"<" + fact.event + ">: the robot's unique ID is " + Quote(fact.robot_id) +
                   (outcome == DefineOutcome::kFull ? ", but the robot table is full"
                                                    : ", expected 1 to 255 bytes of UTF-8")};
    }
    const Result<Block> block = AddBlock(fact, author, naming, &next);
    if (!block.ok()) {
      return Error{"<" + fact.event + ">: " + block.error()};
    }
    blocks.push_back({fact.tag, block.value()});
  }
  *tables = std::move(next);
  return blocks;
}

}  // namespace pheromone::tags
