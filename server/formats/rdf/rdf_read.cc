// The reading half of rdf_file.h.
#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "server/base/file.h"
#include "server/base/message.h"
#include "server/formats/rdf/lexical.h"
#include "server/formats/rdf/raptor.h"
#include "server/formats/rdf/rdf_file.h"
#include "server/formats/rdf/rdf_names.h"
#include "server/formats/rdf/xml_depth.h"

namespace pheromone::ctl {
namespace {

using tags::Fact;

// What is at the end of a triple.
struct Value {
  enum class Kind { kIri, kLiteral, kBlank } kind = Kind::kIri;
  std::string text;
  std::string datatype{};
  std::string language{};
  bool operator==(const Value&) const = default;

  std::string Describe() const {
    switch (kind) {
      case Kind::kIri:
        return "<" + text + ">";
      case Kind::kBlank:
        return "_:" + text;
      case Kind::kLiteral:
        break;
    }
    return tags::Quote(text) + (language.empty() ? "" : " in the language " + language);
  }
};

enum Property { kType, kSubject, kPredicate, kObject, kTag, kRobotId, kDtime, kProperties };

struct PropertyName {
  std::string_view iri;
  std::string_view name;
  std::string_view expected;
};
constexpr std::array<PropertyName, kProperties> kPropertyNames = {{
    {kRdfType, "rdf:type", "rdf:Statement"},
    {kRdfSubject, "rdf:subject", "an IRI"},
    {kRdfPredicate, "rdf:predicate", "an IRI"},
    {kRdfObject, "rdf:object", "an IRI or a literal without a language"},
    {kRobTag, "rob:tag", "the IRI of a tag"},
    {kRobRobotId, "rob:robotId", "the unique ID of a robot as text"},
    {kRobDtime, "rob:dtime", "an xsd:dateTime such as 2006-01-28T14:20:00Z"},
}};

// A thing about which the file has triples.
struct Thing {
  std::string name;  // with <> or _:
  int line = 0;
  size_t triples = 0;
  std::array<std::optional<Value>, kProperties> values;
};

std::string TextOf(const unsigned char* text) {
  return reinterpret_cast<const char*>(text);
}

std::string TextOf(raptor_uri* uri) {
  size_t bytes = 0;
  const unsigned char* const text = raptor_uri_as_counted_string(uri, &bytes);
  return {reinterpret_cast<const char*>(text), bytes};
}

Value ValueOf(const raptor_term& term) {
  switch (term.type) {
    case RAPTOR_TERM_TYPE_URI:
      return {.kind = Value::Kind::kIri, .text = TextOf(term.value.uri)};
    case RAPTOR_TERM_TYPE_LITERAL: {
      const raptor_term_literal_value& it = term.value.literal;
      return {.kind = Value::Kind::kLiteral,
              .text = {reinterpret_cast<const char*>(it.string), it.string_len},
              .datatype = it.datatype != nullptr ? TextOf(it.datatype) : tags::XsdType("string"),
              .language = it.language != nullptr ? TextOf(it.language) : ""};
    }
    case RAPTOR_TERM_TYPE_BLANK:
    case RAPTOR_TERM_TYPE_UNKNOWN:
      break;
  }
  return {.kind = Value::Kind::kBlank, .text = TextOf(term.value.blank.string)};
}

class RdfReader {
 public:
  RdfReader(const std::string& name, const tags::Naming& naming) : name_(name), naming_(naming) {}

  Status Parse(std::string_view text, RdfFormat format);
  Result<RdfContents> Contents() const;

 private:
  void Take(const raptor_statement& triple);
  int LineOf(const std::string& subject);
  std::string At(int line) const {
    return name_ + (line > 0 ? ":" + std::to_string(line) : "") + ": ";
  }
  Error Wrong(const Thing& thing, Property property, const std::string& found) const {
    return Error{At(thing.line) + thing.name + ": the " +
                 std::string(kPropertyNames[property].name) + " is " + found + ", expected " +
                 std::string(kPropertyNames[property].expected)};
  }
  Result<Fact> FactOf(const Thing& thing) const;

