// To which cluster a journal belongs, in the file `cluster` beside the log; without that file, to
// none. A journal of a cluster is a prefix of the cluster's log: a server that continued it alone,
// or with another log, would give other events the same sequences.
//
//   Result<std::optional<Membership>> found = ReadMembership(*folder);
//   Status written = WriteMembership({.cluster = "lab", .id = page.id}, folder);   // durable
//
// The file is replaced as a whole. It is text, a line for each field that is not empty or 0:
//
//   pheromone journal of a cluster, version 1
//   cluster lab
//   id 8f2c60aa91d2b7e3
//   founds 1
//   new_epoch 1
//   field_less_utc_ms -1700000000000
//   end
//
// Errors of reading: another program's file, another version, damage, no regular file; it is not to
// be ignored then.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "server/base/result.h"
#include "server/store/journal/folder.h"

namespace pheromone::journal {

constexpr std::string_view kMembershipName = "cluster";

struct Membership {
  /// Its configured name; empty: it was left, and nothing is to be followed.
  std::string cluster{};
  std::string id{};     ///< of its log (cluster::Page::id)
  bool founds = false;  ///< the log is to begin with this journal's state: it has to be empty
  /// The next who leads with this journal begins an epoch: others may have had changes that it
  /// lacks.
  bool new_epoch = false;
  /// Field time less UTC by this machine's clock, when it ran last; events have the UTC of another
  /// machine.
  std::optional<int64_t> field_less_utc_ms{};
  bool operator==(const Membership&) const = default;
};

std::string EncodeMembership(const Membership& membership);
/// Errors: see above.
Result<Membership> DecodeMembership(std::string_view text);

/// Nothing if there is no such file. Errors name it.
Result<std::optional<Membership>> ReadMembership(const Folder& folder);
/// Returns when it is durable. Errors, too: what ReadMembership would not read as the same, since
/// the names may come from elsewhere; nothing is written then.
Status WriteMembership(const Membership& membership, Folder* folder);
/// The journal is one that never was in a cluster. Returns when that is durable.
Status RemoveMembership(Folder* folder);

}  // namespace pheromone::journal
