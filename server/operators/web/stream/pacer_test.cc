#include "server/operators/web/stream/pacer.h"

#include <gtest/gtest.h>

#include <chrono>

namespace pheromone::web {
namespace {

using std::chrono::microseconds;

class PacerTest : public ::testing::Test {
 protected:
  void Work(microseconds time) {
    used_ += time;
    now_ += time;
  }

  Pacer::Nanoseconds used_{0};
  Pacer::Nanoseconds now_{0};
  Pacer::Nanoseconds late_{0};  // that a sleep takes longer than it should
  int sleeps_ = 0;
  Pacer pacer_{Pacer::Parts{.used = [this] { return used_; },
                            .now = [this] { return now_; },
                            .sleep =
                                [this](Pacer::Nanoseconds time) {
                                  ++sleeps_;
                                  now_ += time + late_;
                                }}};
};

TEST_F(PacerTest, PausesAfterEachPieceOfWork) {
  Work(microseconds(199));
  pacer_.MayPause();
  EXPECT_EQ(sleeps_, 0);
  Work(microseconds(1));
  pacer_.MayPause();
  EXPECT_EQ(sleeps_, 1);
  pacer_.MayPause();
  EXPECT_EQ(sleeps_, 1);
  Work(microseconds(5000));
  pacer_.MayPause();
  EXPECT_EQ(sleeps_, 2);
}

TEST_F(PacerTest, DoesNotCountTimeWithoutTheProcessor) {
  now_ += std::chrono::seconds(10);
  pacer_.MayPause();
  EXPECT_EQ(sleeps_, 0);
}

TEST_F(PacerTest, TellsHowLongItPausedInFact) {
  late_ = microseconds(700);
  Work(microseconds(200));
  pacer_.MayPause();
  Work(microseconds(300));
  pacer_.MayPause();
  EXPECT_EQ(pacer_.paused(), microseconds(2 * (300 + 700)));
}

// With the system's clocks: a thread that computes is made to pause.
TEST(Pacer, PausesAThreadThatComputes) {
  Pacer pacer;
  while (pacer.paused() == Pacer::Nanoseconds(0)) {
    pacer.MayPause();
  }
  EXPECT_GE(pacer.paused(), Pacer::kPause);
}

}  // namespace
}  // namespace pheromone::web
