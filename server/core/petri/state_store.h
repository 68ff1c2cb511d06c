// Packed states, each once, numbered from 0 in the order in which they were added: for searches
// through as many as fit into memory.
//
//   StateStore<1> states(layout.key_bytes());
//   const auto [number, is_new] = states.Insert({key});
//   states.Get(number);
//
// Memory is key_bytes for each state and 6 to 12 bytes of a hash table. Not thread-safe.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

namespace pheromone::petri {

template <size_t kWords>
class StateStore {
 public:
  using Key = std::array<uint64_t, kWords>;
  static constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

  /// Of a key only the first bytes are stored; the others are 0.
  explicit StateStore(size_t key_bytes)
      : key_bytes_(key_bytes), places_(size_t{1} << kFirstBits, kNone) {
    assert(key_bytes <= sizeof(Key));
    std::memset(mask_.data(), 0xFF, key_bytes);
  }

  size_t size() const { return size_; }
  size_t bytes() const {
    return chunks_.size() * ChunkBytes() + places_.size() * sizeof(places_[0]);
  }
  /// What it may need as soon as another state is added.
  size_t next_bytes() const {
    return bytes() + ChunkBytes() + (IsFull() ? places_.size() * sizeof(places_[0]) : 0);
  }

  Key Get(size_t number) const {
    Key key;
    std::memcpy(key.data(), At(number), sizeof(key));
    for (size_t word = 0; word < kWords; ++word) {
      key[word] &= mask_[word];
    }
    return key;
  }

  /// Before Find or Insert, some time ahead: lets the memory come meanwhile.
  uint64_t Prefetch(const Key& key) const {
    const uint64_t hash = Hash(key);
    __builtin_prefetch(&places_[hash >> shift_]);
    return hash;
  }
  void PrefetchKey(uint64_t hash) const {
    const uint32_t number = places_[hash >> shift_];
    if (number != kNone) {
      __builtin_prefetch(At(number));
    }
  }

  uint32_t Find(const Key& key) const { return places_[PlaceOf(key, Hash(key))]; }

  /// The state's number, and whether it was not known.
  std::pair<uint32_t, bool> Insert(const Key& key) {
    if (IsFull()) {
      Grow();
    }
    uint32_t& place = places_[PlaceOf(key, Hash(key))];
    if (place != kNone) {
      return {place, false};
    }
    assert(size_ < kNone);
    if (size_ % kChunk == 0) {
      chunks_.push_back(std::make_unique_for_overwrite<uint8_t[]>(ChunkBytes()));
    }
    place = static_cast<uint32_t>(size_);
    // Goes by whole words into what the next state overwrites.
    std::memcpy(chunks_.back().get() + size_ % kChunk * key_bytes_, key.data(), sizeof(key));
    ++size_;
    return {place, true};
  }

 private:
  static constexpr size_t kChunk = size_t{1} << 16;
  static constexpr unsigned kFirstBits = 12;

  size_t ChunkBytes() const { return kChunk * key_bytes_ + sizeof(Key); }
  const uint8_t* At(size_t number) const {
    return chunks_[number / kChunk].get() + number % kChunk * key_bytes_;
  }
  bool IsFull() const { return size_ * 3 >= places_.size() * 2; }

  static uint64_t Hash(const Key& key) {
    uint64_t hash = 0;
    for (const uint64_t word : key) {
      hash = (hash ^ word) * 0x9E3779B97F4A7C15;
      hash ^= hash >> 32;
    }
    return hash * 0xD6E8FEB86659FD93;
  }

  size_t PlaceOf(const Key& key, uint64_t hash) const {
    const size_t mask = places_.size() - 1;
    size_t place = hash >> shift_;
    while (places_[place] != kNone && Get(places_[place]) != key) {
      place = (place + 1) & mask;
    }
    return place;
  }

  void Grow() {
    const size_t size = places_.size() * 2;
    places_ = {};
    places_.assign(size, kNone);
    --shift_;
    const size_t mask = size - 1;
    for (size_t number = 0; number < size_; ++number) {
      size_t place = Hash(Get(number)) >> shift_;
      while (places_[place] != kNone) {
        place = (place + 1) & mask;
      }
      places_[place] = static_cast<uint32_t>(number);
    }
  }

  size_t key_bytes_;
  Key mask_ = {};
  size_t size_ = 0;
  std::vector<std::unique_ptr<uint8_t[]>> chunks_;
  unsigned shift_ = 64 - kFirstBits;
  std::vector<uint32_t> places_;  // a power of two of them
};

}  // namespace pheromone::petri
