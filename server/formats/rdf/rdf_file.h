// Facts of tags in files of RDF: N-Triples (.nt), Turtle (.ttl) or RDF/XML (.rdf, .xml), by Raptor.
//
//   Status saved = SaveRdf("tags.ttl", tags::FactsOf(blocks, tables, naming).value().facts,
//   naming); Result<RdfContents> read = LoadRdf("tags.ttl", std::nullopt, naming);
//   tags::BlocksOf(read.value().facts, naming, &tables);
//
// A fact is an rdf:Statement with exactly one rdf:subject, rdf:predicate, rdf:object, rob:tag,
// rob:robotId and rob:dtime (server/core/tags/README.md, "RDF"). It does not assert the triple:
// robots may contradict each other. Leases and privileges are not part of it, and two equal facts
// are one.
//
// Reading needs no network and no other file. One thread at a time.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"
#include "server/formats/rdf/fact.h"

namespace pheromone::ctl {

enum class RdfFormat { kNTriples, kTurtle, kRdfXml };

/// By the file's ending. Error: it is another.
Result<RdfFormat> RdfFormatOf(const std::string& path);
/// By name: "ntriples", "turtle" or "rdfxml". Error: it is another.
Result<RdfFormat> RdfFormatNamed(std::string_view name);

/// As the text of a file. Facts of one event IRI that differ get -2, -3, ... behind it. Errors:
/// those of tags::CheckFact, which facts of tags::FactsOf do not have but for tags without a
/// number.
Result<std::string> WriteRdf(std::span<const tags::Fact> facts, RdfFormat format,
                             const tags::Naming& naming);
/// Into a file, whose ending selects the format unless it is given.
Status SaveRdf(const std::string& path, std::span<const tags::Fact> facts,
               const tags::Naming& naming, std::optional<RdfFormat> format = std::nullopt);

struct RdfContents {
  std::vector<tags::Fact> facts;  ///< in the order in which the file begins them
  size_t ignored = 0;             ///< triples of other things
};

/// The facts of a text, of the file `name` in errors; with all of them the naming's base is the
/// same as when they were written. Errors, of which the first is reported with its line: invalid
/// syntax; properties of facts that are missing, double or of a wrong kind; those of
/// tags::CheckFact.
Result<RdfContents> ReadRdf(const std::string& name, std::string_view text, RdfFormat format,
                            const tags::Naming& naming);
/// The same for a file, whose ending tells the format unless it is given.
Result<RdfContents> LoadRdf(const std::string& path, std::optional<RdfFormat> format,
                            const tags::Naming& naming);

}  // namespace pheromone::ctl
