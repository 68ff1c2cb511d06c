#include "server/cluster/etcd_log.h"

#include <cstdint>
#include <exception>
#include <optional>
#include <utility>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "server/base/format.h"
#include "server/cluster/etcd_format.h"
#include "server/cluster/etcd_messages.h"
#include "server/cluster/etcd_reader.h"

namespace pheromone::cluster {
namespace {

namespace asio = boost::asio;
using std::chrono::milliseconds;

constexpr milliseconds kAfterError{100};         // before a follower reads again
constexpr uint32_t kBetweenCompactions = 4'096;  // changes of registers

Register RegisterOf(const std::vector<Entry>& entries) {
  return entries.empty() ? Register{} : Register{entries[0].revision, entries[0].value};
}

}  // namespace

class EtcdLog::Impl : public std::enable_shared_from_this<EtcdLog::Impl> {
 public:
  Impl(asio::any_io_executor executor, EtcdSettings settings)
      : executor_(std::move(executor)),
        settings_(std::move(settings)),
        keys_(settings_.cluster),
        client_(std::make_shared<EtcdClient>(executor_, settings_.members, settings_.patience,
                                             settings_.on_member)) {}

  /// Runs `begin()` after this call, and then `done` with its result, unless it was stopped.
  template <typename Begin, typename Done>
  void Run(Begin begin, Done done) {
    auto run = [self = shared_from_this(), begin = std::move(begin),
                done = std::move(done)]() -> asio::awaitable<void> {
      co_await asio::post(self->executor_, asio::use_awaitable);
      const auto result = co_await begin();
      if (!self->client_->stopped()) {
        done(result);
      }
    };
    asio::co_spawn(executor_, std::move(run), [](const std::exception_ptr& thrown) {
      if (thrown) {
        std::rethrow_exception(thrown);
      }
    });
  }

  asio::awaitable<Result<Leader>> TakeLead(Term seen, std::string node);
  asio::awaitable<Appended> Append(Group group);
  asio::awaitable<Status> Trim(Sequence floor);
  asio::awaitable<Status> Transfer();
  asio::awaitable<Result<Register>> ReadRegister(std::string name);
  asio::awaitable<Result<Register>> SetRegister(std::string name, uint64_t seen, std::string value);
  asio::awaitable<Status> Follow(uint64_t followed, Sequence from,
                                 std::function<void(const Result<Page>&)> news);

  /// A call of Follow, which ends the earlier one.
  uint64_t BeginToFollow() { return ++followed_; }
  void Stop() { client_->Stop(); }

 private:
  using News = std::function<void(const Result<Page>&)>;
  struct Transacted {
    size_t member = 0;  // that answered
    TxnAnswer txn;
  };

  asio::awaitable<Result<Transacted>> Transact(const TxnRequest& request, size_t success_parts,
                                               size_t failure_parts);
  asio::awaitable<std::optional<Appended>> Write(const Group& group, const KeyAndValue& what,
                                                 const std::string& group_value);
  asio::awaitable<Result<EtcdReader::News>> Read(EtcdReader* reader, size_t* member);
  asio::awaitable<Status> ReadPieces(StoredGroup* stored);
  asio::awaitable<Status> Compact(Revision revision);
  asio::awaitable<Status> Watch(EtcdReader* reader, size_t member, Revision revision,
                                uint64_t followed, const News& news);
  asio::awaitable<Status> Publish(EtcdReader* reader, EtcdReader::News* found, uint64_t followed,
                                  const News& news);
  bool IsFollowed(uint64_t followed) const { return followed == followed_ && !client_->stopped(); }
  Error Unusable(size_t member, const Error& error) {
    const Error named = client_->ErrorAt(member, error);
    client_->SetDown(member, named);
    return named;
  }

