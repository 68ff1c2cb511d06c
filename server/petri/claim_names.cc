#include "server/petri/claim_names.h"

#include <algorithm>
#include <cstddef>
#include <iterator>

#include "server/petri/claim_scanner.h"

namespace pheromone::petri {
namespace {

std::string Quoted(const std::string& name) {
  const bool plain = !name.empty() && BeginsName(name[0]) &&
                     std::all_of(name.begin(), name.end(), IsOfName) &&
                     !IsKeyword({TokenKind::kName, name, 2, 0});
  return plain ? name : '"' + name + '"';
}

// Words that the grammar has. As IDs of places they are in quotes; the first word is none at all.
bool IsKeyword(const Token& token) {
  static constexpr std::string_view kWords[] = {"and", "at", "by", "most", "not", "or", "while"};
  return token.kind == TokenKind::kName &&
         (token.column == 1 ||
          std::find(std::begin(kWords), std::end(kWords), token.text) != std::end(kWords));
}

// The text in pieces: `other` gets what is between the names.
template <typename Name, typename Other>
void TakeApart(std::string_view text, const Name& name, const Other& other) {
  size_t done = 0;
  for (ClaimScanner scanner(text); scanner.token().kind != TokenKind::kEnd; scanner.Next()) {
    const Token& token = scanner.token();
    if (!IsKeyword(token) && (token.kind == TokenKind::kName || token.kind == TokenKind::kQuoted)) {
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
