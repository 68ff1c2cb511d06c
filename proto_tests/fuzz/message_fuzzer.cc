// Any ID, opcode and data as a message: it is what the specification's table says, decoding and
// encoding it again gives the same bytes, and so does a frame around it.

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "proto_tests/fuzz/require.h"
#include "protocol/fields.h"
#include "protocol/net_record.h"
#include "protocol/testing/listen.h"
#include "protocol/testing/message_table.h"

namespace {

using pheromone::fuzz::Require;
using pheromone::protocol::Message;

struct RoundTrip {
  template <typename Kind>
  void Visit(Kind decoded) const {
    if (Decode(message, &decoded)) {
      Message again;
      Require(Encode(decoded, &again));
      again.id = message.id;  // a COMMAND's is set by the one who sends it
      Require(pheromone::testing::ToBody(again) == pheromone::testing::ToBody(message));
    }
  }

  const Message& message;
};

// A pose goes into two bytes a coordinate, or it is not sent that way at all.
template <typename Request>
void RequireNarrowOnlyIfItFits(const Message& message) {
  Request request;
  if (Decode(message, &request)) {
    request.wide = false;
    const auto fits = [](int32_t at) { return at >= INT16_MIN && at <= INT16_MAX; };
    Message narrow;
    Require(Encode(request, &narrow) == (fits(request.pose.x) && fits(request.pose.y)));
  }
}

// A record of a net in a block is of one kind at most, and encoding it again does not change what
// it says.
template <typename Record>
int RequireSameRecord(const uint8_t* statement) {
  namespace protocol = pheromone::protocol;
  const uint32_t hash = protocol::NetHashOf(statement);
  Record record = {};
  if (Decode(statement, hash, &record) != protocol::NetRecordFault::kNone) {
    return 0;
  }
  uint8_t again[protocol::kNetStatementSize];
  uint8_t once_more[protocol::kNetStatementSize];
  Encode(record, again);
  Require(Decode(again, hash, &record) == protocol::NetRecordFault::kNone);
  Encode(record, once_more);
  Require(std::equal(again, again + sizeof again, once_more));
  Require(std::equal(again, again + protocol::kNetStatementSize - 14, statement));
  Require(Decode(again, hash ^ 1, &record) == protocol::NetRecordFault::kHash);
  return 1;
}

void CheckNetRecord(const Message& message) {
  namespace protocol = pheromone::protocol;
  const int at = message.opcode == protocol::kTagWrite                            ? 21
                 : message.opcode == (protocol::kTagRead | protocol::kFromServer) ? 20
                                                                                  : -1;
  if (at < 0 || message.length != at + protocol::kNetStatementSize) {
    return;
  }
  const uint8_t* const statement = message.data + at;
  const int kinds = RequireSameRecord<protocol::TriggerRecord>(statement) +
                    RequireSameRecord<protocol::EnvironmentRecord>(statement) +
                    RequireSameRecord<protocol::RobotRecord>(statement);
  Require(kinds <= 1);
  Require(kinds == 0 || protocol::IsNetRecord(statement));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 2) {
    return 0;
  }
  Message message;
  message.id = data[0];
  message.opcode = data[1];
  uint8_t wire[pheromone::protocol::kMaxFrame];
  message.length = static_cast<uint8_t>(std::min<size_t>(size - 2, 255));
  if (message.length > pheromone::protocol::kMaxData) {
    Require(pheromone::protocol::EncodeFrame(message, wire, sizeof wire) == 0);
    message.length = pheromone::protocol::kMaxData;
  }
  std::copy_n(data + 2, message.length, message.data);
  Require(pheromone::testing::AcceptedAs(message) == pheromone::testing::ExpectedNames(message));
  RoundTrip round_trip{message};
  pheromone::protocol::ForEachMessage(&round_trip);

  CheckNetRecord(message);
  RequireNarrowOnlyIfItFits<pheromone::protocol::SenseRequest>(message);
  RequireNarrowOnlyIfItFits<pheromone::protocol::TraceRequest>(message);

  const size_t sent = pheromone::protocol::EncodeFrame(message, wire, sizeof wire);
  uint8_t just_enough[pheromone::protocol::kMaxFrame];
  Require(pheromone::protocol::EncodeFrame(message, just_enough, sent) == sent);
  Require(std::equal(wire, wire + sent, just_enough));
  Require(pheromone::protocol::EncodeFrame(message, just_enough, sent - 1) == 0);
  std::vector<pheromone::testing::TimedByte> stream;
  pheromone::testing::Append({wire, wire + sent}, 0, &stream);
  const auto heard = pheromone::testing::NaiveDecoder(stream, 0).Run();
  const bool refused = message.id == 0 || message.opcode == 0;
  Require(heard.bodies.size() == (refused ? 0 : 1));
  Require(refused || heard.bodies[0] == pheromone::testing::ToBody(message));
  return 0;
}
