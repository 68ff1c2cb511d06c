#include "server/formats/nets/pnml.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "server/formats/nets/testing/random_net.h"

namespace pheromone::nets {
namespace {

using petri::Net;
using testing::HasSubstr;
using testing::Not;

// A document of one net with this inside of its page.
std::string Document(const std::string& page,
                     const std::string& type = "http://www.pnml.org/version-2009/grammar/ptnet") {
  return "<?xml version=\"1.0\"?>\n"
         "<pnml xmlns=\"http://www.pnml.org/version-2009/grammar/pnml\">\n"
         "<net id=\"n\" type=\"" +
         type + "\"><page id=\"page\">\n" + page + "\n</page></net></pnml>";
}

// Two places and a transition, on lines 4 to 6, and more from line 7.
std::string Around(const std::string& more) {
  return Document("<place id=\"p\"/>\n<place id=\"q\"/>\n<transition id=\"t\"/>\n" + more);
}

Net Parsed(const std::string& text) {
  Result<Net> net = ParsePnml("a.pnml", text);
  EXPECT_TRUE(net.ok()) << net.error() << "\n" << text;
  return net.ok() ? std::move(net).value() : Net{};
}

std::string ErrorOf(const std::string& text) {
  const Result<Net> net = ParsePnml("a.pnml", text);
  return net.ErrorOr("no error");
}

TEST(Pnml, ReadsPlacesTransitionsAndWeights) {
  const Net net = Parsed(Document(R"(
      <place id="p"><name><text> Ready </text><graphics/></name>
        <initialMarking><text>
          3 </text></initialMarking></place>
      <place id="q"/>
      <transition id="t"><name><text>go &amp; <!-- what? --><![CDATA[<do>]]></text></name></transition>
      <arc id="a" source="p" target="t"><inscription><text>2</text></inscription></arc>
      <arc id="b" source="t" target="q"/>)"));
  EXPECT_EQ(
      net,
      (Net{.name = "n",
           .places = {{.id = "p", .name = "Ready", .tokens = 3}, {.id = "q"}},
           .transitions = {{.id = "t", .name = "go & <do>", .takes = {{0, 2}}, .gives = {{1}}}}}));
}

TEST(Pnml, JoinsPagesAndFollowsReferences) {
  const Net net = Parsed(Document(R"(
      <arc id="a" source="r2" target="rt"/>
      <referencePlace id="r2" ref="r1"/>
      <page id="inner"><place id="p"/><page id="deeper"><referencePlace id="r1" ref="p"/></page></page>
      <referenceTransition id="rt" ref="t"/>
      <page id="other"><transition id="t"/><arc id="b" source="t" target="p"/></page>)"));
  EXPECT_EQ(net, (Net{.name = "n",
                      .places = {{.id = "p"}},
                      .transitions = {{.id = "t", .takes = {{0}}, .gives = {{0}}}}}));
}

TEST(Pnml, RefusesReferencesToNothingOrThemselves) {
  EXPECT_EQ(ErrorOf(Around(R"(<referencePlace id="r" ref="s"/><referencePlace id="s" ref="r"/>
<arc id="a" source="r" target="t"/>)")),
            "a.pnml:7: found references that form a cycle at \"r\", expected a place or transition "
            "after at most 1000");
  EXPECT_EQ(
      ErrorOf(Around(R"(<referencePlace id="r" ref="t"/><arc id="a" source="r" target="t"/>)")),
      "a.pnml:7: found <referencePlace> \"r\" of \"t\", expected the ID of a place");
  EXPECT_EQ(
      ErrorOf(Around(R"(<arc id="a" source="x" target="t"/>)")),
      "a.pnml:7: found arc \"a\" with the source \"x\", expected the ID of a place or transition");
  EXPECT_EQ(ErrorOf(Around(R"(<arc id="a" source="p" target="page"/>)")),
            "a.pnml:7: found arc \"a\" with the target \"page\", expected the ID of a place or "
            "transition");
}

TEST(Pnml, UnderstandsEveryDialectOfInhibitorAndReadArcs) {
  for (const std::string arc :
       {R"(<arc id="a" source="p" target="t"><type value="inhibitor"/>)",
        R"(<arc id="a" source="p" target="t" type="inhibitor">)",
        R"x(<arc id="a" source="p" target="t" type="tapnInhibitor" inscription="[0,inf)">)x",
        R"(<arc id="a" source="p" target="t"><arctype><text>inhibitor</text></arctype>)",
        R"(<arc id="a" source="p" target="t"><arctype>inhibitor</arctype>)"}) {
    const Net net = Parsed(Around(arc + "<inscription><text>2</text></inscription></arc>"));
    EXPECT_EQ(net.transitions[0],
              (petri::Transition{.id = "t", .inhibitors = {{.place = 0, .weight = 2}}}))
        << arc;
  }
  for (const std::string type : {R"(<type value="read"/>)", R"(<type value="test"/>)",
                                 R"(<arctype><text>read</text></arctype>)"}) {
    EXPECT_EQ(
        Parsed(Around("<arc id=\"a\" source=\"q\" target=\"t\">" + type + "</arc>")).transitions[0],
        (petri::Transition{.id = "t", .reads = {{.place = 1}}}));
  }
  EXPECT_EQ(Parsed(Around(R"(<arc id="a" source="p" target="t"><type value="normal"/></arc>)"))
                .transitions[0],
            (petri::Transition{.id = "t", .takes = {{.place = 0}}}));
}

TEST(Pnml, RefusesOtherKindsOfArcs) {
  EXPECT_EQ(ErrorOf(Around(R"(<arc id="a7" source="p" target="t">
<type value="reset"/></arc>)")),
            "a.pnml:7: found arc \"a7\" of the kind \"reset\", expected normal, read, test or "
            "inhibitor");
  EXPECT_EQ(ErrorOf(Around(R"(<arc id="a" source="p" target="t" type="transport"/>)")),
            "a.pnml:7: found arc \"a\" of the kind \"transport\", expected normal, read, test or "
            "inhibitor");
  EXPECT_EQ(
      ErrorOf(Around(R"(<arc id="a" source="p" target="t" type="timed" inscription="[2,5]"/>)")),
      "a.pnml:7: found arc \"a\" with the interval \"[2,5]\", expected a net without time");
  EXPECT_EQ(
      ErrorOf(Around(R"(<arc id="a" source="t" target="p" type="inhibitor"/>)")),
      "a.pnml:7: found arc \"a\" from a transition to a place, expected a place to a transition");
  EXPECT_EQ(ErrorOf(Around(R"(<arc id="a" source="p" target="q"/>)")),
            "a.pnml:7: found arc \"a\" from a place to a place, expected one of each");
  EXPECT_EQ(ErrorOf(Around(R"(<arc id="a" source="p" target="t" type="read">
<type value="inhibitor"/></arc>)")),
            "a.pnml:7: found arc \"a\" of two kinds, expected one of them");
}

TEST(Pnml, JoinsParallelArcs) {
  const Net net = Parsed(Around(R"(
      <arc id="a" source="p" target="t"/>
      <arc id="b" source="t" target="q"/>
      <arc id="c" source="p" target="t"><inscription><text>2</text></inscription></arc>
      <arc id="d" source="t" target="p"/>
      <arc id="e" source="q" target="t" type="inhibitor"><inscription><text>5</text></inscription></arc>
      <arc id="f" source="q" target="t" type="inhibitor"><inscription><text>3</text></inscription></arc>
      <arc id="g" source="q" target="t" type="read"/>
      <arc id="h" source="q" target="t" type="read"><inscription><text>2</text></inscription></arc>)"));
  EXPECT_EQ(net.transitions[0], (petri::Transition{.id = "t",
                                                   .takes = {{0, 3}},
                                                   .gives = {{1}, {0}},
                                                   .reads = {{1, 2}},
                                                   .inhibitors = {{1, 3}}}));
}

TEST(Pnml, UnderstandsPipe) {
  const Net net = Parsed(
      "<?xml version=\"1.0\" encoding=\"iso-8859-1\"?>\r\n<pnml>\n<net id=\"Net-One\" type=\"P/T "
      "net\">"
      R"(<token id="Default" enabled="true" red="0" green="0" blue="0"/>
      <place id="P0"><name><value>P)"
      "\xE4"
      R"(</value><graphics/></name><initialMarking><value>Default,2,Red,0</value></initialMarking>
        <capacity><value>0</value></capacity></place>
      <transition id="T0"><name><value>T0</value></name><rate><value>1.0</value></rate>
        <timed><value>false</value></timed><priority><value>1</value></priority></transition>
      <arc id="P0 to T0" source="P0" target="T0"><inscription><value>Default,2</value></inscription>
        <arcpath id="000" x="0" y="0" curvePoint="false"/><type value="normal"/></arc>
      <arc id="T0 to P0" source="T0" target="P0"><inscription><value/></inscription></arc>
      </net></pnml>)");
  EXPECT_EQ(
      net,
      (Net{.name = "Net-One",
           .places = {{.id = "P0", .name = "Pä", .tokens = 2}},
           .transitions = {{.id = "T0", .name = "T0", .takes = {{0, 2}}, .gives = {{0, 1}}}}}));
}

// What a transition says, on line 6, beside one that says nothing.
std::string OfTransition(const std::string& inside, const std::string& attributes = "") {
  return ErrorOf(Document("<place id=\"p\"/>\n\n<transition id=\"t\" " + attributes + ">" + inside +
                          "</transition>"));
}

TEST(Pnml, RefusesTimeThatWouldChangeTheAnswer) {
  const std::string tina =
      "<delay><interval xmlns=\"http://www.w3.org/1998/Math/MathML\" closure=\"closed-open\">"
      "<cn>0</cn><ci>infty</ci></interval></delay>";
  EXPECT_EQ(OfTransition(tina), "no error");
  std::string late = tina;
  late.replace(late.find("<cn>0"), 5, "<cn>2");
  EXPECT_EQ(
      OfTransition(late),
      "a.pnml:6: found transition \"t\" with the time \"2,infty\", expected a net without time");
  std::string soon = tina;
  soon.replace(soon.find("<ci>infty</ci>"), 14, "<cn>5</cn>");
  EXPECT_THAT(OfTransition(soon), HasSubstr("the time \"0,5\""));
  EXPECT_THAT(OfTransition("<delay><text>3</text></delay>"), HasSubstr("the time \"3\""));
  EXPECT_THAT(OfTransition("<time>[1,4]</time>"), HasSubstr("the time \"[1,4]\""));
  EXPECT_THAT(OfTransition("", R"(eft="1" lft="inf")"), HasSubstr("the time \"1\""));
  EXPECT_EQ(OfTransition("", R"(eft="0" lft="inf")"), "no error");
  EXPECT_EQ(OfTransition("<time><text>0</text></time>"), "no error");
}

TEST(Pnml, RefusesGuards) {
  EXPECT_EQ(
      OfTransition("", R"(guard="x &gt; 3")"),
      "a.pnml:6: found transition \"t\" with the guard \"x > 3\", expected a net without guards");
  EXPECT_THAT(OfTransition("<condition><text>x = y</text><structure/></condition>"),
              HasSubstr("the guard \"x = y\""));
  EXPECT_EQ(OfTransition("<guard><text>true</text></guard>"), "no error");
  EXPECT_EQ(OfTransition("<condition/>"), "no error");
}

TEST(Pnml, RefusesPrioritiesThatDiffer) {
  const auto two = [](const std::string& first, const std::string& second) {
    return ErrorOf(Document("<transition id=\"t\">" + first +
                            "</transition>\n<transition id=\"u\">" + second + "</transition>"));
  };
  const auto priority = [](const std::string& value) {
    return "<priority><value>" + value + "</value></priority>";
  };
  const auto timed = [](const std::string& value) {
    return "<timed><value>" + value + "</value></timed>";
  };
  EXPECT_EQ(
      two(priority("1"), priority("2")),
      "a.pnml:5: found transition \"u\" (priority 2) beside \"t\" (priority 1), expected a net "
      "without priorities: the same of all transitions");
  EXPECT_THAT(two("", priority("2")), HasSubstr("beside \"t\" (no priority)"));
  EXPECT_EQ(two(priority("7"), priority("7")), "no error");
  // PIPE fires immediate transitions before timed ones.
  EXPECT_THAT(two(timed("false"), timed("true")),
              HasSubstr("\"u\" (timed) beside \"t\" (immediate)"));
  EXPECT_EQ(two(timed("true") + "<rate><value>1.0</value></rate>",
                timed("true") + "<rate><value>9.0</value></rate>"),
            "no error");
}

TEST(Pnml, UnderstandsTapaal) {
  const Net net = Parsed(R"x(<pnml xmlns="http://www.informatik.hu-berlin.de/top/pnml/ptNetb">
      <net active="true" id="TAPN1" type="P/T net">
      <place id="P0" initialMarking="1" invariant="&lt; inf" name="P0"/>
      <transition id="T0" urgent="false"/>
      <arc id="A0" inscription="[0,inf)" source="P0" target="T0" type="timed" weight="3"/>
      <arc id="A1" inscription="2" source="T0" target="P0" type="normal"/></net></pnml>)x");
  EXPECT_EQ(net.places[0], (petri::Place{.id = "P0", .tokens = 1}));
  EXPECT_EQ(net.transitions[0],
            (petri::Transition{.id = "T0", .takes = {{0, 3}}, .gives = {{0, 2}}}));
}

TEST(Pnml, UnderstandsAnyPrefix) {
  const Net net = Parsed(
      R"(<p:pnml xmlns:p="http://www.pnml.org/version-2009/grammar/pnml">
      <p:net id="n" type="http://www.informatik.hu-berlin.de/top/pntd/ptNetb"><p:name><p:text>x</p:text>
      </p:name><p:place id="p"><p:initialMarking><p:text>2</p:text></p:initialMarking></p:place></p:net>
      </p:pnml>)");
  EXPECT_EQ(net, (Net{.name = "x", .places = {{.id = "p", .tokens = 2}}}));
}

TEST(Pnml, ReadsTheNetTypesOfPlaceTransitionNetsOnly) {
  for (const std::string type : {"http://www.pnml.org/version-2009/grammar/ptnet", "P/T net",
                                 "http://www.informatik.hu-berlin.de/top/pntd/ptNetb",
                                 "http://www.pnml.org/version-2009/extensions/inhibitorptnet",
                                 "http://www.pnml.org/version-2009/grammar/pnmlcoremodel"}) {
    EXPECT_EQ(ErrorOf(Document("", type)), "no error") << type;
  }
  EXPECT_EQ(ErrorOf(Document("", "http://www.pnml.org/version-2009/grammar/symmetricnet")),
            "a.pnml:3: found a net of the type "
            "\"http://www.pnml.org/version-2009/grammar/symmetricnet\", "
            "expected a P/T net: http://www.pnml.org/version-2009/grammar/ptnet");
  EXPECT_THAT(ErrorOf("<pnml><net id='n'/></pnml>"), HasSubstr("found a net without a type"));
}

TEST(Pnml, RefusesNumbersThatAreNone) {
  const auto marking = [](const std::string& text) {
    return ErrorOf(Document("<place id=\"p\"><initialMarking><text>" + text +
                            "</text></initialMarking></place>"));
  };
  for (const std::string text : {"-1", "1000000001", "99999999999999999999", "2.5", "two", "1 2",
                                 "Red,1", "Default,1,Red,1", "Default", "+1", "0x1", "&bomb;"}) {
    EXPECT_EQ(marking(text), "a.pnml:4: found place \"p\" with the initial marking \"" + text +
                                 "\", expected 0 to 1000000000 tokens of one kind");
  }
  EXPECT_EQ(marking("1000000000"), "no error");
  EXPECT_EQ(ErrorOf(Around("<arc id=\"a\" source=\"p\" target=\"t\">\n<inscription><text>0</text>"
                           "</inscription></arc>")),
            "a.pnml:7: found arc \"a\" with the weight \"0\", expected 1 to 1000000000");
  const std::string half =
      "\" source=\"t\" target=\"p\"><inscription><text>500000001</text></inscription></arc>";
  EXPECT_EQ(ErrorOf(Around("<arc id=\"a" + half + "\n<arc id=\"b" + half)),
            "a.pnml:8: found arc \"b\", with which parallel ones have the weight 1000000002, "
            "expected at most 1000000000");
  EXPECT_EQ(
      ErrorOf(Document("<place id='p'><capacity><value>3</value></capacity></place>")),
      "a.pnml:4: found place \"p\" with the capacity \"3\", expected places without a capacity");
}

TEST(Pnml, RefusesIdsThatAreNotUnique) {
  EXPECT_EQ(ErrorOf(Around("\n<transition id=\"p\"/>")),
            "a.pnml:8: found the ID \"p\" of another element, expected one that is unique in the "
            "document");
  EXPECT_THAT(ErrorOf(Document("<place/>")), HasSubstr("found <place> without an ID"));
}

// As WoPeD writes them.
TEST(Pnml, WarnsOfArcsWhoseIdsAreNotUnique) {
  std::string warning;
  const auto net = [&](const std::string& arcs) {
    Result<Net> read = ParsePnml("a.pnml", Around(arcs), &warning);
    EXPECT_TRUE(read.ok()) << read.error();
    return std::move(read).value();
  };
  net(R"(<arc id="a" source="p" target="t"/><arc id="b" source="t" target="q"/>)");
  EXPECT_EQ(warning, "");
  const Net same = net(R"(<arc id="a" source="p" target="t"/><arc id="a" source="t" target="q"/>)");
  EXPECT_EQ(same.transitions[0], (petri::Transition{.id = "t", .takes = {{0}}, .gives = {{1}}}));
  EXPECT_EQ(warning,
            "a.pnml: 1 arc has the ID of another element, such as \"a\": each is an arc of its "
            "own");
  net(R"(<arc id="p" source="p" target="t"/><arc id="n" source="t" target="q"/>)");
  EXPECT_EQ(warning,
            "a.pnml: 2 arcs have the ID of another element, such as \"p\": each is an arc of "
            "its own");
}

TEST(Pnml, ReadsOneNetOnly) {
  EXPECT_EQ(ErrorOf("<pnml>\n<net id='a' type='P/T net'/>\n<net id='b' type='P/T net'/></pnml>"),
            "a.pnml:3: found 2 nets: \"a\", \"b\", expected one");
  EXPECT_EQ(ErrorOf("<pnml/>"), "a.pnml:1: found 0 nets, expected one");
}

TEST(Pnml, SkipsAByteOrderMark) {
  EXPECT_EQ(Parsed("\xEF\xBB\xBF" + Document("<place id=\"p\"/>")).places.size(), 1u);
}

TEST(Pnml, SaysWhereXmlIsWrong) {
  EXPECT_EQ(ErrorOf("<pnml>\n<net></page></pnml>"),
            "a.pnml:2: found \"page></pnml>\", expected XML (Start-end tags mismatch)");
  EXPECT_EQ(ErrorOf(""), "a.pnml:1: found \"\", expected XML (No document element found)");
  EXPECT_EQ(ErrorOf("<svg/>"), "a.pnml:1: found <svg>, expected the root element <pnml>");
  EXPECT_EQ(ErrorOf("<pnml>\n\xE4</pnml>"),
            "a.pnml:2: found byte 7, expected text in UTF-8, or ISO-8859-1 if it says so");
  std::string deep;
  for (int i = 0; i < 66; ++i) {
    deep += "<page id=\"d" + std::to_string(i) + "\">";
  }
  std::string ends;
  for (int i = 0; i < 66; ++i) {
    ends += "</page>";
  }
  EXPECT_EQ(ErrorOf(Document(deep + ends)),
            "a.pnml:4: found pages nested too deep, expected at most 64");
}

// "Billion laughs": entities of a DTD are left as they are, not expanded.
TEST(Pnml, ExpandsNoEntities) {
  const Net net = Parsed(R"(<?xml version="1.0"?>
      <!DOCTYPE pnml [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;"><!ENTITY c SYSTEM "file:///etc/passwd">]>
      <pnml><net id="n" type="P/T net"><name><text>&b;&c;&#65;</text></name></net></pnml>)");
  EXPECT_EQ(net.name, "&b;&c;A");
}

TEST(Pnml, WritesTheStandardIfItCan) {
  const Net net{.name = "a<b",
                .places = {{.id = "p", .name = "P", .tokens = 2}, {.id = "q"}},
                .transitions = {{.id = "t", .takes = {{0, 2}}, .gives = {{1}}}}};
  EXPECT_EQ(ToPnml(net), R"(<?xml version="1.0" encoding="UTF-8"?>
<pnml xmlns="http://www.pnml.org/version-2009/grammar/pnml">
  <net id="net" type="http://www.pnml.org/version-2009/grammar/ptnet">
    <name><text>a&lt;b</text></name>
    <page id="page">
      <place id="p">
        <name><text>P</text></name>
        <initialMarking><text>2</text></initialMarking>
      </place>
      <place id="q">
      </place>
      <transition id="t">
      </transition>
      <arc id="a1" source="p" target="t"><inscription><text>2</text></inscription></arc>
      <arc id="a2" source="t" target="q"/>
    </page>
  </net>
</pnml>
)");
}

TEST(Pnml, WritesWhatHasNoPlaceInTheStandardAsToolSpecific) {
  const Net net{.name = "n",
                .places = {{.id = "a b", .box = "go", .owner = "robot", .tag = "7"}, {.id = "a_b"}},
                .transitions = {{.id = "net", .reads = {{0}}, .inhibitors = {{1, 2}}}},
                .claims = {{.id = "c", .text = "always a_b <= 1"}}};
  const std::string text = ToPnml(net);
  EXPECT_THAT(text, HasSubstr(R"(
      <claim identifier="c" text="always a_b &lt;= 1"/>)"));
  EXPECT_THAT(text, HasSubstr(R"(
      <place id="a_b_1">
        <toolspecific tool="pheromone" version="1">
          <properties identifier="a b" box="go" owner="robot" tag="7"/>
        </toolspecific>
      </place>
      <place id="a_b">)"));
  EXPECT_THAT(text, HasSubstr(R"(
      <arc id="a1" source="a_b_1" target="net"><type value="read"/></arc>
      <arc id="a2" source="a_b" target="net"><type value="inhibitor"/><inscription>)"));
  EXPECT_THAT(text, HasSubstr("<net id=\"net_1\""));
  EXPECT_EQ(Parsed(text), net);
}

TEST(Pnml, RefusesToolSpecificDataOfAnotherVersion) {
  EXPECT_EQ(ErrorOf(Document(R"(<place id="p"><toolspecific tool="other" version="2"/>
<toolspecific tool="pheromone" version="2"/></place>)")),
            "a.pnml:5: found <toolspecific> of version \"2\", expected version 1");
}

TEST(Pnml, ReadsBackWhatItWrites) {
  std::mt19937 random(1);
  for (int i = 0; i < 3000; ++i) {
    const Net net = WithRandomTexts(RandomNet(&random), &random);
    ASSERT_TRUE(CheckNet(net).ok());
    ASSERT_EQ(Parsed(ToPnml(net)), net);
  }
}

}  // namespace
}  // namespace pheromone::nets
