// States in the order in which they were found, each of some 64-bit words, and which of them are
// known: for searches through millions of states.
//
//   StateSet<2> states;
//   const auto [number, is_new] = states.Insert({low, high});
//   const StateSet<2>::Key& key = states[number];
//
// Memory is that of the keys and from 6 to 12 bytes for each. Not thread-safe.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

namespace pheromone::verify {

/// A vector that grows without being copied.
template <typename T>
class Chunked {
 public:
  size_t size() const { return size_; }
  const T& operator[](size_t i) const { return chunks_[i / kChunk][i % kChunk]; }
  void push_back(const T& value) {
    if (size_ % kChunk == 0) {
      chunks_.push_back(std::make_unique_for_overwrite<T[]>(kChunk));
    }
    chunks_.back()[size_++ % kChunk] = value;
  }

 private:
  static constexpr size_t kChunk = size_t{1} << 16;

  std::vector<std::unique_ptr<T[]>> chunks_;
  size_t size_ = 0;
};

template <size_t kWords>
class StateSet {
 public:
  using Key = std::array<uint64_t, kWords>;

  StateSet() : places_(1024, kNone) {}

  size_t size() const { return keys_.size(); }
  const Key& operator[](size_t number) const { return keys_[number]; }

  /// The state's number, from 0, and whether it was not known.
  std::pair<uint32_t, bool> Insert(const Key& key) {
    if (keys_.size() * 3 >= places_.size() * 2) {
      Grow();
    }
    uint32_t& place = places_[Find(key)];
    if (place != kNone) {
      return {place, false};
    }
    assert(keys_.size() < kNone);
    place = static_cast<uint32_t>(keys_.size());
    keys_.push_back(key);
    return {place, true};
  }

 private:
  static constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

  static uint64_t Hash(const Key& key) {
    uint64_t hash = 0;
    for (const uint64_t word : key) {
      hash = (hash ^ word) * 0x9E3779B97F4A7C15;
      hash ^= hash >> 32;
    }
    return hash * 0xD6E8FEB86659FD93 >> 20;
  }

  size_t Find(const Key& key) const {
    const size_t mask = places_.size() - 1;
    size_t place = Hash(key) & mask;
    while (places_[place] != kNone && keys_[places_[place]] != key) {
      place = (place + 1) & mask;
    }
    return place;
  }

  void Grow() {
    const size_t size = places_.size() * 2;
    places_ = {};
    places_.assign(size, kNone);
    for (size_t number = 0; number < keys_.size(); ++number) {
      places_[Find(keys_[number])] = static_cast<uint32_t>(number);
    }
  }

  Chunked<Key> keys_;
  std::vector<uint32_t> places_;  // a power of two of them
};

}  // namespace pheromone::verify
