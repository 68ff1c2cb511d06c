// States in the order in which they were found, each of some 64-bit words, and which of them are
// known: for searches through millions of states.
//
//   StateSet states(/*words=*/2);
//   const auto [number, is_new] = states.Insert(key);  // of two words
//   const uint64_t* same = states[number];
//   states.Clear();                                    // as long as what was in it
//
// Memory is that of the keys and from 6 to 12 bytes for each. Not thread-safe.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

namespace pheromone::verify {

constexpr size_t kLargeChunk = size_t{1} << 16;

/// A vector that grows by `kChunk` without being copied, of items of `width` values each.
template <typename T, size_t kChunk = kLargeChunk>
class Chunked {
 public:
  explicit Chunked(size_t width = 1) : width_(width) {}

  size_t size() const { return size_; }
  size_t bytes() const { return chunks_.size() * kChunk * width_ * sizeof(T); }
  const T* item(size_t i) const { return &chunks_[i / kChunk][i % kChunk * width_]; }
  const T& operator[](size_t i) const { return *item(i); }
  void Add(const T* values) {
    if (size_ == chunks_.size() * kChunk) {
      chunks_.push_back(std::make_unique_for_overwrite<T[]>(kChunk * width_));
    }
    std::copy_n(values, width_, &chunks_[size_ / kChunk][size_ % kChunk * width_]);
    ++size_;
  }
  void push_back(const T& value) { Add(&value); }
  void pop_back() { --size_; }  ///< its memory is kept

 private:
  size_t width_;
  std::vector<std::unique_ptr<T[]>> chunks_;
  size_t size_ = 0;
};

/// Of up to kMaxStates: beyond, a state has no number. To be seen to before Insert.
template <size_t kChunk>
class BasicStateSet {
 public:
  static constexpr size_t kMaxStates = std::numeric_limits<uint32_t>::max() - 1;

  explicit BasicStateSet(size_t words)
      : words_(words), keys_(words), places_(std::min(kChunk, kFirstPlaces), kNone) {}

  size_t size() const { return keys_.size(); }
  size_t bytes() const { return keys_.bytes() + places_.size() * sizeof(uint32_t); }
  const uint64_t* operator[](size_t number) const { return keys_.item(number); }

  /// The state's number, from 0, and whether it was not known.
  std::pair<uint32_t, bool> Insert(const uint64_t* key) {
    if (keys_.size() * 3 >= places_.size() * 2) {
      Grow();
    }
    uint32_t& place = places_[Find(key)];
    if (place != kNone) {
      return {place, false};
    }
    place = static_cast<uint32_t>(keys_.size());
    keys_.Add(key);
    return {place, true};
  }

  /// Keeps the memory.
  void Clear() {
    // The last one first: so none is on the way to another that is still there.
    for (; size() > 0; keys_.pop_back()) {
      places_[Find(keys_.item(size() - 1))] = kNone;
    }
  }

 private:
  static constexpr size_t kFirstPlaces = 1024;
  static constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

  uint64_t Hash(const uint64_t* key) const {
    uint64_t hash = 0;
    for (size_t word = 0; word < words_; ++word) {
      hash = (hash ^ key[word]) * 0x9E3779B97F4A7C15;
      hash ^= hash >> 32;
    }
    return hash * 0xD6E8FEB86659FD93 >> 20;
  }

  size_t Find(const uint64_t* key) const {
    const size_t mask = places_.size() - 1;
    size_t place = Hash(key) & mask;
    while (places_[place] != kNone && !std::equal(key, key + words_, keys_.item(places_[place]))) {
      place = (place + 1) & mask;
    }
    return place;
  }

  void Grow() {
    const size_t size = places_.size() * 2;
    places_ = {};
    places_.assign(size, kNone);
    for (size_t number = 0; number < keys_.size(); ++number) {
      places_[Find(keys_.item(number))] = static_cast<uint32_t>(number);
    }
  }

  size_t words_;
  Chunked<uint64_t, kChunk> keys_;
  std::vector<uint32_t> places_;  // a power of two of them
};

using StateSet = BasicStateSet<kLargeChunk>;
using SmallStateSet = BasicStateSet<256>;  ///< emptied often, and most of the time small

}  // namespace pheromone::verify
