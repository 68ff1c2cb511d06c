// Checks of numbers on the command line, for CLI11, with the usual form of error messages:
//
//   command->add_option("--radius", radius_m)->check(Number(0, 1000));
//   // --radius: found "nan", expected a number from 0 to 1000
//
// CLI11's own CLI::Range accepts "nan", and without any check "inf" is accepted too: neither can be
// written in JSON.
#pragma once

#include <cstdint>

#include <CLI/CLI.hpp>

namespace pheromone::ctl {

/// Largest absolute coordinate that the server accepts, in metres.
constexpr double kFarthestM = 1e6;

/// A finite number, bounds included.
CLI::Validator Number(double least, double most);
CLI::Validator WholeNumber(int64_t least, int64_t most);

}  // namespace pheromone::ctl
