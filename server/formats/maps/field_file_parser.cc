// The reader of field_file.h's format: line by line, and within a line word by word. Anything that
// EncodeField would not write is refused.

#include <algorithm>
#include <charconv>
#include <optional>
#include <string>
#include <utility>

#include "server/base/message.h"
#include "server/formats/maps/field_file.h"

namespace pheromone::maps {
namespace {

constexpr int64_t kFarthestUm = 1'000'000'000'000;  // 1000 km
constexpr int64_t kMaxCellsOfSide = (1 << 24) - 1;  // more is no field
constexpr int64_t kMaxQuantum = 1'000'000'000'000'000;
constexpr int64_t kMaxLevel = int64_t{UINT16_MAX} * field::kLevelsPerQuantum;
constexpr size_t kMaxNameBytes = 65536;

bool IsPrintable(std::string_view text) {
  return std::none_of(text.begin(), text.end(),
                      [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7f'; });
}

class Parser {
 public:
  Parser(std::string_view text, std::string_view name) : text_(text), name_(name) {}

  Result<SavedField> Parse() {
    if (!ReadHeader() || !ReadTypes() || !ReadNodes() || !ReadEnd()) {
      return *error_;
    }
    return std::move(saved_);
  }

 private:
  // --- Tokens. Each returns false, with error_ set, if something else is found.

  // Advances to the next line, which must have a line end: the last line of a truncated file has
  // none.
  bool NextLine() {
    rest_.remove_prefix(line_.size());
    ++line_number_;
    const size_t end = rest_.find('\n');
    line_ = rest_.substr(0, end == std::string_view::npos ? rest_.size() : end + 1);
    at_ = 0;
    return !line_.empty() && line_.back() == '\n'
               ? true
               : Fail(line_.size(), "the end of the file", "a whole line: the file is truncated");
  }

  bool Fail(size_t at, std::string_view found, std::string_view expected) {
    error_ = AtLine(name_, line_number_, at + 1,
                    "found " + std::string(found) + ", expected " + std::string(expected));
    return false;
  }

  bool Expected(std::string_view what) {
    const std::string_view word = line_.substr(at_, line_.find_first_of(" ,\n", at_) - at_);
    return word.empty() ? Fail(at_, line_[at_] == '\n' ? "the end of the line" : "nothing", what)
                        : Fail(at_, Quoted(word), what);
  }

  bool StartsWith(std::string_view literal) const {
    return line_.substr(at_, literal.size()) == literal;
  }

  bool Literal(std::string_view literal) {
    if (!StartsWith(literal)) {
      return Expected(literal == "\n" ? "the end of the line" : Quoted(literal));
    }
    at_ += literal.size();
    return true;
  }

  bool Number(std::string_view what, int64_t least, int64_t most, int64_t* number) {
    const char* const begin = line_.data() + at_;
    const auto [end, error] = std::from_chars(begin, line_.data() + line_.size(), *number);
    const char first = line_[at_ + (line_[at_] == '-' ? 1u : 0u)];
    const bool plain = first != '0' || end - begin == 1;  // no 007, no -0
    if (error != std::errc() || !plain || *number < least || *number > most) {
      return Expected(std::string(what) + " from " + std::to_string(least) + " to " +
                      std::to_string(most));
    }
    at_ += static_cast<size_t>(end - begin);
    return true;
  }

  // --- The parts of a file.

  bool ReadHeader() {
    field::MapGeometry& map = saved_.map;
    return NextLine() && Literal("# pheromone-field ") &&
           (StartsWith("1\n") || Expected("version 1")) && NextLine() &&
           Literal("# map origin_um ") && Number("x", -kFarthestUm, kFarthestUm, &map.origin.x) &&
           Literal(" ") && Number("y", -kFarthestUm, kFarthestUm, &map.origin.y) &&
           Literal(" size_um ") && Number("a width", 1, kFarthestUm, &map.width_um) &&
           Literal(" ") && Number("a height", 1, kFarthestUm, &map.height_um) &&
           Literal(" cell_um ") &&
           Number("a cell", std::max(map.width_um, map.height_um) / (kMaxCellsOfSide + 1) + 1,
                  kFarthestUm, &map.cell_um) &&
           Literal("\n");
  }

  bool ReadTypes() {
    if (!NextLine()) {
      return false;
    }
    while (StartsWith("# type ")) {
      if (!ReadType() || !NextLine()) {
        return false;
      }
    }
    return Literal("# nodes type,column,row,level") && Literal("\n");
  }

  bool ReadType() {
    SavedType type;
    int64_t number = 0;
    const int64_t least = saved_.types.empty() ? 1 : saved_.types.back().type + 1;
    if (!Literal("# type ") || !Number("a type", least, field::kTypes - 1, &number) ||
        !Literal(" quantum_micro ") || !Number("a quantum", 1, kMaxQuantum, &type.quantum_micro) ||
        !Literal(" law ")) {
      return false;
    }
    const size_t blank = std::min(line_.find_first_of(" \n", at_), at_ + kMaxNameBytes);
    type.type = static_cast<uint8_t>(number);
    type.law = line_.substr(at_, blank - at_);
    if (!IsPrintable(type.law)) {
      return Expected("a law in words");
    }
    at_ = blank;
    if (!Literal(" name \"")) {
      return false;
    }
    const size_t quote = line_.size() - 2;  // the last character but the line's end
    if (quote < at_ || line_[quote] != '"') {
      return Expected("a name in quotation marks");
    }
    type.name = line_.substr(at_, quote - at_);
    if (type.name.size() > kMaxNameBytes || !IsPrintable(type.name)) {
      return Expected("a printable name of at most " + std::to_string(kMaxNameBytes) + " bytes");
    }
    saved_.types.push_back(std::move(type));
    return true;
  }

  bool ReadNodes() {
    while (NextLine() && !StartsWith("#")) {
      if (!ReadNode()) {
        return false;
      }
    }
    EndPrint();
    return !error_;
  }

  bool ReadNode() {
    int64_t type = 0;
    int64_t column = 0;
    int64_t row = 0;
    int64_t level = 0;
    if (!Number("a type", 1, field::kTypes - 1, &type) || !Literal(",") ||
        !Number("a column", 0, saved_.map.columns() - 1, &column) || !Literal(",") ||
        !Number("a row", 0, saved_.map.rows() - 1, &row) || !Literal(",") ||
        !Number("a level", 1, kMaxLevel, &level) || !Literal("\n")) {
      return false;
    }
    const field::NodeIndex node{static_cast<int32_t>(column), static_cast<int32_t>(row)};
    const bool follows = type != type_ ? type > type_ : nodes_.empty() || nodes_.back().node < node;
    if (!follows) {
      return Fail(0, Quoted(line_.substr(0, line_.size() - 1)), "nodes in order, each once");
    }
    if (type != type_) {
      EndPrint();
      type_ = type;
      const bool known = std::any_of(saved_.types.begin(), saved_.types.end(),
                                     [type](const SavedType& it) { return it.type == type; });
      if (!known) {
        return Fail(0, "type " + std::to_string(type), "a type that the header names");
      }
    }
    if (++count_ > kMaxSavedNodes) {
      return Fail(0, "more nodes", "at most " + std::to_string(kMaxSavedNodes));
    }
    levels_ += level;
    nodes_.push_back({node, static_cast<uint32_t>(level)});
    return true;
  }

  void EndPrint() {
    if (!nodes_.empty()) {
      saved_.initial_rasters.push_back(
          {static_cast<uint8_t>(type_),
           field::Shared<std::vector<field::InitialNode>>(std::move(nodes_))});
      nodes_.clear();
    }
  }

  bool ReadEnd() {
    if (!Literal("# end nodes ") || !Literal(std::to_string(count_)) || !Literal(" levels ") ||
        !Literal(std::to_string(levels_)) || !Literal("\n")) {
      return false;
    }
    rest_.remove_prefix(line_.size());
    ++line_number_;
    return rest_.empty() || Fail(0, "more", "the end of the file");
  }

  std::string_view text_;
  std::string_view name_;
  std::string_view rest_ = text_;  // from the present line on
  std::string_view line_;          // with its end
  size_t line_number_ = 0;
  size_t at_ = 0;  // in the line
  std::optional<Error> error_;
  SavedField saved_;
  int64_t type_ = 0;  // of nodes_
  std::vector<field::InitialNode> nodes_;
  size_t count_ = 0;
  int64_t levels_ = 0;
};

}  // namespace

Result<SavedField> ParseField(std::string_view text, std::string_view name) {
  return Parser(text, name).Parse();
}

}  // namespace pheromone::maps
