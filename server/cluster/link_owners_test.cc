// Who may send on a shared link, in virtual time: servers with clocks of their own, one register,
// and requests that are slow, lost, or executed long after they were given up. They send, too, as a
// link does (links::SendPermit): what was given to a driver is on the air even if its server stops.
#include "server/cluster/link_owners.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "server/robots/links/send_permit.h"

namespace pheromone::cluster {
namespace {

TEST(LinkLease, IsEncodedAsTextAndDecodedStrictly) {
  const LinkLease lease{"a", 18446744073709551615u, 7, 1500};
  EXPECT_EQ(EncodeLinkLease(lease), "a 18446744073709551615 7 1500");
  EXPECT_EQ(DecodeLinkLease(EncodeLinkLease(lease)).value(), lease);
  for (const char* text : {"", "a", "a 1 2", "a 1 2 ", "a 1 2 3 4", " 1 2 3", "a 1 2 -3",
                           "a 1 2 60001", "a x 2 3", "a 1 2 18446744073709551616"}) {
    EXPECT_FALSE(DecodeLinkLease(text).ok()) << text;
  }
}

// The clock of the server that is looked at.
uint64_t permit_clock_ms = 0;

// Servers that share one link. Time is real time, in ms; each server's clock has its own rate.
class Room {
 public:
  struct Server {
    std::unique_ptr<LinkOwners> owners;
    std::unique_ptr<links::SendPermit> permit;
    uint64_t on_air_until = 0;
    double rate = 1.0;
    double offset = 0;
    uint64_t paused_until = 0;
    bool is_cut = false;
    uint64_t process = 0;
  };
  struct Pending {  // a request or an answer, on its way
    uint64_t at = 0;
    std::function<void()> happen;
  };

  explicit Room(int count, uint64_t seed = 1)
      : random_(seed), servers_(static_cast<size_t>(count)) {
    for (int i = 0; i < count; ++i) {
      server(i).offset = 1'000.0 * (i + 1);
      Restart(i);
    }
  }

  Server& server(int i) { return servers_[static_cast<size_t>(i)]; }
  uint64_t now() const { return now_; }
  void Restart(int i) {
    Server& it = server(i);
    it.process = ++processes_;
    it.owners = std::make_unique<LinkOwners>(
        std::string(1, static_cast<char>('a' + i)), it.process,
        std::vector<SharedLink>{{.name = "radio", .rank = static_cast<uint32_t>(i)}});
    it.owners->SetUsable(0, true);
    it.permit = std::make_unique<links::SendPermit>([] { return permit_clock_ms; });
  }
  uint64_t ClockOf(const Server& it) const {
    return static_cast<uint64_t>(it.offset + it.rate * static_cast<double>(now_));
  }
  // A stopped process sends nothing; when it goes on, it asks its clock first.
  bool MaySend(int i) {
    Server& it = server(i);
    return now_ >= it.paused_until && ClockOf(it) < it.owners->until_ms(0);
  }
  std::vector<int> Senders() {
    std::vector<int> senders;
    for (int i = 0; i < static_cast<int>(servers_.size()); ++i) {
      if (MaySend(i)) {
        senders.push_back(i);
      }
    }
    return senders;
  }
  void RunUntil(uint64_t end) {
    for (; now_ < end; ++now_) {
      for (size_t i = 0; i < pending_.size(); ++i) {
        if (pending_[i].at <= now_) {
          const auto happen = std::move(pending_[i].happen);
          pending_.erase(pending_.begin() + static_cast<std::ptrdiff_t>(i--));
          happen();
        }
      }
      for (int i = 0; i < static_cast<int>(servers_.size()); ++i) {
        if (now_ >= server(i).paused_until) {
          Continue(i);
          Send(&server(i));
        }
      }
      const std::vector<int> senders = Senders();
      ASSERT_LE(senders.size(), 1u) << "at " << now_;
      const auto on_air = std::count_if(servers_.begin(), servers_.end(), [this](const Server& it) {
        return now_ < it.on_air_until;
      });
      ASSERT_LE(on_air, 1) << "at " << now_;
      transmissions_ms_ += static_cast<uint64_t>(on_air);
      sent_[senders.empty() ? -1 : senders[0]]++;
    }
  }
  /// For how many ms each could send; -1: nobody.
  std::map<int, int>& sent() { return sent_; }
  size_t sets() const { return sets_; }
  /// For how many ms somebody was on the air.
  uint64_t transmissions_ms() const { return transmissions_ms_; }

