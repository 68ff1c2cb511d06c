#include "server/operators/ctl/journal_resample.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <map>
#include <utility>
#include <vector>

#include "server/config/config.h"
#include "server/core/engine/engine.h"
#include "server/core/field/field.h"
#include "server/formats/maps/field_file.h"
#include "server/formats/maps/resample.h"
#include "server/operators/ctl/journal_commands.h"
#include "server/operators/ctl/server_call.h"
#include "server/store/journal/membership.h"
#include "server/store/journal/posix_folder.h"
#include "server/store/journal/recovery.h"
#include "server/store/journal/snapshot.h"

namespace pheromone::ctl {
namespace {

using journal::PosixFolder;

// The contents of a field, without what remains of the initial deposits of its configuration. Later
// deposits are kept.
maps::SavedField WithoutLaid(const field::Field& field, uint64_t now_ms) {
  maps::SavedField all = maps::TakeFieldSnapshot(field, now_ms);
  const maps::SavedField laid = maps::TakeFieldSnapshot(field::Field(field.config()), now_ms);
  std::map<std::pair<uint8_t, field::NodeIndex>, uint32_t> levels;
  for (const field::InitialRaster& print : laid.initial_rasters) {
    for (const field::InitialNode& it : *print.nodes) {
      levels[{print.type, it.node}] = it.level;
    }
  }
  for (field::InitialRaster& print : all.initial_rasters) {
    std::vector<field::InitialNode> left;
    for (field::InitialNode it : *print.nodes) {
      const auto found = levels.find({print.type, it.node});
      it.level -= found != levels.end() ? std::min(found->second, it.level) : 0;
      if (it.level != 0) {
        left.push_back(it);
      }
    }
    print.nodes = field::Shared(std::move(left));
  }
  std::erase_if(all.initial_rasters,
                [](const field::InitialRaster& print) { return print.nodes->empty(); });
  return all;
}

// An engine that begins with this configuration, the deposits on the map, and of the old state what
// does not depend on the map. Errors: the configuration does not permit what is on the tags or in
// the nets.
Result<engine::Engine> BeginWith(const engine::EngineConfig& config, uint16_t epoch,
                                 const engine::Stamp& stamp, const maps::SavedField& left,
                                 const engine::Engine& old) {
  engine::Engine engine;
  std::vector<engine::Outgoing> out;
  uint64_t sequence = 0;
  engine.Apply(++sequence, stamp, engine::ConfigChanged{config, epoch}, &out);
  PHEROMONE_TRY_STATUS(engine.ContinueTagsAndNets(old));
  if (!old.revoked_keys().keys().empty()) {
    engine.Apply(++sequence, stamp, engine::KeysRevoked{old.revoked_keys().keys()}, &out);
  }
  for (const field::InitialRaster& print : left.initial_rasters) {
    for (const field::InitialNode& it : *print.nodes) {
      const field::PointUm at = config.field.map.PositionOf(it.node);
      field::FieldEdit edit;
      edit.type = print.type;
      edit.shape = field::FieldEdit::Shape::kRectangle;
      edit.action = field::FieldEdit::Action::kAdd;
      edit.level = it.level;
      edit.points = {at, at};
      const field::EditHistory::Entry* last = engine.field().history().Next(false);
      edit.continues = last != nullptr ? last->info.id : 0;
      engine.Apply(++sequence, stamp, engine::FieldEdited{std::move(edit)}, &out);
      out.clear();
    }
  }
  engine.ForgetEdits();
  return engine;
}

std::string TextOfErrno() {
  return std::strerror(errno);
}

// Gives all files of a folder the owner of another one: a command run by root must not lock out the
// server's user.
Status TakeOwner(const std::string& from, const std::string& to) {
  struct stat owner = {};
  if (stat(from.c_str(), &owner) != 0) {
    return Error{from + ": " + TextOfErrno()};
  }
  std::vector<std::string> paths = {to};
  for (const auto& entry : std::filesystem::directory_iterator(to)) {
    paths.push_back(entry.path().string());
  }
  for (const std::string& path : paths) {
    if (geteuid() == 0 && lchown(path.c_str(), owner.st_uid, owner.st_gid) != 0) {
      return Error{path + ": its owner cannot be changed: " + TextOfErrno()};
    }
  }
  if (chmod(to.c_str(), owner.st_mode & 07777u) != 0) {
    return Error{to + ": " + TextOfErrno()};
  }
  return Ok();
}

// A rename survives a power failure once its folder is synced.
Status SyncParent(const std::string& folder) {
  const std::string parent = std::filesystem::absolute(folder).parent_path().string();
  const auto opened = PosixFolder::Open(parent, PosixFolder::Mode::kReader);
  return opened.ok() ? opened.value()->Sync() : Status(Error{opened.error()});
}

// At any time there is a complete state at `folder`.
Status Replace(const std::string& folder, const std::string& next, const std::string& before) {
  PHEROMONE_TRY_STATUS(TakeOwner(folder, next));
  const auto exchange = [&] {
    return renameat2(AT_FDCWD, next.c_str(), AT_FDCWD, folder.c_str(), RENAME_EXCHANGE) == 0;
  };
  if (!exchange()) {
    return Error{folder + ": cannot be exchanged with " + next + ": " + TextOfErrno()};
  }
  if (rename(next.c_str(), before.c_str()) != 0) {
    const std::string why = TextOfErrno();
    exchange();
    return Error{folder + ": cannot be renamed to " + before + ": " + why};
  }
  return SyncParent(folder);
}

}  // namespace

int ResampleJournal(const std::string& config_file, const std::string& name) {
  const std::string folder = std::filesystem::path(name + "/").parent_path().string();
  const std::string next = folder + ".new";
  const std::string before = folder + ".before";
  const Result<config::Config> loaded = config::LoadConfig(config_file);
  if (!loaded.ok()) {
    return Fail(kUsage, loaded.error());
  }
  const Status holds = HoldsJournal(folder);
  if (!holds.ok()) {
    return Fail(kFailed, holds.error());
  }
  for (const std::string& path : {next, before}) {
    if (std::filesystem::exists(path)) {
      return Fail(kFailed, path + ": already exists; move or remove it first");
    }
  }
  const auto old = PosixFolder::Open(folder, PosixFolder::Mode::kOwner);
  if (!old.ok()) {
    return Fail(kFailed, old.error());
  }
  const auto membership = journal::ReadMembership(*old.value());
  if (!membership.ok() || (membership.value() && !membership.value()->cluster.empty())) {
    return Fail(kFailed, membership.ErrorOr(
                             folder + ": belongs to a cluster, whose servers have one map; see "
                                      "pheromonectl(1), cluster leave"));
  }
  const Result<journal::Recovered> recovered = journal::Recover(*old.value());
  if (!recovered.ok() || recovered.value().lost || recovered.value().differs ||
      !recovered.value().engine.configured()) {
    return Fail(kFoundDamage,
                recovered.ErrorOr(folder + ": no complete state; see \"journal check\""));
  }
  const journal::Recovered& state = recovered.value();
  const engine::EngineConfig& config = loaded.value().engine;
  const Result<maps::Resampled> moved =
      maps::Resample(WithoutLaid(state.engine.field(), state.stamp.field_time_ms), config.field);
  if (!moved.ok()) {
    return Fail(kUsage, folder + " does not match the configuration: " + moved.error());
  }
  const auto epoch = static_cast<uint16_t>(std::max(1, (state.engine.epoch() + 1) & 0xFFFF));
  const Result<engine::Engine> engine =
      BeginWith(config, epoch, state.stamp, moved.value().field, state.engine);
  if (!engine.ok()) {
    return Fail(kUsage, folder + " does not match the configuration: " + engine.error());
  }
  auto made = PosixFolder::Open(next, PosixFolder::Mode::kOwner);
  Status done = made.ok() ? journal::WriteSnapshot(engine.value(), state.stamp, made.value().get())
                          : Status(Error{made.error()});
  // Of a cluster that was left: its clock, and that others may have begun this epoch, too.
  if (done.ok() && membership.value()) {
    done = journal::WriteMembership(*membership.value(), made.value().get());
  }
  if (done.ok()) {
    done = Replace(folder, next, before);
  }
  if (!done.ok()) {
    std::error_code ignored;
    std::filesystem::remove_all(next, ignored);
    return Fail(kFailed, done.error());
  }
  fmt::print("{}: {}; the old state is in {}\n", folder, maps::InWords(moved.value()), before);
  return 0;
}

}  // namespace pheromone::ctl
