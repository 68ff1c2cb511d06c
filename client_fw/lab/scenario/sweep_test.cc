#include "client_fw/lab/scenario/sweep.h"

#include <gtest/gtest.h>

#include <string>

namespace pheromone::lab {
namespace {

std::vector<std::string> CommandsOf(const std::string& text, const std::string& summary = "") {
  const Result<std::vector<SweepRun>> runs =
      RunsOf(config::ParseDocument(text, "a b.toml").value(), "a b.toml");
  if (!runs.ok()) {
    return {runs.error()};
  }
  std::vector<std::string> commands;
  for (const SweepRun& run : runs.value()) {
    commands.push_back(CommandOf(run, "a b.toml", summary));
  }
  return commands;
}

TEST(Sweep, HasACommandForEachCombinationAndSeed) {
  EXPECT_EQ(CommandsOf("[sweep]\nseeds = 2\n\"robots[1].count\" = [5, 10]\n"
                       "robots.parameters.home = [\"bearing\"]\n",
                       "runs.csv"),
            (std::vector<std::string>{
                "pheromone-swarm lab run 'a b.toml' --set 'robots.parameters.home=\"bearing\"' "
                "--set 'robots[1].count=5' --seed 1 --summary runs.csv",
                "pheromone-swarm lab run 'a b.toml' --set 'robots.parameters.home=\"bearing\"' "
                "--set 'robots[1].count=5' --seed 2 --summary runs.csv",
                "pheromone-swarm lab run 'a b.toml' --set 'robots.parameters.home=\"bearing\"' "
                "--set 'robots[1].count=10' --seed 1 --summary runs.csv",
                "pheromone-swarm lab run 'a b.toml' --set 'robots.parameters.home=\"bearing\"' "
                "--set 'robots[1].count=10' --seed 2 --summary runs.csv"}));
  EXPECT_EQ(CommandsOf("[sweep]\nseeds = [7, 9]\n"),
            (std::vector<std::string>{"pheromone-swarm lab run 'a b.toml' --seed 7",
                                      "pheromone-swarm lab run 'a b.toml' --seed 9"}));
}

TEST(Sweep, AMistakeIsTold) {
  EXPECT_EQ(CommandsOf("[run]\nseed = 1\n")[0],
            "a b.toml:1:1: sweep: missing, expected a table [sweep]");
  EXPECT_EQ(CommandsOf("[sweep]\n\"robots.count\" = 5\n")[0],
            "a b.toml:2:18: sweep.robots.count: found 5, expected an array of the values that it "
            "takes");
  EXPECT_EQ(CommandsOf("[sweep]\nseeds = [-1]\n")[0],
            "a b.toml:2:10: sweep.seeds: found -1, expected whole numbers from 0 up, or how many "
            "seeds");
  EXPECT_EQ(
      CommandsOf("[sweep]\nseeds = []\n")[0],
      "a b.toml:2:9: sweep.seeds: found an array of 0, expected at least one seed, or how many");
}

}  // namespace
}  // namespace pheromone::lab
