// Requests to etcd's HTTP gateway, and its answers: JSON with Base64 in it, as text. The gateway
// leaves out what is empty or zero, so that every absent field is read as that.
//
//   TxnRequest request;
//   request.IfChangedAt(keys.leader(), seen);
//   request.success.Put(keys.leader(), node);
//   request.failure.Read(keys.leader());
//   ... request.Text() is sent to kTxnPath ...
//   const Result<TxnAnswer> answer = ParseTxn(text);
//
// Pure; any thread. Any text may be parsed: errors name the field and what was expected.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"

namespace pheromone::cluster {

using Revision = uint64_t;

constexpr char kTxnPath[] = "/v3/kv/txn";
constexpr char kCompactionPath[] = "/v3/kv/compaction";
constexpr char kWatchPath[] = "/v3/watch";
constexpr char kStatusPath[] = "/v3/maintenance/status";
constexpr char kTransferPath[] = "/v3/maintenance/transfer-leadership";

/// Operations, done in one step.
class Operations {
 public:
  void Put(std::string_view key, std::string_view value);
  void Read(std::string_view key);
  /// The first `limit` keys from `begin` to before `end`.
  void ReadRange(std::string_view begin, std::string_view end, uint32_t limit);
  /// The last key of these. etcd 3.4 reads the whole range for it.
  void ReadLast(std::string_view begin, std::string_view end);
  void DeleteRange(std::string_view begin, std::string_view end);

  const std::string& text() const { return text_; }

 private:
  void Add(std::string_view operation);
  std::string text_;
};

/// If all comparisons hold, `success` is done, else `failure`.
class TxnRequest {
 public:
  /// The last change of `key` was at `revision`; 0: there is no such key.
  void IfChangedAt(std::string_view key, Revision revision);
  void IfAbsent(std::string_view key);
  /// There is such a key, and its value is this.
  void IfEqual(std::string_view key, std::string_view value);
  /// There is such a key, and its value is greater, as bytes.
  void IfGreater(std::string_view key, std::string_view value);

  Operations success;
  Operations failure;

  std::string Text() const;

 private:
  void Compare(std::string_view text);
  void CompareValue(std::string_view how, std::string_view key, std::string_view value);
  std::string comparisons_;
};

std::string CompactionRequest(Revision revision);
/// Every change from `begin` to before `end`, since `revision`.
std::string WatchRequest(std::string_view begin, std::string_view end, Revision revision);
std::string TransferRequest(uint64_t member);

struct Entry {
  std::string key;
  std::string value;
  Revision revision = 0;  ///< of its last change
  bool operator==(const Entry&) const = default;
};

struct TxnAnswer {
  Revision revision = 0;  ///< of the store, after it
  bool succeeded = false;
  struct Part {
    std::vector<Entry> entries;  ///< that were read
    bool more = false;           ///< the range has more than `limit`
  };
  std::vector<Part> parts;  ///< one for each operation that was done
};
/// With so many parts as are expected of success or failure, else it is an error.
Result<TxnAnswer> ParseTxn(std::string_view text, size_t success_parts, size_t failure_parts);

/// Of a transaction without comparisons: that it failed is an error.
Result<TxnAnswer> ParseRead(std::string_view text, size_t parts);

struct WatchAnswer {
  struct Change {
    Entry entry;
    bool is_deleted = false;
  };
  std::vector<Change> changes;
  bool is_compacted = false;  ///< what it was to begin with: it has ended
};
/// Errors, too: it has ended for another reason.
Result<WatchAnswer> ParseWatch(std::string_view line);

struct StatusAnswer {
  uint64_t member = 0;
  uint64_t leader = 0;  ///< 0: none
};
Result<StatusAnswer> ParseStatus(std::string_view text);

/// What an answer that is not 200 says, in one line.
std::string ErrorOf(std::string_view text);

}  // namespace pheromone::cluster
