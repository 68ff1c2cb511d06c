#include "server/operators/playback/player.h"

#include <algorithm>
#include <iterator>
#include <utility>
#include <variant>

#include "server/operators/control/engine_views.h"

namespace pheromone::playback {
namespace {

constexpr uint64_t kNsPerMs = 1'000'000;
constexpr uint64_t kNsPerSecond = 1'000'000'000;

uint64_t NsOf(const engine::Stamp& stamp) {
  return static_cast<uint64_t>(std::max<int64_t>(stamp.utc_ms, 0)) * kNsPerMs;
}

const engine::Stamp* StampOf(const capture::Record& record) {
  if (const auto* batch = std::get_if<capture::Batch>(&record)) {
    return &batch->stamp;
  }
  const auto* event = std::get_if<capture::EventApplied>(&record);
  return event != nullptr ? &event->stamp : nullptr;
}

// 0 if the record has no time of its own: it belongs to the one before.
uint64_t TimeOf(const capture::Record& record) {
  if (const engine::Stamp* stamp = StampOf(record)) {
    return NsOf(*stamp);
  }
  if (const auto* packet = std::get_if<capture::Packet>(&record)) {
    return packet->utc_ns;
  }
  if (const auto* start = std::get_if<capture::Start>(&record)) {
    return start->utc_ns;
  }
  const auto* end = std::get_if<capture::End>(&record);
  return end != nullptr ? end->utc_ns : 0;
}

}  // namespace

Player::Player(std::string name, Open open, PlayerOptions options)
    : name_(std::move(name)), open_(std::move(open)), options_(std::move(options)) {}

bool Player::Survey(uint64_t most_bytes) {
  if (!is_surveyed_ && !surveyor_) {
    Result<ByteReader::Source> source = open_(0);
    if (!source.ok()) {
      problem_ = source.error();
      is_surveyed_ = true;
      return true;
    }
    surveyor_.emplace(std::move(source).value(), name_);
  }
  const uint64_t begin = is_surveyed_ ? 0 : surveyor_->position().byte;
  while (!is_surveyed_ && surveyor_->position().byte - begin < most_bytes) {
    const Result<std::optional<capture::Found>> found = surveyor_->Next();
    if (!found.ok() || !found.value()) {
      problem_ = found.ErrorOr("");
      is_surveyed_ = true;
      break;
    }
    const capture::Record& record = found.value()->record;
    if (const auto* start = std::get_if<capture::Start>(&record)) {
      range_ = {start->utc_ns, start->utc_ns};
    }
    range_.end_ns = std::max(range_.end_ns, TimeOf(record));
    const engine::Stamp* const stamp = StampOf(record);
    if (stamp != nullptr && stamp->utc_ms > 0 && !first_stamp_) {
      first_stamp_ = Anchor{NsOf(*stamp), stamp->field_time_ms};
    }
    records_ = found.value()->number;
    has_end_ = std::holds_alternative<capture::End>(record);
  }
  if (is_surveyed_ && surveyor_) {
    surveyor_.reset();
    if (problem_.empty() && !has_end_ && records_ != 0) {
      problem_ = name_ + ": after record " + std::to_string(records_) +
                 ": the recording has no end record: it is being written, or was cut off";
    }
    Seek(range_.begin_ns);
  }
  return is_surveyed_;
}

bool Player::Reopen(const capture::CaptureReader::Position& from) {
  reader_.reset();
  next_.reset();
  Result<ByteReader::Source> source = open_(from.byte);
  if (!source.ok()) {
    replay_problem_ = source.error();
    return false;
  }
  reader_.emplace(std::move(source).value(), name_, from);
  ReadNext();
  return true;
}

void Player::Restart() {
  ++generation_;
  replay_problem_.clear();
  replay_ =
      std::make_unique<capture::Replay>([errors = errors_, on_answer = options_.on_answer](
                                            uint64_t /*field_ms*/, const capture::Sent& sent) {
        protocol::ErrorAnswer error;
        if (protocol::Decode(sent.message, &error)) {
          errors->push_back(error);
        }
        if (on_answer) {
          on_answer(sent);
        }
      });
  progress_ = {};
  progress_.last_ns = range_.begin_ns;
  Reopen({});
}

void Player::GoOnFrom(const Checkpoint& checkpoint) {
  ++generation_;
  replay_problem_.clear();
  replay_ = std::make_unique<capture::Replay>(*checkpoint.replay);
  progress_ = checkpoint.progress;
  Reopen(progress_.position);
}

// What came after the survey is not read: its end is known by then.
void Player::ReadNext() {
  next_.reset();
  progress_.position = reader_->position();
  if (progress_.position.number >= records_) {
    return;
  }
  Result<std::optional<capture::Found>> found = reader_->Next();
  if (!found.ok()) {
    replay_problem_ = found.error();  // it has changed since the survey
  } else {
    next_ = std::move(found).value();
  }
}

std::optional<uint64_t> Player::next_ns() const {
  return next_ ? std::optional(std::max(progress_.last_ns, TimeOf(next_->record))) : std::nullopt;
}

void Player::Seek(uint64_t time_ns) {
  target_ns_ = std::clamp(time_ns, range_.begin_ns, range_.end_ns);
  if (records_ == 0) {
    return;
  }
  const bool is_back = replay_ == nullptr || target_ns_ < progress_.last_ns;
  const Checkpoint* best = nullptr;
  for (const auto& [part, checkpoint] : checkpoints_) {
    const uint64_t its_ns = checkpoint.progress.last_ns;
    if (its_ns <= target_ns_ && (is_back || its_ns > progress_.last_ns)) {
      best = &checkpoint;
    }
  }
  if (best != nullptr) {
    GoOnFrom(*best);
  } else if (is_back) {
    Restart();
  }
  if (target_ns_ < time_ns_ || best != nullptr || is_back) {
    time_ns_ = progress_.last_ns;
  }
}

void Player::Proceed(uint64_t time_ns) {
  target_ns_ = std::clamp(time_ns, std::max(time_ns_, range_.begin_ns), range_.end_ns);
}

bool Player::Arrive(uint64_t most_bytes) {
  const uint64_t begin = progress_.position.byte;
  while (const std::optional<uint64_t> at_ns = next_ns()) {
    if (*at_ns > target_ns_) {
      break;
    }
    if (progress_.position.byte - begin >= most_bytes) {
      time_ns_ = progress_.last_ns;
      return false;
    }
    Step();
  }
  time_ns_ = has_failed() ? progress_.last_ns : target_ns_;
  return true;
}

bool Player::Step() {
  if (!next_ || has_failed()) {
    return false;
  }
  const capture::Found found = *std::exchange(next_, std::nullopt);
  errors_->clear();
  const Status same = replay_->Take(found);
  if (!same.ok()) {
    replay_problem_ = name_ + ": " + same.error();
    return false;
  }
  Note(found.record);
  if (options_.on_record) {
    options_.on_record(found.record);
  }
  ReadNext();
  KeepCheckpoint();
  return true;
}

void Player::Note(const capture::Record& record) {
  progress_.last_ns = std::max(progress_.last_ns, TimeOf(record));
  const engine::Stamp* const stamp = StampOf(record);
  if (stamp != nullptr && stamp->utc_ms > 0) {
    progress_.anchor = {NsOf(*stamp), stamp->field_time_ms};
  }
  if (const auto* packet = std::get_if<capture::Packet>(&record)) {
    Count(*packet);
  } else if (const auto* batch = std::get_if<capture::Batch>(&record)) {
    NoteBatch(*batch);
  } else if (const auto* applied = std::get_if<capture::EventApplied>(&record)) {
    NoteEvent(*applied);
  } else if (const auto* halt = std::get_if<capture::Unlogged>(&record)) {
    progress_.traffic.NoteHaltOfAll(halt->sent.link, progress_.anchor.field_ms);
  }
}

void Player::NoteBatch(const capture::Batch& batch) {
  for (const capture::Handled& handled : batch.messages) {
    const auto error =
        std::find_if(errors_->begin(), errors_->end(), [&](const protocol::ErrorAnswer& it) {
          return it.id == handled.message.id && it.refused_opcode == handled.message.opcode;
        });
    const bool refused = error != errors_->end();
    progress_.traffic.Count(
        batch.link, handled.message, batch.stamp.field_time_ms,
        refused ? engine::Traffic::Fate::kRefused : engine::Traffic::Fate::kAnswered,
        refused ? error->reason : protocol::Reason::kNone);
  }
}

void Player::NoteEvent(const capture::EventApplied& applied) {
  const uint64_t at_ms = applied.stamp.field_time_ms;
  if (const auto* command = std::get_if<engine::CommandIssued>(&applied.event)) {
    if (command->id == protocol::kBroadcastId && command->code == protocol::CommandCode::kHalt) {
      progress_.traffic.NoteHaltOfAll(command->link, at_ms);
    }
  } else if (const auto* ended = std::get_if<engine::GoalEnded>(&applied.event)) {
    if (ended->reached) {
      progress_.traffic.NoteArrival(ended->link, ended->id, at_ms);
    }
  }
}

void Player::Count(const capture::Packet& packet) {
  progress_.links.resize(start().links.size());
  LinkBytes& link = progress_.links[packet.link];
  (packet.direction == capture::Direction::kFromRobots ? link.received : link.sent) +=
      packet.bytes.size();
  const uint64_t second = packet.utc_ns / kNsPerSecond;
  if (second != link.second) {
    link.last_second = second == link.second + 1 ? link.in_second : 0;
    link.second = second;
    link.in_second = 0;
  }
  link.in_second += packet.bytes.size();
}

// The first moment of each part of the range is kept, unless all together would be too large.
void Player::KeepCheckpoint() {
  const uint64_t span = range_.end_ns - range_.begin_ns;
  if (!has_views() || !next_ || span == 0) {
    return;
  }
  const double share =
      static_cast<double>(progress_.last_ns - range_.begin_ns) / static_cast<double>(span);
  const auto part = static_cast<size_t>(share * static_cast<double>(options_.max_checkpoints));
  if (part >= options_.max_checkpoints || checkpoints_.contains(part)) {
    return;
  }
  const auto bytes_of = [](const field::Field& field) {
    return field.used_bytes() + field.history().used_bytes();
  };
  uint64_t bytes = bytes_of(engine().field());
  for (const auto& [number, it] : checkpoints_) {
    bytes += bytes_of(it.replay->engine()->field());
  }
  if (bytes <= options_.checkpoint_bytes) {
    checkpoints_.emplace(part,
                         Checkpoint{std::make_unique<const capture::Replay>(*replay_), progress_});
  }
}

// --- Views.

uint64_t Player::FieldTimeAt(uint64_t at_ns) const {
  const Anchor anchor =
      progress_.anchor.utc_ns != 0 ? progress_.anchor : first_stamp_.value_or(Anchor{at_ns, 0});
  const uint64_t back_ms = (anchor.utc_ns - std::min(anchor.utc_ns, at_ns)) / kNsPerMs;
  const uint64_t on_ms = (at_ns - std::min(anchor.utc_ns, at_ns)) / kNsPerMs;
  const uint64_t field_ms = anchor.field_ms + on_ms;
  return std::clamp(field_ms - std::min(field_ms, back_ms), engine().field_time_ms(),
                    engine::kMaxFieldTimeMs);
}

control::FieldView Player::Field(uint64_t at_ns) const {
  return control::FieldOf(engine(), FieldTimeAt(at_ns));
}

std::vector<control::ClientView> Player::Clients(uint64_t at_ns) const {
  return control::ClientsOf(engine(), progress_.traffic, FieldTimeAt(at_ns));
}

std::vector<control::TagView> Player::Tags(uint64_t at_ns) const {
  std::vector<control::TagView> all;
  std::optional<uint16_t> next = 1;
  while (next) {
    control::TagPage page = control::TagsOf(engine(), *next, FieldTimeAt(at_ns));
    std::move(page.tags.begin(), page.tags.end(), std::back_inserter(all));
    next = page.next;
  }
  return all;
}

std::vector<control::NetView> Player::Nets(uint64_t at_ns) const {
  return control::NetsOf(engine(), FieldTimeAt(at_ns));
}

std::vector<control::LinkView> Player::Links(uint64_t at_ns) const {
  std::vector<control::LinkView> views;
  for (size_t i = 0; i < start().links.size(); ++i) {
    control::LinkView& view = views.emplace_back();
    view.name = start().links[i].name;
    view.kind = "recorded";
    view.up = true;
    view.state = "recorded";
    if (i < progress_.links.size()) {
      const LinkBytes& bytes = progress_.links[i];
      const uint64_t second = at_ns / kNsPerSecond;
      view.bytes_per_s = static_cast<double>(second == bytes.second       ? bytes.last_second
                                             : second == bytes.second + 1 ? bytes.in_second
                                                                          : 0);
      view.counters = {{"received_bytes", "Bytes received.", bytes.received},
                       {"sent_bytes", "Bytes sent.", bytes.sent}};
    }
  }
  return views;
}

control::StatusView Player::ServerStatus(uint64_t at_ns) const {
  control::StatusView status;
  status.version = start().version;
  status.field_time_ms = FieldTimeAt(at_ns);
  status.uptime_s = static_cast<double>(at_ns - range_.begin_ns) / 1e9;
  control::AddEngine(engine(), progress_.traffic, &status);
  status.durable_sequence = status.sequence;
  status.service.requests = replay_->report().messages;
  status.service.answers = replay_->report().answers;
  status.service.changes = status.sequence;
  status.links = status.links_up = start().links.size();
  return status;
}

}  // namespace pheromone::playback