  bool is_rough = false;     // requests are slow, lost, late
  uint64_t longest_ms = 60;  // of transmissions

 private:
  uint64_t Delay() {
    if (!is_rough) {
      return 3;
    }
    const uint64_t kind = random_() % 100;
    return kind < 80 ? random_() % 10 : kind < 97 ? random_() % 400 : random_() % 6'000;
  }

  // One transmission after the other, as long as it may. The driver takes a little to begin.
  void Send(Server* it) {
    if (now_ < it->on_air_until) {
      return;
    }
    const uint64_t lasts_ms = 1 + random_() % (random_() % 8 == 0 ? longest_ms : 60);
    permit_clock_ms = ClockOf(*it);
    if (it->permit->Claim(std::chrono::milliseconds(lasts_ms))) {
      it->on_air_until = now_ + random_() % 10 + lasts_ms;
    }
  }

  void Continue(int i) {
    Server& it = server(i);
    it.owners->SetInUse(0, it.permit->in_use_until_ms());
    const std::vector<LinkOwners::Request> requests = it.owners->Next(ClockOf(it));
    permit_clock_ms = ClockOf(it);
    it.permit->Set(it.owners->until_ms(0), it.owners->owner(0));
    for (const LinkOwners::Request& request : requests) {
      // Answered once: by the answer, or by the patience of who asks.
      const auto answered = std::make_shared<bool>(false);
      const auto answer = [this, i, answered, process = it.process](const Result<Register>& told) {
        Server& asker = server(i);
        if (asker.process == process && !*answered) {
          if (now_ < asker.paused_until) {
            pending_.push_back({asker.paused_until, [this, i, answered, process, told] {
                                  if (server(i).process == process && !*answered) {
                                    *answered = true;
                                    server(i).owners->OnRegister(0, told, ClockOf(server(i)));
                                  }
                                }});
            return;
          }
          *answered = true;
          asker.owners->OnRegister(0, told, ClockOf(asker));
        }
      };
      pending_.push_back({now_ + 500, [answer] { answer(Error{"no answer"}); }});
      if (it.is_cut || (is_rough && random_() % 20 == 0)) {
        continue;
      }
      pending_.push_back(
          {now_ + Delay(), [this, i, request, answer] {
             if (request.sets && register_.revision == request.seen) {
               register_ = {++revision_, request.value};
               ++sets_;
             }
             if (!server(i).is_cut && !(is_rough && random_() % 20 == 0)) {
               pending_.push_back({now_ + Delay(), [answer, now = register_] { answer(now); }});
             }
           }});
    }
  }

