// Encodes numbers as bytes and decodes them, for files: little-endian, without padding, the same on
// every machine.
//
//   ByteWriter writer;
//   writer.U16(7);
//   writer.Text("radio-a");
//   ByteReader reader(writer.bytes());
//   uint16_t number = reader.U16();
//   std::string name = reader.Text();
//   if (!reader.ok()) return Error{reader.error()};
//
// Data that does not fit into memory is processed in portions: a writer with a sink passes its
// bytes on, and a reader with a source asks for more.
//
// A reader accepts any bytes. Its first failure persists; from then on it returns zeros, so that a
// function may read a whole object and check once. Lists begin with their length, which is not
// trusted: a loop over it checks ok() each time, so that no list is larger than what was read.
//
// One thread at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "server/base/result.h"

namespace pheromone {

class ByteWriter {
 public:
  using Sink = std::function<void(std::string_view)>;
  static constexpr size_t kPortionBytes = size_t{1} << 16;

  /// Keeps everything in bytes().
  ByteWriter() = default;
  /// Passes on portions of about kPortionBytes, the last one at Flush.
  explicit ByteWriter(Sink sink) : sink_(std::move(sink)) {}

  void U8(uint8_t value) { Number(value); }
  void U16(uint16_t value) { Number(value); }
  void U32(uint32_t value) { Number(value); }
  void U64(uint64_t value) { Number(value); }
  void I16(int16_t value) { Number(static_cast<uint16_t>(value)); }
  void I32(int32_t value) { Number(static_cast<uint32_t>(value)); }
  void I64(int64_t value) { Number(static_cast<uint64_t>(value)); }
  void Flag(bool value) { U8(value ? 1 : 0); }
  void Raw(std::string_view bytes) {
    bytes_ += bytes;
    FlushIfMany();
  }
  /// Its length, then its bytes.
  void Text(std::string_view text) {
    Count(text.size());
    Raw(text);
  }
  /// The length of a list; below 2^32.
  void Count(size_t count) { U32(static_cast<uint32_t>(count)); }

  void Flush() {
    if (sink_ && !bytes_.empty()) {
      sink_(bytes_);
      bytes_.clear();
    }
  }
  const std::string& bytes() const { return bytes_; }
  void Clear() { bytes_.clear(); }
  std::string Take() { return std::exchange(bytes_, {}); }

 private:
  template <typename Unsigned>
  void Number(Unsigned value) {
    char raw[sizeof value];
    for (size_t i = 0; i < sizeof value; ++i) {
      raw[i] = static_cast<char>(uint64_t{value} >> (8 * i));
    }
    bytes_.append(raw, sizeof raw);
    FlushIfMany();
  }
  void FlushIfMany() {
    if (sink_ && bytes_.size() >= kPortionBytes) {
      Flush();
    }
  }

  Sink sink_;
  std::string bytes_;
};

class ByteReader {
 public:
  /// The next portion, which stays valid until the next call; empty at the end.
  using Source = std::function<std::string_view()>;

  /// `bytes` outlive the reader.
  explicit ByteReader(std::string_view bytes) : rest_(bytes) {}
  explicit ByteReader(Source source) : source_(std::move(source)) {}

  uint8_t U8() {
    if (!MoreIsThere()) {
      Fail("unexpected end of data");
      return 0;
    }
    const auto byte = static_cast<uint8_t>(rest_.front());
    rest_.remove_prefix(1);
    return byte;
  }
  uint16_t U16() { return Number<uint16_t>(); }
  uint32_t U32() { return Number<uint32_t>(); }
  uint64_t U64() { return Number<uint64_t>(); }
  int16_t I16() { return static_cast<int16_t>(U16()); }
  int32_t I32() { return static_cast<int32_t>(U32()); }
  int64_t I64() { return static_cast<int64_t>(U64()); }
  /// 0 or 1, so that encodings are unique.
  bool Flag() { return U8UpTo(1, "a flag") != 0; }
  uint8_t U8UpTo(uint8_t most, std::string_view what) {
    const uint8_t value = U8();
    if (value > most) {
      Fail(std::string(what) + " is " + std::to_string(value) + ", expected at most " +
           std::to_string(most));
      return 0;
    }
    return value;
  }
  std::string Text() {
    std::string text;
    for (uint32_t left = U32(); left > 0 && ok(); --left) {
      text += static_cast<char>(U8());
    }
    return text;
  }
  uint32_t Count() { return U32(); }

  bool ok() const { return error_.empty(); }
  const std::string& error() const { return error_; }
  /// Stores the error, unless there is one already.
  void Fail(std::string_view what) {
    if (ok()) {
      error_ = what;
      rest_ = {};
      source_ = nullptr;
    }
  }
  void Check(const Status& status) {
    if (!status.ok()) {
      Fail(status.error());
    }
  }
  /// Whether no bytes are left; true after a failure.
  bool AtEnd() { return !MoreIsThere(); }
  /// Fails if bytes are left.
  void ExpectEnd() {
    if (ok() && MoreIsThere()) {
      Fail("trailing bytes");
    }
  }

 private:
  bool MoreIsThere() {
    if (rest_.empty() && source_) {
      rest_ = source_();
    }
    return !rest_.empty();
  }
  template <typename Unsigned>
  Unsigned Number() {
    uint64_t value = 0;
    if (rest_.size() >= sizeof(Unsigned)) {
      for (size_t i = 0; i < sizeof(Unsigned); ++i) {
        value |= uint64_t{static_cast<uint8_t>(rest_[i])} << (8 * i);
      }
      rest_.remove_prefix(sizeof(Unsigned));
      return static_cast<Unsigned>(value);
    }
    for (size_t i = 0; i < sizeof(Unsigned); ++i) {  // it spans two portions
      value |= uint64_t{U8()} << (8 * i);
    }
    return ok() ? static_cast<Unsigned>(value) : Unsigned{0};
  }

  std::string_view rest_;
  Source source_;
  std::string error_;
};

}  // namespace pheromone
