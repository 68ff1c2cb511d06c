// What is asked of a floor, and what the checkers of client_fw/verify answer: the two queries of
// Tammet, Vain and Kuusik 2006, section 4.5, and what follows for all time.
//
//   for (const ProofQuestion& question : ProofQuestions(floor)) {
//     const ProofAnswer answer = Answer(floor, question, search);
//     fmt::print("{}: {}\n", Claim(floor, question), Outcome(answer));
//   }
//
// Pure; a search at a time for each thread.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "client_fw/experiments/cleaning/floor.h"
#include "client_fw/verify/cleaning_check.h"

namespace pheromone::swarm {

enum class ProofKind {
  kClean,      ///< from dirty, all zones are eventually clean: the paper's first query
  kBounded,    ///< all zones stay below the limit until the horizon: the second
  kForgotten,  ///< for all time: robots never meet, and no zone is forgotten
  kForEver,    ///< all zones stay below the limit
  kCrash,      ///< kForgotten, if a robot breaks down at any time
};

struct ProofQuestion {
  ProofKind kind = ProofKind::kClean;
  std::string_view name;  ///< on the command line and in files
};

/// All; kCrash only where a robot is left.
std::vector<ProofQuestion> ProofQuestions(const CleaningFloor& floor);

struct ProofAnswer {
  ProofQuestion question;
  verify::CleaningResult result;
  double seconds = 0;  ///< what it took, if the caller measures it
};

/// `forgotten`, if it was asked before: its answer, on which that for ever rests.
ProofAnswer Answer(const CleaningFloor& floor, const ProofQuestion& question,
                   const verify::SearchLimits& search, const ProofAnswer* forgotten = nullptr);

/// What was asked: "from 80 % all zones are below 30 %".
std::string Claim(const CleaningFloor& floor, const ProofQuestion& question);

/// The verdict and its figure: "proved: at the latest after 101 units".
std::string Outcome(const ProofAnswer& answer);

/// A header line, then a line for each answer: the verdict, the longest time in units, the
/// highest soil in %, the zone that it is of, and the size of the search.
std::string AnswersToCsv(const std::vector<ProofAnswer>& answers);

/// A line for each zone: the longest gap in units, and the highest soil in %, where these were
/// proved.
std::string ProvedZonesToCsv(const CleaningFloor& floor, const std::vector<ProofAnswer>& answers);

}  // namespace pheromone::swarm
