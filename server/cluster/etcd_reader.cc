#include "server/cluster/etcd_reader.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "server/base/escape.h"

namespace pheromone::cluster {
namespace {

constexpr uint32_t kGroupsOfPortion = 32;  // of at most kMaxInlineBytes: 4 MiB
constexpr uint64_t kFirstWindow = 64;
constexpr uint64_t kWindowGrows = 8;
constexpr size_t kReadParts = 4;

Error AtKey(std::string_view key, const std::string& what) {
  return Error{"key " + EscapeControls(key, "") + ": " + what};
}

}  // namespace

void EtcdReader::Find(Sequence from) {
  from_ = from;
  next_ = from;
  found_ = false;
  window_ = kFirstWindow;
}

Sequence EtcdReader::WindowBegin() const {
  return from_ > window_ ? from_ - window_ + 1 : 0;
}

// Groups have different lengths, so that the key of the one that contains from_ is not known. To
// ask for the last group up to there would be right, but etcd reads all groups before it.
std::string EtcdReader::ReadRequest() const {
  TxnRequest request;
  request.success.Read(keys_.leader());
  request.success.Read(keys_.id());
  request.success.Read(keys_.floor());
  if (found_) {
    request.success.ReadRange(keys_.Log(next_), keys_.log_end(), kGroupsOfPortion);
  } else {
    request.success.ReadLast(keys_.Log(WindowBegin()), keys_.Log(from_ + 1));
  }
  return request.Text();
}

std::string EtcdReader::WatchFrom(Revision revision) const {
  return WatchRequest(keys_.watch_begin(), keys_.watch_end(), revision);
}

Result<EtcdReader::News> EtcdReader::OnRead(std::string_view text) {
  PHEROMONE_TRY(const TxnAnswer answer, ParseRead(text, kReadParts));
  const auto only = [&](size_t part) {
    return answer.parts[part].entries.empty() ? Entry{} : answer.parts[part].entries.front();
  };
  PHEROMONE_TRY_STATUS(KeepId(keys_, only(1).value, id_));
  Sequence floor = 1;
  if (!answer.parts[2].entries.empty()) {
    const Result<Sequence> number = FromHex(only(2).value);
    if (!number.ok()) {
      return AtKey(keys_.floor(), number.error());
    }
    floor = number.value();
  }
  const bool went_back = answer.revision < revision_;  // etcd was restored from a backup
  leader_ = {only(0).revision, only(0).value};
  floor_ = floor;
  revision_ = answer.revision;

  News news;
  news.revision = answer.revision;
  news.more = true;
  if (went_back && found_) {
    Find(next_);
  } else if (found_) {
    PHEROMONE_TRY_STATUS(OnGroups(answer.parts[3], &news));
  } else if (floor_ > from_) {
    Find(floor_);
  } else {
    PHEROMONE_TRY_STATUS(OnFound(answer.parts[3]));
  }
  Fill(&news);
  return news;
}

// The last group of the window, if there is one.
Status EtcdReader::OnFound(const TxnAnswer::Part& last) {
  if (!last.entries.empty()) {
    const Entry& entry = last.entries.front();
    const std::optional<Result<Sequence>> first = keys_.FirstOf(entry.key);
    if (!first || !first->ok()) {
      return AtKey(entry.key, "expected log/ and a number of 16 hexadecimal digits");
    }
    PHEROMONE_TRY(const StoredGroup stored, Decode(entry, first->value()));
    next_ = stored.end() > from_ ? stored.group.first : from_;
    log_end_ = std::max(stored.end(), floor_);
    found_ = true;
  } else if (WindowBegin() == 0) {
    log_end_ = floor_;
    found_ = true;
  } else {
    window_ = window_ > from_ / kWindowGrows ? from_ : window_ * kWindowGrows;
  }
  return Ok();
}

Status EtcdReader::OnGroups(const TxnAnswer::Part& part, News* news) {
  news->more = part.more;
  for (const Entry& entry : part.entries) {
    if (entry.key != keys_.Log(next_)) {
      break;
    }
    Result<StoredGroup> stored = Decode(entry, next_);
    if (!stored.ok() && news->groups.empty()) {
      return stored.error();
    }
    if (!stored.ok()) {
      break;  // an error of the next read: what is before it is good
    }
    next_ = stored.value().end();
    log_end_ = std::max(log_end_, next_);
    news->groups.push_back(std::move(stored).value());
  }
  const bool is_gap = news->groups.empty() && !part.entries.empty();
  if (!is_gap && (!news->groups.empty() || floor_ <= next_)) {
    looked_again_ = false;
    news->more = news->more || news->groups.size() < part.entries.size();
    return Ok();
  }
  // Trimmed meanwhile; or the log ended before from_ and has grown beyond it.
  const std::string missing = keys_.Log(next_);
  const bool looked_again = std::exchange(looked_again_, !looked_again_);
  Find(std::max(next_, floor_));
  news->more = true;
  return is_gap && looked_again ? AtKey(missing, "expected a group before the one at " +
                                                     EscapeControls(part.entries.front().key, "") +
                                                     ": the log has a gap")
                                : Ok();
}

Result<EtcdReader::News> EtcdReader::OnWatch(std::string_view line) {
  const Sequence before = next_;
  Result<News> news = TryWatch(line);
  if (!news.ok()) {
    next_ = before;
  }
  return news;
}

Result<EtcdReader::News> EtcdReader::TryWatch(std::string_view line) {
  PHEROMONE_TRY(const WatchAnswer answer, ParseWatch(line));
  News news;
  news.more = answer.is_compacted;
  for (const WatchAnswer::Change& change : answer.changes) {
    const Entry& entry = change.entry;
    if (entry.key == keys_.leader()) {
      leader_ = {change.is_deleted ? 0 : entry.revision, entry.value};
    } else if (entry.key == keys_.id()) {
      PHEROMONE_TRY_STATUS(KeepId(keys_, entry.value, id_));
    } else if (entry.key == keys_.floor() && !change.is_deleted) {
      const Result<Sequence> number = FromHex(entry.value);
      if (!number.ok()) {
        return AtKey(entry.key, number.error());
      }
      floor_ = number.value();
    } else if (const auto first = keys_.FirstOf(entry.key); first && !change.is_deleted) {
      if (!first->ok()) {
        return AtKey(entry.key, first->error());
      }
      if (first->value() > next_) {
        news.more = true;
        break;
      }
      if (first->value() == next_) {
        PHEROMONE_TRY(StoredGroup stored, Decode(entry, next_));
        next_ = stored.end();
        log_end_ = std::max(log_end_, next_);
        news.groups.push_back(std::move(stored));
      }
    }
  }
  Fill(&news);
  return news;
}

Result<StoredGroup> EtcdReader::Decode(const Entry& entry, Sequence first) const {
  Result<StoredGroup> stored = DecodeGroup(first, entry.value);
  return stored.ok() ? std::move(stored) : AtKey(entry.key, stored.error());
}

void EtcdReader::Fill(News* news) const {
  news->id = *id_;
  news->leader = news->more ? Leader{} : leader_;
  news->floor = floor_;
  news->log_end = std::max(log_end_, floor_);
}

}  // namespace pheromone::cluster
