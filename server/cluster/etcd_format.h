// How a cluster's log stands in etcd: keys and values.
//
// All keys begin with /pheromone/NAME/, where NAME is the cluster's. FIRST, TERM, FLOOR are numbers
// of 16 hexadecimal digits in lower case, so that keys sort as the numbers do.
//
//   leader                  the name of the node that leads. The key's mod_revision is the term:
//                           etcd raises it with each change, and never gives one out again
//   id                      made with the first leader, then never changed. Another id is another
//                           log, whatever its groups and terms look like
//   floor                   FLOOR: groups that end before this sequence were removed. Absent: 1
//   log/FIRST               a group of events; FIRST is the sequence of its first event
//   owner/LINK              which server may send on a link (link_owners.h). The key's
//                           mod_revision is the register's revision
//   piece/FIRST/TERM/INDEX  a part of the records of a group that is too large for one request;
//                           INDEX has 4 digits or more
//
// The value of log/FIRST, little-endian:
//
//   u8   version       1
//   u32  count         of events, not 0
//   u64  term          of the leader that wrote it
//   u32  pieces        0: the records follow. Else nothing does: they are pieces 0 to pieces - 1
//   u32  checksum      CRC-32C of FIRST (u64), of what is before the checksum, and of the records
//   ...  records
//
// What holds: a group begins where its predecessor ends; groups are written only by the leader
// whose term they have, and never changed; a group is written after all of its pieces, under the
// same comparisons, so that it is there with all of its pieces or not at all. Pieces without a
// group are left when a leader dies between them: no one reads them, and Trim removes them.
//
// Pure; any thread.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/format.h"
#include "server/base/result.h"
#include "server/cluster/replicated_log.h"

namespace pheromone::cluster {

/// Records above this are written as pieces, so that a few groups make an answer of bounded size.
constexpr size_t kMaxInlineBytes = size_t{128} << 10;
/// Of a piece. etcd's limit of a request is 1.5 MiB.
constexpr size_t kPieceBytes = size_t{1} << 20;

/// What HexText writes. Errors: anything else.
Result<Sequence> FromHex(std::string_view digits);

class EtcdKeys {
 public:
  /// `cluster` has no slash.
  explicit EtcdKeys(const std::string& cluster) : prefix_("/pheromone/" + cluster + "/") {}

  std::string leader() const { return prefix_ + "leader"; }
  std::string id() const { return prefix_ + "id"; }
  std::string floor() const { return prefix_ + "floor"; }
  std::string Owner(const std::string& link) const { return prefix_ + "owner/" + link; }
  std::string Log(Sequence first) const { return prefix_ + "log/" + HexText(first); }
  std::string Piece(const Group& group, uint32_t index) const;
  /// All pieces of earlier groups sort before it, and none of this and later groups does.
  std::string PiecesOf(Sequence first) const { return prefix_ + "piece/" + HexText(first); }

  /// After all groups.
  std::string log_end() const { return prefix_ + "log0"; }
  /// What a follower needs to know is between these two; owners and pieces are not.
  std::string watch_begin() const { return prefix_ + "floor"; }
  std::string watch_end() const { return log_end(); }

  /// The FIRST of a group's key; empty for the key of something else. Errors: it is not a number.
  std::optional<Result<Sequence>> FirstOf(std::string_view key) const;

 private:
  std::string prefix_;
};

/// Sets `known` if it is empty. Errors: `id` is another one.
Status KeepId(const EtcdKeys& keys, const std::string& id, std::string* known);

struct KeyAndValue {
  std::string key;
  std::string value;
  bool operator==(const KeyAndValue&) const = default;
};

/// What is to be written for a group, in this order.
std::vector<KeyAndValue> EncodeGroup(const EtcdKeys& keys, const Group& group);

/// A group as its value has it.
struct StoredGroup {
  Group group;  ///< without records, if they are in pieces
  uint32_t pieces = 0;
  uint32_t checksum = 0;

  Sequence end() const { return group.first + group.count; }
};

/// Errors: not a group of this version; a wrong checksum, unless its records are in pieces.
Result<StoredGroup> DecodeGroup(Sequence first, std::string_view value);
/// Errors: the checksum is not that of the group's records.
Status CheckGroup(const StoredGroup& stored);

}  // namespace pheromone::cluster
