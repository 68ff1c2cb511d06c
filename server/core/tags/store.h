// All virtual RFID tags of a map with what is written on them, and the symbol tables: the state of
// the engine's component (server/core/engine/tags_part.h).
//
//   Store store;
//   store.Configure(settings);
//   store.Write(number, {.block = block}, now_ms, utc_s);
//
// A tag is known by its name in the configuration; its number, with which robots address it, is
// given when the name appears first and stays. A tag that is no longer configured cannot be reached
// but keeps its blocks, and is forgotten once it has none.
//
// Pure; one thread at a time. A copy shares the tags that neither changes.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/base/bytes.h"
#include "server/base/result.h"
#include "server/core/tags/plan.h"
#include "server/core/tags/settings.h"
#include "server/core/tags/symbols.h"
#include "server/core/tags/tag.h"
#include "server/core/tags/tag_map.h"

namespace pheromone::tags {

/// Since the start. Not part of the state.
struct Counters {
  uint64_t writes = 0;
  uint64_t dropped = 0;  ///< blocks that others were written over
  uint64_t expired = 0;  ///< blocks whose lease ended
};

/// How much there is. Counted as it changes: asking takes the same time for any number of tags.
struct Figures {
  uint64_t configured = 0;    ///< tags
  uint64_t unconfigured = 0;  ///< tags that are kept for their blocks
  uint64_t slots = 0;         ///< of all of them
  uint64_t blocks = 0;        ///< slots in use
  uint64_t leased = 0;        ///< of these blocks
  uint64_t definitions = 0;   ///< rows of the symbol tables
  bool operator==(const Figures&) const = default;
};

class FrozenStore;

class Store {
 public:
  /// Whether it can continue with these settings. Errors: those of CheckSettings; a tag of which
  /// slots in use would be taken away; no number is left.
  Status Check(const Settings& settings) const;
  void Configure(const Settings& settings);

  /// The same in time that depends on the differences alone, by a plan that was made of what Look
  /// gave (plan.h). Take only what Check accepts; a plan that is not current must be made anew.
  Survey Look() const { return {directory_, used_}; }
  bool IsCurrent(const Plan& plan) const;
  Status Check(const Plan& plan) const;
  void Take(const Plan& plan);

  /// The tags that reach a point, by number.
  std::vector<uint16_t> InRange(int64_t x_um, int64_t y_um) const {
    return directory_->map.InRange(x_um, y_um);
  }
  /// Null for a number that no configured tag has.
  const Place* PlaceOf(uint16_t number) const { return directory_->PlaceOf(number); }
  /// Null for a number that no tag has, configured or not.
  const NamedTag* Find(uint16_t number) const;
  std::optional<uint16_t> NumberOf(std::string_view name) const {
    return directory_->NumberOf(name);
  }
  /// The largest number in use; 0 if there is none.
  uint16_t last_number() const { return static_cast<uint16_t>(tags_.size()); }

  const SymbolTables& symbols() const { return symbols_; }
  bool IsPrivileged(int32_t author) const { return PolicyAt(0).IsPrivileged(author); }
  bool IsProtected(const Slot& slot) const { return PolicyAt(0).IsProtected(slot); }

  /// As Tag::Write and Tag::Erase; the tag exists.
  Written Write(uint16_t number, const WriteRequest& request, uint64_t now_ms, int64_t utc_s);
  /// What Write would do.
  Written TryWrite(uint16_t number, const WriteRequest& request, uint64_t now_ms,
                   int64_t utc_s) const;
  WriteOutcome Erase(uint16_t number, uint8_t slot, int32_t author,
                     std::optional<uint16_t> expected);
  /// Erases a slot, whoever wrote it; tag and slot exist.
  void Clear(uint16_t number, uint8_t slot);

