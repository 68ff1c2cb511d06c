// Messages as text, and from the vectors, by the lists of their fields. Host only.
//
//   EXPECT_EQ(decoded, sent);                      // prints "HELLO id=7 nonce=42 ..."
//   WithMessage(vector, [](const auto& message) { ... });
#pragma once

#include <cstdint>
#include <limits>
#include <ostream>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "protocol/fields.h"
#include "protocol/testing/vectors.h"

namespace pheromone::testing {

struct TextSink {
  template <typename Field>
  void Add(const char* name, Field field) {
    text += std::string(" ") + name + "=" + std::to_string(static_cast<int64_t>(field));
  }

  std::string text;
};

/// "HELLO id=7 nonce=42 ..."
template <typename M>
std::string TextOf(const M& message) {
  TextSink sink{NameOf(message)};
  protocol::ForEachField(message, &sink);
  return sink.text;
}

/// Compares a name with those of a message.
class NameMatcher : public protocol::IgnoresHeader<NameMatcher>,
                    public protocol::IgnoresData<NameMatcher> {
 public:
  explicit NameMatcher(const std::string& name, bool it_matches = false)
      : matches(it_matches), name_(name) {}

  NameMatcher Opcode(const char* name, uint8_t /*opcode*/) const {
    return NameMatcher(name_, name_ == name);
  }
  NameMatcher Opcode(const char* /*flag_name*/, const bool& /*flag*/, const char* name,
                     uint8_t /*opcode*/, const char* name_if_set, uint8_t /*opcode_if_set*/) const {
    return NameMatcher(name_, name_ == name || name_ == name_if_set);
  }
  NameMatcher Typed(const uint8_t& /*type*/, const char* name, unsigned /*service*/) const {
    return NameMatcher(name_, name_ == name);
  }
  NameMatcher Typed(const uint8_t& /*type*/, const bool& /*wide*/, const char* name,
                    unsigned /*service*/, const char* wide_name, unsigned /*wide_service*/) const {
    return NameMatcher(name_, name_ == name || name_ == wide_name);
  }

  bool matches;

 private:
  const std::string& name_;
};

/// Reads a vector's fields into a message, each once. Throws std::runtime_error for a field that is
/// missing, out of range or unknown to the message.
class VectorReader {
 public:
  explicit VectorReader(const FieldsVector& vector) : vector_(vector) {}

  VectorReader& Id(uint8_t& id) { return Field("id", id); }
  VectorReader& ToAll() {
    Require(Number("id") == protocol::kBroadcastId, "id", "is not 255");
    return *this;
  }
  VectorReader& Opcode(const char* /*name*/, uint8_t /*opcode*/) { return *this; }
  VectorReader& Opcode(const char* /*flag_name*/, bool& flag, const char* /*name*/,
                       uint8_t /*opcode*/, const char* name_if_set, uint8_t /*opcode_if_set*/) {
    flag = vector_.message == name_if_set;
    return *this;
  }
  VectorReader& Typed(uint8_t& type, const char* /*name*/, unsigned /*service*/) {
    return Field("type", type);
  }
  VectorReader& Typed(uint8_t& type, bool& wide, const char* /*name*/, unsigned /*service*/,
                      const char* wide_name, unsigned /*wide_service*/) {
    wide = vector_.message == wide_name;
    return Field("type", type);
  }
  template <typename Value>
  VectorReader& Field(const char* name, Value& field) {
    Set(name, Number(name), &field);
    return *this;
  }
  VectorReader& Coordinate(const char* name, int32_t& field, const bool& /*wide*/) {
    return Field(name, field);
  }
  // Their arrays say how many there are.
  VectorReader& Nibbles(const char* /*high*/, uint8_t& /*high*/, const char* /*low*/,
                        uint8_t& /*low*/) {
    return *this;
  }

  /// Numbers or rows, separated by commas.
  template <typename Item, size_t size>
  VectorReader& Some(const char* name, Item (&items)[size], uint8_t& count) {
    for (count = 0; count < size && ReadItem(name, count, &items[count]);) {
      ++count;
    }
    return *this;
  }
  template <size_t size>
  VectorReader& Arguments(const char* /*name*/, uint8_t (&arguments)[size],
                          const protocol::CommandCode& code) {
    size_t at = 0;
    for (const Argument& argument : ArgumentsOf(code)) {
      int64_t rest = Number(argument.name);
      for (int i = 0; i < argument.bytes; ++i, rest >>= 8) {
        arguments[at++] = static_cast<uint8_t>(rest & 0xFF);
      }
    }
    return *this;
  }
  template <typename Row, size_t size>
  VectorReader& Rest(const char* name, Row (&rows)[size], uint8_t& count) {
    return Some(name, rows, count);
  }
  /// Hexadecimal, without spaces; "-" for none.
  template <size_t size>
  VectorReader& Rest(const char* name, uint8_t (&bytes)[size], uint8_t& count) {
    const std::string& digits = Text(name);
    count = 0;
    for (size_t i = 0; digits != "-" && i < digits.size(); i += 2) {
      Require(count < size, name, "is too long");
      bytes[count++] = static_cast<uint8_t>(std::stoul(digits.substr(i, 2), nullptr, 16));
    }
    return *this;
  }

