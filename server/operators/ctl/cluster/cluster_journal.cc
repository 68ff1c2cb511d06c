#include "server/operators/ctl/cluster/cluster_journal.h"

#include <fmt/format.h>

#include <memory>
#include <optional>

#include "server/base/format.h"
#include "server/base/random.h"
#include "server/config/sections.h"
#include "server/operators/ctl/journal_commands.h"
#include "server/operators/ctl/server_call.h"
#include "server/store/journal/membership.h"
#include "server/store/journal/posix_folder.h"
#include "server/store/journal/recovery.h"

namespace pheromone::ctl {
namespace {

using journal::Membership;
using journal::PosixFolder;

struct OwnedJournal {
  std::unique_ptr<PosixFolder> folder;
  std::optional<Membership> membership;
};

// Errors: there is no journal, or a server uses it.
Result<OwnedJournal> OwnJournal(const std::string& path) {
  PHEROMONE_TRY_STATUS(HoldsJournal(path));
  OwnedJournal owned;
  PHEROMONE_TRY(owned.folder, PosixFolder::Open(path, PosixFolder::Mode::kOwner));
  PHEROMONE_TRY(owned.membership, journal::ReadMembership(*owned.folder));
  return owned;
}

}  // namespace

int LeaveCluster(const std::string& folder) {
  const Result<OwnedJournal> owned = OwnJournal(folder);
  if (!owned.ok()) {
    return Fail(kFailed, owned.error());
  }
  const std::optional<Membership>& its = owned.value().membership;
  if (!its || its->cluster.empty()) {
    return Fail(kFailed, folder + ": belongs to no cluster");
  }
  const Status left = journal::WriteMembership(
      {.new_epoch = true, .field_less_utc_ms = its->field_less_utc_ms}, owned.value().folder.get());
  if (!left.ok()) {
    return Fail(kFailed, left.error());
  }
  fmt::print(
      "{}: belongs to cluster \"{}\" no longer; remove [cluster] from its server's configuration. "
      "The next start begins an epoch: robots send HELLO again\n",
      folder, its->cluster);
  return 0;
}

int ResetCluster(const std::string& folder, const std::string& cluster, bool is_confirmed) {
  if (!config::IsName(cluster)) {
    return Fail(kUsage, "--name: found \"" + cluster +
                            "\", expected the name in [cluster] of the configuration");
  }
  Result<OwnedJournal> owned = OwnJournal(folder);
  if (!owned.ok()) {
    return Fail(kFailed, owned.error());
  }
  const Result<journal::Recovered> recovered = journal::Recover(*owned.value().folder);
  if (!recovered.ok() || recovered.value().differs ||
      (recovered.value().lost && !recovered.value().findings.empty())) {
    return Fail(kFoundDamage, recovered.ErrorOr(folder + ": is damaged; see \"journal check\""));
  }
  const journal::Recovered& state = recovered.value();
  if (!state.engine.configured()) {
    return Fail(kFailed,
                folder +
                    ": has no map; a cluster of empty journals needs no reset, only an empty "
                    "log in etcd");
  }
  const std::optional<Membership>& its = owned.value().membership;
  const std::string of = its && !its->cluster.empty()
                             ? "cluster \"" + its->cluster + "\", ID " + its->id
                             : "no cluster so far";
  fmt::print("{}: {}; {} events, the last at {} by the clock of the server that led\n", folder, of,
             state.sequence, UtcText(state.stamp.utc_ms / 1000));
  const std::string steps = fmt::format(
      "  1. stop pheromoned on all machines;\n"
      "  2. empty the cluster's log: etcdctl del --prefix /pheromone/{}/\n"
      "  3. start this server, and wait until \"pheromonectl status\" says that it leads;\n"
      "  4. on each other machine, move the journal's folder away and start the server: it takes "
      "this map.",
      cluster);
  if (!is_confirmed) {
    return Fail(
        kFailed,
        fmt::format("nothing was done: with --yes, this journal becomes the truth of cluster "
                    "\"{}\". Changes that other machines have beyond it are lost for good, so "
                    "use the journal with the most events. Then:\n{}",
                    cluster, steps));
  }
  // A server that was alone has stamped its events itself.
  const std::optional<int64_t> clock =
      its ? its->field_less_utc_ms
          : std::optional(static_cast<int64_t>(state.stamp.field_time_ms) - state.stamp.utc_ms);
  const Status written = journal::WriteMembership({.cluster = cluster,
                                                   .id = HexText(Random64()),
                                                   .founds = true,
                                                   .new_epoch = true,
                                                   .field_less_utc_ms = clock},
                                                  owned.value().folder.get());
  if (!written.ok()) {
    return Fail(kFailed, written.error());
  }
  fmt::print("{}: cluster \"{}\" will begin with this map, in a new epoch:\n{}\n", folder, cluster,
             steps);
  return 0;
}

}  // namespace pheromone::ctl
