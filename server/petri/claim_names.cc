#include "server/petri/claim_names.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace pheromone::petri {
namespace {

bool IsNameLetter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
         c == '.' || c == '-';
}

bool BeginsName(char c) {
  return IsNameLetter(c) && !(c >= '0' && c <= '9') && c != '-';
}

std::string Quoted(const std::string& name) {
  const bool plain =
      !name.empty() && BeginsName(name[0]) && std::all_of(name.begin(), name.end(), IsNameLetter);
  return plain ? name : '"' + name + '"';
}

// Words that mean something to the claim unless they are in quotes: the first one always, others by
// what kind of claim the first one makes it.
bool IsKeyword(std::string_view word, std::string_view first, bool is_first) {
  constexpr std::array<std::string_view, 3> kJoining = {"and", "or", "not"};
  constexpr std::array<std::string_view, 4> kOfOvertaken = {"at", "most", "by", "while"};
  return is_first || std::find(kJoining.begin(), kJoining.end(), word) != kJoining.end() ||
         (first == "overtaken" &&
          std::find(kOfOvertaken.begin(), kOfOvertaken.end(), word) != kOfOvertaken.end());
}

// The text in pieces: `other` gets what is between the names.
template <typename Name, typename Other>
void TakeApart(std::string_view text, const Name& name, const Other& other) {
  std::string_view first;
  size_t at = 0;
  while (at < text.size()) {
    size_t end = at + 1;
    if (text[at] == '"') {
      end = std::min(text.find('"', end), text.size());
      name(text.substr(at + 1, end - at - 1), text.substr(at, end + 1 - at));
      at = std::min(end + 1, text.size());
      continue;
    }
    if (IsNameLetter(text[at])) {
      while (end < text.size() && IsNameLetter(text[end])) {
        ++end;
      }
    }
    const std::string_view piece = text.substr(at, end - at);
    const bool is_first = first.empty() && BeginsName(text[at]);
    first = is_first ? piece : first;
    if (BeginsName(text[at]) && !IsKeyword(piece, first, is_first)) {
      name(piece, piece);
    } else {
      other(piece);
    }
    at = end;
  }
}

}  // namespace

void ForEachName(std::string_view text, const std::function<void(std::string_view)>& use) {
  TakeApart(
      text, [&](std::string_view name, std::string_view) { use(name); }, [](std::string_view) {});
}

std::string RenameIn(std::string_view text, const Renaming& names) {
  std::string renamed;
  TakeApart(
      text,
      [&](std::string_view name, std::string_view piece) {
        const auto found = names.find(name);
        renamed += found == names.end()   ? std::string(piece)
                   : piece.front() == '"' ? '"' + found->second + '"'
                                          : Quoted(found->second);
      },
      [&](std::string_view piece) { renamed += piece; });
  return renamed;
}

}  // namespace pheromone::petri
