#include "server/core/engine/nets_part.h"

#include <algorithm>
#include <cassert>
#include <set>
#include <utility>

#include "protocol/byte_order.h"
#include "protocol/net_record.h"
#include "server/base/hash.h"
#include "server/core/engine/tags_part.h"

namespace pheromone::engine {
namespace {

using petri::LiveNet;
using petri::LiveRules;
using petri::LiveSettings;
using petri::Refusal;
using protocol::NetRecordFault;

static_assert(static_cast<int>(petri::kLastLiveAction) ==
              static_cast<int>(protocol::kLastNetAction));
static_assert(static_cast<int>(petri::LiveOutcome::kRefused) ==
              static_cast<int>(protocol::NetOutcome::kRefused));
static_assert(tags::kNetRecordType == protocol::kTypeNetRecord);
static_assert(petri::kMaxTriggers == protocol::kMaxCandidates);

using Statement = NetStatement;

tags::Block BlockOf(int32_t author, const Statement& statement) {
  tags::Words words{};
  for (size_t i = 0; i < protocol::kStatementWords; ++i) {
    words[protocol::kWordSubjectNamespace + i] = protocol::GetI32(&statement[4 * i]);
  }
  tags::Block block = tags::BlockFromWords(words);
  block.author = author;
  return block;
}

template <typename Record>
Statement Encoded(const Record& record) {
  Statement statement;
  protocol::Encode(record, statement.data());
  return statement;
}

Statement TriggerOf(const LiveRules& rules, size_t tag) {
  const std::vector<uint8_t>& candidates = rules.settings.tags[tag].candidates;
  protocol::TriggerRecord record{
      rules.settings.robot_hash, static_cast<uint8_t>(candidates.size()), {}};
  std::copy(candidates.begin(), candidates.end(), record.candidates);
  return Encoded(record);
}

Statement SignsOf(const LiveNet& net, size_t tag) {
  const petri::LiveSigns signs = net.SignsAt(tag);
  uint8_t state = signs.green ? protocol::kNetGreen : 0;
  state |= signs.advice == petri::Advice::kA   ? protocol::kNetAdviceA
           : signs.advice == petri::Advice::kB ? protocol::kNetAdviceB
                                               : 0;
  return Encoded(protocol::EnvironmentRecord{
      net.rules().settings.robot_hash, state, static_cast<protocol::NetOutcome>(signs.ack.outcome),
      signs.ack.robot, signs.ack.seq, signs.ack.amount, signs.left});
}

Refusal RefusalOf(NetRecordFault fault) {
  switch (fault) {
    case NetRecordFault::kVersion:
      return Refusal::kVersion;
    case NetRecordFault::kCrc:
      return Refusal::kCrc;
    case NetRecordFault::kHash:
      return Refusal::kHash;
    case NetRecordFault::kValue:
      return Refusal::kValue;
    case NetRecordFault::kNone:
    case NetRecordFault::kNoRecord:
    case NetRecordFault::kKind:
      break;
  }
  return Refusal::kKind;
}

// The lowest slot in which somebody else has left a record: also one of the reader's own, where
// they were empty.
std::optional<uint8_t> SlotToRead(const tags::Tag& tag, std::optional<int32_t> author) {
  for (size_t i = 0; i < tag.slots().size(); ++i) {
    const tags::Block& block = tag.slots()[i].block;
    if (!block.is_empty() && block.is_net_record() && block.author != author) {
      return static_cast<uint8_t>(i);
    }
  }
  return std::nullopt;
}

bool Has(const tags::Slot& slot, int32_t author, const Statement& statement) {
  return slot.block.author == author && StatementOf(slot.block) == statement;
}

// Whether there is something to be done at a tag.
bool NeedsReading(const LiveNet& net, size_t index, const tags::Tag& tag,
                  std::optional<int32_t> author) {
  return !author || SlotToRead(tag, author) ||
         !Has(tag.slots()[protocol::kTriggerSlot], *author, TriggerOf(net.rules(), index)) ||
         !Has(tag.slots()[protocol::kEnvironmentSlot], *author, SignsOf(net, index));
}

std::optional<int32_t> AuthorNumber(const tags::Store& store, std::string_view net) {
  return store.symbols().RobotOf(NetsPart::AuthorOf(net));
}

// The author's number, which is defined if it is new. Empty if the tables are full.
std::optional<int32_t> DefineAuthor(const Context& context, std::string_view net,
                                    const Output& out) {
  const tags::Store& store = context.tags;
  if (const std::optional<int32_t> known = AuthorNumber(store, net)) {
    return known;
  }
  tags::Row row{tags::RowKind::kRobot, NetsPart::kFirstAuthor, 0, NetsPart::AuthorOf(net)};
  while (store.symbols().HasRobot(row.robot)) {
    ++row.robot;
  }
  row.number = row.robot;
  return out.tags->Define(row) ? std::optional(row.robot) : std::nullopt;
}

// The numbers of the net's tags; they stay until the configuration changes.
void Resolve(const tags::Store& store, NetsPart::Instance* it) {
  if (!it->numbers.empty()) {
    return;
  }
  for (const petri::LiveTag& tag : it->net.rules().settings.tags) {
    it->numbers.push_back(store.NumberOf(tag.tag).value_or(0));
  }
}

// --- Configuration

using RulesByName = std::map<std::string, std::shared_ptr<const LiveRules>>;

Status CheckTags(const EngineConfig& config) {
  std::map<std::string_view, const tags::TagSettings*> by_name;
  for (const tags::TagSettings& tag : config.tags.tags) {
    by_name.emplace(tag.name, &tag);
  }
  std::map<std::string_view, std::string_view> bound;
  for (const LiveSettings& net : config.nets) {
    const std::string who = "net \"" + net.name + "\": ";
    const std::vector<std::string>& privileged = config.tags.privileged;
    const std::string author = NetsPart::AuthorOf(net.name);
    if (std::find(privileged.begin(), privileged.end(), author) == privileged.end()) {
      return Error{who + "its author \"" + author + "\" is not privileged"};
    }
    for (const petri::LiveTag& tag : net.tags) {
      const auto found = by_name.find(tag.tag);
      if (found == by_name.end()) {
        return Error{who + "there is no tag \"" + tag.tag + "\", which it calls \"" + tag.in_net +
                     "\""};
      }
      if (found->second->slots < NetsPart::kLeastSlots) {
        return Error{who + "tag \"" + tag.tag + "\" has " + std::to_string(found->second->slots) +
                     " slots, expected at least " + std::to_string(NetsPart::kLeastSlots)};
      }
      if (const auto [it, is_new] = bound.emplace(tag.tag, net.name); !is_new) {
        return Error{who + "tag \"" + tag.tag + "\" is used by net \"" + std::string(it->second) +
                     "\" already"};
      }
    }
  }
  return Ok();
}

Result<RulesByName> RulesIn(const EngineConfig& config) {
  PHEROMONE_TRY_STATUS(CheckFields(config.nets, "nets"));
  RulesByName rules;
  if (config.nets.size() > petri::kMaxLiveNets) {
    return Error{std::to_string(config.nets.size()) + " nets, expected " +
                 std::to_string(petri::kMaxLiveNets) + " at most"};
  }
  for (const LiveSettings& net : config.nets) {
    PHEROMONE_TRY(std::shared_ptr<const LiveRules> made, petri::MakeLiveRules(net));
    if (net.name.empty() || !rules.emplace(net.name, std::move(made)).second) {
      return Error{"net \"" + net.name + "\": expected a name that no other net has"};
    }
  }
  const Status tags = CheckTags(config);
  return tags.ok() ? Result<RulesByName>(std::move(rules)) : tags.error();
}

// For Hash: one word.
uint64_t WordOf(const std::optional<uint64_t>& time_ms) {
  return time_ms ? *time_ms + 1 : 0;
}

}  // namespace

NetStatement StatementOf(const tags::Block& block) {
  const tags::Words words = tags::ToWords(block);
  NetStatement statement;
  for (size_t i = 0; i < protocol::kStatementWords; ++i) {
    protocol::PutI32(&statement[4 * i], words[protocol::kWordSubjectNamespace + i]);
  }
  return statement;
}

Status NetsPart::CheckConfig(const Context& context, const EngineConfig& next,
                             const ConfigPlan* /*plan*/) const {
  if (&next != &*context.config && context.config->nets == next.nets &&
      context.config->tags == next.tags) {
    return Ok();
  }
  const Result<RulesByName> rules = RulesIn(next);
  if (!rules.ok()) {
    return rules.error();
  }
  for (const auto& [name, it] : rules.value()) {
    const auto running = nets_.find(name);
    if (running != nets_.end() && !running->second.net.rules().settings.SameNet(it->settings)) {
      return Error{"net \"" + name +
                   "\" is running, and robots are on their way in it, but its file, its parameters "
                   "or the robots' net are others now; undo that, or give it another name to "
                   "begin anew"};
    }
  }
  return Ok();
}

void NetsPart::Configure(const Context& context, const Reconfiguration& change, const Output& out) {
  fired_.clear();
  for (auto& [name, it] : nets_) {
    it.numbers.clear();
  }
  if (change.before != nullptr && change.before->nets == context.config->nets) {
    return;
  }
  const RulesByName rules = RulesIn(*context.config).value();
  for (auto it = nets_.begin(); it != nets_.end();) {
    if (rules.count(it->first) > 0) {
      ++it;
      continue;
    }
    const tags::Store& store = context.tags;
    Resolve(store, &it->second);
    for (const uint16_t number : it->second.numbers) {
      for (const uint8_t slot : {protocol::kTriggerSlot, protocol::kEnvironmentSlot}) {
        const tags::NamedTag* const tag = store.Find(number);
        if (tag != nullptr &&
            tag->tag.slots()[slot].block.author == AuthorNumber(store, it->first)) {
          (void)out.tags->Erase(number, slot);
        }
      }
    }
    it = nets_.erase(it);
  }
  for (const auto& [name, its] : rules) {
    const auto found = nets_.find(name);
    if (found == nets_.end()) {
      nets_.emplace(name, Instance{.net = LiveNet(its)});
    } else {
      found->second.net.Adopt(its, context.now_ms);
    }
    Instance& it = nets_.find(name)->second;
    it.seen.resize(its->tags.size());
    it.due_ms = petri::NextInstant(context.now_ms, its->settings.period_ms);
    it.numbers.clear();
  }
}

// --- The operator's changes

Status NetsPart::Check(const Context& /*context*/, const NetsChanged& changed) const {
  return nets_.count(changed.net) > 0 ? Ok() : Error{"there is no net \"" + changed.net + "\""};
}

void NetsPart::Apply(const Context& context, const NetsChanged& changed, const Output& out) {
  fired_.clear();
  const auto found = nets_.find(changed.net);
  Instance& it = found->second;
  const tags::Store& store = context.tags;
  Resolve(store, &it);
  for (const uint16_t number : it.numbers) {
    while (const std::optional<uint8_t> slot =
               SlotToRead(store.Find(number)->tag, AuthorNumber(store, found->first))) {
      (void)out.tags->Erase(number, *slot);
    }
  }
  const std::shared_ptr<const LiveRules> rules = it.net.shared_rules();
  it.net = LiveNet(rules);
  it.change_ms = std::nullopt;
  it.due_ms = petri::NextInstant(context.now_ms, rules->settings.period_ms);
}

// --- Reading

void NetsPart::Notice(const Context& context) {
  for (auto& [name, it] : nets_) {
    const tags::Store& store = context.tags;
    Resolve(store, &it);
    for (size_t i = 0; i < it.numbers.size(); ++i) {
      const tags::NamedTag* const tag = store.Find(it.numbers[i]);
      if (tag == nullptr || tag->tag.generation() == it.seen[i]) {
        continue;
      }
      it.seen[i] = tag->tag.generation();
      if (!it.due_ms && NeedsReading(it.net, i, tag->tag, AuthorNumber(store, name))) {
        it.due_ms = petri::NextInstant(context.now_ms, it.net.rules().settings.period_ms);
      }
    }
  }
}

std::optional<uint64_t> NetsPart::NextDeadline() const {
  std::optional<uint64_t> next;
  for (const auto& [name, it] : nets_) {
    for (const std::optional<uint64_t>& time_ms : {it.due_ms, it.change_ms}) {
      next = next && time_ms ? std::min(*next, *time_ms) : next ? next : time_ms;
    }
  }
  return next;
}

void NetsPart::Advance(const Context& context, const Output& out) {
  fired_.clear();
  const auto is_over = [&](const std::optional<uint64_t>& time_ms) {
    return time_ms && *time_ms <= context.now_ms;
  };
  for (auto& [name, it] : nets_) {
    if (is_over(it.due_ms) || is_over(it.change_ms)) {
      Act(context, &it, out);
    }
  }
}

namespace {

// Reads and erases one record at a tag, if there is one.
void ReadOne(const tags::Store& store, const Context& context, size_t index, int32_t author,
             NetsPart::Instance* it, const Output& out, std::vector<petri::Firing>* fired) {
  const uint16_t number = it->numbers[index];
  const tags::Tag& tag = store.Find(number)->tag;
  const std::optional<uint8_t> slot = SlotToRead(tag, author);
  if (!slot) {
    return;
  }
  const tags::Block block = tag.slots()[*slot].block;
  (void)out.tags->Erase(number, *slot);
  const Statement statement = StatementOf(block);
  protocol::RobotRecord record{};
  const NetRecordFault fault =
      protocol::Decode(statement.data(), it->net.rules().settings.robot_hash, &record);
  if (fault == NetRecordFault::kNone) {
    it->net.Take(
        index,
        {block.author, record.seq, static_cast<petri::LiveAction>(record.action), record.amount},
        context.now_ms, fired);
    return;
  }
  constexpr size_t kSeq = 10;  // if it is intact, and only the rest is not as expected
  const bool has_seq = fault == NetRecordFault::kHash || fault == NetRecordFault::kValue;
  it->net.Refuse({.at_ms = context.now_ms,
                  .tag = static_cast<uint8_t>(index),
                  .robot = block.author,
                  .seq = has_seq ? statement[kSeq] : uint8_t{0},
                  .action = 0,
                  .why = RefusalOf(fault)},
                 has_seq);
}

// Writes one of the reader's own blocks, if it is not there.
void WriteOwn(const tags::Store& store, uint16_t number, uint8_t slot, const Statement& statement,
              int32_t author, NetsPart::Instance* it, const Output& out) {
  const tags::Slot& present = store.Find(number)->tag.slots()[slot];
  if (Has(present, author, statement)) {
    return;
  }
  const bool is_foreign = !present.block.is_empty() && present.block.author != author;
  if (!out.tags->Write(number, slot, BlockOf(author, statement))) {
    it->net.CountBlocked();
  } else if (is_foreign) {
    it->net.CountRestored();
  }
}

}  // namespace

void NetsPart::Act(const Context& context, Instance* it, const Output& out) {
  const std::string& name = it->net.rules().settings.name;
  const tags::Store& store = context.tags;
  Resolve(store, it);
  it->due_ms = std::nullopt;
  const std::optional<int32_t> author = DefineAuthor(context, name, out);
  if (!author) {
    it->net.CountBlocked();
    return;
  }
  std::vector<petri::Firing> fired;
  for (size_t i = 0; i < it->numbers.size(); ++i) {
    ReadOne(store, context, i, *author, it, out, &fired);
  }
  it->net.Settle(context.now_ms, &fired);
  it->change_ms = it->net.NextChange(context.now_ms);
  for (size_t i = 0; i < it->numbers.size(); ++i) {
    const uint16_t number = it->numbers[i];
    WriteOwn(store, number, protocol::kTriggerSlot, TriggerOf(it->net.rules(), i), *author, it,
             out);
    WriteOwn(store, number, protocol::kEnvironmentSlot, SignsOf(it->net, i), *author, it, out);
  }
  for (const petri::Firing& it_fired : fired) {
    fired_.push_back({name, it_fired.transition, it_fired.robot});
  }
}

// --- State

uint64_t NetsPart::Hash() const {
  uint64_t hash = 0;
  for (const auto& [name, it] : nets_) {
    hash +=
        Hash64({'R', it.net.Hash(), WordOf(it.due_ms), WordOf(it.change_ms), HashFields(it.seen)});
  }
  return hash;
}

void NetsPart::Save(ByteWriter* writer) const {
  writer->Count(nets_.size());
  for (const auto& [name, it] : nets_) {
    writer->Text(name);
    writer->U64(WordOf(it.due_ms));
    writer->U64(WordOf(it.change_ms));
    EncodeFields(it.seen, writer);
    it.net.Save(writer);
  }
}

void NetsPart::Restore(const Context& context, ByteReader* reader) {
  const Result<RulesByName> rules = RulesIn(*context.config);
  reader->Check(rules.ok() ? Ok() : Status(Error{rules.error()}));
  if (!reader->ok()) {
    return;
  }
  const auto time = [&]() -> std::optional<uint64_t> {
    const uint64_t word = reader->U64();
    return word != 0 ? std::optional(word - 1) : std::nullopt;
  };
  if (reader->Count() != rules.value().size()) {
    reader->Fail("another number of nets than in the configuration");
  }
  for (const auto& [name, its] : rules.value()) {
    if (reader->ok() && reader->Text() != name) {
      reader->Fail("net \"" + name + "\" is missing in the state");
    }
    if (!reader->ok()) {
      return;
    }
    Instance it{.net = LiveNet(its)};
    it.due_ms = time();
    it.change_ms = time();
    DecodeFields(reader, &it.seen);
    if (reader->ok() && it.seen.size() != its->tags.size()) {
      reader->Fail("net \"" + name + "\": not a state of this net");
    }
    it.net.Restore(reader);
    nets_.emplace(name, std::move(it));
  }
}

}  // namespace pheromone::engine
