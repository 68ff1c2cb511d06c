// How a cleaning robot tells the server its number and strings before it looks at tags.

#include <gtest/gtest.h>

#include "client_fw/core/tasks/cleaner.h"
#include "client_fw/core/testing/conversation_harness.h"
#include "protocol/tag_messages.h"

namespace pheromone {
namespace client {
namespace {

// The cleaner beside the harness's conversation, as Robot has it. Until something of TAG is sent.
bool RunUntilTag(Harness* harness, Cleaner* cleaner) {
  for (int i = 0; i < 3000; ++i) {
    const int before = harness->frames_sent;
    cleaner->Step(harness->now_ms, &harness->pose, &harness->conversation);
    harness->Step();
    if (harness->frames_sent != before) {
      if (protocol::ServiceOf(harness->sent.opcode) == protocol::ServiceOf(protocol::kSymbol)) {
        return true;
      }
      harness->Answer(0, 0);
    }
  }
  return false;
}

// Otherwise it would write blocks that nobody understands.
TEST(CleanerNaming, ADefinitionWhoseOutcomeIsUnknownIsMadeAgain) {
  Harness harness;
  Cleaner cleaner(CleanerParameters(), kTestId, 1);
  harness.GreetAndServe(500);
  ASSERT_TRUE(RunUntilTag(&harness, &cleaner));
  protocol::SymbolRequest symbol;
  ASSERT_TRUE(Decode(harness.sent, &symbol));
  ASSERT_EQ(protocol::SymbolKind::kRobot, symbol.kind);
  harness.FeedEncoded(
      protocol::SymbolAnswer{kTestId, symbol.seq, protocol::SymbolKind::kRobot, 15});

  ASSERT_TRUE(RunUntilTag(&harness, &cleaner));
  ASSERT_TRUE(Decode(harness.sent, &symbol));
  ASSERT_EQ(protocol::SymbolKind::kString, symbol.kind);
  harness.AnswerError(protocol::Reason::kSequenceReused, symbol.seq);

  ASSERT_TRUE(RunUntilTag(&harness, &cleaner));
  ASSERT_TRUE(Decode(harness.sent, &symbol)) << "opcode " << int{harness.sent.opcode};
  EXPECT_EQ(protocol::SymbolKind::kRobot, symbol.kind);
}

}  // namespace
}  // namespace client
}  // namespace pheromone
