#include "server/formats/rdf/rdf_file.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "server/base/file.h"
#include "server/base/testing/temporary_folder.h"

namespace pheromone::ctl {
namespace {

using tags::Block;
using tags::Naming;
using tags::SymbolTables;
using tags::TagBlock;
using tags::Term;

constexpr RdfFormat kFormats[] = {RdfFormat::kNTriples, RdfFormat::kTurtle, RdfFormat::kRdfXml};

// --- Random blocks

// Texts with what formats have to escape.
std::string RandomText(std::mt19937* random) {
  constexpr const char* kPieces[] = {"a",
                                     "Z",
                                     "0",
                                     " ",
                                     "  ",
                                     "\"",
                                     "\\",
                                     "'",
                                     "<",
                                     ">",
                                     "&",
                                     "]]>",
                                     "%41",
                                     "#",
                                     "/",
                                     "/../",
                                     ".",
                                     ":",
                                     ";",
                                     "\xC3\xA4",
                                     "\xE2\x82\xAC",
                                     "\xF0\x9F\xA4\x96",
                                     "\xCC\x81",
                                     "\xC2\x85",
                                     "\xEF\xBF\xBE",
                                     "\xE2\x80\xA8",
                                     "&amp;",
                                     "{",
                                     "`",
                                     "\"\"\"",
                                     "\\u0041",
                                     "_:",
                                     "@en",
                                     "^^",
                                     "\xEF\xBB\xBF"};
  std::string text;
  for (size_t i = 1 + (*random)() % 8; i > 0; --i) {
    text += kPieces[(*random)() % std::size(kPieces)];
  }
  return text;
}

// Robots 1 to 9, of which 9 shares the strings of 8; namespaces are strings 1 to 4, names 5 to 30,
// any text 31 to 60, in an order of its own for each robot.
SymbolTables RandomTables(std::mt19937* random) {
  SymbolTables tables;
  std::set<std::string> texts;
  while (texts.size() < 30) {
    texts.insert(RandomText(random));
  }
  for (int32_t robot = 1; robot <= 9; ++robot) {
    tables.DefineRobot(robot, std::to_string(robot) + RandomText(random));
    if (robot == 9) {
      tables.DefineMapping(9, 8);
      break;
    }
    const char* const spaces[] = {"http://example.org/ns#", "http://robospace.org/a/",
                                  "urn:x-swarm/", "https://\xC3\xA4.example/b?c#"};
    int32_t number = 0;
    for (const char* const space : spaces) {
      tables.DefineString(robot, ++number, space);
    }
    while (number < 30) {
      ++number;
      const std::string dots(static_cast<size_t>(number % 3), '.');
      const std::string end = number % 2 == 0 ? "" : "-\xC3\xA9_";
      std::string name = "name" + dots;
      name.append(std::to_string(robot * number)).append(end);
      tables.DefineString(robot, number, name);
    }
    for (const std::string& text : texts) {
      tables.DefineString(robot, ++number, text);
    }
  }
  return tables;
}

int32_t Between(std::mt19937* random, int32_t least, int32_t most) {
  return std::uniform_int_distribution<int32_t>(least, most)(*random);
}

Term RandomSymbol(std::mt19937* random) {
  switch ((*random)() % 8) {
    case 0:  // any text as IRI, or a number that nothing is defined for
      return {0, Between(random, 31, 70)};
    case 1:
      return {Between(random, 31, 70), Between(random, 31, 70)};
    default:
      return {Between(random, 1, 4), Between(random, 5, 30)};
  }
}

Term RandomObject(std::mt19937* random) {
  const auto any = static_cast<int32_t>((*random)());
  switch ((*random)() % 12) {
    case 0:
      return {-1, Between(random, 1, 70)};
    case 1: {
      const int32_t scalar =
          (*random)() % 2 == 0 ? Between(random, 0, 0x2FF) : Between(random, 0, 0x10FFFF);
      return {-2, scalar >= 0xD800 && scalar <= 0xDFFF ? 'x' : scalar};
    }
    case 2:
      return {-3, any};
    case 3:
      return {-4, any};
    case 4:
      return {-5, any};
    case 5:
      return {-6, (*random)() % 2 == 0 ? any : any % 1'000'000};
    case 6:
      return {-7, Between(random, 0, 86'399'999)};
    case 7:
      return {-17, Between(random, 1, 12)};
    case 8:
      return {-18, Between(random, 1, 12)};
    case 9:
      return {-16 - 3 * Between(random, 0, 1), any};
    default:
      return RandomSymbol(random);
  }
}

TagBlock RandomBlock(std::mt19937* random, const std::vector<std::string>& names) {
  const uint32_t subject = (*random)() % 4;
  return {names[(*random)() % names.size()],
          {.author = Between(random, 1, 9),
           .time_s = static_cast<uint32_t>((*random)()),
           .subject = subject == 0   ? Term{-17, Between(random, 1, 12)}
                      : subject == 1 ? Term{-18, Between(random, 1, 12)}
                                     : RandomSymbol(random),
           .predicate = RandomSymbol(random),
           .object = RandomObject(random)}};
}

// What a block means, told from the tables alone: without the code under test. Empty for what RDF
// cannot represent.
using Meaning =
    std::tuple<std::string, std::string, uint32_t, std::string, std::string, std::string>;

std::string MeaningOf(const Term& term, int32_t author, const SymbolTables& tables) {
  const auto string = [&](int32_t number) {
    const std::string* const text = tables.StringOf(author, number);
    return text != nullptr ? "s" + *text : "n" + std::to_string(number);
  };
  if (term.space > 0) {
    const std::string space = string(term.space);
    const std::string value = string(term.value);
    return space[0] == 's' && value[0] == 's'
               ? "iri " + space.substr(1) + value.substr(1)
               : "symbol " + std::to_string(term.space) + " " + std::to_string(term.value);
  }
  if (term.space == 0) {
    const std::string value = string(term.value);
    return value[0] == 's' ? "iri " + value.substr(1) : "symbol 0 " + value;
  }
  if (term.space == -1) {
    return "string " + string(term.value);
  }
  if (term.space == -4 && std::isnan(std::bit_cast<float>(term.value))) {
    return "NaN";
  }
  if (term.space == -17 && tables.HasRobot(term.value)) {
    return "robot " + *tables.UniqueIdOf(term.value);
  }
  return "value " + std::to_string(term.space) + " " + std::to_string(term.value);
}

std::set<Meaning> MeaningsOf(const std::vector<TagBlock>& blocks, const SymbolTables& tables) {
  std::set<Meaning> all;
  for (const auto& [tag, it] : blocks) {
    if (it.object.space != -16 && it.object.space != -19) {
      all.insert(
          {tag, *tables.UniqueIdOf(it.author), it.time_s, MeaningOf(it.subject, it.author, tables),
           MeaningOf(it.predicate, it.author, tables), MeaningOf(it.object, it.author, tables)});
    }
  }
  return all;
}

TEST(RdfFileTest, RandomBlocksSurviveEachFormat) {
  std::mt19937 random(7);
  Naming naming;
  std::vector<std::string> names = {"dock", "7", "two words", ".", "a/b", "\xC3\xA4<&\">"};
  for (size_t i = 0; i < names.size(); ++i) {
    naming.tags.Add(static_cast<int32_t>(i + 1), names[i]);
  }
  const SymbolTables tables = RandomTables(&random);
  std::vector<TagBlock> blocks;
  size_t unknown = 0;
  for (int i = 0; i < 2'000; ++i) {
    blocks.push_back(RandomBlock(&random, names));
    const int32_t space = blocks.back().block.object.space;
    unknown += space == -16 || space == -19 ? 1 : 0;
  }
  const Result<tags::Facts> facts = tags::FactsOf(blocks, tables, naming);
  ASSERT_TRUE(facts.ok()) << facts.error();
  EXPECT_EQ(facts.value().skipped, unknown);
  const std::set<Meaning> expected = MeaningsOf(blocks, tables);
  for (const RdfFormat format : kFormats) {
    SCOPED_TRACE(static_cast<int>(format));
    const Result<std::string> text = WriteRdf(facts.value().facts, format, naming);
    ASSERT_TRUE(text.ok()) << text.error();
    const Result<RdfContents> read = ReadRdf("memory", text.value(), format, naming);
    ASSERT_TRUE(read.ok()) << read.error();
    EXPECT_EQ(read.value().ignored, 0u);

    SymbolTables same = tables;
    const Result<std::vector<TagBlock>> again = tags::BlocksOf(read.value().facts, naming, &same);
    ASSERT_TRUE(again.ok()) << again.error();
    EXPECT_EQ(MeaningsOf(again.value(), same), expected);
    EXPECT_EQ(same.rows(), tables.rows());  // no string is defined twice

    SymbolTables fresh;
    const Result<std::vector<TagBlock>> elsewhere =
        tags::BlocksOf(read.value().facts, naming, &fresh);
    ASSERT_TRUE(elsewhere.ok()) << elsewhere.error();
    EXPECT_EQ(MeaningsOf(elsewhere.value(), fresh), expected);
  }
}

TEST(RdfFileTest, BlocksOfPlainSymbolsKeepTheirNumbers) {
  std::mt19937 random(8);
  const SymbolTables tables = RandomTables(&random);
  std::vector<TagBlock> blocks;
  for (int i = 0; i < 1000; ++i) {
    TagBlock it = RandomBlock(&random, {"dock"});
    it.block.time_s = static_cast<uint32_t>(1 + i);
    it.block.subject = {Between(&random, 1, 4), Between(&random, 5, 30)};
    it.block.predicate = {Between(&random, 1, 4), Between(&random, 5, 30)};
    it.block.object = {-1 * Between(&random, 5, 6), Between(&random, 0, 1'000'000)};
    blocks.push_back(it);
  }
  const tags::Facts facts = tags::FactsOf(blocks, tables, {}).value();
  for (const RdfFormat format : kFormats) {
    const std::string text = WriteRdf(facts.facts, format, {}).value();
    SymbolTables same = tables;
    const auto again = tags::BlocksOf(ReadRdf("memory", text, format, {}).value().facts, {}, &same);
    std::map<uint32_t, Block> by_time;
    for (const TagBlock& it : again.value()) {
      by_time[it.block.time_s] = it.block;
    }
    for (const TagBlock& it : blocks) {
      ASSERT_EQ(by_time[it.block.time_s], it.block);
    }
  }
}

// --- Errors

constexpr char kPrefixes[] =
    "@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .\n"
    "@prefix rob: <http://robots.org/ns#> .\n"
    "@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .\n";

constexpr char kGood[] =
    "<urn:e> a rdf:Statement ; rdf:subject <urn:s> ; rdf:predicate <urn:p> ; rdf:object 'o' ;\n"
    "  rob:tag <http://robots.org/tag/dock> ; rob:robotId '15' ;\n"
    "  rob:dtime '2006-01-28T14:20:00Z'^^xsd:dateTime .\n";

// The error of the good fact, one text replaced.
std::string FaultOf(const std::string& found, const std::string& replacement) {
  std::string text = std::string(kPrefixes) + kGood;
  const size_t at = text.find(found, sizeof kPrefixes - 1);
  EXPECT_NE(at, std::string::npos) << found;
  text.replace(at, found.size(), replacement);
  const Result<RdfContents> read = ReadRdf("tags.ttl", text, RdfFormat::kTurtle, {});
  return read.ErrorOr("");
}

TEST(RdfFileTest, AFactCanBeWrittenByHand) {
  const std::string text = std::string(kPrefixes) + kGood + "<urn:other> <urn:p> 5, 6 .\n" +
                           "<urn:e> <urn:comment> 'mine' .\n";
  const Result<RdfContents> read = ReadRdf("tags.ttl", text, RdfFormat::kTurtle, {});
  ASSERT_TRUE(read.ok()) << read.error();
  ASSERT_EQ(read.value().facts.size(), 1u);
  EXPECT_EQ(read.value().ignored, 3u);
  EXPECT_EQ(read.value().facts[0],
            (tags::Fact{.event = "urn:e",
                        .tag = "dock",
                        .robot_id = "15",
                        .time_s = 1'138'458'000,
                        .subject = "urn:s",
                        .predicate = "urn:p",
                        .object = {"o", "http://www.w3.org/2001/XMLSchema#string"}}));
}

TEST(RdfFileTest, WrongPropertiesAreNamedWithFileAndLine) {
  EXPECT_EQ(FaultOf("a rdf:Statement ;", ""),
            "tags.ttl:6: <urn:e>: found no rdf:type, expected rdf:Statement");
  EXPECT_EQ(FaultOf("a rdf:Statement", "a 'Statement'"),
            "tags.ttl:6: <urn:e>: the rdf:type is \"Statement\", expected rdf:Statement");
  EXPECT_EQ(FaultOf("rdf:subject <urn:s>", "rdf:subject 'urn:s'"),
            "tags.ttl:6: <urn:e>: the rdf:subject is \"urn:s\", expected an IRI");
  EXPECT_EQ(FaultOf("<urn:s>", "<urn:s>, <urn:t>"),
            "tags.ttl:6: <urn:e>: the rdf:subject is <urn:t> and <urn:s>, expected one");
  EXPECT_EQ(FaultOf("rob:tag <http://robots.org/tag/dock> ;", ""),
            "tags.ttl:6: <urn:e>: found no rob:tag, expected the IRI of a tag");
  EXPECT_EQ(FaultOf("<http://robots.org/tag/dock>", "<http://robots.org/dock>"),
            "tags.ttl:6: <urn:e>: the rob:tag is <http://robots.org/dock>, expected the IRI of a "
            "tag, such as <http://robots.org/tag/7>");
  EXPECT_EQ(
      FaultOf("rob:robotId '15'", "rob:robotId 15"),
      "tags.ttl:6: <urn:e>: the rob:robotId is \"15\" of datatype "
      "<http://www.w3.org/2001/XMLSchema#integer>, expected the unique ID of a robot as text");
  EXPECT_EQ(FaultOf("'2006-01-28T14:20:00Z'", "'2006-01-28T14:20'"),
            "tags.ttl:6: <urn:e>: the rob:dtime is \"2006-01-28T14:20\" of datatype "
            "<http://www.w3.org/2001/XMLSchema#dateTime>, expected an xsd:dateTime such as "
            "2006-01-28T14:20:00Z");
  EXPECT_EQ(FaultOf("'2006-01-28T14:20:00Z'", "'1970-01-01T00:00:00Z'"),
            "tags.ttl:6: <urn:e>: the rob:dtime is \"1970-01-01T00:00:00Z\", expected an "
            "xsd:dateTime such as 2006-01-28T14:20:00Z, after 1970-01-01T00:00:00Z");
  EXPECT_EQ(FaultOf("'o'", "'o'@en"),
            "tags.ttl:6: <urn:e>: the rdf:object is \"o\" in the language en, expected an IRI or a "
            "literal without a language");
  EXPECT_EQ(FaultOf("'o'", "'244'^^xsd:gYear"),
            "tags.ttl:6: <urn:e>: the object is \"244\" of datatype "
            "<http://www.w3.org/2001/XMLSchema#gYear>, expected xsd:string, boolean, decimal, "
            "integer or a "
            "type derived from it, float, double, dateTime, date or time, or rob:char or escaped");
  EXPECT_EQ(
      FaultOf("'o'", "'\\n244'^^xsd:int"),
      "tags.ttl:6: <urn:e>: the object is \"\n244\", expected a whole number from -2147483648 "
      "to 2147483647");
  EXPECT_EQ(FaultOf("'o'", "'" + std::string(256, 'x') + "'").substr(0, 40),
            "tags.ttl:6: <urn:e>: the object is \"xxxx");
  EXPECT_EQ(FaultOf("'o'", "[]").substr(0, 42), "tags.ttl:6: <urn:e>: the rdf:object is _:g");
}

TEST(RdfFileTest, InvalidSyntaxIsNamedWithFileAndLine) {
  const std::string turtle = FaultOf("rob:tag <", "rob:tag tag <");
  EXPECT_EQ(turtle.substr(0, 12), "tags.ttl:5: ") << turtle;
  EXPECT_TRUE(turtle.ends_with("expected Turtle")) << turtle;
  const Result<RdfContents> triples =
      ReadRdf("tags.nt", "<urn:a> <urn:b> <urn:c> .\n<urn:a> <urn:b .\n", RdfFormat::kNTriples, {});
  ASSERT_FALSE(triples.ok());
  EXPECT_EQ(triples.error().substr(0, 11), "tags.nt:2: ") << triples.error();
  const Result<RdfContents> xml = ReadRdf(
      "tags.rdf",
      "<rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">\n<a>&b;</rdf:RDF>",
      RdfFormat::kRdfXml, {});
  ASSERT_FALSE(xml.ok());
  EXPECT_EQ(xml.error().substr(0, 12), "tags.rdf:2: ") << xml.error();
}

TEST(RdfFileTest, FactsOfNTriplesAreNamedWithTheirLine) {
  const std::string good =
      WriteRdf(
          ReadRdf("tags.ttl", std::string(kPrefixes) + kGood, RdfFormat::kTurtle, {}).value().facts,
          RdfFormat::kNTriples, {})
          .value();
  std::string bad = good;
  for (size_t at = 0; (at = bad.find("<urn:e>", at)) != std::string::npos;) {
    bad.replace(at, 7, "<urn:bad>");
  }
  bad.replace(bad.find("\"o\""), 3, "\"\"");
  const auto fault = [](const std::string& text) {
    const Result<RdfContents> read = ReadRdf("tags.nt", text, RdfFormat::kNTriples, {});
    return read.ErrorOr("");
  };
  EXPECT_EQ(fault(good + bad).substr(0, 21), "tags.nt:8: <urn:bad>:");
  EXPECT_EQ(fault("# a comment\n\n" + good + " \t" + bad).substr(0, 22), "tags.nt:10: <urn:bad>:");
  // Turtle that is no N-Triples is read too; a line that is named is about that subject.
  EXPECT_EQ(fault("<urn:o>\n <urn:p>\n 5 .\n" + good + bad).substr(0, 19), "tags.nt: <urn:bad>:");
}

TEST(RdfFileTest, AByteOrderMarkIsNoPartOfTheText) {
  const std::vector<tags::Fact> facts =
      ReadRdf("tags.ttl", std::string(kPrefixes) + kGood, RdfFormat::kTurtle, {}).value().facts;
  for (const RdfFormat format : kFormats) {
    const std::string text = WriteRdf(facts, format, {}).value();
    const Result<RdfContents> read = ReadRdf("tags", "\xEF\xBB\xBF" + text, format, {});
    ASSERT_TRUE(read.ok()) << read.error();
    EXPECT_EQ(read.value().facts, facts);
    EXPECT_EQ(ReadRdf("tags", "\xFF\xFE" + text, format, {}).ErrorOr(""),
              "tags:1: found the byte order mark of UTF-16 or UTF-32, expected UTF-8");
  }
}

TEST(RdfFileTest, ElementsThatAreNestedTooDeepAreRefused) {
  std::string xml = "<rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">\n";
  for (int i = 0; i < 8'000; ++i) {
    xml += i % 2 == 0 ? "<rdf:Description>\n" : "<rdf:value>\n";
  }
  EXPECT_EQ(
      ReadRdf("deep.rdf", xml, RdfFormat::kRdfXml, {}).ErrorOr(""),
      "deep.rdf:65: found elements nested deeper than 64, or in an entity, expected RDF/XML of "
      "facts");
}

TEST(RdfFileTest, AByteOfZeroIsNotTheEnd) {
  const std::string text = "<urn:a> <urn:b> <urn:c> .\n" + std::string(1, '\0') + "rubbish";
  for (const RdfFormat format : kFormats) {
    const Result<RdfContents> read = ReadRdf("tags", text, format, {});
    ASSERT_FALSE(read.ok());
    EXPECT_EQ(read.error().substr(0, 38), "tags:2: found a byte of 0, expected " +
                                              std::string(format == RdfFormat::kNTriples ? "N-"
                                                          : format == RdfFormat::kTurtle ? "Tu"
                                                                                         : "RD"));
  }
}

// As it is printed in Tammet, Vain and Kuusik 2006, section 3.3, but for the lines' ends.
TEST(RdfFileTest, ThePapersExampleIsNoRdf) {
  constexpr char kPaper[] = R"(<rdf:Description
 xmlns="http://www.w3.org/" xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"
 xmlns:rob="http://robots.org" xmlns:r1="http://example.org"
 xml:base="http://robospace.org/event" rdf:ID="123-233-201at2006-01-28T14:20">
 <rdf:type>Statement</rdf:type>
 <rob:robnr>123-233-201</rob:robnr>
 <rob:dtime rdf:datatype="&xsd;dateTime">2006-01-28T14:20</rob:dtime>
 <rdf:subject>rob:123-233-201</rdf:subject>
 <rdf:predicate>r1:lookingfortag</rdf:predicate>
 <rdf:object rdf:datatype="&xsd;decimal">244</rdf:object>
</rdf:Description>)";
  EXPECT_FALSE(ReadRdf("paper.rdf", kPaper, RdfFormat::kRdfXml, {}).ok());
}

TEST(RdfFileTest, ReadingOpensNoOtherFile) {
  const TemporaryFolder folder;
  const std::string other = folder / "other.txt";
  ASSERT_TRUE(WriteFile(other, "contents").ok());
  std::string xml =
      WriteRdf(
          ReadRdf("tags.ttl", std::string(kPrefixes) + kGood, RdfFormat::kTurtle, {}).value().facts,
          RdfFormat::kRdfXml, {})
          .value();
  const size_t id = xml.find(">15<");
  ASSERT_NE(id, std::string::npos) << xml;
  const auto with = [&](const std::string& entity) {
    std::string text = xml;
    text.replace(id, 4, ">&e;<");
    text.insert(text.find("?>") + 2, "<!DOCTYPE x [<!ENTITY e " + entity + ">]>");
    const Result<RdfContents> read = ReadRdf("tags.rdf", text, RdfFormat::kRdfXml, {});
    return read.ok() ? read.value().facts.at(0).robot_id : read.error();
  };
  EXPECT_EQ(with("\"contents\""), "contents");
  const std::string refused = with("SYSTEM \"file://" + other + "\"");
  EXPECT_NE(refused.find("expected"), std::string::npos) << refused;
  EXPECT_EQ(refused.find("contents"), std::string::npos) << refused;
}

TEST(RdfFileTest, TheEndingTellsTheFormat) {
  EXPECT_EQ(RdfFormatOf("a/b.ttl").value(), RdfFormat::kTurtle);
  EXPECT_EQ(RdfFormatOf("b.xml").value(), RdfFormat::kRdfXml);
  EXPECT_EQ(RdfFormatOf("b.json").error(),
            "b.json: unknown ending, expected .nt, .ttl, .rdf or .xml");
  EXPECT_EQ(RdfFormatNamed("n3").error(),
            "the format is \"n3\", expected ntriples, turtle or rdfxml");
}

TEST(RdfFileTest, EventsOfOneHashStayApart) {
  const Result<RdfContents> read =
      ReadRdf("tags.ttl", std::string(kPrefixes) + kGood, RdfFormat::kTurtle, {});
  std::vector<tags::Fact> facts(3, read.value().facts.at(0));
  facts[1].subject = "urn:another";
  for (const RdfFormat format : kFormats) {
    const std::string text = WriteRdf(facts, format, {}).value();
    const Result<RdfContents> again = ReadRdf("memory", text, format, {});
    ASSERT_TRUE(again.ok()) << again.error();
    std::set<std::string> events;
    for (const tags::Fact& fact : again.value().facts) {
      events.insert(fact.event + " " + fact.subject);
    }
    EXPECT_EQ(events, (std::set<std::string>{"urn:e urn:s", "urn:e-2 urn:another"}));
  }
}

}  // namespace
}  // namespace pheromone::ctl
