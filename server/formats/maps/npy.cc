#include "server/formats/maps/npy.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <optional>
#include <vector>

#include "server/base/file.h"
#include "server/base/message.h"

namespace pheromone::maps {

namespace {

constexpr std::string_view kMagic = "\x93NUMPY";
constexpr size_t kMaxHeader = 65536;

struct ElementType {
  char kind = 'f';  // b(ool), u(nsigned), i(nteger) or f(loat)
  size_t size = 8;
  bool big_endian = false;
};

std::optional<ElementType> TypeNamed(std::string_view descr) {
  constexpr std::array<std::string_view, 11> kKnown = {"b1", "u1", "u2", "u4", "u8", "i1",
                                                       "i2", "i4", "i8", "f4", "f8"};
  if (descr.size() != 3 || std::count(kKnown.begin(), kKnown.end(), descr.substr(1)) == 0) {
    return std::nullopt;
  }
  const ElementType type{descr[1], static_cast<size_t>(descr[2] - '0'), descr[0] == '>'};
  const bool ordered = descr[0] == '<' || descr[0] == '>' || (descr[0] == '|' && type.size == 1);
  return ordered ? std::optional(type) : std::nullopt;
}

struct Header {
  std::optional<ElementType> type;
  std::optional<bool> fortran_order;
  std::vector<uint64_t> shape;
};

// Reads the header, which is text as Python writes a dictionary:
//   {'descr': '<f8', 'fortran_order': False, 'shape': (3, 4), }
class HeaderText {
 public:
  HeaderText(std::string_view text, size_t offset, std::string_view name)
      : text_(text), offset_(offset), name_(name) {}

  Result<Header> Read() {
    if (!Take("{")) {
      return Expected("{");
    }
    while (!Take("}")) {
      PHEROMONE_TRY_STATUS(ReadEntry());
      if (!Take(",") && text_.substr(at_, 1) != "}") {
        return Expected(", or }");
      }
    }
    SkipBlanks();
    if (at_ != text_.size()) {
      return Expected("the end of the header");
    }
    if (!header_.type || !header_.fortran_order || header_.shape.empty()) {
      return Expected("'descr', 'fortran_order' and 'shape' before it");
    }
    return header_;
  }

 private:
  Status ReadEntry() {
    if (Take("'descr'") || Take("\"descr\"")) {
      return Take(":") ? ReadType() : Expected(":");
    }
    if (Take("'fortran_order'") || Take("\"fortran_order\"")) {
      return Take(":") ? ReadOrder() : Expected(":");
    }
    if (Take("'shape'") || Take("\"shape\"")) {
      return Take(":") ? ReadShape() : Expected(":");
    }
    return Expected("'descr', 'fortran_order' or 'shape'");
  }

  Status ReadType() {
    SkipBlanks();
    const char quote = at_ < text_.size() ? text_[at_] : '\0';
    const size_t end = text_.find(quote, at_ + 1);
    if ((quote == '\'' || quote == '"') && end != std::string_view::npos) {
      header_.type = TypeNamed(text_.substr(at_ + 1, end - at_ - 1));
    }
    if (!header_.type) {
      return Expected("the type '|b1', '|u1', '|i1' or < or > with u2, u4, u8, i2, i4, i8, f4, f8");
    }
    at_ = end + 1;
    return Ok();
  }

  Status ReadOrder() {
    header_.fortran_order = Take("True");
    return *header_.fortran_order || Take("False") ? Ok() : Expected("True or False");
  }

  Status ReadShape() {
    header_.shape.clear();
    if (!Take("(")) {
      return Expected("(rows, columns)");
    }
    while (!Take(")")) {
      SkipBlanks();
      uint64_t extent = 0;
      const char* const begin = text_.data() + at_;
      const auto [end, error] = std::from_chars(begin, text_.data() + text_.size(), extent);
      if (error != std::errc() || header_.shape.size() == 2) {
        return Expected("the two extents of an array of rows and columns");
      }
      header_.shape.push_back(extent);
      at_ += static_cast<size_t>(end - begin);
      if (!Take(",") && text_.substr(at_, 1) != ")") {
        return Expected(", or )");
      }
    }
    return header_.shape.size() == 2 ? Ok() : Expected("two extents before it: rows, columns");
  }

  void SkipBlanks() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\n')) {
      ++at_;
    }
  }

  bool Take(std::string_view word) {
    SkipBlanks();
    const bool found = text_.substr(at_, word.size()) == word;
    at_ += found ? word.size() : 0;
    return found;
  }

  Error Expected(std::string_view what) const {
    const std::string_view rest = text_.substr(at_);
    return AtByte(name_, offset_ + at_,
                  "found " + (rest.empty() ? "the end of the header" : Quoted(rest)) +
                      ", expected " + std::string(what));
  }

  std::string_view text_;
  size_t offset_;
  std::string_view name_;
  size_t at_ = 0;
  Header header_;
};

