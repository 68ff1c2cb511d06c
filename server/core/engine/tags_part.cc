#include "server/core/engine/tags_part.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "server/core/engine/refusal.h"
#include "server/core/engine/wire_units.h"

namespace pheromone::engine {
namespace {

using protocol::Message;
using protocol::Reason;
using tags::DefineOutcome;
using tags::WriteOutcome;

constexpr size_t kExpiredInOneStep = 256;
constexpr size_t kFrozenInOnePortion = 256;

// What robots and operators are told of an outcome.
template <typename Outcome>
struct Meaning {
  Outcome outcome = Outcome::kDone;
  Reason reason = Reason::kNone;
  std::string_view text;
};

constexpr Meaning<WriteOutcome> kWriteMeanings[] = {
    {WriteOutcome::kDone, Reason::kNone, ""},
    {WriteOutcome::kGenerationChanged, Reason::kGenerationChanged, "its generation has changed"},
    {WriteOutcome::kProtected, Reason::kTagProtected, "the block there is protected"},
    {WriteOutcome::kFull, Reason::kTagFull, "it is full"},
    {WriteOutcome::kNoSuchSlot, Reason::kBadValue, "it has no such slot"},
};

constexpr Meaning<DefineOutcome> kDefineMeanings[] = {
    {DefineOutcome::kDone, Reason::kNone, ""},
    {DefineOutcome::kBadValue, Reason::kBadValue,
     "invalid number or text, expected numbers from 1 on and 1 to 255 bytes of UTF-8"},
    {DefineOutcome::kUnknownRobot, Reason::kUnknownSymbol, "unknown robot"},
    {DefineOutcome::kTaken, Reason::kNotPermitted, "the number or the ID is bound otherwise"},
    {DefineOutcome::kFull, Reason::kTagFull, "the symbol tables are full"},
    {DefineOutcome::kMakerFull, Reason::kTagFull,
     "this robot has made as many definitions as it may"},
};

template <typename Outcome, size_t kCount>
const Meaning<Outcome>& FindMeaning(const Meaning<Outcome> (&meanings)[kCount], Outcome outcome) {
  const auto* const found = std::find_if(
      std::begin(meanings), std::end(meanings),
      [outcome](const Meaning<Outcome>& meaning) { return meaning.outcome == outcome; });
  assert(found != std::end(meanings));
  return *found;
}

const Meaning<WriteOutcome>& MeaningOf(WriteOutcome outcome) {
  return FindMeaning(kWriteMeanings, outcome);
}

const Meaning<DefineOutcome>& MeaningOf(DefineOutcome outcome) {
  return FindMeaning(kDefineMeanings, outcome);
}

// The server's clock where a writer has none.
uint32_t TimeOr(uint32_t time_s, int64_t utc_ms) {
  return time_s != 0
             ? time_s
             : static_cast<uint32_t>(std::clamp<int64_t>(utc_ms / 1000, 1, int64_t{0xFFFFFFFF}));
}

tags::WriteRequest RequestOf(const TagsChanged::Write& write, const Context& context) {
  tags::WriteRequest request{.block = write.block,
                             .slot = write.slot,
                             .expected = write.expected,
                             .lease_ms = write.lease_ms,
                             .is_state = write.is_state};
  request.block.time_s = TimeOr(write.block.time_s, context.utc_ms);
  return request;
}

Error NoSuchTag(uint16_t tag) {
  return Error{"there is no tag " + std::to_string(tag)};
}

Error Refusal(const tags::NamedTag& tag, std::string_view why) {
  return Error{"tag \"" + tag.name + "\": " + std::string(why)};
}

// Why: with how many of its slots are protected.
Error RefusalOfFull(const tags::NamedTag& tag, const tags::Store& store) {
  const std::vector<tags::Slot>& slots = tag.tag.slots();
  const auto taken = std::count_if(slots.begin(), slots.end(),
                                   [&](const tags::Slot& slot) { return store.IsProtected(slot); });
  return Refusal(tag, std::string(MeaningOf(WriteOutcome::kFull).text) +
                          ": leased and privileged blocks take " + std::to_string(taken) +
                          " of its " + std::to_string(slots.size()) + " slots, and may take " +
                          std::to_string(tag.tag.quota()) +
                          (taken > 0 ? ": erase one of them, or wait until a lease ends" : ""));
}

// The generation that a WRITE or ERASE depends on, if it depends on one.
template <typename Request>
std::optional<uint16_t> ExpectedBy(const Request& request) {
  return (request.flags & protocol::kTagExpect) != 0 ? std::optional(request.expected)
                                                     : std::nullopt;
}

int16_t ToPoseUnits(int64_t um, uint16_t pose_unit_10um) {
  const int64_t unit_um = int64_t{pose_unit_10um} * 10;
  const int64_t half = um < 0 ? -unit_um / 2 : unit_um / 2;
  return static_cast<int16_t>(std::clamp<int64_t>((um + half) / unit_um, -32'768, 32'767));
}

class FrozenTags final : public FrozenPart {
 public:
  explicit FrozenTags(std::unique_ptr<tags::FrozenStore> store) : store_(std::move(store)) {}
  uint64_t bytes() const override { return store_->bytes(); }
  bool CopySome(std::string* to, int /*tiles*/) override {
    return store_->CopySome(to, kFrozenInOnePortion);
  }
  bool failed() const override { return store_->failed(); }
  void LetGo() override { store_->LetGo(); }

