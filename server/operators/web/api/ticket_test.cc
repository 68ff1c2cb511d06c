#include "server/operators/web/api/ticket.h"

#include <gtest/gtest.h>

#include <string>

namespace pheromone::web {
namespace {

constexpr char kKey[] = "0123456789abcdef";

// The code is Python's: hmac.new(key, b"viewer until 1700043200", "sha256").hexdigest()[:32].
TEST(Ticket, IsATimeAndItsCode) {
  EXPECT_EQ(MakeTicket(kKey, 1'700'000'000), "1700043200-5d7448319e45c218b5d9e52791cdc07a");
}

TEST(Ticket, IsValidForItsTimeAndForItsTokenAlone) {
  const std::string ticket = MakeTicket(kKey, 1'000'000);
  EXPECT_TRUE(IsTicket(ticket, kKey, 1'000'000));
  EXPECT_TRUE(IsTicket(ticket, kKey, 1'000'000 + kTicketSeconds - 1));
  EXPECT_FALSE(IsTicket(ticket, kKey, 1'000'000 + kTicketSeconds));
  EXPECT_FALSE(IsTicket(ticket, kKey, 999'999));  // of a clock that was set back
  EXPECT_FALSE(IsTicket(ticket, "0123456789abcdeg", 1'000'000));
}

TEST(Ticket, OfAnotherTextIsInvalid) {
  const std::string ticket = MakeTicket(kKey, 1'000'000);
  for (size_t i = 0; i < ticket.size(); ++i) {
    for (const char c : {'0', '1', 'f', '-', ' ', '\0'}) {
      std::string other = ticket;
      other[i] = c;
      EXPECT_EQ(IsTicket(other, kKey, 1'000'000), other == ticket) << other;
    }
    EXPECT_FALSE(IsTicket(ticket.substr(0, i), kKey, 1'000'000));
  }
  EXPECT_FALSE(IsTicket(ticket + '0', kKey, 1'000'000));
  EXPECT_FALSE(IsTicket(MakeTicket("", 1'000'000), "", 1'000'000));  // a server without a token
}

}  // namespace
}  // namespace pheromone::web
