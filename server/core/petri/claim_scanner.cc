#include "server/core/petri/claim_scanner.h"

#include <algorithm>
#include <cctype>

namespace pheromone::petri {

bool IsOfName(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.' || c == '-';
}

// Not a digit or -: `a - 1` is a sum, and `a-1` a name.
bool BeginsName(char c) {
  return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_';
}

void ClaimScanner::Next() {
  while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) {
    ++at_;
  }
  token_ = {TokenKind::kEnd, {}, at_ + 1};
  if (at_ == text_.size()) {
    return;
  }
  const char c = text_[at_];
  size_t end = at_ + 1;
  if (c == '"') {
    end = std::min(text_.find('"', end), text_.size());
    token_.kind = end == text_.size() ? TokenKind::kBad : TokenKind::kQuoted;
    token_.text = text_.substr(at_ + 1, end - at_ - 1);
    at_ = std::min(end + 1, text_.size());
    token_.end = at_ + 1;
    return;
  }
  if (BeginsName(c)) {
    token_.kind = TokenKind::kName;
    while (end < text_.size() && IsOfName(text_[end])) {
      ++end;
    }
  } else if (std::isdigit(static_cast<unsigned char>(c)) != 0) {
    token_.kind = TokenKind::kNumber;
    while (end < text_.size() && std::isdigit(static_cast<unsigned char>(text_[end])) != 0) {
      ++end;
    }
  } else {
    token_.kind = TokenKind::kSign;
    const std::string_view two = text_.substr(at_, 2);
    end += two == "<=" || two == ">=" || two == "!=" ? 1U : 0U;
  }
  token_.text = text_.substr(at_, end - at_);
  at_ = end;
  token_.end = at_ + 1;
}

}  // namespace pheromone::petri
