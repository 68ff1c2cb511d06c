// The words of a claim, whose grammar is in property.h.
//
//   for (ClaimScanner scanner(text); scanner.token().kind != TokenKind::kEnd; scanner.Next()) ...
#pragma once

#include <cstddef>
#include <string_view>

namespace pheromone::petri {

enum class TokenKind { kName, kQuoted, kNumber, kSign, kEnd, kBad };

struct Token {
  TokenKind kind = TokenKind::kEnd;
  std::string_view text;  ///< without quotation marks
  size_t column = 0;      ///< from 1
  size_t end = 0;         ///< the column after it
};

/// Whether it may stand in a name without quotation marks: after the first letter, and as that.
bool IsOfName(char c);
bool BeginsName(char c);

class ClaimScanner {
 public:
  explicit ClaimScanner(std::string_view text) : text_(text) { Next(); }

  const Token& token() const { return token_; }

  void Next();

 private:
  std::string_view text_;
  size_t at_ = 0;
  Token token_;
};

}  // namespace pheromone::petri
