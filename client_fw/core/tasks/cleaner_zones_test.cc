// Which tags a cleaning robot reads when those in range come and go.

#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "client_fw/core/tasks/cleaner.h"
#include "client_fw/core/testing/conversation_harness.h"
#include "protocol/tag_messages.h"

namespace pheromone {
namespace client {
namespace {

constexpr int32_t kOwnNumber = 15;
constexpr int32_t kForeigner = 77;

// A server with tags, each of which has a leased block of another robot that nobody can resolve:
// all zones are occupied, so that the robot stands and looks again and again.
class TagServer {
 public:
  TagServer() { harness_.GreetAndServe(500); }

  struct Tag {
    uint16_t number;
    int16_t dx_mm;
    uint16_t generation;
  };

  /// The tags that the robot READs until it has looked once more and read what it wanted.
  std::vector<uint16_t> ReadAfterLook(const std::vector<Tag>& tags) {
    tags_ = tags;
    read_.clear();
    looks_ = 0;
    for (int i = 0; i < 20'000 && looks_ < 2; ++i) {
      Step();
    }
    EXPECT_EQ(looks_, 2) << "the next look ends what the first one began";
    return read_;
  }

 private:
  void Step() {
    const int before = harness_.frames_sent;
    cleaner_.Step(static_cast<Moment>(harness_.now_ms), &harness_.pose, &harness_.conversation);
    harness_.Step();
    if (harness_.frames_sent == before) {
      return;
    }
    protocol::SymbolRequest symbol;
    protocol::ResolveRequest resolve;
    protocol::ScanRequest scan;
    protocol::TagReadRequest read;
    if (Decode(harness_.sent, &symbol)) {
      strings_[symbol.number] =
          std::string(reinterpret_cast<const char*>(symbol.text), symbol.length);
      const bool is_robot = symbol.kind == protocol::SymbolKind::kRobot;
      harness_.FeedEncoded(protocol::SymbolAnswer{kTestId, symbol.seq, symbol.kind,
                                                  is_robot ? kOwnNumber : symbol.number});
    } else if (Decode(harness_.sent, &resolve)) {
      Resolve(resolve);
    } else if (Decode(harness_.sent, &scan)) {
      ++looks_;
      if (looks_ < 2) {
        Scan();
      }
    } else if (Decode(harness_.sent, &read)) {
      read_.push_back(read.tag);
      harness_.FeedEncoded(ContentOf(read.tag));
    } else {
      harness_.Answer(0, 0);
    }
  }

  void Resolve(const protocol::ResolveRequest& request) {
    if (request.robot != kOwnNumber) {
      harness_.AnswerError(protocol::Reason::kUnknownSymbol);
      return;
    }
    const std::string& text = strings_[request.number];
    protocol::ResolveAnswer answer;
    answer.id = kTestId;
    answer.kind = protocol::SymbolKind::kString;
    answer.robot = request.robot;
    answer.number = request.number;
    answer.length = static_cast<uint8_t>(text.size());
    answer.count = answer.length;
    std::memcpy(answer.text, text.data(), text.size());
    harness_.FeedEncoded(answer);
  }

  void Scan() {
    protocol::ScanAnswer answer;
    answer.id = kTestId;
    for (const Tag& tag : tags_) {  // a unit of poses is 1 mm
      answer.rows[answer.count++] = {tag.number, tag.dx_mm, 0, tag.generation};
    }
    harness_.FeedEncoded(answer);
  }

  protocol::TagReadAnswer ContentOf(uint16_t number) const {
    protocol::TagReadAnswer answer;
    answer.id = kTestId;
    answer.tag = number;
    answer.next = protocol::kNoSlot;
    answer.slots = 8;
    for (const Tag& tag : tags_) {
      answer.tag_generation = tag.number == number ? tag.generation : answer.tag_generation;
    }
    answer.lease_s = 30;
    const int32_t words[] = {kForeigner, 1,  protocol::kTypeTag,   number,
                             40,         41, protocol::kTypeRobot, kForeigner};
    std::memcpy(answer.words, words, sizeof words);
    return answer;
  }

  Harness harness_;
  Cleaner cleaner_{CleanerParameters(), kTestId, 1};
  std::map<int32_t, std::string> strings_;
  std::vector<Tag> tags_;
  std::vector<uint16_t> read_;
  int looks_ = 0;
};

TEST(CleanerZones, ReadsATagAgainOnlyWhenItHasChanged) {
  TagServer server;
  EXPECT_EQ(server.ReadAfterLook({{1, 0, 5}, {2, 1000, 5}}), (std::vector<uint16_t>{1, 2}));
  EXPECT_EQ(server.ReadAfterLook({{1, 0, 5}, {2, 1000, 6}}), (std::vector<uint16_t>{2}));
  EXPECT_EQ(server.ReadAfterLook({{1, 0, 5}, {2, 1000, 6}}), (std::vector<uint16_t>{}));
}

// What the list of zones had behind its end is not taken for what comes there next.
TEST(CleanerZones, ReadsATagThatComesInPlaceOfOneThatWasRead) {
  TagServer server;
  EXPECT_EQ(server.ReadAfterLook({{1, 0, 5}, {2, 1000, 5}, {3, 2000, 5}}),
            (std::vector<uint16_t>{1, 2, 3}));
  EXPECT_EQ(server.ReadAfterLook({{1, 0, 5}}), (std::vector<uint16_t>{}));
  EXPECT_EQ(server.ReadAfterLook({{1, 0, 5}, {4, 1000, 5}, {5, 2000, 5}}),
            (std::vector<uint16_t>{4, 5}));
  EXPECT_EQ(server.ReadAfterLook({{4, 0, 5}, {5, 1000, 5}, {1, 2000, 5}}),
            (std::vector<uint16_t>{}));
}

}  // namespace
}  // namespace client
}  // namespace pheromone
