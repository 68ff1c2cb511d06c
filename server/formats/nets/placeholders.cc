#include "server/formats/nets/placeholders.h"

#include <charconv>
#include <cstddef>
#include <optional>

#include "server/base/text.h"

namespace pheromone::nets {
namespace {

constexpr int64_t kMaxAddend = 1'000'000'000;

std::optional<int64_t> AddendOf(std::string_view text) {
  int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool good = error == std::errc() && end == text.data() + text.size() && number >= 0 &&
                    number <= kMaxAddend;
  return good ? std::optional(number) : std::nullopt;
}

// What stands for the text between two braces.
Result<std::string> FillInOne(std::string_view inside, const Parameters& parameters,
                              std::string_view as) {
  if (inside == "as") {
    return std::string(as);
  }
  const size_t sign = inside.find_first_of("+-");
  const auto found = parameters.find(Trim(inside.substr(0, sign), " "));
  const std::optional<int64_t> addend =
      sign == std::string_view::npos ? 0 : AddendOf(Trim(inside.substr(sign + 1), " "));
  if (found == parameters.end() || !addend) {
    return Error{"found \"{" + std::string(inside) +
                 "}\", expected a parameter in the braces, such as {robots} or {robots - 1}; "
                 "parameters: " +
                 NamesOf(parameters)};
  }
  const bool minus = sign != std::string_view::npos && inside[sign] == '-';
  return std::to_string(minus ? found->second - *addend : found->second + *addend);
}

}  // namespace

Result<std::string> FillIn(std::string_view text, const Parameters& parameters,
                           std::string_view as) {
  std::string filled;
  while (true) {
    const size_t open = text.find('{');
    filled += text.substr(0, open);
    if (open == std::string_view::npos) {
      return filled;
    }
    const size_t close = text.find('}', open);
    if (close == std::string_view::npos) {
      return Error{"found \"{\" without \"}\", expected a parameter in braces"};
    }
    PHEROMONE_TRY(std::string one,
                  FillInOne(text.substr(open + 1, close - open - 1), parameters, as));
    filled += one;
    text.remove_prefix(close + 1);
  }
}

std::string NamesOf(const Parameters& parameters) {
  std::string names;
  for (const auto& [name, value] : parameters) {
    names += (names.empty() ? "" : ", ") + name;
  }
  return names.empty() ? "none" : names;
}

}  // namespace pheromone::nets
