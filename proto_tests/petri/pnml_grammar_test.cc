// That what we write is PNML by the grammar of the standard, whatever names a net has; and that the
// grammar in ptnet.rng would not let everything pass.

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <utility>
#include <vector>

#include "proto_tests/petri/contest_nets.h"
#include "server/formats/nets/core_net.h"
#include "server/formats/nets/pnml.h"
#include "server/formats/nets/testing/random_net.h"

namespace pheromone::nets {
namespace {

using petri::Net;

// What xmllint says of the documents a0.pnml, a1.pnml ...
std::string Validated(const std::vector<std::string>& documents) {
  const TemporaryFolder folder;
  std::string files;
  for (const std::string& document : documents) {
    const std::string name = "a" + std::to_string(&document - documents.data()) + ".pnml";
    EXPECT_TRUE(WriteFile(folder / name, document).ok());
    files += " " + name;
  }
  return OutputOf("xmllint --noout --relaxng " PHEROMONE_SOURCE_DIR "/proto_tests/petri/ptnet.rng" +
                      files + " || true",
                  folder);
}

std::string AllValid(size_t documents) {
  std::string said;
  for (size_t i = 0; i < documents; ++i) {
    said += "a" + std::to_string(i) + ".pnml validates\n";
  }
  return said;
}

TEST(PnmlGrammar, AllowsWhatWeWriteForToolsThatKnowTheCore) {
  std::mt19937 random(11);
  std::vector<std::string> documents = {ToPnml(ContestNet("kanban", 1))};
  while (documents.size() < 200) {
    const Net net = WithRandomTexts(RandomNet(&random), &random);
    const Result<Net> core = CoreNet(net, std::vector<uint32_t>(net.places.size(), 9));
    ASSERT_TRUE(core.ok()) << core.error();
    documents.push_back(ToPnml(core.value()));
  }
  EXPECT_EQ(Validated(documents), AllValid(documents.size()));
}

TEST(PnmlGrammar, AllowsTheContestsNets) {
  const std::vector<std::string> documents = {MakeNets("kanban 1"), MakeNets("fms 2"),
                                              MakeNets("token_ring 3")};
  EXPECT_EQ(Validated(documents), AllValid(documents.size()));
}

TEST(PnmlGrammar, RefusesMistakes) {
  const std::string good = ToPnml({.name = "n",
                                   .places = {{.id = "p", .tokens = 2}, {.id = "q"}},
                                   .transitions = {{.id = "t", .takes = {{0, 3}}}}});
  EXPECT_EQ(Validated({good}), AllValid(1));
  for (const auto& [wanted, instead] : std::vector<std::pair<std::string, std::string>>{
           {"id=\"q\"", "id=\"p\""},
           {"id=\"q\"", ""},
           {"id=\"q\"", "id=\"q r\""},
           {"source=\"p\"", "source=\"r\""},
           {"<text>2<", "<text>-2<"},
           {"<text>3<", "<text>0<"},
           {"<inscription>", "<type value=\"inhibitor\"/><inscription>"},
           {"grammar/ptnet\"", "grammar/symmetricnet\""},
           {"<page id=\"page\">", "<page>"}}) {
    std::string bad = good;
    const size_t at = bad.find(wanted);
    ASSERT_NE(at, std::string::npos) << wanted;
    bad.replace(at, wanted.size(), instead);
    EXPECT_NE(Validated({bad}).find("a0.pnml fails to validate"), std::string::npos) << bad;
  }
}

}  // namespace
}  // namespace pheromone::nets
