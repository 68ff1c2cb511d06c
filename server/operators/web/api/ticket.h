// Tickets for viewers, which can say who they are in their address only: proxies and histories keep
// addresses, so the token does not belong there. A ticket is made with the token, lets a viewer
// change what viewers may change, and ends by itself.
//
//   const std::string ticket = MakeTicket(token, now_s);       // ws://HOST:PORT/?ticket=...
//   if (IsTicket(ticket, token, later_s)) { it may make changes }
//
// The time until which it is valid, and an HMAC-SHA-256 of it (RFC 2104) with the token as the key:
// nothing is kept, and another token ends all of them. Any thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace pheromone::web {

constexpr uint64_t kTicketSeconds = 12 * 3600;

/// `now_s` is UTC, in seconds since 1970.
std::string MakeTicket(std::string_view token, uint64_t now_s);
bool IsTicket(std::string_view ticket, std::string_view token, uint64_t now_s);

/// The time that this takes does not depend on where `found` differs.
bool SameSecret(std::string_view found, std::string_view secret);

}  // namespace pheromone::web