 private:
  std::unique_ptr<tags::FrozenStore> store_;
};

}  // namespace

// --- What nets change

bool TagEditor::Define(const tags::Row& row) {
  return store_->Define(row) == DefineOutcome::kDone;
}

bool TagEditor::Write(uint16_t tag, uint8_t slot, tags::Block block) {
  block.time_s = TimeOr(block.time_s, utc_ms_);
  return store_->Find(tag) != nullptr && tags::CheckBlock(block).ok() &&
         store_->symbols().HasRobot(block.author) &&
         store_->Write(tag, {.block = block, .slot = slot}, now_ms_, utc_ms_ / 1000).outcome ==
             WriteOutcome::kDone;
}

bool TagEditor::Erase(uint16_t tag, uint8_t slot) {
  const tags::NamedTag* const found = store_->Find(tag);
  if (found == nullptr || slot >= found->tag.slots().size()) {
    return false;
  }
  store_->Clear(tag, slot);
  return true;
}

// --- Configuration

Status TagsPart::Prepare(const SharedConfig& present, const tags::Survey& survey,
                         ConfigChanged* change) {
  if (present->tags == change->config->tags) {
    return Ok();
  }
  Result<tags::Plan> tags = tags::MakePlan(survey, change->config->tags);
  if (!tags.ok()) {
    return tags.error();
  }
  ConfigPlan plan = *change->plan;
  plan.tags = std::make_shared<const tags::Plan>(std::move(tags).value());
  change->plan = std::make_shared<const ConfigPlan>(std::move(plan));
  return Ok();
}

// Settings of the present state were checked when they came.
Status TagsPart::CheckConfig(const Context& context, const EngineConfig& next,
                             const ConfigPlan* plan) const {
  if (const tags::Plan* const current = CurrentIn(plan)) {
    return store_.Check(*current);
  }
  if (context.config->tags == next.tags) {
    return Ok();
  }
  const Status in_bounds = CheckFields(next.tags, "");
  return in_bounds.ok() ? store_.Check(next.tags) : in_bounds;
}

void TagsPart::Configure(const Context& context, const Reconfiguration& change,
                         const Output& /*out*/) {
  if (const tags::Plan* const current = CurrentIn(change.plan)) {
    store_.Take(*current);
  } else if (change.before == nullptr || change.before->tags != context.config->tags) {
    store_.Configure(context.config->tags);
  }
}

// Null if there is none, or if what it was made for has changed.
const tags::Plan* TagsPart::CurrentIn(const ConfigPlan* plan) const {
  const tags::Plan* const tags = plan != nullptr ? plan->tags.get() : nullptr;
  return tags != nullptr && store_.IsCurrent(*tags) ? tags : nullptr;
}

// --- Requests that change nothing

bool TagsPart::IsInRange(const Context& context, LinkIndex link, uint8_t id, int32_t x, int32_t y,
                         uint16_t tag) const {
  const tags::Place* const place = store_.PlaceOf(tag);
  const field::PointUm at = context.robots.PoseOf(link, id, {x, y, 0}, context.now_ms).position;
  return place != nullptr && place->Reaches(at.x, at.y);
}

Message TagsPart::Answer(const Context& context, LinkIndex link, const Message& request) const {
  protocol::ScanRequest scan;
  if (protocol::Decode(request, &scan)) {
    return Scan(context, link, scan);
  }
  protocol::TagReadRequest read;
  if (protocol::Decode(request, &read)) {
    return IsInRange(context, link, read.id, read.x, read.y, read.tag)
               ? Read(context, read)
               : ErrorMessage(request, Reason::kNoTagInRange);
  }
  protocol::ResolveRequest resolve;
  protocol::Decode(request, &resolve);
  const std::optional<Message> answer = Resolve(resolve);
  return answer ? *answer : ErrorMessage(request, Reason::kUnknownSymbol);
}

Message TagsPart::Scan(const Context& context, LinkIndex link,
                       const protocol::ScanRequest& request) const {
  const field::PointUm at =
      context.robots.PoseOf(link, request.id, {request.x, request.y, 0}, context.now_ms).position;
  const std::vector<uint16_t> all = store_.InRange(at.x, at.y);
  auto next = std::upper_bound(all.begin(), all.end(), request.after);
  protocol::ScanAnswer answer;
  answer.id = request.id;
  for (; next != all.end() && answer.count < protocol::kMaxTagsInRange; ++next) {
    const tags::Place& place = *store_.PlaceOf(*next);
    const field::PointUm seen =
        context.robots.DifferenceFor(link, request.id, {place.x_um - at.x, place.y_um - at.y});
    const uint16_t unit = context.config->pose_unit_10um;
    answer.rows[answer.count++] = {*next, ToPoseUnits(seen.x, unit), ToPoseUnits(seen.y, unit),
                                   store_.Find(*next)->tag.generation()};
  }
  answer.more =
      static_cast<uint8_t>(std::min<ptrdiff_t>(all.end() - next, protocol::kManyMoreTags));
  Message message;
  protocol::Encode(answer, &message);
  return message;
}

Message TagsPart::Read(const Context& context, const protocol::TagReadRequest& request) const {
  const tags::Tag& tag = store_.Find(request.tag)->tag;
  const auto used_from = [&](size_t slot) {
    while (slot < tag.slots().size() && tag.slots()[slot].block.is_empty()) {
      ++slot;
    }
    return slot < tag.slots().size() ? static_cast<uint8_t>(slot) : protocol::kNoSlot;
  };
  protocol::TagReadAnswer answer;
  answer.id = request.id;
  answer.tag = request.tag;
  answer.slot = used_from(request.slot);
  answer.next = protocol::kNoSlot;
  answer.slots = static_cast<uint8_t>(tag.slots().size());
  answer.tag_generation = tag.generation();
  if (answer.slot != protocol::kNoSlot) {
    const tags::Slot& slot = tag.slots()[answer.slot];
    answer.next = used_from(answer.slot + size_t{1});
    answer.slot_generation = slot.generation;
    if (slot.is_leased()) {  // it is there until an Advance ends it
      const uint64_t left_ms = slot.lease_end_ms - std::min(slot.lease_end_ms, context.now_ms);
      answer.lease_s = static_cast<uint16_t>(std::max<uint64_t>((left_ms + 999) / 1000, 1));
    }
    answer.flags = store_.IsPrivileged(slot.block.author) ? protocol::kTagPrivileged : 0;
    const tags::Words words = tags::ToWords(slot.block);
    std::copy(words.begin(), words.end(), answer.words);
  }
  Message message;
  protocol::Encode(answer, &message);
  return message;
}

std::optional<Message> TagsPart::Resolve(const protocol::ResolveRequest& request) const {
  const tags::SymbolTables& symbols = store_.symbols();
  protocol::ResolveAnswer answer;
  answer.id = request.id;
  answer.kind = request.kind;
  answer.robot = request.robot;
  answer.number = request.number;
  answer.rows = static_cast<uint32_t>(symbols.rows().size());
  const std::string* text = nullptr;
  static const std::string no_text;
  switch (request.kind) {
    case protocol::SymbolKind::kRobot:
      answer.number = request.robot;
      text = symbols.UniqueIdOf(request.robot);
      break;
    case protocol::SymbolKind::kString:
      text = symbols.StringOf(request.robot, request.number);
      break;
    case protocol::SymbolKind::kMapping:
      answer.number = symbols.OwnerOf(request.robot);
      text = symbols.IsMapped(request.robot) ? &no_text : nullptr;
      break;
    case protocol::SymbolKind::kRow:
      if (request.number >= 0 && static_cast<size_t>(request.number) < symbols.rows().size()) {
        const tags::Row& row = symbols.rows()[static_cast<size_t>(request.number)];
        answer.kind = static_cast<protocol::SymbolKind>(row.kind);
        answer.robot = row.robot;
        answer.number = row.number;
        text = &row.text;
      }
      break;
  }
  if (text == nullptr) {
    return std::nullopt;
  }
  answer.length = static_cast<uint8_t>(text->size());
  const std::string_view rest =
      std::string_view(*text).substr(std::min<size_t>(request.offset, text->size()));
  answer.count = static_cast<uint8_t>(std::min<size_t>(rest.size(), protocol::kMaxResolvedText));
  std::copy_n(rest.begin(), answer.count, answer.text);
  Message message;
  protocol::Encode(answer, &message);
  return message;
}

// --- Requests that change the tags

Message TagsPart::Change(const Context& context, LinkIndex link, const Message& request) {
  Message answer;
  const Reason reason =
      request.opcode == protocol::kTagWrite   ? Write(context, link, request, &answer)
      : request.opcode == protocol::kTagErase ? Erase(context, link, request, &answer)
                                              : Define(context, link, request, &answer);
  return reason == Reason::kNone ? answer : ErrorMessage(request, reason);
}

Message TagsPart::AnswerToWritten(const Message& request, uint16_t tag, uint8_t slot) const {
  const tags::Tag& it = store_.Find(tag)->tag;
  protocol::TagWritten written;
  written.id = request.id;
  written.erased = request.opcode == protocol::kTagErase;
  written.seq = request.data[0];
  written.tag = tag;
  written.slot = slot;
  written.slot_generation = it.slots()[slot].generation;
  written.tag_generation = it.generation();
  Message answer;
  protocol::Encode(written, &answer);
  return answer;
}

template <typename Request>
Reason TagsPart::Admit(const Context& context, LinkIndex link, const Request& request,
                       uint8_t known_flags, int32_t* author) const {
  if (!IsInRange(context, link, request.id, request.x, request.y, request.tag)) {
    return Reason::kNoTagInRange;
  }
  const auto found = store_.AuthorOn(context.config->links[link].name, request.id);
  if (!found) {
    return Reason::kUnknownSymbol;
  }
  *author = *found;
  return (request.flags & ~known_flags) == 0 ? Reason::kNone : Reason::kBadValue;
}

Reason TagsPart::Write(const Context& context, LinkIndex link, const Message& message,
                       Message* answer) {
  protocol::TagWriteRequest request;
  protocol::Decode(message, &request);
  int32_t author = 0;
  constexpr uint8_t kKnownFlags = protocol::kTagReplace | protocol::kTagExpect;
  if (const Reason refusal = Admit(context, link, request, kKnownFlags, &author);
      refusal != Reason::kNone) {
    return refusal;
  }
  tags::Words words{};
  std::copy(std::begin(request.words), std::end(request.words),
            words.begin() + protocol::kWordSubjectNamespace);
  tags::WriteRequest write{.block = tags::BlockFromWords(words),
                           .lease_ms = uint32_t{request.lease_s} * 1000,
                           .is_state = (request.flags & protocol::kTagReplace) != 0};
  write.block.author = author;
  write.block.time_s = TimeOr(request.time, context.utc_ms);
  if (request.slot != protocol::kNoSlot) {
    write.slot = request.slot;
  }
  write.expected = ExpectedBy(request);
  if (write.lease_ms > tags::kMaxLeaseMs || !tags::CheckBlock(write.block).ok()) {
    return Reason::kBadValue;
  }
  const tags::Written written =
      store_.Write(request.tag, write, context.now_ms, context.utc_ms / 1000);
  if (written.outcome == WriteOutcome::kDone) {
    *answer = AnswerToWritten(message, request.tag, written.slot);
  }
  return MeaningOf(written.outcome).reason;
}

Reason TagsPart::Erase(const Context& context, LinkIndex link, const Message& message,
                       Message* answer) {
  protocol::TagEraseRequest request;
  protocol::Decode(message, &request);
  int32_t author = 0;
  if (const Reason refusal = Admit(context, link, request, protocol::kTagExpect, &author);
      refusal != Reason::kNone) {
    return refusal;
  }
  const WriteOutcome outcome = store_.Erase(request.tag, request.slot, author, ExpectedBy(request));
  if (outcome == WriteOutcome::kDone) {
    *answer = AnswerToWritten(message, request.tag, request.slot);
  }
  return MeaningOf(outcome).reason;
}

Reason TagsPart::Define(const Context& context, LinkIndex link, const Message& message,
                        Message* answer) {
  protocol::SymbolRequest request;
  protocol::Decode(message, &request);
  const std::string& link_name = context.config->links[link].name;
  const std::string text(reinterpret_cast<const char*>(request.text), request.length);
  const tags::Maker maker{link_name, request.id};
  protocol::SymbolAnswer defined{request.id, request.seq, request.kind, request.number};
  DefineOutcome outcome = DefineOutcome::kBadValue;
  if (request.kind == protocol::SymbolKind::kRobot) {
    outcome =
        request.number == 0
            ? store_.AddRobot(text, &defined.number, maker)
            : store_.Define({tags::RowKind::kRobot, request.number, request.number, text}, maker);
    if (outcome == DefineOutcome::kDone) {
      store_.SetAuthorOn(link_name, request.id, defined.number);
    }
  } else if (const std::optional<int32_t> author = store_.AuthorOn(link_name, request.id)) {
    if (request.kind == protocol::SymbolKind::kString) {
      outcome = store_.Define({tags::RowKind::kString, *author, request.number, text}, maker);
    } else if (request.kind == protocol::SymbolKind::kMapping) {
      outcome = store_.Define({tags::RowKind::kMapping, *author, request.number, text}, maker);
    }
  } else {
    outcome = DefineOutcome::kUnknownRobot;
  }
  protocol::Encode(defined, answer);
  return MeaningOf(outcome).reason;
}

// --- The operator's changes

Status TagsPart::Check(const Context& context, const TagsChanged& changed) const {
  const Status in_bounds = CheckFields(changed, "");
  if (!in_bounds.ok()) {
    return Error{"a change of tags: " + in_bounds.error()};
  }
  if (const auto* const write = std::get_if<TagsChanged::Write>(&changed.change)) {
    return Check(context, *write);
  }
  if (const auto* const erase = std::get_if<TagsChanged::Erase>(&changed.change)) {
    return Check(*erase);
  }
  if (const auto* const forget = std::get_if<TagsChanged::Forget>(&changed.change)) {
    return Check(*forget);
  }
  const DefineOutcome outcome = store_.TryDefine(std::get<TagsChanged::Define>(changed.change).row);
  return outcome == DefineOutcome::kDone ? Ok() : Error{std::string(MeaningOf(outcome).text)};
}

Status TagsPart::Check(const Context& context, const TagsChanged::Write& write) const {
  const tags::NamedTag* const tag = store_.Find(write.tag);
  if (tag == nullptr) {
    return NoSuchTag(write.tag);
  }
  const tags::WriteRequest request = RequestOf(write, context);
  if (const Status good = tags::CheckBlock(request.block); !good.ok()) {
    return Refusal(*tag, good.error());
  }
  if (!store_.symbols().HasRobot(request.block.author)) {
    return Refusal(*tag, "the author, " + std::to_string(request.block.author) + ", is unknown");
  }
  const tags::Written written =
      store_.TryWrite(write.tag, request, context.now_ms, context.utc_ms / 1000);
  if (written.outcome == WriteOutcome::kFull) {
    return RefusalOfFull(*tag, store_);
  }
  return written.outcome == WriteOutcome::kDone ? Ok()
                                                : Refusal(*tag, MeaningOf(written.outcome).text);
}

Status TagsPart::Check(const TagsChanged::Erase& erase) const {
  const tags::NamedTag* const tag = store_.Find(erase.tag);
  if (tag == nullptr) {
    return NoSuchTag(erase.tag);
  }
  const std::vector<tags::Slot>& slots = tag->tag.slots();
  if (erase.slot >= slots.size()) {
    return Refusal(*tag, MeaningOf(WriteOutcome::kNoSuchSlot).text);
  }
  return erase.expected && *erase.expected != slots[erase.slot].generation
             ? Refusal(*tag, MeaningOf(WriteOutcome::kGenerationChanged).text)
             : Ok();
}

Status TagsPart::Check(const TagsChanged::Forget& forget) const {
  const tags::Maker& maker = forget.maker;
  if (!maker.is_robot() && maker.id != 0) {
    return Error{"robot " + std::to_string(maker.id) + " of no link"};
  }
  if (store_.CountForgettable(maker) != 0) {
    return Ok();
  }
  const auto& makers = store_.symbols().makers();
  const auto made = std::count(makers.begin(), makers.end(), maker);
  const std::string who =
      maker.is_robot() ? "robot " + std::to_string(maker.id) + " on link \"" + maker.link + "\" has"
                       : "operators and nets have";
  return Error{who + (made == 0 ? " defined nothing"
                                : " defined nothing that is not in use, of " +
                                      std::to_string(made) + " definitions")};
}

void TagsPart::Apply(const Context& context, const TagsChanged& changed, const Output& /*out*/) {
  if (const auto* const write = std::get_if<TagsChanged::Write>(&changed.change)) {
    store_.Write(write->tag, RequestOf(*write, context), context.now_ms, context.utc_ms / 1000);
  } else if (const auto* const erase = std::get_if<TagsChanged::Erase>(&changed.change)) {
    store_.Clear(erase->tag, erase->slot);
  } else if (const auto* const forget = std::get_if<TagsChanged::Forget>(&changed.change)) {
    store_.Forget(forget->maker);
  } else {
    store_.Define(std::get<TagsChanged::Define>(changed.change).row);
  }
}

// --- Time and state

void TagsPart::Advance(const Context& context, const Output& /*out*/) {
  store_.Expire(context.now_ms, kExpiredInOneStep);
}

void TagsPart::Restore(const Context& context, ByteReader* reader) {
  store_.Restore(context.config->tags, reader);
}

std::unique_ptr<FrozenPart> TagsPart::Freeze(uint64_t /*most_kept_bytes*/) const {
  return std::make_unique<FrozenTags>(store_.Freeze());
}

}  // namespace pheromone::engine
