// Datagrams in and out of a socket, many with one system call each way: recvmmsg and sendmmsg.
//
//   DatagramReader reader;
//   const int count = reader.Receive(socket);
//   for (int i = 0; i < count; ++i) Use(reader.at(i));
//   DatagramWriter writer;
//   writer.Add(message, peer);
//   const DatagramWriter::Outcome outcome = writer.Flush(socket);
//
// Sockets are non-blocking. All memory is taken when a reader or writer is made, and does not
// depend on what comes. Not thread-safe.
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "protocol/frame.h"

namespace pheromone::links {

/// How many datagrams one call moves at the most.
constexpr int kDatagramBatch = 64;
/// More than any network carries in one piece; what is longer is cut, and told to be.
constexpr size_t kMostDatagramBytes = 2048;

/// An address and port, IPv4 or IPv6.
struct PeerAddress {
  sockaddr_in6 socket_address = {};  ///< the larger of the two kinds
  socklen_t size = 0;                ///< of what the kind uses; 0: none
  bool known() const { return size != 0; }
  bool operator==(const PeerAddress& other) const;
};

struct Datagram {
  std::span<const uint8_t> bytes;
  const PeerAddress* from;
  bool cut;  ///< it was longer than kMostDatagramBytes
};

class DatagramReader {
 public:
  DatagramReader();

  /// How many came, 0 to kDatagramBatch; below 0: none, for the reason in errno (EAGAIN: no more at
  /// the moment). Empty datagrams count.
  int Receive(int socket);

  /// The i-th of them; good until the next Receive.
  Datagram at(int i) const;

 private:
  struct Room {
    std::array<std::array<uint8_t, kMostDatagramBytes>, kDatagramBatch> bytes{};
    std::array<PeerAddress, kDatagramBatch> from{};
    std::array<iovec, kDatagramBatch> parts{};
    std::array<mmsghdr, kDatagramBatch> headers{};
  };
  std::unique_ptr<Room> room_;
};

/// How many datagrams the system has thrown away since the socket was opened, because nobody read
/// those before them. Wraps.
uint32_t DroppedBySystem(int socket);

class DatagramWriter {
 public:
  struct Outcome {
    uint64_t frames = 0;
    uint64_t bytes = 0;
    uint64_t dropped = 0;        ///< the socket had no room for more
    uint64_t undeliverable = 0;  ///< the system knows no way there
  };

  DatagramWriter();

  bool full() const { return count_ == kDatagramBatch; }

  /// Takes a message as a datagram of one frame. Not when full().
  void Add(const protocol::Message& message, const PeerAddress& to);

  /// Sends what was added, in order. Nothing stays behind: what cannot be sent is counted.
  Outcome Flush(int socket);

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
