// The tables that give the numbers in blocks their meaning (Tammet, Vain and Kuusik 2006, section
// 3.2): who the authors are, their strings, and whose strings they share.
//
//   SymbolTables tables;
//   tables.DefineRobot(15, "123-233-201");
//   tables.DefineString(15, 3, "http://example.org/ns#");
//   tables.StringOf(15, 3);   // through the mapping, if robot 15 shares another's strings
//
// Definitions stay, since to bind a number anew would change the meaning of blocks that were
// written before. They are kept in the order in which they were made; whoever knows the first n
// rows needs only those after them. An operator may remove what one maker has defined and no block
// uses (Without); whoever sees fewer rows than before reads them anew.
//
// No robot can fill the tables: each may make kMaxRowsOfMaker rows, and all robots together leave
// kReservedRows to operators and nets.
//
// Pure; one thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/base/fields.h"

namespace pheromone::tags {

enum class RowKind : uint8_t { kRobot = 1, kString = 2, kMapping = 3 };

/// "robot", "string" or "mapping", as in JSON.
std::string_view NameOf(RowKind kind);
/// Empty if no kind has that name.
std::optional<RowKind> RowKindNamed(std::string_view name);

struct Row {
  RowKind kind = RowKind::kRobot;
  int32_t robot = 0;   ///< its number; also that of a person
  int32_t number = 0;  ///< of the string; of the robot whose strings are used; the robot's own
  std::string text;    ///< the unique ID, or the string; UTF-8
  bool operator==(const Row&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("kind", it.kind, Within(1, 3));
    visit("robot", it.robot, AtLeast(1));
    visit("number", it.number, AtLeast(1));
    visit("text", it.text);
  }
};

/// Who made a definition: a robot, by its link's name and its ID; without a link, an operator or a
/// net.
struct Maker {
  std::string link;
  uint8_t id = 0;
  auto operator<=>(const Maker&) const = default;

  bool is_robot() const { return !link.empty(); }
  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("link", it.link);
    visit("id", it.id);
  }
};

enum class DefineOutcome : uint8_t {
  kDone,          ///< or it was so already
  kBadValue,      ///< a number below 1; a text that is empty, too long or not UTF-8
  kUnknownRobot,  ///< a string or mapping of a robot that is not in the table
  kTaken,         ///< the number or the ID is bound otherwise; the robot has strings or is mapped
  kFull,
  kMakerFull,  ///< this robot has made as many as one may
};

class SymbolTables {
 public:
  static constexpr size_t kMaxTextBytes = 255;
  static constexpr size_t kMaxRows = 65'536;
  static constexpr size_t kMaxRowsOfRobot = 4096;
  static constexpr size_t kMaxRowsOfMaker = 1024;  ///< if that is a robot
  static constexpr size_t kReservedRows = 8192;    ///< which robots cannot have

  /// A robot and its unique ID; neither may be bound to another.
  DefineOutcome DefineRobot(int32_t robot, std::string_view unique_id) {
    return Define({RowKind::kRobot, robot, robot, std::string(unique_id)});
  }
  /// The robot of that ID, with the first free number if it is new.
  DefineOutcome AddRobot(std::string_view unique_id, int32_t* robot, const Maker& maker = {});
  DefineOutcome DefineString(int32_t robot, int32_t number, std::string_view text) {
    return Define({RowKind::kString, robot, number, std::string(text)});
  }
  /// `robot` uses the strings of `owner`, whose own mapping does not count. Only while it has no
  /// strings of its own.
  DefineOutcome DefineMapping(int32_t robot, int32_t owner) {
    return Define({RowKind::kMapping, robot, owner, {}});
  }
  /// By its kind. TryDefine says what it would do.
  DefineOutcome Define(const Row& row, const Maker& maker = {});
  DefineOutcome TryDefine(const Row& row, const Maker& maker = {}) const;

  /// The robots in `used`, those of which others than `maker` have defined something, and those
  /// whose strings one of these uses.
  std::set<int32_t> UsedBeside(const Maker& maker, std::set<int32_t> used) const;
  /// The same tables without what `maker` has defined, except of the robots in `used`.
  SymbolTables Without(const Maker& maker, const std::set<int32_t>& used) const;

  bool HasRobot(int32_t robot) const { return ids_.count(robot) > 0; }
  /// Null if it is not in the table.
  const std::string* UniqueIdOf(int32_t robot) const;
  std::optional<int32_t> RobotOf(std::string_view unique_id) const;
  /// Whose strings it uses: its own, unless it is mapped.
  int32_t OwnerOf(int32_t robot) const;
  bool IsMapped(int32_t robot) const { return owners_.count(robot) > 0; }
  /// What a number means in blocks of `robot`; null if nothing.
  const std::string* StringOf(int32_t robot, int32_t number) const;
  /// The first number that means this text in blocks of `robot`.
  std::optional<int32_t> NumberOf(int32_t robot, std::string_view text) const;
  /// The first number that no string of `owner` has.
  int32_t FreeNumberOf(int32_t owner) const;

  const std::vector<Row>& rows() const { return rows_; }
  /// Who made each of them.
  const std::vector<Maker>& makers() const { return makers_; }
  /// The sum of the rows' hashes; their order counts, and who made them.
  uint64_t hash() const { return hash_; }
  /// Of all rows and their makers, each as EncodeFields does.
  uint64_t encoded_bytes() const { return encoded_bytes_; }

  /// Adds a row as it is in rows(). False if no table can have it there.
  bool Restore(const Row& row, const Maker& maker);

 private:
  DefineOutcome CheckRobot(const Row& row) const;
  DefineOutcome CheckString(const Row& row) const;
  DefineOutcome CheckMapping(const Row& row) const;
  bool Has(const Row& row) const;
  void Append(const Row& row, const Maker& maker);

  std::vector<Row> rows_;
  std::vector<Maker> makers_;              // of each row
  std::map<Maker, size_t> rows_of_maker_;  // of robots
  size_t rows_of_makers_ = 0;              // of all robots
  std::map<int32_t, std::string> ids_;
  std::map<std::string, int32_t, std::less<>> robots_;
  std::map<std::pair<int32_t, int32_t>, std::string> strings_;
  std::map<std::pair<int32_t, std::string>, int32_t> numbers_;
  std::map<int32_t, int32_t> owners_;
  std::map<int32_t, size_t> rows_of_robot_;
  uint64_t hash_ = 0;
  uint64_t encoded_bytes_ = 0;
};

/// Whether a text is well-formed UTF-8 without control characters.
bool IsPlainUtf8(std::string_view text);

}  // namespace pheromone::tags
