#include "server/formats/nets/keys.h"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <tuple>

namespace pheromone::nets {
namespace {

constexpr size_t kMaxProblemLines = 20;
constexpr size_t kMaxQuoted = 120;

std::string QuotedShortly(std::string_view text) {
  std::string quoted;
  for (const char c : text.substr(0, kMaxQuoted)) {
    quoted += static_cast<unsigned char>(c) < 0x20 || c == 0x7F ? ' ' : c;
  }
  return '"' + quoted + (text.size() > kMaxQuoted ? "...\"" : "\"");
}

std::optional<int64_t> WholeNumber(std::string_view text) {
  int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(number)
                                                                  : std::nullopt;
}

}  // namespace

void FileProblems::Add(toml::source_position at, std::string_view key, std::string_view text) {
  std::string line = file_ + ':' + std::to_string(std::max<uint32_t>(at.line, 1)) + ':' +
                     std::to_string(std::max<uint32_t>(at.column, 1)) + ": ";
  line.append(key).append(key.empty() ? "" : ": ").append(text);
  lines_.emplace_back(at, std::move(line));
}

void FileProblems::AddLines(toml::source_position at, std::string lines) {
  // The same file may be read for several instances.
  const bool known = std::any_of(lines_.begin(), lines_.end(),
                                 [&](const auto& line) { return line.second == lines; });
  if (!known) {
    lines_.emplace_back(at, std::move(lines));
  }
}

std::string FileProblems::Text() const {
  auto sorted = lines_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
    return std::tie(a.first.line, a.first.column) < std::tie(b.first.line, b.first.column);
  });
  std::string text;
  for (size_t i = 0; i < std::min(sorted.size(), kMaxProblemLines); ++i) {
    text += (i == 0 ? "" : "\n") + sorted[i].second;
  }
  return sorted.size() <= kMaxProblemLines
             ? text
             : text + "\nand " + std::to_string(sorted.size() - kMaxProblemLines) + " more";
}

void Keys::AllowOnly(std::initializer_list<std::string_view> known) const {
  for (const auto& [key, node] : table_) {
    if (std::find(known.begin(), known.end(), key.str()) != known.end()) {
      continue;
    }
    std::string text = "unknown key, expected one of";
    for (const std::string_view word : known) {
      text.append(word == *known.begin() ? " " : ", ").append(word);
    }
    NoteAt(key.source().begin, key.str(), text);
  }
}

std::string Keys::Text(std::string_view key) const {
  const toml::node* node = table_.get(key);
  return node == nullptr ? "" : Filled(*node, key);
}

std::string Keys::Required(std::string_view key, std::string_view expected) const {
  const toml::node* node = table_.get(key);
  if (node == nullptr) {
    NoteAt(at(), key, "missing, expected " + std::string(expected));
    return "";
  }
  std::string text = Filled(*node, key);
  if (text.empty() && node->is_string()) {
    Note(key, "found \"\", expected " + std::string(expected));
  }
  return text;
}

std::string Keys::Id() const {
  std::string id = Required("id", "a name of letters, digits, _ . and -");
  if (!id.empty() && !IsPlainId(id)) {
    Note("id", "found " + QuotedShortly(id) + ", expected letters, digits, _ . and -");
  }
  return id;
}

int64_t Keys::Number(std::string_view key, int64_t least, int64_t most,
                     std::optional<int64_t> fallback) const {
  const std::string range =
      "a whole number from " + std::to_string(least) + " to " + std::to_string(most);
  const toml::node* node = table_.get(key);
  if (node == nullptr) {
    if (!fallback) {
      NoteAt(at(), key, "missing, expected " + range);
    }
    return fallback.value_or(least);
  }
  std::optional<int64_t> number;
  std::string found = Described(*node);
  if (const auto* integer = node->as_integer()) {
    number = integer->get();
  } else if (node->is_string()) {
    const std::string filled = Filled(*node, key);
    if (filled.empty()) {
      return fallback.value_or(least);
    }
    number = WholeNumber(filled);
    found += filled == *node->value<std::string>() ? "" : ", that is " + QuotedShortly(filled);
  }
  if (!number || *number < least || *number > most) {
    Note(key, "found " + found + ", expected " + range);
    return fallback.value_or(least);
  }
  return *number;
}

