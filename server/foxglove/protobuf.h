// Writes the wire format of protobuf (protobuf.dev, "Encoding"): the little of it that the messages
// of this folder need.
//
//   ProtobufWriter writer;
//   writer.Text(2, "map");
//   writer.Message(3, [&](ProtobufWriter& pose) { pose.Double(1, 0.5); });
//   std::string bytes = writer.Take();
//
// As proto3 has it, numbers that are 0 and empty texts are left out; messages and elements of lists
// are not. One thread at a time.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace pheromone::foxglove {

class ProtobufWriter {
 public:
  void Varint(uint32_t field, uint64_t value) {
    if (value != 0) {
      EvenZero(field, value);
    }
  }
  /// As proto2 has it.
  void EvenZero(uint32_t field, uint64_t value) {
    Key(field, kVarint);
    Raw(value);
  }
  void Bool(uint32_t field, bool value) { Varint(field, value ? 1 : 0); }
  void Fixed32(uint32_t field, uint32_t value) {
    if (value != 0) {
      Key(field, kFixed32);
      Fixed<4>(value);
    }
  }
  void Double(uint32_t field, double value) {
    if (const auto bits = std::bit_cast<uint64_t>(value); bits != 0) {  // -0.0 is not left out
      Key(field, kFixed64);
      Fixed<8>(bits);
    }
  }
  void Text(uint32_t field, std::string_view text) {
    if (!text.empty()) {
      Element(field, text);
    }
  }
  /// An element of a list of texts or of encoded messages.
  void Element(uint32_t field, std::string_view bytes) {
    Key(field, kLength);
    Raw(bytes.size());
    bytes_ += bytes;
  }
  /// `write` writes the fields of the message to the writer that it is given.
  template <typename Write>
  void Message(uint32_t field, Write&& write) {
    Key(field, kLength);
    const size_t begin = bytes_.size();
    write(*this);
    const size_t size = bytes_.size() - begin;
    ProtobufWriter length;  // known only now, and of one byte for most messages
    length.Raw(size);
    bytes_.insert(begin, length.bytes_);
  }

  void Reserve(size_t bytes) { bytes_.reserve(bytes); }
  std::string Take() { return std::exchange(bytes_, {}); }

 private:
  static constexpr uint32_t kVarint = 0;
  static constexpr uint32_t kFixed64 = 1;
  static constexpr uint32_t kLength = 2;
  static constexpr uint32_t kFixed32 = 5;

  void Key(uint32_t field, uint32_t kind) { Raw(uint64_t{field} << 3 | kind); }
  void Raw(uint64_t value) {
    for (; value >= 0x80; value >>= 7) {
      bytes_ += static_cast<char>((value & 0x7F) | 0x80);
    }
    bytes_ += static_cast<char>(value);
  }
  template <size_t kBytes>
  void Fixed(uint64_t value) {
    std::array<char, kBytes> raw = {};
    for (size_t i = 0; i < kBytes; ++i) {
      raw[i] = static_cast<char>(value >> (8 * i));
    }
    bytes_.append(raw.data(), raw.size());
  }

  std::string bytes_;
};

}  // namespace pheromone::foxglove
