// A folder in memory that loses its power: what was not synced is then lost, kept or torn, as a
// seeded generator decides.
//
//   CrashFolder folder(seed);
//   folder.CutAt(17);                     // the power goes with the 17th operation from now on
//   ... use it; from the cut on every operation fails ...
//   folder.PowerOn();                     // what a disk would have
//
// The model is that of a disk without mercy. Of a file's bytes that were not synced, each sector of
// 512 may be there, be zeros or be noise, up to a length of its own; of the names made, changed or
// removed since the folder was last synced, each may be so or not, whatever became of the others. A
// sync that fails loses what it was to write for good, as Linux does, while reads still show it.
//
// A part of a file that is written again may, without a sync, be as before, as it should be, or
// noise.
//
// Mutants for the tests of the tests: syncs that do nothing.
//
// One thread at a time.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "server/store/journal/folder.h"

namespace pheromone::journal::testing {

class CrashFolder final : public Folder {
 public:
  explicit CrashFolder(uint64_t seed) : random_(seed) {}

  // --- What goes wrong. Operations are Append, Write, Sync, Create, Rename and Remove, of all
  // files.

  /// The `n`th from now (from 1 on) is cut short, and all after it fail. 0: never.
  void CutAt(uint64_t n) { cut_at_ = n == 0 ? UINT64_MAX : operations_ + n; }
  bool is_off() const { return is_off_; }
  /// Of what is not synced some is lost; then everything works again.
  void PowerOn();

  /// So many appends, or syncs of files or of the folder, fail from now on; others work.
  void FailAppends(int count) { failing_appends_ = count; }
  void FailSyncs(int count) { failing_syncs_ = count; }
  /// Appends and reserves fail beyond so many bytes of all files together.
  void LimitBytes(uint64_t bytes) { limit_bytes_ = bytes; }

  bool ignore_file_syncs = false;
  bool ignore_folder_syncs = false;

  /// What is there beside files.
  std::vector<std::string> others;

  /// How many operations there were.
  uint64_t operations() const { return operations_; }
  uint64_t bytes() const;

  /// For damage by hand. The file must be there.
  std::string& Contents(const std::string& name);
  bool Has(const std::string& name) const { return names_.count(name) != 0; }

  const std::string& path() const override { return path_; }
  Result<std::vector<std::string>> List() const override;
  Result<std::vector<std::string>> ListOthers() const override { return others; }
  Result<uint64_t> Size(const std::string& name) const override;
  Result<std::string> Read(const std::string& name, uint64_t offset, size_t most) const override;
  Result<std::unique_ptr<AppendFile>> Create(const std::string& name) override;
  Result<std::unique_ptr<SlotFile>> OpenSlots(const std::string& name, uint64_t bytes) override;
  Status Rename(const std::string& from, const std::string& to) override;
  Status Remove(const std::string& name) override;
  Status Sync() override;

 private:
  friend class CrashFile;
  friend class CrashSlots;

  // A file, whatever its name is.
  struct Inode {
    std::string bytes;
    std::string synced;  // what is surely on the disk
    // Ranges that a failed sync has lost, although `bytes` has them.
    std::vector<std::pair<size_t, size_t>> lost;
    uint64_t reserved = 0;
    // Ranges that were written again since the last sync.
    std::vector<std::pair<size_t, size_t>> rewritten;
  };
  using Names = std::map<std::string, std::shared_ptr<Inode>>;
  struct Change {
    std::string from;  // empty: it is new
    std::string to;    // empty: it is removed
    std::shared_ptr<Inode> file;
  };

  // Counts an operation; false if it must fail. `*cut`: it is the one that is cut short.
  bool Begin(bool* cut);
  static void Apply(const Change& change, Names* names);
  Status Make(const Change& change);
  void Tear(Inode* file);

  std::mt19937_64 random_;
  std::string path_ = "journal";
  Names names_;
  Names synced_names_;
  std::vector<Change> changes_;  // since the folder was synced
  uint64_t operations_ = 0;
  uint64_t cut_at_ = UINT64_MAX;
  bool is_off_ = false;
  int failing_appends_ = 0;
  int failing_syncs_ = 0;
  uint64_t limit_bytes_ = UINT64_MAX;
};

}  // namespace pheromone::journal::testing
