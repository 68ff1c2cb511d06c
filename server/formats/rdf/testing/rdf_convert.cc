// For rdf_test.py: blocks as lines of text to files of RDF, and back.
//
//   rdf_convert write FOLDER < LINES     writes FOLDER/tags.nt, tags.ttl and tags.rdf
//   rdf_convert read FILE NUMBER NAME    with the name of one tag: prints each fact as a sentence,
//   after its tag, its robot's
//                                        unique ID and its time, with tabs between them
//
// Lines: "robot NUMBER ID", "string ROBOT NUMBER TEXT", "mapping ROBOT OWNER", "name NUMBER NAME"
// of a tag, "block TAG" with eight words.
#include <cstdio>
#include <iostream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "server/formats/rdf/lexical.h"
#include "server/formats/rdf/rdf_file.h"
#include "server/formats/rdf/sentence.h"

namespace pheromone::ctl {
namespace {

int Failed(const std::string& error) {
  std::cerr << error << '\n';
  return 1;
}

std::string Rest(std::istream& line) {
  std::string text;
  std::getline(line >> std::ws, text);
  return text;
}

int Write(const std::string& folder) {
  tags::SymbolTables tables;
  tags::Naming naming;
  std::vector<tags::TagBlock> blocks;
  for (std::string text; std::getline(std::cin, text);) {
    std::istringstream line(text);
    std::string kind;
    int32_t robot = 0;
    int32_t number = 0;
    line >> kind;
    auto outcome = tags::DefineOutcome::kDone;
    if (kind == "robot") {
      line >> robot;
      outcome = tables.DefineRobot(robot, Rest(line));
    } else if (kind == "string") {
      line >> robot >> number;
      outcome = tables.DefineString(robot, number, Rest(line));
    } else if (kind == "mapping") {
      line >> robot >> number;
      outcome = tables.DefineMapping(robot, number);
    } else if (kind == "name") {
      line >> number;
      naming.tags.Add(number, Rest(line));
    } else {
      tags::Words words{};
      std::string tag;
      line >> tag;
      for (int32_t& word : words) {
        line >> word;
      }
      blocks.push_back({tag, tags::BlockFromWords(words)});
    }
    if (line.fail() || outcome != tags::DefineOutcome::kDone) {
      return Failed("found \"" + text + "\"");
    }
  }
  const Result<tags::Facts> facts = tags::FactsOf(blocks, tables, naming);
  if (!facts.ok()) {
    return Failed(facts.error());
  }
  for (const char* const name : {"/tags.nt", "/tags.ttl", "/tags.rdf"}) {
    if (const Status saved = SaveRdf(folder + name, facts.value().facts, naming); !saved.ok()) {
      return Failed(saved.error());
    }
  }
  return 0;
}

int Read(const std::string& path, const std::string& number, const std::string& name) {
  tags::Naming naming;
  naming.tags.Add(tags::ParseInt(number).value_or(1), name);
  tags::SymbolTables tables;
  const Result<RdfContents> read = LoadRdf(path, std::nullopt, naming);
  if (!read.ok()) {
    return Failed(read.error());
  }
  const Result<std::vector<tags::TagBlock>> blocks =
      tags::BlocksOf(read.value().facts, naming, &tables);
  if (!blocks.ok()) {
    return Failed(blocks.error());
  }
  for (const auto& [tag, block] : blocks.value()) {
    std::cout << tag << '\t' << *tables.UniqueIdOf(block.author) << '\t'
              << tags::DateTimeText(block.time_s) << '\t' << tags::SentenceOf(block, tables)
              << '\n';
  }
  return 0;
}

}  // namespace
}  // namespace pheromone::ctl

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.size() == 2 && arguments[0] == "write") {
    return pheromone::ctl::Write(arguments[1]);
  }
  if (arguments.size() == 4 && arguments[0] == "read") {
    return pheromone::ctl::Read(arguments[1], arguments[2], arguments[3]);
  }
  std::fputs("usage: rdf_convert write FOLDER | rdf_convert read FILE NUMBER NAME\n", stderr);
  return 2;
}
