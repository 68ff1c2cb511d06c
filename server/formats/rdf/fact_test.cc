#include "server/formats/rdf/fact.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace pheromone::tags {
namespace {

constexpr char kNamespace[] = "http://example.org/ns#";
constexpr uint32_t kTimeS = 1'138'458'000;  // 2006-01-28T14:20:00Z

SymbolTables PaperTables() {
  SymbolTables tables;
  tables.DefineRobot(12, "00:11:22:33:44:55");
  tables.DefineRobot(15, "123-233-201");
  tables.DefineString(15, 1, kNamespace);
  tables.DefineString(15, 2, "lookingfortag");
  tables.DefineString(15, 3, "book");
  tables.DefineString(15, 4, "urn:isbn:0");
  tables.DefineString(15, 5, "two words");
  tables.DefineString(15, 6, "not \xEF\xBF\xBE XML");
  return tables;
}

Block With(Term object) {
  return {
      .author = 15, .time_s = kTimeS, .subject = {-17, 15}, .predicate = {1, 2}, .object = object};
}

// The object as N-Triples has it, with short prefixes.
std::string ObjectOf(Term object) {
  Naming naming;
  naming.tags.Add(7, "dock 7");
  PHEROMONE_TRY(const Fact fact, FactOf({"dock", With(object)}, PaperTables(), naming));
  const Node& node = fact.object;
  if (!node.is_literal()) {
    return "<" + node.text + ">";
  }
  const std::string type = node.datatype.starts_with(kXsd)
                               ? "xsd:" + node.datatype.substr(kXsd.size())
                               : "rob:" + node.datatype.substr(kRob.size());
  return "\"" + node.text + "\"^^" + type;
}

TEST(FactTest, ThePapersQuintetIsAFact) {
  const Result<Fact> fact = FactOf({"7", With({-3, 244})}, PaperTables(), {});
  ASSERT_TRUE(fact.ok()) << fact.error();
  const Fact& it = fact.value();
  EXPECT_EQ(it.tag, "7");
  EXPECT_EQ(it.robot_id, "123-233-201");
  EXPECT_EQ(it.time_s, kTimeS);
  EXPECT_EQ(it.subject, "http://robots.org/robot/123-233-201");
  EXPECT_EQ(it.predicate, "http://example.org/ns#lookingfortag");
  EXPECT_EQ(it.object.text, "244");
  EXPECT_EQ(it.object.datatype, "http://www.w3.org/2001/XMLSchema#int");
  constexpr char kEvent[] = "http://robots.org/event/7/123-233-201/20060128T142000Z/";
  EXPECT_EQ(it.event.substr(0, sizeof kEvent - 1), kEvent);
  EXPECT_EQ(it.event.size(), sizeof kEvent - 1 + 8);
}

// Those of robot and time alone merge the paper's own three quintets (its section 3.1).
TEST(FactTest, FactsOfOneRobotAtOneTimeHaveTheirOwnEvents) {
  const SymbolTables tables = PaperTables();
  EXPECT_NE(FactOf({"7", With({-3, 244})}, tables, {}).value().event,
            FactOf({"7", With({-3, 245})}, tables, {}).value().event);
  EXPECT_NE(FactOf({"7", With({-3, 244})}, tables, {}).value().event,
            FactOf({"8", With({-3, 244})}, tables, {}).value().event);
}

TEST(FactTest, EachTypeHasItsForm) {
  EXPECT_EQ(ObjectOf({1, 3}), "<http://example.org/ns#book>");
  EXPECT_EQ(ObjectOf({0, 4}), "<urn:isbn:0>");
  EXPECT_EQ(ObjectOf({-1, 5}), "\"two words\"^^xsd:string");
  EXPECT_EQ(ObjectOf({-2, 'x'}), "\"x\"^^rob:char");
  EXPECT_EQ(ObjectOf({-3, -5}), "\"-5\"^^xsd:int");
  EXPECT_EQ(ObjectOf({-4, 0x3F000000}), "\"0.5\"^^xsd:float");
  EXPECT_EQ(ObjectOf({-5, -1}), "\"2106-02-07T06:28:15Z\"^^xsd:dateTime");
  EXPECT_EQ(ObjectOf({-6, 13'176}), "\"2006-01-28\"^^xsd:date");
  EXPECT_EQ(ObjectOf({-7, 51'600'250}), "\"14:20:00.250Z\"^^xsd:time");
  EXPECT_EQ(ObjectOf({-17, 12}), "<http://robots.org/robot/00%3A11%3A22%3A33%3A44%3A55>");
  EXPECT_EQ(ObjectOf({-18, 7}), "<http://robots.org/tag/dock%207>");
}

TEST(FactTest, NothingIsLostForLackOfAForm) {
  EXPECT_EQ(ObjectOf({0, 5}), "<http://robots.org/text/two%20words>");
  EXPECT_EQ(ObjectOf({2, 5}), "<http://robots.org/text/lookingfortag/two%20words>");
  EXPECT_EQ(ObjectOf({1, 99}), "<http://robots.org/unresolved/123-233-201/1/99>");
  EXPECT_EQ(ObjectOf({0, 99}), "<http://robots.org/unresolved/123-233-201/0/99>");
  EXPECT_EQ(ObjectOf({-1, 99}), "<http://robots.org/unresolved/123-233-201/99>");
  EXPECT_EQ(ObjectOf({-1, 6}), "\"not%20%EF%BF%BE%20XML\"^^rob:escaped");
  EXPECT_EQ(ObjectOf({-17, 9}), "<http://robots.org/robot-number/9>");
  EXPECT_EQ(ObjectOf({-18, 9}), "<http://robots.org/tag-number/9>");
}

TEST(FactTest, UnknownTypesAndRecordsOfNetsAreSkippedAndCounted) {
  Block record = With({-3, 1});
  record.subject.space = kNetRecordType;
  const std::vector<TagBlock> blocks = {
      {"a", With({-3, 1})}, {"a", {}}, {"a", With({-16, 5})}, {"b", With({-99, 5})}, {"b", record}};
  EXPECT_EQ(FactOf({"b", record}, PaperTables(), {}).error(),
            "the block is a record of a Petri net, expected a fact");
  const Result<Facts> facts = FactsOf(blocks, PaperTables(), {});
  ASSERT_TRUE(facts.ok());
  EXPECT_EQ(facts.value().facts.size(), 1u);
  EXPECT_EQ(facts.value().skipped, 3u);
}

TEST(FactTest, AMappedRobotsFactsHaveItsOwnIdAndTheOwnersStrings) {
  SymbolTables tables = PaperTables();
  tables.DefineMapping(12, 15);
  Block block = With({-1, 99});
  block.author = 12;
  const Fact fact = FactOf({"dock", block}, tables, {}).value();
  EXPECT_EQ(fact.robot_id, "00:11:22:33:44:55");
  EXPECT_EQ(fact.predicate, "http://example.org/ns#lookingfortag");
  EXPECT_EQ(BlocksOf(std::vector{fact}, {}, &tables).value().front().block, block);
}

TEST(FactTest, NewTablesGetTheRowsThatTheyNeed) {
  const Fact fact = FactOf({"dock", With({-1, 3})}, PaperTables(), {}).value();
  SymbolTables tables;
  const Result<std::vector<TagBlock>> blocks = BlocksOf(std::vector{fact}, {}, &tables);
  ASSERT_TRUE(blocks.ok()) << blocks.error();
  EXPECT_EQ(blocks.value().front(), (TagBlock{"dock",
                                              {.author = 1,
                                               .time_s = kTimeS,
                                               .subject = {-17, 1},
                                               .predicate = {1, 2},
                                               .object = {-1, 3}}}));
  EXPECT_EQ(tables.rows(), (std::vector<Row>{{RowKind::kRobot, 1, 1, "123-233-201"},
                                             {RowKind::kString, 1, 1, kNamespace},
                                             {RowKind::kString, 1, 2, "lookingfortag"},
                                             {RowKind::kString, 1, 3, "book"}}));
}

TEST(FactTest, AnIriIsSplitAsTheAuthorSplitsIt) {
  SymbolTables tables;
  tables.DefineRobot(15, "x");
  tables.DefineString(15, 8, "http://example.org/");
  tables.DefineString(15, 9, "ns#book");
  const Node book{"http://example.org/ns#book", {}};
  EXPECT_EQ(TermOf(book, "object", 15, {}, &tables).value(), (Term{8, 9}));
  tables.DefineString(15, 10, book.text);
  EXPECT_EQ(TermOf(book, "object", 15, {}, &tables).value(), (Term{0, 10}));
}

// The numbers in IRIs begin with 1, but for the namespace of a whole IRI.
TEST(FactTest, IrisOfTheLowestNumbersAreRead) {
  SymbolTables tables;
  tables.DefineRobot(1, "x");
  const auto read = [&](const std::string& path, const std::string& role) {
    const Result<Term> term = TermOf({"http://robots.org/" + path, {}}, role, 1, {}, &tables);
    return term.ok() ? term.value() : Term{-99, 0};
  };
  const Term none{-99, 0};
  EXPECT_EQ(read("robot-number/1", "subject"), (Term{-17, 1}));
  EXPECT_EQ(read("tag-number/1", "object"), (Term{-18, 1}));
  EXPECT_EQ(read("unresolved/x/1", "object"), (Term{-1, 1}));
  EXPECT_EQ(read("unresolved/x/1/1", "predicate"), (Term{1, 1}));
  EXPECT_EQ(read("unresolved/x/0/1", "subject"), (Term{0, 1}));
  for (const std::string path : {"robot-number/0", "tag-number/0", "unresolved/x/0",
                                 "unresolved/x/1/0", "unresolved/x/-1/1", "robot-number/01"}) {
    EXPECT_EQ(read(path, "object"), none) << path;
  }
  EXPECT_EQ(tables.rows().size(), 1u);
}

// What other makers' programs write for a number.
TEST(FactTest, NumbersOfOtherDatatypesComeInWhereTheyFit) {
  const auto term = [](const std::string& text, const std::string& type) {
    SymbolTables tables;
    tables.DefineRobot(1, "x");
    const Result<Term> read = TermOf({text, std::string(kXsd) + type}, "object", 1, {}, &tables);
    return read.ok() ? std::to_string(read.value().space) + " " + std::to_string(read.value().value)
                     : read.ErrorOr("");
  };
  for (const char* const type :
       {"integer", "long", "short", "unsignedLong", "unsignedInt", "unsignedShort", "unsignedByte",
        "nonNegativeInteger", "positiveInteger", "decimal"}) {
    EXPECT_EQ(term("244", type), "-3 244") << type;
  }
  for (const char* const type : {"byte", "nonPositiveInteger", "negativeInteger"}) {
    EXPECT_EQ(term("-5", type), "-3 -5") << type;
  }
  EXPECT_EQ(term("2147483648", "integer"),
            "the object is \"2147483648\" of datatype xsd:integer, expected a whole number of that "
            "datatype and of 32 bits");
  EXPECT_EQ(term("+7", "integer"), "-3 7");
  for (const auto& [text, type] :
       {std::pair("128", "byte"), std::pair("-1", "unsignedInt"), std::pair("0", "positiveInteger"),
        std::pair("4.0", "integer"), std::pair("", "integer"), std::pair("1e2", "decimal"),
        std::pair("INF", "decimal"), std::pair("yes", "boolean"),
        std::pair("3.141592653589793", "double"), std::pair("16777217.5", "decimal"),
        std::pair("1e300", "double")}) {
    EXPECT_TRUE(term(text, type).starts_with("the object is ")) << text << " " << type;
  }
  EXPECT_EQ(term("244.00", "decimal"), "-3 244");
  EXPECT_EQ(term("0.5", "decimal"), "-4 " + std::to_string(0x3F000000));
  EXPECT_EQ(term("0.5E0", "double"), "-4 " + std::to_string(0x3F000000));
  EXPECT_EQ(term("0.1", "double"), "-4 " + std::to_string(0x3DCCCCCD));
  EXPECT_EQ(term("-INF", "double"), "-4 " + std::to_string(static_cast<int32_t>(0xFF800000)));
  EXPECT_EQ(term("true", "boolean"), "-3 1");
  EXPECT_EQ(term("0", "boolean"), "-3 0");
}

std::string FaultOf(const Node& object) {
  Naming naming;
  const Fact fact{.event = "urn:e",
                  .tag = "dock",
                  .robot_id = "x",
                  .subject = "urn:s",
                  .predicate = "urn:p",
                  .object = object};
  const Status status = CheckFact(fact, naming);
  SymbolTables tables;
  const Result<std::vector<TagBlock>> blocks = BlocksOf(std::vector{fact}, naming, &tables);
  EXPECT_EQ(status.ok(), blocks.ok());
  EXPECT_EQ(tables.rows().empty(), !blocks.ok());
  return status.ErrorOr("");
}

TEST(FactTest, ErrorsNameWhatWasFoundAndExpected) {
  const std::string xsd(kXsd);
  EXPECT_EQ(FaultOf({"244", xsd + "int"}), "");
  EXPECT_EQ(FaultOf({" 244", xsd + "int"}),
            "the object is \" 244\", expected a whole number from -2147483648 to 2147483647");
  EXPECT_EQ(FaultOf({"244", xsd + "gYear"}),
            "the object is \"244\" of datatype <http://www.w3.org/2001/XMLSchema#gYear>, expected "
            "xsd:string, boolean, decimal, integer or a type derived from it, float, double, "
            "dateTime, date "
            "or time, or rob:char or escaped");
  EXPECT_EQ(
      FaultOf({"14:20:00", xsd + "time"}),
      "the object is \"14:20:00\", expected UTC with at most milliseconds, such as 14:20:00Z");
  EXPECT_EQ(FaultOf({"book", {}}),
            "the object is <book>, expected an absolute IRI such as "
            "<http://example.org/ns#cleaning>");
  EXPECT_EQ(FaultOf({"http://robots.org/tag/dock", {}}),
            "the object is <http://robots.org/tag/dock>, expected the name of a known tag, or "
            "http://robots.org/tag-number/NUMBER");
  EXPECT_EQ(FaultOf({"http://robots.org/unresolved/y/9", {}}),
            "the object is <http://robots.org/unresolved/y/9>, expected numbers of the author's "
            "strings, as http://robots.org/unresolved/x/SPACE/NR or NR");
  EXPECT_EQ(FaultOf({"http://a/" + std::string(600, 'x'), {}}),
            "the object is an IRI of 609 bytes, <http://a/" + std::string(31, 'x') +
                "...>, expected a namespace and a local part of at most 255 bytes each");
  EXPECT_EQ(FaultOf({std::string(256, 'x'), xsd + "string"}),
            "the object is \"" + std::string(80, 'x') +
                "...\" of 256 bytes, expected strings of 1 to 255 bytes of UTF-8 without control "
                "characters");
}

TEST(FactTest, FullTablesAreNamed) {
  SymbolTables tables;
  tables.DefineRobot(1, "x");
  for (int32_t i = 1; i < 4096; ++i) {
    ASSERT_EQ(tables.DefineString(1, i, std::to_string(i)), DefineOutcome::kDone);
  }
  EXPECT_EQ(TermOf({"book", std::string(kXsd) + "string"}, "object", 1, {}, &tables).error(),
            "the object needs the string \"book\", but the string table of robot 1 is full");
}

}  // namespace
}  // namespace pheromone::tags