  const asio::any_io_executor executor_;
  const EtcdSettings settings_;
  const EtcdKeys keys_;
  const std::shared_ptr<EtcdClient> client_;
  uint64_t followed_ = 0;     // calls of Follow
  Revision trimmed_at_ = 0;   // by the last Trim
  Revision compacts_at_ = 0;  // what is older is no longer needed
  uint32_t changes_ = 0;      // of registers
  std::string id_;            // of the log, once it is known: another one is another log
};

asio::awaitable<Result<EtcdLog::Impl::Transacted>> EtcdLog::Impl::Transact(
    const TxnRequest& request, size_t success_parts, size_t failure_parts) {
  const std::string path = kTxnPath;
  const std::string body = request.Text();
  const Result<EtcdAnswer> answer = co_await client_->Call(path, body);
  if (!answer.ok()) {
    co_return answer.error();
  }
  const size_t member = answer.value().member;
  Result<TxnAnswer> txn = ParseTxn(answer.value().text, success_parts, failure_parts);
  if (!txn.ok()) {
    co_return Unusable(member, txn.error());
  }
  co_return Transacted{member, std::move(txn).value()};
}

asio::awaitable<Result<Leader>> EtcdLog::Impl::TakeLead(Term seen, std::string node) {
  TxnRequest request;
  request.IfChangedAt(keys_.leader(), seen);
  if (!id_.empty()) {
    request.IfEqual(keys_.id(), id_);
  }
  request.success.Put(keys_.leader(), node);
  if (seen == 0) {
    request.success.Put(keys_.id(), settings_.new_id);
  }
  for (Operations* const operations : {&request.success, &request.failure}) {
    operations->Read(keys_.leader());
    operations->Read(keys_.id());
  }
  const Result<Transacted> done = co_await Transact(request, seen == 0 ? 4 : 3, 2);
  if (!done.ok()) {
    co_return done.error();
  }
  const std::vector<TxnAnswer::Part>& parts = done.value().txn.parts;
  const std::vector<Entry>& leader = parts[parts.size() - 2].entries;
  const std::vector<Entry>& id = parts.back().entries;
  const Status kept = KeepId(keys_, id.empty() ? std::string() : id.front().value, &id_);
  if (!kept.ok()) {
    co_return Unusable(done.value().member, kept.error());
  }
  if (leader.empty()) {
    co_return Leader{};
  }
  co_return Leader{leader.front().revision, leader.front().value};
}

// A piece is written under the same comparisons as its group, so that each answer may decide.
asio::awaitable<Appended> EtcdLog::Impl::Append(Group group) {
  const std::vector<KeyAndValue> entries = EncodeGroup(keys_, group);
  for (const KeyAndValue& entry : entries) {
    const std::optional<Appended> outcome = co_await Write(group, entry, entries.back().value);
    if (outcome) {
      co_return *outcome;
    }
  }
  co_return Appended::kCommitted;
}

// None: it is written.
asio::awaitable<std::optional<Appended>> EtcdLog::Impl::Write(const Group& group,
                                                              const KeyAndValue& what,
                                                              const std::string& group_value) {
  const std::string place = keys_.Log(group.first);
  TxnRequest request;
  request.IfChangedAt(keys_.leader(), group.term);
  request.IfAbsent(place);
  if (!id_.empty()) {
    request.IfEqual(keys_.id(), id_);  // a store that was begun anew may have the same terms
  }
  request.success.Put(what.key, what.value);
  request.failure.Read(keys_.leader());
  request.failure.Read(place);
  request.failure.Read(keys_.id());
  const Result<Transacted> done = co_await Transact(request, 1, 3);
  if (!done.ok()) {
    co_return Appended::kUnknown;
  }
  const TxnAnswer& txn = done.value().txn;
  if (txn.succeeded) {
    co_return std::nullopt;
  }
  const std::vector<Entry>& leader = txn.parts[0].entries;
  const std::vector<Entry>& there = txn.parts[1].entries;
  const std::vector<Entry>& id = txn.parts[2].entries;
  if (!id_.empty() && (id.empty() || id.front().value != id_)) {
    co_return Appended::kFenced;
  }
  if (!there.empty()) {
    co_return there.front().value == group_value ? Appended::kCommitted : Appended::kFenced;
  }
  if (!leader.empty() && leader.front().revision == group.term) {
    const Error contradiction("the transaction failed, expected success: its comparisons hold");
    static_cast<void>(Unusable(done.value().member, contradiction));
    co_return Appended::kUnknown;
  }
  co_return Appended::kFenced;
}

asio::awaitable<Status> EtcdLog::Impl::Trim(Sequence floor) {
  EtcdReader reader(keys_, floor, &id_);
  while (!reader.found()) {
    size_t member = 0;
    const Result<EtcdReader::News> read = co_await Read(&reader, &member);
    if (!read.ok()) {
      co_return read.error();
    }
  }
  TxnRequest request;
  request.IfGreater(keys_.floor(), HexText(floor));
  request.failure.Put(keys_.floor(), HexText(floor));
  request.failure.DeleteRange(keys_.Log(0), keys_.Log(reader.next()));
  request.failure.DeleteRange(keys_.PiecesOf(0), keys_.PiecesOf(reader.next()));
  const Result<Transacted> done = co_await Transact(request, 0, 3);
  if (!done.ok()) {
    co_return done.error();
  }
  const Revision before = std::exchange(trimmed_at_, done.value().txn.revision);
  if (before == 0) {
    co_return Ok();
  }
  co_return co_await Compact(before);
}

asio::awaitable<Status> EtcdLog::Impl::Compact(Revision revision) {
  const std::string path = kCompactionPath;
  const std::string body = CompactionRequest(revision);
  const Result<EtcdAnswer> compacted = co_await client_->Call(path, body);
  // Another node may have compacted more.
  if (!compacted.ok() && compacted.error().find("has been compacted") == std::string::npos) {
    co_return compacted.error();
  }
  co_return Ok();
}

// Only the member that leads can pass it on.
asio::awaitable<Status> EtcdLog::Impl::Transfer() {
  if (!settings_.has_own_member) {
    co_return Ok();
  }
  const std::string status_path = kStatusPath;
  const std::string status_body = "{}";
  StatusAnswer own;
  for (size_t member = 0; member < client_->size(); ++member) {
    const Result<std::string> answer =
        co_await client_->CallMember(member, status_path, status_body);
    if (!answer.ok() && member == 0) {
      co_return answer.error();
    }
    if (!answer.ok()) {
      continue;
    }
    const Result<StatusAnswer> status = ParseStatus(answer.value());
    if (!status.ok()) {
      co_return client_->ErrorAt(member, status.error());
    }
    own = member == 0 ? status.value() : own;
    if (own.leader == own.member) {
      co_return Ok();
    }
    if (status.value().member == own.leader) {
      const std::string path = kTransferPath;
      const std::string body = TransferRequest(own.member);
      const Result<std::string> transferred = co_await client_->CallMember(member, path, body);
      co_return transferred.ok() ? Ok() : Status(transferred.error());
    }
  }
  co_return client_->ErrorAt(0, own.leader == 0
                                    ? "knows no leader of etcd"
                                    : "the leader of etcd, member " + HexText(own.leader) +
                                          ", is not among those that respond; check the addresses");
}

asio::awaitable<Result<Register>> EtcdLog::Impl::ReadRegister(std::string name) {
  TxnRequest request;
  request.success.Read(keys_.Owner(name));
  const Result<Transacted> done = co_await Transact(request, 1, 0);
  if (!done.ok()) {
    co_return done.error();
  }
  co_return RegisterOf(done.value().txn.parts[0].entries);
}

asio::awaitable<Result<Register>> EtcdLog::Impl::SetRegister(std::string name, uint64_t seen,
                                                             std::string value) {
  const std::string key = keys_.Owner(name);
  TxnRequest request;
  request.IfChangedAt(key, seen);
  request.success.Put(key, value);
  request.success.Read(key);
  request.failure.Read(key);
  const Result<Transacted> done = co_await Transact(request, 2, 1);
  if (!done.ok()) {
    co_return done.error();
  }
  const TxnAnswer& txn = done.value().txn;
  if (txn.succeeded && ++changes_ % kBetweenCompactions == 0) {
    if (const Revision before = std::exchange(compacts_at_, txn.revision); before != 0) {
      Run([this, before] { return Compact(before); }, [](const Status& /*compacted*/) {});
    }
  }
  co_return RegisterOf(txn.parts.back().entries);
}

asio::awaitable<Result<EtcdReader::News>> EtcdLog::Impl::Read(EtcdReader* reader, size_t* member) {
  const std::string path = kTxnPath;
  const std::string body = reader->ReadRequest();
  const Result<EtcdAnswer> answer = co_await client_->Call(path, body);
  if (!answer.ok()) {
    co_return answer.error();
  }
  *member = answer.value().member;
  Result<EtcdReader::News> news = reader->OnRead(answer.value().text);
  if (!news.ok()) {
    co_return Unusable(*member, news.error());
  }
  co_return news;
}

asio::awaitable<Status> EtcdLog::Impl::ReadPieces(StoredGroup* stored) {
  for (uint32_t piece = 0; piece < stored->pieces; ++piece) {
    const std::string key = keys_.Piece(stored->group, piece);
    TxnRequest request;
    request.success.Read(key);
    const Result<Transacted> done = co_await Transact(request, 1, 0);
    if (!done.ok()) {
      co_return done.error();
    }
    const std::vector<TxnAnswer::Part>& parts = done.value().txn.parts;
    if (parts.empty() || parts[0].entries.empty()) {
      co_return client_->ErrorAt(done.value().member, "key " + key + ": absent, expected piece " +
                                                          std::to_string(piece + 1) + " of " +
                                                          std::to_string(stored->pieces) +
                                                          " of the group at " +
                                                          std::to_string(stored->group.first));
    }
    stored->group.records += parts[0].entries.front().value;
  }
  const Status checked = CheckGroup(*stored);
  if (!checked.ok()) {
    co_return Error{"key " + keys_.Log(stored->group.first) + ": " + checked.error()};
  }
  co_return Ok();
}

// Completes groups and tells them. What could not be completed is read again: a page without groups
// would say that there are none.
asio::awaitable<Status> EtcdLog::Impl::Publish(EtcdReader* reader, EtcdReader::News* found,
                                               uint64_t followed, const News& news) {
  Page page{found->id, found->leader, found->floor, found->log_end, {}};
  Status status = Ok();
  for (StoredGroup& stored : found->groups) {
    if (stored.pieces > 0) {
      status = co_await ReadPieces(&stored);
      if (!status.ok()) {
        page.leader = {};
        reader->ReturnTo(stored.group.first);
        break;
      }
    }
    page.groups.push_back(std::move(stored.group));
  }
  const bool tells_nothing = page.groups.empty() && (found->more || !status.ok());
  if (IsFollowed(followed) && !tells_nothing) {
    news(page);
  }
  co_return status;
}

// Ends without an error if it was silent, or began before what was compacted: a read is next.
asio::awaitable<Status> EtcdLog::Impl::Watch(EtcdReader* reader, size_t member, Revision revision,
                                             uint64_t followed, const News& news) {
  const std::string path = kWatchPath;
  const std::string body = reader->WatchFrom(revision);
  Result<std::unique_ptr<EtcdStream>> stream = co_await client_->Open(member, path, body);
  if (!stream.ok()) {
    client_->SetDown(member, stream.error());
    co_return Ok();  // an error only if no other member responds
  }
  while (IsFollowed(followed)) {
    const Result<std::optional<std::string>> line =
        co_await stream.value()->Next(settings_.silence);
    if (!line.ok()) {
      client_->SetDown(member, line.error());
      co_return Ok();
    }
    if (!line.value()) {
      co_return Ok();
    }
    Result<EtcdReader::News> found = reader->OnWatch(*line.value());
    if (!found.ok()) {
      co_return Unusable(member, found.error());
    }
    const Status published = co_await Publish(reader, &found.value(), followed, news);
    if (!published.ok() || found.value().more) {
      co_return published;
    }
  }
  co_return Ok();
}

asio::awaitable<Status> EtcdLog::Impl::Follow(uint64_t followed, Sequence from, News news) {
  EtcdReader reader(keys_, from, &id_);
  while (IsFollowed(followed)) {
    size_t member = 0;
    Result<EtcdReader::News> found = co_await Read(&reader, &member);
    Status status = Ok();
    if (!found.ok()) {
      status = found.error();
    } else {
      status = co_await Publish(&reader, &found.value(), followed, news);
      if (status.ok() && !found.value().more) {
        const Revision after = found.value().revision + 1;
        status = co_await Watch(&reader, member, after, followed, news);
      }
    }
    if (!status.ok() && IsFollowed(followed)) {
      news(status.error());
      co_await client_->Pause(kAfterError);
    }
  }
  co_return Ok();
}

EtcdLog::EtcdLog(asio::any_io_executor executor, EtcdSettings settings)
    : impl_(std::make_shared<Impl>(std::move(executor), std::move(settings))) {}

EtcdLog::~EtcdLog() {
  Stop();
}

void EtcdLog::TakeLead(Term seen, const std::string& node,
                       std::function<void(const Result<Leader>&)> done) {
  impl_->Run([impl = impl_.get(), seen, node] { return impl->TakeLead(seen, node); },
             std::move(done));
}

void EtcdLog::Append(const Group& group, std::function<void(Appended)> done) {
  impl_->Run([impl = impl_.get(), group] { return impl->Append(group); }, std::move(done));
}

void EtcdLog::Follow(Sequence from, std::function<void(const Result<Page>&)> news) {
  impl_->Run([impl = impl_.get(), followed = impl_->BeginToFollow(), from,
              news = std::move(news)] { return impl->Follow(followed, from, news); },
             [](const Status& /*ended*/) {});
}

void EtcdLog::Trim(Sequence floor, std::function<void(const Status&)> done) {
  impl_->Run([impl = impl_.get(), floor] { return impl->Trim(floor); }, std::move(done));
}

void EtcdLog::Transfer(std::function<void(const Status&)> done) {
  impl_->Run([impl = impl_.get()] { return impl->Transfer(); }, std::move(done));
}

void EtcdLog::ReadRegister(const std::string& name,
                           std::function<void(const Result<Register>&)> done) {
  impl_->Run([impl = impl_.get(), name] { return impl->ReadRegister(name); }, std::move(done));
}

void EtcdLog::SetRegister(const std::string& name, uint64_t seen, const std::string& value,
                          std::function<void(const Result<Register>&)> done) {
  impl_->Run(
      [impl = impl_.get(), name, seen, value] { return impl->SetRegister(name, seen, value); },
      std::move(done));
}

void EtcdLog::Stop() {
  impl_->Stop();
}

}  // namespace pheromone::cluster