  std::mt19937_64 random_;
  std::vector<Server> servers_;
  std::vector<Pending> pending_;
  Register register_;
  uint64_t revision_ = 100;
  uint64_t now_ = 0;
  uint64_t processes_ = 0;
  size_t sets_ = 0;
  uint64_t transmissions_ms_ = 0;
  std::map<int, int> sent_;
};

constexpr uint64_t kSoonMs = kLinkLeaseMs + kLinkLeaseMs / 50 + 300;

TEST(LinkOwners, TheFirstOneOfTheListHasItAndKeepsItByTwoWritesASecond) {
  Room room(3);
  room.RunUntil(kSoonMs);
  EXPECT_EQ(room.Senders(), std::vector<int>{0});
  room.sent().clear();
  const size_t before = room.sets();
  room.RunUntil(room.now() + 10'000);
  EXPECT_EQ(room.sent(), (std::map<int, int>{{0, 10'000}}));
  EXPECT_LE(room.sets() - before, 21u);
  EXPECT_EQ(room.server(2).owners->owner(0), "a");
}

TEST(LinkOwners, AStandbyTakesOverWhenTheOwnerIsStoppedAndKeepsItWhenThatOneGoesOn) {
  Room room(2);
  room.RunUntil(5'000);
  room.server(0).paused_until = 9'000;
  room.RunUntil(5'000 + kSoonMs);
  EXPECT_EQ(room.Senders(), std::vector<int>{1});
  room.sent().clear();
  room.RunUntil(20'000);
  EXPECT_EQ(room.sent().size(), 1u);
  EXPECT_EQ(room.Senders(), std::vector<int>{1});
  EXPECT_EQ(room.server(0).owners->owner(0), "b");
}

TEST(LinkOwners, AnOwnerThatIsCutOffFromTheEngineStopsBeforeTheStandbyBegins) {
  Room room(2);
  room.RunUntil(5'000);
  room.server(0).is_cut = true;
  room.sent().clear();
  room.RunUntil(5'000 + kSoonMs);
  EXPECT_EQ(room.Senders(), std::vector<int>{1});
  EXPECT_GT(room.sent()[0], static_cast<int>(kLinkLeaseMs / 2));
  room.server(0).is_cut = false;
  room.RunUntil(12'000);
  EXPECT_EQ(room.Senders(), std::vector<int>{1});
}

TEST(LinkOwners, AShortPauseOfTheEngineCostsNothing) {
  Room room(2);
  room.RunUntil(5'000);
  room.sent().clear();
  room.server(0).is_cut = room.server(1).is_cut = true;
  room.RunUntil(5'550);
  room.server(0).is_cut = room.server(1).is_cut = false;
  room.RunUntil(8'000);
  EXPECT_EQ(room.sent(), (std::map<int, int>{{0, 3'000}}));
}

TEST(LinkOwners, WhoCannotUseItsPortOrEndsFreesItAtOnceWhenItHasSent) {
  for (const bool ends : {false, true}) {
    Room room(2);
    room.RunUntil(5'000);
    ends ? room.server(0).owners->Release() : room.server(0).owners->SetUsable(0, false);
    room.RunUntil(5'900);
    EXPECT_EQ(room.Senders(), std::vector<int>{1});
    EXPECT_FALSE(room.server(0).owners->has_any());
    room.server(0).owners->SetUsable(0, true);
    room.RunUntil(9'000);
    EXPECT_EQ(room.Senders(), std::vector<int>{1});
    room.server(1).owners->SetUsable(0, false);
    room.RunUntil(9'900);
    EXPECT_EQ(room.Senders(), ends ? std::vector<int>{} : std::vector<int>{0});
    EXPECT_EQ(room.server(1).owners->owner(0), ends ? "" : "a");
  }
}

TEST(LinkOwners, ARestartedServerWaitsForTheLeaseOfItsFormerProcess) {
  Room room(1);
  room.RunUntil(5'000);
  room.Restart(0);
  room.sent().clear();
  room.RunUntil(5'000 + kSoonMs);
  EXPECT_EQ(room.Senders(), std::vector<int>{0});
  EXPECT_GE(room.sent()[-1], static_cast<int>(kLinkLeaseMs * 2 / 3));
}

// A later success of a request that was given up says nothing about the one after it.
TEST(LinkOwners, ALeaseBeginsWithTheRequestThatWasWritten) {
  LinkOwners owners("a", 7, {{.name = "radio"}});
  owners.SetUsable(0, true);
  (void)owners.Next(0);
  owners.OnRegister(0, Register{}, 0);
  uint64_t now_ms = owners.Deadline(0);
  while (!owners.Next(now_ms).empty() && now_ms < kLinkLeaseMs) {  // reads
    owners.OnRegister(0, Register{}, now_ms);
    now_ms = owners.Deadline(now_ms);
  }
  owners.OnRegister(0, Error{"no answer"}, now_ms);  // the first claim, which arrives nevertheless
  now_ms = owners.Deadline(now_ms);
  const auto second = owners.Next(now_ms);
  ASSERT_EQ(second.size(), 1u);
  ASSERT_TRUE(second[0].sets);
  LinkLease first = DecodeLinkLease(second[0].value).value();
  --first.change;
  owners.OnRegister(0, Register{3, EncodeLinkLease(first)}, now_ms);
  EXPECT_EQ(owners.until_ms(0), 0u);
  const auto third = owners.Next(now_ms);
  ASSERT_EQ(third.size(), 1u);
  EXPECT_EQ(third[0].seen, 3u);
  owners.OnRegister(0, Register{4, third[0].value}, now_ms + 40);
  EXPECT_EQ(owners.until_ms(0), now_ms + kLinkLeaseMs);
}

// What was begun before is on the air until its end.
TEST(LinkOwners, ALinkIsFreedWhenTheLastTransmissionIsOver) {
  Room room(2);
  room.longest_ms = 1'200;
  for (int i = 0; i < 40 && !testing::Test::HasFatalFailure(); ++i) {
    room.RunUntil(room.now() + 2'500 + static_cast<uint64_t>(7 * i));
    const std::vector<int> senders = room.Senders();
    ASSERT_EQ(senders.size(), 1u);
    room.server(senders[0]).owners->SetUsable(0, false);
    room.server(1 - senders[0]).owners->SetUsable(0, true);
  }
}

// The one with the fast clock is the first of the list, and waits for nothing else.
TEST(LinkOwners, TheLeaseOfASlowClockIsOverWhenAFastOneTakesOver) {
  Room room(2);
  room.server(0).rate = 1.01;
  room.server(1).rate = 0.991;
  for (int i = 0; i < 60 && !testing::Test::HasFatalFailure(); ++i) {
    room.server(0).owners->SetUsable(0, false);
    room.RunUntil(room.now() + 3'000);
    ASSERT_EQ(room.Senders(), std::vector<int>{1});
    room.server(0).owners->SetUsable(0, true);
    room.RunUntil(room.now() + 1'000 + static_cast<uint64_t>(7 * i));
    room.server(1).is_cut = true;
    room.RunUntil(room.now() + kSoonMs);
    ASSERT_EQ(room.Senders(), std::vector<int>{0});
    room.server(1).is_cut = false;
  }
}

// Pauses, cuts, restarts, ports that fail, servers that end, slow and lost requests, clocks that
// drift nearly 2 % apart, in all orders.
TEST(LinkOwners, TwoAreNeverOnTheAirAtOnceWhateverHappens) {
  uint64_t by_others = 0;
  uint64_t transmissions_ms = 0;
  for (uint64_t seed = 1; seed <= 12 && !testing::Test::HasFatalFailure(); ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    Room room(3, seed);
    room.is_rough = true;
    room.longest_ms = 1'000;
    for (int i = 0; i < 3; ++i) {
      room.server(i).rate = (seed % 2 == 0 ? 0.991 : 1.01) + (seed % 2 == 0 ? 0.0095 : -0.0095) * i;
    }
    for (int step = 0; step < 120; ++step) {
      const int i = static_cast<int>(random() % 3);
      Room::Server& it = room.server(i);
      switch (random() % 9) {
        case 0:
        case 1:
          it.paused_until = std::max(it.paused_until, room.now() + random() % 4'000);
          break;
        case 2:
          it.is_cut = !it.is_cut;
          break;
        case 3:
          it.owners->SetUsable(0, random() % 4 != 0);
          break;
        case 4:
          room.Restart(i);
          break;
        case 5:
          it.owners->Release();
          break;
        default:
          it.is_cut = false;
          it.owners->SetUsable(0, true);
          break;
      }
      room.RunUntil(room.now() + random() % 800);
    }
    by_others += static_cast<uint64_t>(room.sent()[1]) + static_cast<uint64_t>(room.sent()[2]);
    transmissions_ms += room.transmissions_ms();
  }
  EXPECT_GT(by_others, 20'000u);  // it was taken over many times
  EXPECT_GT(transmissions_ms, 50'000u);
}

}  // namespace
}  // namespace pheromone::cluster