// One element as a double; empty if a double cannot represent it.
std::optional<double> ValueOf(const ElementType& type, std::string_view bytes) {
  const auto top = static_cast<uint8_t>(type.big_endian ? bytes.front() : bytes.back());
  const bool negative = type.kind == 'i' && top >= 0x80;
  uint64_t bits = negative ? ~uint64_t{0} : 0;  // extends the sign of short integers
  for (size_t i = 0; i < type.size; ++i) {
    const size_t from_top = type.big_endian ? i : type.size - 1 - i;
    bits = bits << 8 | static_cast<uint8_t>(bytes[from_top]);
  }
  if (type.kind == 'f') {
    return type.size == 8 ? std::bit_cast<double>(bits)
                          : double{std::bit_cast<float>(static_cast<uint32_t>(bits))};
  }
  if (type.kind == 'b') {
    return bits != 0 ? 1 : 0;
  }
  const uint64_t size = negative ? 0 - bits : bits;
  // Exact if at most 53 bits lie between the highest and the lowest one.
  const uint64_t lowest = size & (0 - size);
  if (size != 0 && size / lowest >> 53 != 0) {
    return std::nullopt;
  }
  const auto value = static_cast<double>(size);
  return negative ? -value : value;
}

Result<Raster> ReadElements(const Header& header, std::string_view bytes, size_t start,
                            std::string_view name) {
  const std::string problem = SizeProblem(header.shape[1], header.shape[0]);
  if (!problem.empty()) {
    return AtByte(name, start, problem);
  }
  const ElementType& type = *header.type;
  const size_t rows = header.shape[0];
  const size_t columns = header.shape[1];
  const size_t expected = rows * columns * type.size;
  if (bytes.size() - start != expected) {
    return AtByte(name, start,
                  "found " + std::to_string(bytes.size() - start) + " bytes of values, expected " +
                      std::to_string(expected));
  }
  Raster raster = MakeRaster(static_cast<int32_t>(columns), static_cast<int32_t>(rows));
  for (size_t i = 0; i < rows; ++i) {
    for (size_t j = 0; j < columns; ++j) {
      const size_t index = *header.fortran_order ? j * rows + i : i * columns + j;
      const size_t at = start + index * type.size;
      const std::optional<double> value = ValueOf(type, bytes.substr(at, type.size));
      if (!value) {
        return AtByte(name, at, "found an integer that a 64-bit float cannot hold exactly");
      }
      raster.values[(rows - 1 - i) * columns + j] = *value;
    }
  }
  return raster;
}

// Magic, version 1.0, the length of the header, and the header, filled up so that the values begin
// at a multiple of 64.
std::string Preamble(const Raster& raster) {
  std::string header = "{'descr': '<f8', 'fortran_order': False, 'shape': (" +
                       std::to_string(raster.rows) + ", " + std::to_string(raster.columns) + "), }";
  while ((kMagic.size() + 4 + header.size() + 1) % 64 != 0) {
    header += ' ';
  }
  header += '\n';
  std::string bytes(kMagic);
  bytes += '\x01';
  bytes += '\x00';
  bytes += static_cast<char>(header.size() & 0xFF);
  bytes += static_cast<char>(header.size() >> 8);
  return bytes + header;
}

}  // namespace

Result<Raster> ParseNpy(std::string_view bytes, std::string_view name) {
  if (bytes.substr(0, kMagic.size()) != kMagic) {
    return AtByte(name, 0, "expected \\x93NUMPY, as a .npy begins");
  }
  const std::string_view version = bytes.substr(kMagic.size(), 2);
  const bool version_1 = version == std::string_view("\x01\x00", 2);
  if (!version_1 && version != std::string_view("\x02\x00", 2)) {
    return AtByte(name, kMagic.size(), "expected version 1.0 or 2.0 of the format");
  }
  const size_t length_at = kMagic.size() + 2;
  const size_t length_size = version_1 ? 2 : 4;
  const size_t header_at = length_at + length_size;
  if (bytes.size() < header_at) {
    return AtByte(name, bytes.size(), "found the end, expected the length of the header");
  }
  size_t length = 0;
  for (size_t i = length_size; i > 0; --i) {
    length = length << 8 | static_cast<uint8_t>(bytes[length_at + i - 1]);
  }
  if (length > kMaxHeader || length > bytes.size() - header_at) {
    return AtByte(name, length_at,
                  "found a header of " + std::to_string(length) + " bytes, expected at most " +
                      std::to_string(std::min(kMaxHeader, bytes.size() - header_at)));
  }
  PHEROMONE_TRY(const Header header,
                HeaderText(bytes.substr(header_at, length), header_at, name).Read());
  return ReadElements(header, bytes, header_at + length, name);
}

Result<Raster> LoadNpy(const std::string& path) {
  const Result<std::string> bytes = ReadFile(path);
  return bytes.ok() ? ParseNpy(bytes.value(), path) : bytes.error();
}

std::string EncodeNpy(const Raster& raster) {
  std::string bytes = Preamble(raster);
  bytes.reserve(bytes.size() + 8 * raster.values.size());
  for (int32_t row = raster.rows - 1; row >= 0; --row) {
    for (int32_t column = 0; column < raster.columns; ++column) {
      const auto bits = std::bit_cast<uint64_t>(raster.At(column, row));
      for (int shift = 0; shift < 64; shift += 8) {
        bytes += static_cast<char>(bits >> shift & 0xFF);
      }
    }
  }
  return bytes;
}

Status SaveNpy(const std::string& path, const Raster& raster) {
  return WriteFile(path, EncodeNpy(raster));
}

}  // namespace pheromone::maps