  const std::string& name_;
  const tags::Naming& naming_;
  raptor_parser* parser_ = nullptr;
  bool has_line_each_ = false;  // each triple, as in N-Triples: then
  std::string_view lines_;      // those that have not been taken,
  int line_ = 0;                // and the number of those that have
  std::vector<Thing> things_;
  std::map<std::string, size_t> found_;  // by name
  std::optional<Error> error_;
};

// Raptor's own parser for N-Triples, which are Turtle too, leaks memory for each datatype.
const char* ParserOf(RdfFormat format) {
  return format == RdfFormat::kRdfXml ? "rdfxml" : "turtle";
}

// Of the character at `offset`, from 1 on.
int LineAt(std::string_view text, size_t offset) {
  const std::string_view before = text.substr(0, offset);
  return 1 + static_cast<int>(std::count(before.begin(), before.end(), '\n'));
}

std::string_view Title(RdfFormat format) {
  switch (format) {
    case RdfFormat::kNTriples:
      return "N-Triples";
    case RdfFormat::kTurtle:
      return "Turtle";
    case RdfFormat::kRdfXml:
      break;
  }
  return "RDF/XML";
}

Status RdfReader::Parse(std::string_view text, RdfFormat format) {
  if (const Status utf8 = SkipByteOrderMark(&text); !utf8.ok()) {
    return Error{At(1) + utf8.error()};
  }
  if (const size_t end = text.find('\0'); end != std::string_view::npos) {
    // Raptor would read no further.
    return Error{At(LineAt(text, end)) + "found a byte of 0, expected " +
                 std::string(Title(format))};
  }
  if (const size_t deep = format == RdfFormat::kRdfXml ? TooDeepAt(text) : text.size();
      deep < text.size()) {
    return Error{At(LineAt(text, deep)) + "found elements nested deeper than " +
                 std::to_string(kMaxXmlDepth) + ", or in an entity, expected RDF/XML of facts"};
  }
  has_line_each_ = format == RdfFormat::kNTriples;
  lines_ = text;
  RaptorWorld world;
  const RaptorParser parser(raptor_new_parser(world.get(), ParserOf(format)));
  const RaptorUri base = world.Uri(naming_.base);
  parser_ = parser.get();
  raptor_parser_set_option(parser_, RAPTOR_OPTION_NO_NET, nullptr, 1);
  raptor_parser_set_option(parser_, RAPTOR_OPTION_NO_FILE, nullptr, 1);
  raptor_parser_set_option(parser_, RAPTOR_OPTION_LOAD_EXTERNAL_ENTITIES, nullptr, 0);
  raptor_parser_set_statement_handler(parser_, this, [](void* self, raptor_statement* triple) {
    static_cast<RdfReader*>(self)->Take(*triple);
  });
  raptor_parser_parse_start(parser_, base.get());
  const int failed = raptor_parser_parse_chunk(
      parser_, reinterpret_cast<const unsigned char*>(text.data()), text.size(), 1);
  parser_ = nullptr;
  if (world.fault() || failed != 0) {
    const RaptorWorld::Fault fault = world.fault().value_or(RaptorWorld::Fault{0, "invalid"});
    return Error{At(fault.line) + fault.text + ", expected " + std::string(Title(format))};
  }
  return error_ ? Status(*error_) : Ok();
}

// Where the triple that is being taken begins, which is about this subject; 0 if that is not known.
// Raptor's parser of Turtle counts no lines where it finds no prefixes.
int RdfReader::LineOf(const std::string& subject) {
  if (!has_line_each_) {
    const raptor_locator* const locator = raptor_parser_get_locator(parser_);
    return locator != nullptr ? locator->line : 0;
  }
  while (!lines_.empty()) {
    std::string_view line = lines_.substr(0, lines_.find('\n'));
    lines_.remove_prefix(std::min(line.size() + 1, lines_.size()));
    ++line_;
    line.remove_prefix(std::min(line.find_first_not_of(" \t\r"), line.size()));
    if (!line.empty() && line.front() != '#') {
      return line.starts_with(subject) ? line_ : 0;
    }
  }
  return 0;
}

void RdfReader::Take(const raptor_statement& triple) {
  const Value subject = ValueOf(*triple.subject);
  const std::string name = subject.Describe();
  const auto [found, is_new] = found_.emplace(name, things_.size());
  const int line = LineOf(name);
  if (is_new) {
    things_.push_back({.name = name, .line = line, .values = {}});
  }
  Thing& thing = things_[found->second];
  ++thing.triples;
  const std::string iri = TextOf(triple.predicate->value.uri);
  const auto* const known = std::find_if(kPropertyNames.begin(), kPropertyNames.end(),
                                         [&](const auto& it) { return it.iri == iri; });
  if (known == kPropertyNames.end()) {
    return;
  }
  Value value = ValueOf(*triple.object);
  if (known->iri == kRdfType && value.text != kRdfStatement && value.text != "Statement") {
    return;  // of another class; the paper's example has a literal "Statement", which FactOf
             // reports
  }
  std::optional<Value>& its = thing.values[static_cast<size_t>(known - kPropertyNames.begin())];
  if (its && *its != value && !error_) {
    error_ = Error{At(line) + name + ": the " + std::string(known->name) + " is " +
                   value.Describe() + " and " + its->Describe() + ", expected one"};
  }
  its = std::move(value);
}

Result<Fact> RdfReader::FactOf(const Thing& thing) const {
  for (size_t i = 0; i < kProperties; ++i) {
    const auto property = static_cast<Property>(i);
    const std::optional<Value>& value = thing.values[i];
    if (!value) {
      return Error{At(thing.line) + thing.name + ": found no " +
                   std::string(kPropertyNames[i].name) + ", expected " +
                   std::string(kPropertyNames[i].expected)};
    }
    const bool is_text = property == kRobotId || property == kDtime;
    const bool has_kind = property == kObject ? value->kind != Value::Kind::kBlank
                          : is_text           ? value->kind == Value::Kind::kLiteral
                                              : value->kind == Value::Kind::kIri;
    if (!has_kind || !value->language.empty()) {
      return Wrong(thing, property, value->Describe());
    }
  }
  const auto& values = thing.values;
  const std::optional<std::string> tag = tags::TagNameOf(values[kTag]->text, naming_);
  if (!tag) {
    return Error{Wrong(thing, kTag, values[kTag]->Describe()) + ", such as <" +
                 tags::TagIri("7", naming_) + ">"};
  }
  const Value& id = *values[kRobotId];
  const std::optional<std::string> robot_id = tags::TextOf({id.text, id.datatype});
  if (!robot_id) {
    return Wrong(thing, kRobotId, id.Describe() + " of datatype <" + id.datatype + ">");
  }
  const Value& time = *values[kDtime];
  const std::optional<uint32_t> time_s = tags::ParseDateTime(time.text);
  if (time.datatype != tags::XsdType("dateTime") || !time_s) {
    return Wrong(thing, kDtime, time.Describe() + " of datatype <" + time.datatype + ">");
  }
  if (*time_s == 0) {  // a block without a time gets that of writing, and another one each time
    return Error{Wrong(thing, kDtime, time.Describe()) + ", after 1970-01-01T00:00:00Z"};
  }
  const Value& object = *values[kObject];
  const bool is_iri = thing.name.starts_with('<');
  Fact fact{.event = is_iri ? thing.name.substr(1, thing.name.size() - 2) : thing.name,
            .tag = *tag,
            .robot_id = *robot_id,
            .time_s = *time_s,
            .subject = values[kSubject]->text,
            .predicate = values[kPredicate]->text,
            .object = {object.text, object.kind == Value::Kind::kIri ? "" : object.datatype}};
  if (const Status good = tags::CheckFact(fact, naming_); !good.ok()) {
    return Error{At(thing.line) + thing.name + ": " + good.error()};
  }
  return fact;
}

Result<RdfContents> RdfReader::Contents() const {
  RdfContents contents;
  for (const Thing& thing : things_) {
    const auto used = static_cast<size_t>(
        std::count_if(thing.values.begin(), thing.values.end(), [](const auto& it) { return it; }));
    if (used == 0) {
      contents.ignored += thing.triples;
      continue;
    }
    PHEROMONE_TRY(Fact fact, FactOf(thing));
    contents.facts.push_back(std::move(fact));
    contents.ignored += thing.triples - used;
  }
  return contents;
}

}  // namespace

Result<RdfContents> ReadRdf(const std::string& name, std::string_view text, RdfFormat format,
                            const tags::Naming& naming) {
  RdfReader reader(name, naming);
  const Status parsed = reader.Parse(text, format);
  return parsed.ok() ? reader.Contents() : parsed.error();
}

Result<RdfContents> LoadRdf(const std::string& path, std::optional<RdfFormat> format,
                            const tags::Naming& naming) {
  if (!format) {
    PHEROMONE_TRY(const RdfFormat by_ending, RdfFormatOf(path));
    format = by_ending;
  }
  const Result<std::string> text = ReadFile(path);
  return text.ok() ? ReadRdf(path, text.value(), *format, naming) : text.error();
}

}  // namespace pheromone::ctl
