// Receives and sends batches of datagrams with one system call each: recvmmsg and sendmmsg.
//
//   DatagramReader reader;
//   const int count = reader.Receive(socket);
//   for (int i = 0; i < count; ++i) Use(reader.at(i));
//   DatagramWriter writer;
//   writer.Add(message, peer);
//   const DatagramWriter::Outcome outcome = writer.Flush(socket);
//
// Sockets are non-blocking. All memory is allocated at construction and does not depend on the
// traffic. Not thread-safe.
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "protocol/frame.h"

namespace pheromone::links {

/// The maximum number of datagrams in one call.
constexpr int kDatagramBatch = 64;
/// More than any network carries unfragmented; longer datagrams are truncated and marked so.
constexpr size_t kMaxDatagramBytes = 2048;

/// An address and port, IPv4 or IPv6.
struct PeerAddress {
  sockaddr_in6 socket_address = {};  ///< the larger of the two kinds
  socklen_t size = 0;                ///< of the part used by its family; 0: no address
  bool known() const { return size != 0; }
  bool operator==(const PeerAddress& other) const;
};

struct Datagram {
  std::span<const uint8_t> bytes;
  const PeerAddress* from;
  bool cut;  ///< truncated: it was longer than kMaxDatagramBytes
};

class DatagramReader {
 public:
  DatagramReader();

  /// Returns the number received, 0 to kDatagramBatch; negative: an error in errno (EAGAIN: none
  /// available at present). Empty datagrams count.
  int Receive(int socket);

  /// The i-th datagram; valid until the next Receive.
  Datagram at(int i) const;

 private:
  struct Room {
    std::array<std::array<uint8_t, kMaxDatagramBytes>, kDatagramBatch> bytes{};
    std::array<PeerAddress, kDatagramBatch> from{};
    std::array<iovec, kDatagramBatch> parts{};
    std::array<mmsghdr, kDatagramBatch> headers{};
  };
  std::unique_ptr<Room> room_;
};

/// The number of datagrams dropped by the kernel since the socket was opened, because its receive
/// buffer was full. Wraps around.
uint32_t DroppedBySystem(int socket);

class DatagramWriter {
 public:
  struct Outcome {
    uint64_t frames = 0;
    uint64_t bytes = 0;
    uint64_t dropped = 0;        ///< the send buffer was full
    uint64_t undeliverable = 0;  ///< no route to the peer
  };

  DatagramWriter();

  bool full() const { return count_ == kDatagramBatch; }

  /// Adds a message as a datagram of one frame. Requires !full().
  void Add(const protocol::Message& message, const PeerAddress& to);

  /// Of each datagram, in order.
  using OnDone = std::function<void(std::span<const uint8_t> datagram, bool is_sent)>;

  /// Sends all added datagrams in order and empties the writer; those that cannot be sent are
  /// counted.
  Outcome Flush(int socket, const OnDone& on_done = nullptr);

 private:
  struct Room {
    std::array<std::array<uint8_t, protocol::kMaxFrame>, kDatagramBatch> bytes{};
    std::array<PeerAddress, kDatagramBatch> to{};
    std::array<iovec, kDatagramBatch> parts{};
    std::array<mmsghdr, kDatagramBatch> headers{};
  };
  std::unique_ptr<Room> room_;
  int count_ = 0;
};

}  // namespace pheromone::links
