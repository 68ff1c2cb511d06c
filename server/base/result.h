// Errors are values. A function that can fail for reasons outside of the program returns a Result:
// either the value or a message to act on (what, where, what was expected).
//
//   Result<Config> config = LoadConfig(path);
//   if (!config.ok()) { std::cerr << config.error() << '\n'; return 2; }
//   Use(config.value());
//
// A function that hands errors of others on:
//
//   Result<Plan> ReadPlan(const std::string& path) {
//     PHEROMONE_TRY(const std::string text, ReadFile(path));
//     PHEROMONE_TRY_STATUS(CheckPlan(text));
//     return ParsePlan(text);
//   }
//
// Calling value() of a failed Result, or error() of a good one, is a bug and asserts.
#pragma once

#include <cassert>
#include <iosfwd>
#include <string>
#include <utility>
#include <variant>

namespace pheromone {

/// The message. A type of its own, so that a Result of a text tells it from a value.
class Error : public std::string {
 public:
  explicit Error(std::string message) : std::string(std::move(message)) {}
};

/// For GoogleTest, which would list its characters.
void PrintTo(const Error& error, std::ostream* out);

template <typename T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}      // NOLINT
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT

  bool ok() const { return state_.index() == 0; }

  const T& value() const& {
    assert(ok());
    return *std::get_if<0>(&state_);
  }
  T& value() & {
    assert(ok());
    return *std::get_if<0>(&state_);
  }
  T&& value() && {
    assert(ok());
    return std::move(*std::get_if<0>(&state_));
  }

  /// Every Result can be made of it: `return other.error();`
  const Error& error() const {
    assert(!ok());
    return *std::get_if<1>(&state_);
  }
  /// The error as text, or `good` if there is none.
  std::string ErrorOr(std::string good) const {
    return ok() ? std::move(good) : std::string(error());
  }

 private:
  std::variant<T, Error> state_;
};

/// The result of an operation without a value.
using Status = Result<std::monostate>;

inline Status Ok() {
  return Status(std::monostate{});
}

}  // namespace pheromone

#define PHEROMONE_JOIN_AGAIN(a, b) a##b
#define PHEROMONE_JOIN(a, b) PHEROMONE_JOIN_AGAIN(a, b)

#define PHEROMONE_TRY_AS(result, declaration, ...) \
  auto result = (__VA_ARGS__);                     \
  if (!result.ok()) {                              \
    return result.error();                         \
  }                                                \
  declaration = std::move(result).value()

/// Declares a variable with the value of a Result, or returns its error from the function around
/// it. Two statements: it needs braces around it. A declaration whose type has a comma says `auto`.
#define PHEROMONE_TRY(declaration, ...) \
  PHEROMONE_TRY_AS(PHEROMONE_JOIN(tried_, __LINE__), declaration, __VA_ARGS__)

/// Returns the error of a Status, or of a Result whose value is not needed.
#define PHEROMONE_TRY_STATUS(...)                        \
  do {                                                   \
    if (const auto tried = (__VA_ARGS__); !tried.ok()) { \
      return tried.error();                              \
    }                                                    \
  } while (false)
