// The cases of the benchmark. A case is a loop over one operation; Google Benchmark runs and times
// it, tables.h compares the times.
//
// Maps are kept between cases that follow each other and need the same one; so the order of the
// cases matters for the time that it takes, and for nothing else.
#pragma once

#include <benchmark/benchmark.h>

#include <functional>
#include <string>
#include <vector>

#include "server/core/field/bench/results.h"

namespace pheromone::field::bench {

struct Case {
  CaseKey key;
  std::function<void(benchmark::State&)> run;
  double operations = 1;   ///< in one iteration: what its time is divided by
  bool wall_time = false;  ///< instead of the time of the thread's processor
  /// Of each repetition. For the field so long that a case meets more than a million poses.
  double seconds = 0.02;
};

// Groups and variants, as tables and pictures look for them.
inline constexpr const char* kQuery = "query";
inline constexpr const char* kOption = "option";
inline constexpr const char* kDeposit = "deposit";
inline constexpr const char* kRobotStep = "robot-step";
inline constexpr const char* kReaders = "readers";
inline constexpr const char* kMachine = "machine";
inline constexpr const char* kDiffusion = "diffusion";

inline constexpr const char* kField = "field";
inline constexpr const char* kLiteralScan = "literal scan";
inline constexpr const char* kWideScan = "SIMD scan";
inline constexpr const char* kSkippingScan = "SIMD scan, skipping";
inline constexpr const char* kMemoryBound = "memory bound";
inline constexpr const char* kDenseSweep = "dense sweep";
inline constexpr const char* kStencil = "5-point stencil";
inline constexpr const char* kWithObstacles = "field, obstacles";
inline constexpr const char* kOneThread = "one thread";
inline constexpr const char* kTwoThreads = "two threads";

/// How long a repetition of a case with the real field lasts.
inline constexpr double kFieldSeconds = 0.1;

/// The case with which the goals are stated, and to which options are compared.
inline constexpr MapSpec kStandardMap = {.nodes = 1000, .density_percent = 10};
inline constexpr int kStandardReach = 10;

/// One answer for both antennas, from another random place each time; and what memory alone asks.
std::vector<Case> QueryCases();
/// The same with other laws and with the loops for other processors.
std::vector<Case> OptionCases();
/// A deposit alone, readers beside a writer, and what else is measured by itself.
std::vector<Case> SingleCases();
/// Deposit, answer and the share of evaporation, with robots that drive about.
std::vector<Case> RobotStepCases();

}  // namespace pheromone::field::bench
