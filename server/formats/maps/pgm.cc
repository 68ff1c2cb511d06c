#include "server/formats/maps/pgm.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "server/base/file.h"
#include "server/base/message.h"

namespace pheromone::maps {

namespace {

constexpr uint32_t kMaxLevel = 65535;

bool IsSpace(char byte) {
  return byte == ' ' || (byte >= '\t' && byte <= '\r');
}

// The words of the header, and of all of a P2: numbers between white space and comments.
class Words {
 public:
  Words(std::string_view bytes, std::string_view name) : bytes_(bytes), name_(name) {}

  // The next number, `minimum` to `maximum`.
  Result<uint32_t> Number(std::string_view what, uint32_t minimum, uint32_t maximum) {
    SkipBlanks();
    const size_t begin = at_;
    while (at_ < bytes_.size() && !IsSpace(bytes_[at_]) && bytes_[at_] != '#') {
      ++at_;
    }
    const std::string_view word = bytes_.substr(begin, at_ - begin);
    uint32_t number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (word.empty() || end != word.data() + word.size() || error != std::errc() ||
        number < minimum || number > maximum) {
      return ErrorAt(begin, "found " + (word.empty() ? "the end" : Quoted(word)) + ", expected " +
                                std::string(what) + ", " + std::to_string(minimum) + " to " +
                                std::to_string(maximum));
    }
    return number;
  }

  void SkipBlanks() {
    while (at_ < bytes_.size() && (IsSpace(bytes_[at_]) || bytes_[at_] == '#')) {
      at_ = bytes_[at_] == '#' ? std::min(bytes_.find('\n', at_), bytes_.size()) : at_ + 1;
    }
  }

  size_t at() const { return at_; }
  void set_at(size_t at) { at_ = at; }

  Error ErrorAt(size_t offset, std::string_view what) const {
    const std::string_view before = bytes_.substr(0, offset);
    const auto line = static_cast<size_t>(std::count(before.begin(), before.end(), '\n')) + 1;
    const size_t start = before.rfind('\n');
    return AtLine(name_, line, offset - (start == std::string_view::npos ? 0 : start + 1) + 1,
                  what);
  }

 private:
  std::string_view bytes_;
  std::string_view name_;
  size_t at_ = 0;
};

struct Header {
  int32_t columns = 0;
  int32_t rows = 0;
  uint16_t maximum = 0;
};

Result<Header> ReadHeader(Words& words) {
  std::array<uint32_t, 3> numbers{};
  const std::array<std::string_view, 3> names = {"the width", "the height", "the white level"};
  for (size_t i = 0; i < numbers.size(); ++i) {
    const uint32_t maximum = i == 2 ? kMaxLevel : static_cast<uint32_t>(kMaxSide);
    PHEROMONE_TRY(const uint32_t number, words.Number(names[i], 1, maximum));
    numbers[i] = number;
  }
  const std::string problem = SizeProblem(numbers[0], numbers[1]);
  if (!problem.empty()) {
    return words.ErrorAt(words.at(), problem);
  }
  return Header{static_cast<int32_t>(numbers[0]), static_cast<int32_t>(numbers[1]),
                static_cast<uint16_t>(numbers[2])};
}

size_t BytesPerPixel(uint16_t maximum) {
  return maximum > 255 ? 2 : 1;
}

Result<GrayImage> ReadBinary(const Header& header, std::string_view bytes, size_t start,
                             std::string_view name) {
  const size_t width = BytesPerPixel(header.maximum);
  const size_t expected =
      static_cast<size_t>(header.columns) * static_cast<size_t>(header.rows) * width;
  if (bytes.size() - start != expected) {
    return AtByte(name, start,
                  "found " + std::to_string(bytes.size() - start) + " bytes of pixels, expected " +
                      std::to_string(expected));
  }
  GrayImage image{MakeRaster(header.columns, header.rows), header.maximum};
  size_t at = start;
  for (int32_t row = header.rows - 1; row >= 0; --row) {
    for (int32_t column = 0; column < header.columns; ++column, at += width) {
      uint32_t level = static_cast<uint8_t>(bytes[at]);
      if (width == 2) {
        level = level << 8 | static_cast<uint8_t>(bytes[at + 1]);
      }
      if (level > header.maximum) {
        return AtByte(name, at,
                      "found level " + std::to_string(level) + ", expected at most " +
                          std::to_string(header.maximum));
      }
      image.raster.At(column, row) = level;
    }
  }
  return image;
}

Result<GrayImage> ReadText(const Header& header, std::string_view bytes, Words& words) {
  // Each number needs two bytes, the last perhaps one: a short file cannot declare a large image.
  const size_t cells = static_cast<size_t>(header.columns) * static_cast<size_t>(header.rows);
  if ((bytes.size() - words.at() + 1) / 2 < cells) {
    return words.ErrorAt(
        words.at(), "the rest of the file is too short for " + std::to_string(cells) + " levels");
  }
  GrayImage image{MakeRaster(header.columns, header.rows), header.maximum};
  for (int32_t row = header.rows - 1; row >= 0; --row) {
    for (int32_t column = 0; column < header.columns; ++column) {
      PHEROMONE_TRY(const uint32_t level, words.Number("a level", 0, header.maximum));
      image.raster.At(column, row) = level;
    }
  }
  words.SkipBlanks();
  if (words.at() != bytes.size()) {
    return words.ErrorAt(words.at(),
                         "found more than " + std::to_string(cells) + " levels, expected the end");
  }
  return image;
}

}  // namespace

Result<GrayImage> ParsePgm(std::string_view bytes, std::string_view name) {
  const std::string_view magic = bytes.substr(0, 2);
  if (magic != "P5" && magic != "P2") {
    return AtByte(name, 0, "found " + Quoted(magic) + ", expected P5 or P2, as a PGM begins");
  }
  Words words(bytes, name);
  words.set_at(magic.size());
  if (words.at() < bytes.size() && !IsSpace(bytes[words.at()]) && bytes[words.at()] != '#') {
    return words.ErrorAt(words.at(), "expected white space after " + std::string(magic));
  }
  PHEROMONE_TRY(const Header header, ReadHeader(words));
  if (magic == "P2") {
    return ReadText(header, bytes, words);
  }
  if (words.at() == bytes.size() || !IsSpace(bytes[words.at()])) {
    return words.ErrorAt(words.at(), "expected one white space between the white level and pixels");
  }
  return ReadBinary(header, bytes, words.at() + 1, name);
}

Result<GrayImage> LoadPgm(const std::string& path) {
  const Result<std::string> bytes = ReadFile(path);
  return bytes.ok() ? ParsePgm(bytes.value(), path) : bytes.error();
}

std::string EncodePgm(const GrayImage& image) {
  const Raster& raster = image.raster;
  std::string bytes = "P5\n" + std::to_string(raster.columns) + " " + std::to_string(raster.rows) +
                      "\n" + std::to_string(image.maximum) + "\n";
  const bool wide = BytesPerPixel(image.maximum) == 2;
  bytes.reserve(bytes.size() + raster.values.size() * (wide ? 2 : 1));
  for (int32_t row = raster.rows - 1; row >= 0; --row) {
    for (int32_t column = 0; column < raster.columns; ++column) {
      const uint16_t level = NearestLevel(raster.At(column, row), image.maximum);
      if (wide) {
        bytes += static_cast<char>(level >> 8);
      }
      bytes += static_cast<char>(level & 0xFF);
    }
  }
  return bytes;
}

Status SavePgm(const std::string& path, const GrayImage& image) {
  return WriteFile(path, EncodePgm(image));
}

}  // namespace pheromone::maps
