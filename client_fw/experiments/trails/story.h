// The story that the paper tells of the pheromone tag (Ferreira, Tavares and Silva 2018, Fig. 5),
// told by the real engine: seven robots, of which 1 to 4 come home and 5 to 7 leave. Only their
// timing is given here; concentrations and advice are the engine's.
//
//   Result<TrailsStory> story = TellStory(bench);
//   SamplesToCsv(story.value().samples);            // report.h
//
// Until T1 no robot has come home: advice 00, and robot 5 takes any trail. At T1 robot 1 stores A,
// and robot 6 is sent along A. At T2 robot 3 has stored B after robot 2, and robot 7 is sent along
// B. At T3 robot 4 has stored A. At T4 both trails have evaporated: 00 again.
//
// Pure; any thread.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client_fw/experiments/trails/bench.h"
#include "client_fw/experiments/trails/run.h"
#include "server/base/result.h"

namespace pheromone::swarm {

struct StoryMark {
  int64_t time_ms = 0;
  std::string label;       ///< "T1", or what a robot does
  bool is_change = false;  ///< of the advice
};

struct TrailsStory {
  std::vector<TrailsSample> samples;
  std::vector<StoryMark> marks;
};

/// Errors: those of ConfigWith; a step that the net does not permit.
Result<TrailsStory> TellStory(const TrailsBench& bench);

}  // namespace pheromone::swarm
