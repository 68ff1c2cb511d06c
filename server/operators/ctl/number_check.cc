#include "server/operators/ctl/number_check.h"

#include <fmt/format.h>

#include <string>
#include <string_view>

namespace pheromone::ctl {
namespace {

template <typename T>
CLI::Validator Between(T least, T most, std::string_view kind) {
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

}  // namespace

CLI::Validator Number(double least, double most) {
  return Between(least, most, "number");
}

CLI::Validator WholeNumber(int64_t least, int64_t most) {
  return Between(least, most, "whole number");
}

}  // namespace pheromone::ctl
