// Which server may send on a link that several have: a radio channel with a modem at each of them.
// One at a time, by a lease. Sans I/O: time and registers go in, requests come out.
//
//   LinkOwners owners("a", instance, {{.name = "radio-a", .rank = 0}});
//   owners.SetUsable(0, true);                       // its port is open
//   owners.SetInUse(0, in_use_until_ms);             // what was begun is on the air until then
//   for (const LinkOwners::Request& it : owners.Next(now_ms)) ...   // read or set the register
//   owners.OnRegister(it.link, register, now_ms);    // the answer to it
//   ... again at owners.Deadline(now_ms)
//   owners.until_ms(0) > now_ms                      // it may send, at present
//
// Each link has a register in the replicated log's engine, which is changed by comparison only
// (ReplicatedLog::SetRegister). Its value names the owner, the process, the number of the change,
// and for how long the lease is. The owner writes it again three times a lease, so two writes a
// second for each link; the others read it, which costs the engine no write.
//
// Why two never send at once. R is a revision of the register, L its lease.
//  1. Who wrote R may send until the time of *asking* for it, plus L, by its own clock; and only
//     once it knows that R was written by this very request, from the number in it. Else a late
//     success of an earlier request would count from a later time.
//  2. Another one writes only over a revision R that it has seen, after L and the largest drift of
//     the clocks by its own clock. It saw R after R was asked for: so the lease of R is over.
//  3. Its write is compared with R. If R was renewed meanwhile, it fails; if not, there is no lease
//     later than that of R.
//  4. Who frees it, because its port fails or it ends, first has no permit any more, then learns
//     what was begun before (SetInUse), and writes that it is free when that is over.
// The clocks are never compared, only their rates, which drift by less than 2 %. They are
// CLOCK_BOOTTIME, which goes on while a machine is suspended. A process that was stopped finds its
// lease over, since the sender asks the clock directly before each write (links::SendPermit), and
// refuses what would still be on the air at the end of the lease. What remains: a process that is
// stopped in the microseconds between the clock and the write sends that one transmission when it
// goes on.
//
// A register that is absent, or that nobody can read, counts as a lease of this link's own length:
// the engine may have been restored while an owner still sends.
//
// The usable server with the lowest rank takes what is free. It stays with whoever has it, until
// that one's lease ends, or its port cannot be used, or it ends: nothing flaps.
//
// Not thread-safe. Milliseconds of CLOCK_BOOTTIME.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"
#include "server/cluster/replicated_log.h"

namespace pheromone::cluster {

constexpr uint64_t kLinkLeaseMs = 1'500;
constexpr uint64_t kMaxLinkLeaseMs = 60'000;  // of slow channels

struct SharedLink {
  std::string name;
  uint32_t rank = 0;  ///< of this server among those that have it
  uint64_t lease_ms = kLinkLeaseMs;
};

/// A register's value: "NODE PROCESS CHANGE LEASE", the numbers decimal.
struct LinkLease {
  std::string node;
  uint64_t process = 0;
  uint64_t change = 0;    ///< counted by the process
  uint64_t lease_ms = 0;  ///< 0: it is free
  bool operator==(const LinkLease&) const = default;
};
std::string EncodeLinkLease(const LinkLease& lease);
/// Errors: anything else.
Result<LinkLease> DecodeLinkLease(std::string_view text);

class LinkOwners {
 public:
  /// `process`: random. `node` has no space.
  LinkOwners(std::string node, uint64_t process, std::vector<SharedLink> links);

  struct Request {
    size_t link = 0;
    bool sets = false;  ///< else it reads
    uint64_t seen = 0;  ///< the revision to compare with, if it sets
    std::string value{};
  };
  /// What to ask for now: at most one request of each link at a time.
  std::vector<Request> Next(uint64_t now_ms);
  /// The answer. Errors: there was none.
  void OnRegister(size_t link, const Result<Register>& answer, uint64_t now_ms);
  /// When Next has something to ask for, or an own lease ends; UINT64_MAX: after OnRegister.
  uint64_t Deadline(uint64_t now_ms) const;

  /// Whether this server could send; false at first.
  void SetUsable(size_t link, bool is_usable) { links_[link].is_usable = is_usable; }
  /// Until when what was begun is on the air, as known after the last until_ms was passed on to who
  /// sends: the link is not freed before. To be said before each Next.
  void SetInUse(size_t link, uint64_t until_ms) { links_[link].in_use_until_ms = until_ms; }
  /// Frees what it has, and takes nothing any more.
  void Release() { is_releasing_ = true; }
  /// Whether it has, or may have, any.
  bool has_any() const;

  /// This server may send until then; past, or 0: it may not.
  uint64_t until_ms(size_t link) const { return links_[link].until_ms; }
  /// Who has it as far as is known; empty: nobody.
  std::string owner(size_t link) const {
    const LinkLease& lease = links_[link].lease;
    return lease.lease_ms == 0 ? "" : lease.node;
  }

 private:
  static constexpr uint64_t kNever = UINT64_MAX;

  struct Link {
    SharedLink settings;
    bool is_usable = false;
    bool is_known = false;
    Register there;
    LinkLease lease;             // what that says
    uint64_t seen_ms = 0;        // when this revision was seen first
    uint64_t until_ms = 0;       // of the own lease
    uint64_t ended_ms = kNever;  // since when it begins nothing any more
    uint64_t in_use_until_ms = 0;
    bool is_asked = false;
    LinkLease asked;
    bool sets = false;      // the request
    uint64_t asked_ms = 0;  // when it was made
    uint64_t next_ms = 0;   // no request before
  };

  bool IsOwn(const Link& link) const;
  bool MaySend(const Link& link) const { return link.is_usable && !is_releasing_; }
  uint64_t ClaimAt(const Link& link) const;
  uint64_t DueAt(const Link& link) const;

  const std::string node_;
  const uint64_t process_;
  std::vector<Link> links_;
  uint64_t changes_ = 0;
  bool is_releasing_ = false;
};

}  // namespace pheromone::cluster