  /// As in SymbolTables. New robots may be privileged.
  DefineOutcome Define(const Row& row, const Maker& maker = {});
  DefineOutcome AddRobot(std::string_view unique_id, int32_t* robot, const Maker& maker = {});
  /// What Define would do.
  DefineOutcome TryDefine(const Row& row, const Maker& maker = {}) const {
    return symbols_.TryDefine(row, maker);
  }
  /// Removes what `maker` has defined, except what blocks on tags or others' definitions refer to
  /// (SymbolTables::Without). Robots whose number is gone have to tell their unique ID again.
  void Forget(const Maker& maker);
  /// How many rows Forget would remove. Both in time that grows with tags and rows.
  size_t CountForgettable(const Maker& maker) const;

  /// Which author the robot of a link is; set when it tells its unique ID.
  std::optional<int32_t> AuthorOn(const std::string& link, uint8_t id) const;
  void SetAuthorOn(const std::string& link, uint8_t id, int32_t author);

  /// Ends the leases that are over, of at most `most` tags.
  void Expire(uint64_t now_ms, size_t most);
  std::optional<uint64_t> NextExpiry() const;

  const Counters& counters() const { return counters_; }
  Figures figures() const;
  /// The sum over tags, rows and authors; 0 if there is none.
  uint64_t hash() const { return hash_ + symbols_.hash(); }

  /// Canonical bytes.
  void Save(ByteWriter* writer) const;
  /// Into a new store that had these settings when it was saved. Invalid bytes fail the reader.
  void Restore(const Settings& settings, ByteReader* reader);
  /// The same bytes, copied in portions; the store outlives it or lets it go.
  std::unique_ptr<FrozenStore> Freeze() const;

 private:
  friend class FrozenStore;
  using Author = std::pair<std::string, uint8_t>;  // link and ID

  Policy PolicyAt(int64_t utc_s) const { return {.utc_s = utc_s, .privileged = privileged_}; }
  // The tag, not shared with a copy; its share of hash, sums and leases is taken out until Settle.
  NamedTag& Unsettle(uint16_t number);
  void Settle(NamedTag& tag);
  void TakeOut(const NamedTag& tag);
  void FindPrivileged();
  std::set<int32_t> UsedBeside(const Maker& maker) const;

  std::vector<std::shared_ptr<NamedTag>> tags_;  // by number - 1; null: the number is free
  std::vector<uint8_t> used_;                    // slots in use, by number - 1
  SymbolTables symbols_;
  // The tables that a frozen copy reads once they are no longer those of the store.
  mutable std::weak_ptr<std::optional<SymbolTables>> frozen_symbols_;
  std::map<Author, int32_t> authors_;
  std::set<std::pair<uint64_t, uint16_t>> leases_;  // of each tag with a lease, the first to end
  uint64_t hash_ = 0;
  Figures sums_;  // of slots, blocks and leases

  // From the configuration. Shared with copies and with plans.
  std::shared_ptr<const Directory> directory_ = std::make_shared<const Directory>();
  std::vector<int32_t> privileged_;  // sorted
  Counters counters_;
};

/// A store's bytes at one moment, copied in portions while it changes.
class FrozenStore {
 public:
  uint64_t bytes() const { return bytes_; }
  /// Appends the next portion of about `most` tags or rows. False if none is left. Not while the
  /// store changes.
  bool CopySome(std::string* to, size_t most);
  bool failed() const { return store_ == nullptr && !is_done_; }
  void LetGo() { store_ = nullptr; }

 private:
  friend class Store;
  explicit FrozenStore(const Store& store);

  const SymbolTables& symbols() const { return *symbols_ ? **symbols_ : store_->symbols_; }

  const Store* store_;
  std::shared_ptr<std::optional<SymbolTables>> symbols_;
  std::vector<std::shared_ptr<const NamedTag>> tags_;
  std::map<std::pair<std::string, uint8_t>, int32_t> authors_;
  size_t rows_;
  uint64_t bytes_ = 0;
  size_t next_tag_ = 0;
  size_t next_row_ = 0;
  bool has_begun_ = false;
  bool is_done_ = false;
};

}  // namespace pheromone::tags
