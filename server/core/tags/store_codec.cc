// Encodes and decodes a store, at once or in portions: the tags by number, the rows of the tables,
// and which author each robot is.

#include <cassert>

#include "server/base/hash.h"
#include "server/core/tags/store.h"

namespace pheromone::tags {
namespace {

constexpr size_t kSlotBytes = 2 + 8 + 4 * kBlockWords;

size_t BytesOf(const NamedTag& it) {
  return 2 + 4 + it.name.size() + 1 + 2 + it.tag.slots().size() * kSlotBytes;
}

void Encode(const NamedTag& it, ByteWriter* writer) {
  writer->U16(it.number);
  writer->Text(it.name);
  writer->U8(static_cast<uint8_t>(it.tag.slots().size()));
  writer->U16(it.tag.generation());
  for (const Slot& slot : it.tag.slots()) {
    writer->U16(slot.generation);
    writer->U64(slot.lease_end_ms);
    for (const int32_t word : ToWords(slot.block)) {
      writer->I32(word);
    }
  }
}

NamedTag DecodeTag(ByteReader* reader) {
  NamedTag it;
  it.number = reader->U16();
  it.name = reader->Text();
  const uint8_t slots = reader->U8();
  if (it.number == 0 || slots == 0 || slots > kMaxSlots) {
    reader->Fail("tag " + std::to_string(it.number) + " has " + std::to_string(slots) +
                 " slots, expected 1 to " + std::to_string(kMaxSlots));
    return it;
  }
  it.tag = Tag(slots);
  it.tag.RestoreGeneration(reader->U16());
  for (size_t i = 0; i < slots; ++i) {
    Slot slot;
    slot.generation = reader->U16();
    slot.lease_end_ms = reader->U64();
    Words words{};
    for (int32_t& word : words) {
      word = reader->I32();
    }
    slot.block = BlockFromWords(words);
    const bool is_good = slot.block.is_empty() ? slot.block == Block{} && !slot.is_leased() : true;
    if (!is_good) {
      reader->Fail("an empty slot of tag " + std::to_string(it.number) + " has contents");
    } else if (!slot.block.is_empty()) {
      reader->Check(CheckBlock(slot.block));
    }
    it.tag.Restore(i, slot);
  }
  return it;
}

}  // namespace

FrozenStore::FrozenStore(const Store& store)
    : store_(&store),
      symbols_(std::make_shared<std::optional<SymbolTables>>()),
      tags_(store.tags_.begin(), store.tags_.end()),
      authors_(store.authors_),
      rows_(store.symbols_.rows().size()) {
  std::erase(tags_, nullptr);
  bytes_ = 4 + 4 + 4 + store.symbols_.encoded_bytes();
  for (const std::shared_ptr<const NamedTag>& it : tags_) {
    bytes_ += BytesOf(*it);
  }
  for (const auto& [robot, author] : authors_) {
    bytes_ += 4 + robot.first.size() + 1 + 4;
  }
}

bool FrozenStore::CopySome(std::string* to, size_t most) {
  if (store_ == nullptr || is_done_) {
    return false;
  }
  ByteWriter writer;
  if (!has_begun_) {
    has_begun_ = true;
    writer.Count(tags_.size());
  }
  for (; most > 0 && next_tag_ < tags_.size(); --most) {
    Encode(*tags_[next_tag_], &writer);
    tags_[next_tag_++] = nullptr;  // changes of this one need no copy any more
  }
  if (most > 0 && next_row_ == 0) {
    writer.Count(rows_);
  }
  for (; most > 0 && next_row_ < rows_; --most) {
    EncodeFields(symbols().rows()[next_row_], &writer);
    EncodeFields(symbols().makers()[next_row_++], &writer);
  }
  if (most > 0) {
    writer.Count(authors_.size());
    for (const auto& [robot, author] : authors_) {
      writer.Text(robot.first);
      writer.U8(robot.second);
      writer.I32(author);
    }
    is_done_ = true;
  }
  *to += writer.bytes();
  return true;
}

std::unique_ptr<FrozenStore> Store::Freeze() const {
  std::unique_ptr<FrozenStore> frozen(new FrozenStore(*this));
  frozen_symbols_ = frozen->symbols_;
  return frozen;
}

void Store::Save(ByteWriter* writer) const {
  FrozenStore frozen(*this);
  std::string portion;
  while (frozen.CopySome(&portion, 1024)) {
    writer->Raw(portion);
    portion.clear();
  }
}

void Store::Restore(const Settings& settings, ByteReader* reader) {
  auto directory = std::make_shared<Directory>();
  for (uint32_t left = reader->Count(); left > 0 && reader->ok(); --left) {
    NamedTag it = DecodeTag(reader);
    if (reader->ok() && (it.number <= tags_.size() || it.number > kMaxTags ||
                         !directory->numbers.emplace(it.name, it.number).second)) {
      reader->Fail("tag " + std::to_string(it.number) + " is out of order");
    }
    if (reader->ok()) {
      tags_.resize(it.number);
      used_.resize(it.number);
      directory->slots.resize(it.number);
      directory->slots.back() = static_cast<uint8_t>(it.tag.slots().size());
      tags_.back() = std::make_shared<NamedTag>(std::move(it));
      Settle(*tags_.back());
    }
  }
  for (const TagSettings& it : settings.tags) {
    const std::optional<uint16_t> number = directory->NumberOf(it.name);
    if (!number || Find(*number)->tag.slots().size() != it.slots) {
      reader->Fail("tag \"" + it.name + "\" is configured, but not in the state with " +
                   std::to_string(it.slots) + " slots");
      return;
    }
  }
  for (uint32_t left = reader->Count(); left > 0 && reader->ok(); --left) {
    Row row;
    Maker maker;
    DecodeFields(reader, &row);
    DecodeFields(reader, &maker);
    if (reader->ok() && !maker.is_robot() && maker.id != 0) {
      reader->Fail("a row of the symbol tables was made by a robot without a link");
    }
    if (reader->ok() && !symbols_.Restore(row, maker)) {
      reader->Fail("a row of the symbol tables contradicts one before it");
    }
  }
  std::optional<Author> last;
  for (uint32_t left = reader->Count(); left > 0 && reader->ok(); --left) {
    Author robot;
    robot.first = reader->Text();
    robot.second = reader->U8();
    const int32_t author = reader->I32();
    if (reader->ok() && ((last && robot <= *last) || !symbols_.HasRobot(author))) {
      reader->Fail("the author of robot " + std::to_string(robot.second) + " on link \"" +
                   robot.first + "\" is out of order or unknown");
    }
    if (reader->ok()) {
      SetAuthorOn(robot.first, robot.second, author);
      last = robot;
    }
  }
  directory->TakePlaces(settings);
  directory_ = std::move(directory);
  FindPrivileged();
}

}  // namespace pheromone::tags
