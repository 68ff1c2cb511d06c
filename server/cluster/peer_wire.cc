#include "server/cluster/peer_wire.h"

#include <type_traits>
#include <utility>

#include "server/base/bytes.h"

namespace pheromone::cluster {
namespace {

constexpr size_t kLengthBytes = 4;
constexpr uint8_t kGreetingType = 0;
static_assert(std::is_same_v<std::variant_alternative_t<kGreetingType, PeerMessage>, Greeting>);

// "node b has pheromoned 0.2.0 with peer version 2, this node a 0.1.0 with 1": the one with the
// lower number is to be upgraded.
Error OtherVersion(const char* what, const Greeting& own, const Greeting& theirs, uint8_t ours,
                   uint8_t its) {
  const std::string who = theirs.node.empty() ? "the other node" : "node " + theirs.node;
  return Error{who + " runs pheromoned " + theirs.versions.program + " with " + what + " version " +
               std::to_string(its) + ", this node " + own.node + " pheromoned " +
               own.versions.program + " with " + what + " version " + std::to_string(ours) +
               ", expected the same; upgrade " + (its < ours ? who : "this node") +
               ": followers first, the leader last"};
}

Error Other(const char* what, const Greeting& theirs, const std::string& its,
            const std::string& ours) {
  return Error{"node " + theirs.node + " has " + what + " " + its + ", expected " + ours};
}

// Of another version, as far as all versions have it in common.
std::optional<Greeting> ReadOtherGreeting(std::string_view frame) {
  ByteReader reader(frame);
  Greeting greeting;
  const bool is_greeting = reader.U8() == kGreetingType;
  DecodeFields(&reader, &greeting.versions);
  return is_greeting && reader.ok() && greeting.versions.peers != kPeerVersion
             ? std::optional(greeting)
             : std::nullopt;
}

}  // namespace

Result<std::string> EncodePeerMessage(const PeerMessage& message) {
  ByteWriter body;
  EncodeFields(message, &body);
  if (body.bytes().size() > kMaxPeerBytes) {
    return Error{"a message of type " + std::to_string(message.index()) + " has " +
                 std::to_string(body.bytes().size()) + " bytes, expected at most " +
                 std::to_string(kMaxPeerBytes)};
  }
  ByteWriter frame;
  frame.Text(body.bytes());
  return frame.Take();
}

Result<PeerMessage> DecodePeerMessage(std::string_view frame) {
  if (auto greeting = ReadOtherGreeting(frame)) {
    return PeerMessage(*std::move(greeting));
  }
  constexpr size_t kTypes = std::variant_size_v<PeerMessage>;
  if (frame.empty() || static_cast<uint8_t>(frame.front()) >= kTypes) {
    return Error{frame.empty() ? "found an empty message"
                               : "found a message of type " +
                                     std::to_string(static_cast<uint8_t>(frame.front())) +
                                     ", expected 0 to " + std::to_string(kTypes - 1)};
  }
  ByteReader reader(frame);
  PeerMessage message;
  DecodeFields(&reader, &message);
  reader.ExpectEnd();
  if (reader.ok()) {
    reader.Check(CheckFields(message, ""));
  }
  if (!reader.ok()) {
    return Error{"found a message of type " + std::to_string(static_cast<uint8_t>(frame.front())) +
                 " that is invalid: " + reader.error()};
  }
  return message;
}

void PeerFrames::Add(std::string_view bytes) {
  bytes_.erase(0, begin_);
  begin_ = 0;
  bytes_ += bytes;
}

Result<std::optional<PeerMessage>> PeerFrames::Next() {
  const std::string_view rest = std::string_view(bytes_).substr(begin_);
  if (rest.size() < kLengthBytes) {
    return std::optional<PeerMessage>();
  }
  const size_t length = ByteReader(rest).U32();
  if (length == 0 || length > kMaxPeerBytes) {
    return Error{"found a message of " + std::to_string(length) + " bytes, expected 1 to " +
                 std::to_string(kMaxPeerBytes)};
  }
  if (rest.size() - kLengthBytes < length) {
    return std::optional<PeerMessage>();
  }
  PHEROMONE_TRY(PeerMessage message, DecodePeerMessage(rest.substr(kLengthBytes, length)));
  begin_ += kLengthBytes + length;
  return std::optional(std::move(message));
}

Status CheckGreeting(const Greeting& own, const Greeting& theirs) {
  const PeerVersions& ours = own.versions;
  const PeerVersions& its = theirs.versions;
  if (its.peers != ours.peers) {
    return OtherVersion("peer", own, theirs, ours.peers, its.peers);
  }
  if (its.events != ours.events) {
    return OtherVersion("event", own, theirs, ours.events, its.events);
  }
  if (theirs.cluster != own.cluster) {
    return Other("the cluster", theirs, theirs.cluster, own.cluster);
  }
  if (theirs.node == own.node) {
    return Error{"another machine is node " + own.node + " as well, expected one of each name"};
  }
  if (!theirs.id.empty() && !own.id.empty() && theirs.id != own.id) {
    return Other("the log of cluster ID", theirs, theirs.id, own.id);
  }
  if (theirs.links_hash != own.links_hash) {
    return Error{"node " + theirs.node +
                 " has other links, expected the same [[link]] sections on all machines"};
  }
  return Ok();
}

}  // namespace pheromone::cluster
