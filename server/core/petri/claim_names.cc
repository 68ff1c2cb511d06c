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

}  // namespace

std::string RenameIn(std::string_view text, const Renaming& names) {
  std::string renamed;
  size_t done = 0;
  ClaimScanner scanner(text);
  const std::string_view first = scanner.token().text;
  for (; scanner.token().kind != TokenKind::kEnd; scanner.Next()) {
    const Token& token = scanner.token();
    const bool is_word = token.kind == TokenKind::kName && token.text.data() != first.data() &&
                         !IsKeyword(token.text, first);
    const auto found =
        is_word || token.kind == TokenKind::kQuoted ? names.find(token.text) : names.end();
    if (found != names.end()) {
      renamed += text.substr(done, token.column - 1 - done);
      renamed += Quoted(found->second);
      done = token.end - 1;
    }
  }
  return renamed += text.substr(done);
}

}  // namespace pheromone::petri
