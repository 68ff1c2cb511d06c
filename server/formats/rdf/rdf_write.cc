// The writing half of rdf_file.h.
#include <filesystem>
#include <map>
#include <tuple>
#include <utility>

#include "server/base/file.h"
#include "server/formats/rdf/lexical.h"
#include "server/formats/rdf/raptor.h"
#include "server/formats/rdf/rdf_file.h"
#include "server/formats/rdf/rdf_names.h"

namespace pheromone::ctl {
namespace {

using tags::Fact;
using tags::Node;

constexpr std::pair<std::string_view, RdfFormat> kFormatNames[] = {
    {"ntriples", RdfFormat::kNTriples},
    {"turtle", RdfFormat::kTurtle},
    {"rdfxml", RdfFormat::kRdfXml}};
constexpr std::pair<std::string_view, RdfFormat> kFormatEndings[] = {{".nt", RdfFormat::kNTriples},
                                                                     {".ttl", RdfFormat::kTurtle},
                                                                     {".rdf", RdfFormat::kRdfXml},
                                                                     {".xml", RdfFormat::kRdfXml}};

const char* SerializerOf(RdfFormat format) {
  switch (format) {
    case RdfFormat::kNTriples:
      return "ntriples";
    case RdfFormat::kTurtle:
      return "turtle";
    case RdfFormat::kRdfXml:
      break;
  }
  return "rdfxml-abbrev";  // one element a fact; plain rdfxml has one a triple
}

raptor_term* NewIri(raptor_world* world, const std::string& iri) {
  return raptor_new_term_from_counted_uri_string(world, RaptorText(iri), iri.size());
}

raptor_term* NewTerm(const RaptorWorld& world, const Node& node) {
  if (!node.is_literal()) {
    return NewIri(world.get(), node.text);
  }
  const RaptorUri datatype = world.Uri(node.datatype);  // the term has a reference of its own
  return raptor_new_term_from_counted_literal(world.get(), RaptorText(node.text), node.text.size(),
                                              datatype.get(), nullptr, 0);
}

class RdfWriter {
 public:
  RdfWriter(RdfFormat format, const tags::Naming& naming)
      : serializer_(raptor_new_serializer(world_.get(), SerializerOf(format))) {
    for (const auto& [prefix, iri] :
         {std::pair("rob", std::string(tags::kRob)), std::pair("xsd", std::string(tags::kXsd)),
          std::pair("ns", naming.default_namespace)}) {
      const RaptorUri uri = world_.Uri(iri);
      raptor_serializer_set_namespace(serializer_.get(), uri.get(), RaptorText(prefix));
    }
    raptor_serializer_start_to_string(serializer_.get(), nullptr, &text_, &bytes_);
  }
  ~RdfWriter() {
    serializer_.reset();
    raptor_free_memory(text_);
  }
  RdfWriter(const RdfWriter&) = delete;
  RdfWriter& operator=(const RdfWriter&) = delete;

  void Add(const std::string& event, const Fact& fact, const tags::Naming& naming) {
    Add(event, kRdfType, {std::string(kRdfStatement), {}});
    Add(event, kRdfSubject, {fact.subject, {}});
    Add(event, kRdfPredicate, {fact.predicate, {}});
    Add(event, kRdfObject, fact.object);
    Add(event, kRobTag, {tags::TagIri(fact.tag, naming), {}});
    Add(event, kRobRobotId, tags::LiteralOf(fact.robot_id));
    Add(event, kRobDtime, {tags::DateTimeText(fact.time_s), tags::XsdType("dateTime")});
  }

  Result<std::string> End() {
    raptor_serializer_serialize_end(serializer_.get());
    if (world_.fault()) {
      return Error{world_.fault()->text};
    }
    return std::string(static_cast<const char*>(text_), bytes_);
  }

 private:
  void Add(const std::string& event, std::string_view property, const Node& value) {
    raptor_statement triple;
    raptor_statement_init(&triple, world_.get());
    triple.subject = NewIri(world_.get(), event);
    triple.predicate = NewIri(world_.get(), std::string(property));
    triple.object = NewTerm(world_, value);
    raptor_serializer_serialize_statement(serializer_.get(), &triple);
    raptor_statement_clear(&triple);
  }

  RaptorWorld world_;
  RaptorSerializer serializer_;
  void* text_ = nullptr;
  size_t bytes_ = 0;
};

}  // namespace

Result<RdfFormat> RdfFormatOf(const std::string& path) {
  const std::string ending = std::filesystem::path(path).extension().string();
  for (const auto& [known, format] : kFormatEndings) {
    if (ending == known) {
      return format;
    }
  }
  return Error{path + ": unknown ending, expected .nt, .ttl, .rdf or .xml"};
}

Result<RdfFormat> RdfFormatNamed(std::string_view name) {
  for (const auto& [known, format] : kFormatNames) {
    if (name == known) {
      return format;
    }
  }
  return Error{"the format is " + tags::Quote(name) + ", expected ntriples, turtle or rdfxml"};
}

Result<std::string> WriteRdf(std::span<const Fact> facts, RdfFormat format,
                             const tags::Naming& naming) {
  RdfWriter writer(format, naming);
  std::map<std::string, Fact> written;  // by event
  for (const Fact& fact : facts) {
    if (const Status good = tags::CheckFact(fact, naming); !good.ok()) {
      return Error{"<" + fact.event + ">: " + good.error()};
    }
    std::string event = fact.event;
    auto [found, is_new] = written.emplace(event, fact);
    for (int i = 2; !is_new && found->second != fact; ++i) {
      event = fact.event + "-" + std::to_string(i);
      std::tie(found, is_new) = written.emplace(event, fact);
    }
    if (is_new) {
      writer.Add(event, fact, naming);
    }
  }
  return writer.End();
}

Status SaveRdf(const std::string& path, std::span<const Fact> facts, const tags::Naming& naming,
               std::optional<RdfFormat> format) {
  if (!format) {
    PHEROMONE_TRY(const RdfFormat by_ending, RdfFormatOf(path));
    format = by_ending;
  }
  const Result<std::string> text = WriteRdf(facts, *format, naming);
  return text.ok() ? WriteFile(path, text.value()) : Error{path + ": " + text.error()};
}

}  // namespace pheromone::ctl