std::vector<Located> Keys::Texts(std::string_view key) const {
  std::vector<Located> texts;
  const toml::node* node = table_.get(key);
  if (node == nullptr) {
    return texts;
  }
  const toml::array* array = node->as_array();
  if (array == nullptr) {
    Note(key, "found " + Described(*node) + ", expected an array of strings");
    return texts;
  }
  for (const toml::node& item : *array) {
    if (std::string text = Filled(item, key); !text.empty()) {
      texts.push_back({std::move(text), item.source().begin});
    }
  }
  return texts;
}

std::vector<Keys> Keys::Tables(std::string_view key) const {
  std::vector<Keys> tables;
  const toml::node* node = table_.get(key);
  const toml::array* array = node != nullptr ? node->as_array() : nullptr;
  if (node != nullptr && array == nullptr) {
    Note(key, "found " + Described(*node) + ", expected tables [[" + KeyOf(key) + "]]");
  }
  for (size_t i = 0; array != nullptr && i < array->size(); ++i) {
    const toml::node& item = (*array)[i];
    const std::string path = KeyOf(key) + '[' + std::to_string(i + 1) + ']';
    if (const toml::table* table = item.as_table()) {
      tables.emplace_back(*table, path, scope_);
    } else {
      scope_.problems->Add(item.source().begin, path,
                           "found " + Described(item) + ", expected a table");
    }
  }
  return tables;
}

std::optional<Keys> Keys::Table(std::string_view key) const {
  const toml::node* node = table_.get(key);
  if (node == nullptr) {
    return std::nullopt;
  }
  if (!node->is_table()) {
    Note(key, "found " + Described(*node) + ", expected a table");
    return std::nullopt;
  }
  return Keys(*node->as_table(), KeyOf(key), scope_);
}

std::vector<std::pair<Located, Located>> Keys::Entries() const {
  std::vector<std::pair<Located, Located>> entries;
  for (const auto& [key, node] : table_) {
    if (std::string text = Filled(node, key.str()); !text.empty()) {
      entries.emplace_back(Located{std::string(key.str()), key.source().begin},
                           Located{std::move(text), node.source().begin});
    }
  }
  return entries;
}

std::vector<std::string> Keys::Names() const {
  std::vector<std::string> names;
  for (const auto& [key, node] : table_) {
    names.emplace_back(key.str());
  }
  return names;
}

bool Keys::IsTable(std::string_view key) const {
  const toml::node* node = table_.get(key);
  return node != nullptr && node->is_table();
}

void Keys::Note(std::string_view key, std::string_view text) const {
  const toml::node* node = table_.get(key);
  NoteAt(node != nullptr ? node->source().begin : at(), key, text);
}

void Keys::NoteAt(toml::source_position at, std::string_view key, std::string_view text) const {
  scope_.problems->Add(at, KeyOf(key), text);
}

std::string Keys::KeyOf(std::string_view key) const {
  std::string whole = path_;
  return whole.append(path_.empty() || key.empty() ? "" : ".").append(key);
}

// Empty if it is no string, or cannot be filled in.
std::string Keys::Filled(const toml::node& node, std::string_view key) const {
  const auto* text = node.as_string();
  if (text == nullptr) {
    NoteAt(node.source().begin, key, "found " + Described(node) + ", expected a string");
    return "";
  }
  Result<std::string> filled = FillIn(text->get(), scope_.parameters, scope_.as);
  if (!filled.ok()) {
    NoteAt(node.source().begin, key, filled.error());
    return "";
  }
  return std::move(filled).value();
}

std::string Described(const toml::node& node) {
  if (const auto* text = node.as_string()) {
    return "the string " + QuotedShortly(text->get());
  }
  if (const auto* number = node.as_integer()) {
    return std::to_string(number->get());
  }
  if (const auto* boolean = node.as_boolean()) {
    return boolean->get() ? "true" : "false";
  }
  return node.is_table() ? "a table" : node.is_array() ? "an array" : "no integer or string";
}

bool IsPlainId(std::string_view id) {
  return !id.empty() && id.find_first_not_of(
                            "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                            "0123456789_.-") == std::string_view::npos;
}

}  // namespace pheromone::nets
