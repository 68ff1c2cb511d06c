// Revoking the keys of robots.
#include <utility>

#include "server/daemon/live_control.h"
#include "server/daemon/revocations.h"

namespace pheromone::daemon {

void LiveControl::RevokeKeys(std::span<const uint8_t> robots,
                             DoneWith<std::vector<std::string>> done) {
  Result<Revocation> found = FindKeys(parts_.keys(), robots);
  if (!found.ok()) {
    done(found.error());
    return;
  }
  Revoke({std::move(found.value().keys)},
         [done = std::move(done), links = std::move(found.value().links)](const Status& revoked) {
           done(revoked.ok() ? Result(links) : revoked.error());
         });
}

void LiveControl::Revoke(const engine::KeysRevoked& change, const Done& done) {
  if (Forwards(change, done)) {
    return;
  }
  std::vector<engine::Outgoing> none;
  const Result<uint64_t> applied = parts_.service->Submit(change, &none);
  if (applied.ok()) {
    parts_.drop_revoked();
  }
  DoneIfDurable(applied.ok() ? Ok() : Status(applied.error()), done);
}

}  // namespace pheromone::daemon
