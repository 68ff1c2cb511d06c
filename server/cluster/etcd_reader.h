// Where a follower stands in the log, and what it asks etcd next: reads in portions up to the log's
// end, then a watch from there. Sans I/O.
//
//   EtcdReader reader(keys, from, &id);
//   for (;;) {
//     ... reader.ReadRequest() is sent; its answer: ...
//     const Result<News> news = reader.OnRead(text);
//     if (news.ok() && !news.value().more) { a watch from news.value().revision + 1: }
//     ... for each line: reader.OnWatch(line) ...
//   }
//
// Each read is a transaction and groups are never changed, so that reads of any revisions fit
// together; what is already read, a watch may show again. Nothing is returned twice, and nothing
// after a gap: a gap in a watch asks for a read, a gap in a read is an error. Another log than the
// first that was read, by its id, is an error, too: its sequences and terms mean nothing here.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/base/result.h"
#include "server/cluster/etcd_format.h"
#include "server/cluster/etcd_messages.h"
#include "server/cluster/replicated_log.h"

namespace pheromone::cluster {

class EtcdReader {
 public:
  /// Begins with the group that contains `from`. `id` is the log's, or empty: then it is set as
  /// soon as it is read. The reader refers to it.
  EtcdReader(EtcdKeys keys, Sequence from, std::string* id)
      : keys_(std::move(keys)), from_(from), next_(from), id_(id) {}

  struct News {
    std::string id;
    Leader leader;  ///< with the last portion: all before its term is known then (Page)
    Sequence floor = 1;
    Sequence log_end = 1;             ///< Page::next
    std::vector<StoredGroup> groups;  ///< those in pieces without their records
    bool more = false;                ///< to be read, now
    Revision revision = 0;            ///< of a read: a watch goes on after it
  };

  std::string ReadRequest() const;
  Result<News> OnRead(std::string_view text);
  std::string WatchFrom(Revision revision) const;
  Result<News> OnWatch(std::string_view line);

  /// The group that contains `from` is found, or is known not to be there yet.
  bool found() const { return found_; }
  /// The first sequence that was not returned yet.
  Sequence next() const { return next_; }
  /// Forgets that this group and later ones were returned.
  void ReturnTo(Sequence first) { next_ = first; }

 private:
  void Find(Sequence from);
  Sequence WindowBegin() const;
  Status OnFound(const TxnAnswer::Part& last);
  Status OnGroups(const TxnAnswer::Part& part, News* news);
  Result<News> TryWatch(std::string_view line);
  Result<StoredGroup> Decode(const Entry& entry, Sequence first) const;
  void Fill(News* news) const;

  EtcdKeys keys_;
  Sequence from_;
  Sequence next_;
  bool found_ = false;
  uint64_t window_ = 64;  // sequences before from_ among which its group is sought
  bool looked_again_ = false;

  std::string* id_;
  Leader leader_;
  Sequence floor_ = 1;
  Sequence log_end_ = 1;
  Revision revision_ = 0;
};

}  // namespace pheromone::cluster
