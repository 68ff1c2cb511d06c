#include "server/store/journal/open.h"

#include <utility>

#include "server/store/journal/format.h"
#include "server/store/journal/recovery.h"
#include "server/store/journal/snapshot.h"

namespace pheromone::journal {
namespace {

Status RemoveUnfinished(Folder* folder) {
  PHEROMONE_TRY(const std::vector<std::string> names, folder->List());
  for (const std::string& name : names) {
    if (name.ends_with(kUnfinished) &&
        SnapshotSequenceOf(name.substr(0, name.size() - kUnfinished.size()))) {
      Status removed = folder->Remove(name);
      if (!removed.ok()) {
        return removed;
      }
    }
  }
  return Ok();
}

Status MoveAside(const std::string& name, Folder* folder) {
  return folder->Rename(name, name + std::string(kDamaged));
}

// From here on a new snapshot has the state, and nothing damaged is read again. Damaged snapshots
// go first: the new one may need the name.
Status SetAside(Recovered* recovered, Folder* folder) {
  Status status = Ok();
  for (const std::string& name : recovered->damaged_files) {
    if (status.ok() && SnapshotSequenceOf(name)) {
      status = MoveAside(name, folder);
    }
  }
  if (status.ok() && recovered->engine.configured()) {
    status = WriteSnapshot(recovered->engine, recovered->stamp, folder);
  }
  for (const std::string& name : recovered->damaged_files) {
    if (status.ok() && OrdinalOf(name)) {
      status = MoveAside(name, folder);
    }
  }
  recovered->certain = recovered->sequence;
  recovered->tail.clear();
  recovered->bytes_since_snapshot = 0;
  recovered->cost_since_snapshot = 0;
  return status.ok() ? folder->Sync() : status;
}

std::vector<std::string> Report(const std::vector<Finding>& findings) {
  std::vector<std::string> report;
  report.reserve(findings.size());
  for (const Finding& finding : findings) {
    report.push_back((finding.is_damage ? "damaged: " : "incomplete: ") + finding.Text());
  }
  return report;
}

}  // namespace

Result<Opened> OpenJournal(Folder* folder, const JournalSettings& settings,
                           LocalJournal::ReadMicroseconds clock, LocalJournal::Tell tell,
                           const TellProgress& tell_progress) {
  PHEROMONE_TRY(Recovered recovered, Recover(*folder, UINT64_MAX, tell_progress));
  Status status = RemoveUnfinished(folder);
  if (status.ok() && (!recovered.damaged_files.empty() || recovered.differs)) {
    status = SetAside(&recovered, folder);
  }
  if (!status.ok()) {
    return status.error();
  }
  Opened opened;
  opened.report = Report(recovered.findings);
  opened.stamp = recovered.stamp;
  opened.state_lost = recovered.lost || recovered.differs;
  opened.engine = std::move(recovered.engine);
  opened.journal = std::make_unique<LocalJournal>(
      folder, settings, std::move(clock), std::move(tell),
      LocalJournal::Start{recovered.sequence, recovered.certain, std::move(recovered.tail),
                          recovered.next_ordinal, recovered.bytes_since_snapshot,
                          recovered.cost_since_snapshot, recovered.stamp.utc_ms});
  opened.journal->WriteOnce();
  return opened;
}

}  // namespace pheromone::journal
