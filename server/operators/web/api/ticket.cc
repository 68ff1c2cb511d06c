#include "server/operators/web/api/ticket.h"

#include <openssl/evp.h>
#include <openssl/hmac.h>

#include <array>
#include <charconv>
#include <cstddef>
#include <span>

#include "server/base/hex.h"

namespace pheromone::web {
namespace {

constexpr size_t kMacBytes = 16;  // of 32

std::string TicketUntil(std::string_view token, uint64_t end_s) {
  const std::string text = "viewer until " + std::to_string(end_s);
  std::array<unsigned char, EVP_MAX_MD_SIZE> mac{};
  unsigned size = 0;
  HMAC(EVP_sha256(), token.data(), static_cast<int>(token.size()),
       reinterpret_cast<const unsigned char*>(text.data()), text.size(), mac.data(), &size);
  return std::to_string(end_s) + '-' + HexText(std::span(mac).first(kMacBytes));
}

}  // namespace

std::string MakeTicket(std::string_view token, uint64_t now_s) {
  return TicketUntil(token, now_s + kTicketSeconds);
}

bool IsTicket(std::string_view ticket, std::string_view token, uint64_t now_s) {
  uint64_t end_s = 0;
  const auto read = std::from_chars(ticket.data(), ticket.data() + ticket.size(), end_s);
  return read.ec == std::errc() && !token.empty() && end_s > now_s &&
         end_s - now_s <= kTicketSeconds && SameSecret(ticket, TicketUntil(token, end_s));
}

bool SameSecret(std::string_view found, std::string_view secret) {
  unsigned difference = found.size() == secret.size() ? 0 : 1;
  for (size_t i = 0; i < secret.size(); ++i) {
    const char c = i < found.size() ? found[i] : '\0';
    difference |= static_cast<unsigned>(static_cast<unsigned char>(c ^ secret[i]));
  }
  return difference == 0;
}

}  // namespace pheromone::web
