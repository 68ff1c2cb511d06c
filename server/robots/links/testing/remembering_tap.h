// A tap that remembers what it was shown. Thread-safe.
#pragma once

#include <mutex>
#include <span>
#include <vector>

#include "server/robots/links/tap.h"

namespace pheromone::links::testing {

class RememberingTap : public Tap {
 public:
  using Bytes = std::vector<uint8_t>;

  struct Block {
    uint32_t connection;
    Bytes bytes;
  };
  struct Refusal {
    protocol::Message message;
    protocol::Reason answer;
  };

  void BeginRead() override {
    const std::lock_guard lock(mutex_);
    ++reading_;
  }
  void EndRead() override {
    const std::lock_guard lock(mutex_);
    --reading_;
  }
  void Read(Connection* line, std::span<const uint8_t> bytes, uint32_t /*now_ms*/,
            const protocol::FrameDecoder& /*decoder*/) override {
    const std::lock_guard lock(mutex_);
    outside_ |= reading_ == 0;
    read_.push_back({line->connection, {bytes.begin(), bytes.end()}});
  }
  void Wrote(const Connection& line, std::span<const uint8_t> bytes) override {
    const std::lock_guard lock(mutex_);
    written_.push_back({line.connection, {bytes.begin(), bytes.end()}});
  }
  void Dropped(engine::LinkIndex /*link*/, const protocol::Message& message) override {
    const std::lock_guard lock(mutex_);
    left_out_.push_back(message);
  }
  void Rejected(engine::LinkIndex /*link*/, const protocol::Message& message,
                protocol::Reason answer) override {
    const std::lock_guard lock(mutex_);
    outside_ |= reading_ == 0;
    turned_away_.push_back({message, answer});
  }

  /// Whether what belongs between BeginRead and EndRead was told there, and these come in pairs.
  bool in_order() const {
    const std::lock_guard lock(mutex_);
    return reading_ == 0 && !outside_;
  }
  std::vector<Block> read() const { return Copy(read_); }
  std::vector<Block> written() const { return Copy(written_); }
  std::vector<protocol::Message> dropped() const { return Copy(left_out_); }
  std::vector<Refusal> rejected() const { return Copy(turned_away_); }

  /// All blocks of a connection, one after the other.
  static Bytes Together(const std::vector<Block>& blocks, uint32_t connection) {
    Bytes all;
    for (const Block& block : blocks) {
      if (block.connection == connection) {
        all.insert(all.end(), block.bytes.begin(), block.bytes.end());
      }
    }
    return all;
  }

 private:
  template <typename T>
  std::vector<T> Copy(const std::vector<T>& from) const {
    const std::lock_guard lock(mutex_);
    return from;
  }

  mutable std::mutex mutex_;
  int reading_ = 0;
  bool outside_ = false;
  std::vector<Block> read_;
  std::vector<Block> written_;
  std::vector<protocol::Message> left_out_;
  std::vector<Refusal> turned_away_;
};

}  // namespace pheromone::links::testing
