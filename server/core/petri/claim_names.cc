#include "server/core/petri/claim_names.h"

#include <algorithm>
#include <cstddef>
#include <iterator>

#include "server/core/petri/claim_scanner.h"

namespace pheromone::petri {
namespace {

// Words that mean something to the claim unless they are in quotes: the first one always, others by
// what kind of claim the first one makes it.
bool IsKeyword(std::string_view word, std::string_view first) {
  constexpr std::string_view kJoining[] = {"and", "or", "not"};
  constexpr std::string_view kOfOvertaken[] = {"at", "most", "by", "while"};
  return std::find(std::begin(kJoining), std::end(kJoining), word) != std::end(kJoining) ||
         (first == "overtaken" && std::find(std::begin(kOfOvertaken), std::end(kOfOvertaken),
                                            word) != std::end(kOfOvertaken));
}

std::string Quoted(const std::string& name) {
  const bool plain = !name.empty() && BeginsName(name[0]) &&
                     std::all_of(name.begin(), name.end(), IsOfName) &&
                     !IsKeyword(name, "overtaken");
  return plain ? name : '"' + name + '"';
}

// The text in pieces: `other` gets what is between the names.
template <typename Name, typename Other>
void TakeApart(std::string_view text, const Name& name, const Other& other) {
  size_t done = 0;
  ClaimScanner scanner(text);
  const std::string_view first = scanner.token().text;
  for (; scanner.token().kind != TokenKind::kEnd; scanner.Next()) {
    const Token& token = scanner.token();
    const bool is_word = token.kind == TokenKind::kName && token.text.data() != first.data() &&
                         !IsKeyword(token.text, first);
    if (is_word || token.kind == TokenKind::kQuoted) {
      other(text.substr(done, token.column - 1 - done));
      name(token.text, text.substr(token.column - 1, token.end - token.column));
      done = token.end - 1;
    }
  }
  other(text.substr(done));
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
        renamed += found == names.end() ? std::string(piece) : Quoted(found->second);
      },
      [&](std::string_view piece) { renamed += piece; });
  return renamed;
}

}  // namespace pheromone::petri
