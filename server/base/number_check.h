// Checks of numbers on the command line, for CLI11, with the usual form of error messages:
//
//   command->add_option("--radius", radius_m)->check(Number(0, 1000));
//   // --radius: found "nan", expected a number from 0 to 1000
//
// CLI11's own CLI::Range accepts "nan", and without any check "inf" is accepted too: neither can be
// written in JSON, and no robot can drive as fast.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>

namespace pheromone {

/// Largest absolute coordinate that the server accepts, in metres.
constexpr double kFarthestM = 1e6;

template <typename T>
CLI::Validator NumberBetween(T least, T most, std::string_view kind) {
  const std::string expected = fmt::format("a {} from {} to {}", kind, least, most);
  return {[=](std::string& text) {
            T value{};
            // So written, "nan" is outside.
            const bool good =
                CLI::detail::lexical_cast(text, value) && value >= least && value <= most;
            return good ? std::string() : fmt::format("found \"{}\", expected {}", text, expected);
          },
          fmt::format("{} to {}", least, most)};
}

/// A finite number, bounds included.
inline CLI::Validator Number(double least, double most) {
  return NumberBetween(least, most, "number");
}
inline CLI::Validator WholeNumber(int64_t least, int64_t most) {
  return NumberBetween(least, most, "whole number");
}

}  // namespace pheromone