  void ExpectEnd() const {
    for (const auto& [name, value] : vector_.fields) {
      Require(used_.count(name) == 1, name, "is no field of " + vector_.message);
    }
  }

 private:
  struct Argument {
    const char* name;
    int bytes;
  };

  // Reads the row at an index of each column.
  class RowReader {
   public:
    RowReader(VectorReader* reader, size_t index) : reader_(reader), index_(index) {}
    template <typename Value>
    RowReader& Field(const char* name, Value& field) {
      const bool is_listed = reader_->ReadItem(name, index_, &field);
      reader_->Require(is_first_ || is_listed == is_there, name, "is not as long as other columns");
      is_there = is_listed;
      is_first_ = false;
      return *this;
    }
    bool is_there = false;

   private:
    VectorReader* reader_;
    size_t index_;
    bool is_first_ = true;
  };

  // By name and size, in the order of the wire.
  static std::vector<Argument> ArgumentsOf(protocol::CommandCode code) {
    switch (code) {
      case protocol::CommandCode::kSpeed:
        return {{"speed_mm_s", 2}};
      case protocol::CommandCode::kGoTo:
        return {{"x", 2}, {"y", 2}};
      case protocol::CommandCode::kFollowType:
        return {{"type_to_follow", 1}};
      case protocol::CommandCode::kSetParameter:
        return {{"parameter", 1}, {"value", 4}};
      case protocol::CommandCode::kGetParameter:
        return {{"parameter", 1}};
      default:
        return {};
    }
  }

  void Require(bool holds, const std::string& name, const std::string& what) const {
    if (!holds) {
      throw std::runtime_error(vector_.name + ": " + name + " " + what);
    }
  }

  const std::string& Text(const std::string& name) {
    used_.insert(name);
    const auto found = vector_.fields.find(name);
    Require(found != vector_.fields.end(), name, "is missing");
    return found->second;
  }

  int64_t Number(const std::string& name) { return std::stoll(Text(name)); }

  // Words of 32 bits may be given with or without a sign: what they are depends on others.
  template <typename Value>
  void Set(const std::string& name, int64_t value, Value* to) const {
    if constexpr (std::is_integral_v<Value>) {
      constexpr int64_t kMax = sizeof(Value) == 4 ? std::numeric_limits<uint32_t>::max()
                                                  : std::numeric_limits<Value>::max();
      Require(value >= std::numeric_limits<Value>::min() && value <= kMax, name, "is out of range");
    } else {
      Require(value >= 0 && value <= 255, name, "is out of range");
    }
    *to = static_cast<Value>(value);
  }

  // Whether there is one at this place of a list; "-" for an empty list.
  bool ReadItem(const std::string& name, size_t index, uint8_t* to) {
    return ReadNumber(name, index, to);
  }
  bool ReadItem(const std::string& name, size_t index, uint16_t* to) {
    return ReadNumber(name, index, to);
  }
  bool ReadItem(const std::string& name, size_t index, int16_t* to) {
    return ReadNumber(name, index, to);
  }
  template <typename Row>
  bool ReadItem(const std::string& /*name*/, size_t index, Row* row) {
    RowReader reader(this, index);
    Row::Fields(*row, reader);
    return reader.is_there;
  }
  template <typename Value>
  bool ReadNumber(const std::string& name, size_t index, Value* to) {
    std::istringstream stream(Text(name));
    std::string one;
    for (size_t i = 0; i <= index; ++i) {
      if (!std::getline(stream, one, ',') || one == "-") {
        return false;
      }
    }
    Set(name, std::stoll(one), to);
    return true;
  }

  const FieldsVector& vector_;
  std::set<std::string> used_;
};

template <typename Action>
struct VectorFinder {
  template <typename M>
  void Visit(M message) {
    if (M::Fields(message, NameMatcher(vector.message)).matches) {
      VectorReader reader(vector);
      M::Fields(message, reader);
      reader.ExpectEnd();
      visit(message);
      ++found;
    }
  }

  const FieldsVector& vector;
  const Action& visit;
  int found = 0;
};

/// Calls `visit(message)` with what a vector's fields say. Throws std::runtime_error unless exactly
/// one message has the vector's name, and its fields.
template <typename Action>
void WithMessage(const FieldsVector& vector, const Action& visit) {
  VectorFinder<Action> finder{vector, visit};
  protocol::ForEachMessage(&finder);
  if (finder.found != 1) {
    throw std::runtime_error(std::to_string(finder.found) + " messages are called " +
                             vector.message);
  }
}

}  // namespace pheromone::testing

namespace pheromone::protocol {

/// For GoogleTest.
template <typename M>
requires requires(const M& message) {
  M::Fields(message, Namer());
}
std::ostream& operator<<(std::ostream& stream, const M& message) {
  return stream << testing::TextOf(message);
}

}  // namespace pheromone::protocol
