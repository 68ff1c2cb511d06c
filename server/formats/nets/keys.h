// Reading the tables of a net's file key by key. What is wrong is noted with its line, and reading
// goes on: one run finds all mistakes of a file.
//
//   const Keys place(table, "place[1]", scope);
//   place.AllowOnly({"id", "tokens"});
//   const std::string id = place.Required("id", "a name");
//   const int64_t tokens = place.Number("tokens", 0, kMaxTokens, 0);
//
// A getter that has noted a problem returns its fallback. One thread.
#pragma once

#include <toml++/toml.h>

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/base/result.h"
#include "server/formats/nets/placeholders.h"

namespace pheromone::nets {

/// The mistakes found in one file and in those that it names.
class FileProblems {
 public:
  explicit FileProblems(std::string_view file) : file_(file) {}

  /// `FILE:LINE:COL: KEY: TEXT`
  void Add(toml::source_position at, std::string_view key, std::string_view text);
  /// As another file has it.
  void AddLines(toml::source_position at, std::string lines);

  bool empty() const { return lines_.empty(); }
  /// In the order of the file; the first twenty.
  std::string Text() const;

 private:
  std::string file_;
  std::vector<std::pair<toml::source_position, std::string>> lines_{};
};

/// What the file is read for.
struct Scope {
  Parameters parameters{};
  std::string as{};
  FileProblems* problems = nullptr;
};

/// A string of the file, filled in.
struct Located {
  std::string text;
  toml::source_position at;
};

class Keys {
 public:
  /// `table` and `scope` outlive it. `path` is the table's own key.
  Keys(const toml::table& table, std::string path, const Scope& scope)
      : table_(table), path_(std::move(path)), scope_(scope) {}

  /// Notes keys that are not among `known`.
  void AllowOnly(std::initializer_list<std::string_view> known) const;

  std::string Text(std::string_view key) const;
  std::string Required(std::string_view key, std::string_view expected) const;
  /// Letters, digits, _ . and -
  std::string Id() const;
  /// An integer, or a string that is one when it is filled in.
  int64_t Number(std::string_view key, int64_t least, int64_t most,
                 std::optional<int64_t> fallback) const;
  std::vector<Located> Texts(std::string_view key) const;
  std::vector<Keys> Tables(std::string_view key) const;
  std::optional<Keys> Table(std::string_view key) const;
  /// All entries, as strings by key.
  std::vector<std::pair<Located, Located>> Entries() const;
  std::vector<std::string> Names() const;

  bool Has(std::string_view key) const { return table_.get(key) != nullptr; }
  bool IsTable(std::string_view key) const;
  void Note(std::string_view key, std::string_view text) const;
  void NoteAt(toml::source_position at, std::string_view key, std::string_view text) const;
  toml::source_position at() const { return table_.source().begin; }
  std::string KeyOf(std::string_view key) const;
  const Scope& scope() const { return scope_; }
  /// The same table, read for something else.
  Keys For(const Scope& scope) const { return {table_, path_, scope}; }

 private:
  std::string Filled(const toml::node& node, std::string_view key) const;

  const toml::table& table_;
  std::string path_;
  const Scope& scope_;
};

/// What a value of a file is, for messages: `the string "x"`, `3`, `a table`.
std::string Described(const toml::node& node);

bool IsPlainId(std::string_view id);

}  // namespace pheromone::nets
