#include "server/robots/links/datagrams.h"

#include <linux/sock_diag.h>

#include <cassert>
#include <cerrno>
#include <cstring>
#include <utility>

namespace pheromone::links {
namespace {

// Sets each header's buffer and address, once.
template <typename Room, typename Addresses>
void Connect(Room* room, Addresses* addresses) {
  for (size_t i = 0; i < kDatagramBatch; ++i) {
    room->parts[i] = {room->bytes[i].data(), room->bytes[i].size()};
    room->headers[i] = {};
    msghdr& header = room->headers[i].msg_hdr;
    header.msg_name = &(*addresses)[i].socket_address;
    header.msg_iov = &room->parts[i];
    header.msg_iovlen = 1;
  }
}

}  // namespace

bool PeerAddress::operator==(const PeerAddress& other) const {
  // The flow label is not part of an IPv6 address: a peer may use several.
  const sockaddr_in6& a = socket_address;
  const sockaddr_in6& b = other.socket_address;
  if (size != other.size || a.sin6_family != b.sin6_family) {
    return false;
  }
  if (a.sin6_family == AF_INET6) {
    return a.sin6_port == b.sin6_port && a.sin6_scope_id == b.sin6_scope_id &&
           std::memcmp(&a.sin6_addr, &b.sin6_addr, sizeof a.sin6_addr) == 0;
  }
  return std::memcmp(&a, &b, size) == 0;
}

DatagramReader::DatagramReader() : room_(std::make_unique<Room>()) {
  Connect(room_.get(), &room_->from);
}

int DatagramReader::Receive(int socket) {
  for (mmsghdr& header : room_->headers) {
    header.msg_hdr.msg_namelen = sizeof(sockaddr_in6);  // overwritten by the last call
  }
  const int count = recvmmsg(socket, room_->headers.data(), kDatagramBatch, MSG_DONTWAIT, nullptr);
  for (int i = 0; i < count; ++i) {
    const auto place = static_cast<size_t>(i);
    room_->from[place].size = room_->headers[place].msg_hdr.msg_namelen;
  }
  return count;
}

Datagram DatagramReader::at(int i) const {
  const auto place = static_cast<size_t>(i);
  const mmsghdr& header = room_->headers[place];
  return {{room_->bytes[place].data(), header.msg_len},
          &room_->from[place],
          (header.msg_hdr.msg_flags & MSG_TRUNC) != 0};
}

uint32_t DroppedBySystem(int socket) {
  std::array<uint32_t, SK_MEMINFO_VARS> figures{};
  socklen_t size = sizeof figures;
  const bool known = getsockopt(socket, SOL_SOCKET, SO_MEMINFO, figures.data(), &size) == 0;
  return known ? figures[SK_MEMINFO_DROPS] : 0;
}

DatagramWriter::DatagramWriter() : room_(std::make_unique<Room>()) {
  Connect(room_.get(), &room_->to);
}

void DatagramWriter::Add(const protocol::Message& message, const PeerAddress& to) {
  assert(!full());
  const auto place = static_cast<size_t>(count_++);
  auto& bytes = room_->bytes[place];
  room_->parts[place].iov_len = protocol::EncodeFrame(message, bytes.data(), bytes.size());
  room_->to[place] = to;
  room_->headers[place].msg_hdr.msg_namelen = to.size;
}

DatagramWriter::Outcome DatagramWriter::Flush(int socket, const OnDone& on_done) {
  const auto tell = [&](size_t place, bool is_sent) {
    if (on_done) {
      on_done({room_->bytes[place].data(), room_->parts[place].iov_len}, is_sent);
    }
  };
  Outcome outcome;
  const auto count = static_cast<size_t>(std::exchange(count_, 0));
  size_t next = 0;
  while (next < count) {
    const int sent = sendmmsg(socket, room_->headers.data() + next,
                              static_cast<unsigned>(count - next), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) {
      continue;
    }
    if (sent <= 0) {  // the error is that of the first one; try the others
      const bool no_room = errno == EAGAIN || errno == EWOULDBLOCK || errno == ENOBUFS;
      outcome.dropped += no_room ? 1u : 0u;
      outcome.undeliverable += no_room ? 0u : 1u;
      tell(next++, false);
      continue;
    }
    const size_t end = next + static_cast<size_t>(sent);
    outcome.frames += end - next;
    for (; next < end; ++next) {
      outcome.bytes += room_->headers[next].msg_len;
      tell(next, true);
    }
  }
  return outcome;
}

}  // namespace pheromone::links
