// Errors are values. A function that can fail for reasons outside of the program returns a Result:
// either the value or a message to act on (what, where, what was expected).
//
//   Result<Config> config = LoadConfig(path);
//   if (!config.ok()) { std::cerr << config.error() << '\n'; return 2; }
//   Use(config.value());
//
// Calling value() of a failed Result, or error() of a good one, is a bug and asserts.
#pragma once

#include <cassert>
#include <string>
#include <utility>
#include <variant>

namespace pheromone {

struct Error {
  std::string message;
};

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

  const std::string& error() const {
    assert(!ok());
    return std::get_if<1>(&state_)->message;
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
