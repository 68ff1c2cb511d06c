#include "server/robots/links/admission.h"

#include <gtest/gtest.h>

namespace pheromone::links {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Verdict = Admission::Verdict;

const Admission::TimePoint kStart{seconds(1000)};

TEST(AdmissionTest, EveryoneIsWelcomeUnlessToldOtherwise) {
  Admission admission({});
  EXPECT_TRUE(admission.open());
  for (int id = 0; id < 256; ++id) {
    EXPECT_EQ(admission.Judge(static_cast<uint8_t>(id), kStart), Verdict::kWelcome);
  }
}

TEST(AdmissionTest, OnlyListedClientsAreServed) {
  AdmissionOptions options;
  options.clients.reset();
  options.clients.set(7).set(254);
  Admission admission(options);
  EXPECT_FALSE(admission.open());
  for (int id = 0; id < 256; ++id) {
    const bool listed = id == 7 || id == 254;
    EXPECT_EQ(admission.Allows(static_cast<uint8_t>(id)), listed);
    EXPECT_EQ(admission.Judge(static_cast<uint8_t>(id), kStart),
              listed ? Verdict::kWelcome : Verdict::kNotAllowed);
  }
}

TEST(AdmissionTest, ASecondsWorthMayComeAtOnceAndThenTheRateHolds) {
  AdmissionOptions options;
  options.per_client_per_s = 10;
  Admission admission(options);
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(admission.Judge(1, kStart), Verdict::kWelcome) << i;
  }
  EXPECT_EQ(admission.Judge(1, kStart), Verdict::kTooMany);
  EXPECT_EQ(admission.Judge(1, kStart + milliseconds(99)), Verdict::kTooMany);
  EXPECT_EQ(admission.Judge(1, kStart + milliseconds(100)), Verdict::kWelcome);
  EXPECT_EQ(admission.Judge(1, kStart + milliseconds(100)), Verdict::kTooMany);
}

TEST(AdmissionTest, AFloodGetsTheRateAndNoMore) {
  AdmissionOptions options;
  options.per_client_per_s = 50;
  Admission admission(options);
  int welcome = 0;
  for (int i = 0; i < 10'000; ++i) {  // 1000 a second for 10 s
    welcome += admission.Judge(1, kStart + milliseconds(i)) == Verdict::kWelcome ? 1 : 0;
  }
  EXPECT_EQ(welcome, 50 + 50 * 10 - 1);  // the first second's worth, and what 9.999 s earn
}

TEST(AdmissionTest, OneClientsFloodDoesNotCostAnother) {
  AdmissionOptions options;
  options.per_client_per_s = 10;
  options.per_link_per_s = 100;
  Admission admission(options);
  for (int i = 0; i < 1000; ++i) {
    admission.Judge(1, kStart);
  }
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(admission.Judge(2, kStart), Verdict::kWelcome) << i;
  }
}

TEST(AdmissionTest, AllClientsTogetherKeepTheLinksRate) {
  AdmissionOptions options;
  options.per_link_per_s = 20;
  Admission admission(options);
  int welcome = 0;
  for (int id = 1; id < 255; ++id) {
    welcome += admission.Judge(static_cast<uint8_t>(id), kStart) == Verdict::kWelcome ? 1 : 0;
  }
  EXPECT_EQ(welcome, 20);
}

}  // namespace
}  // namespace pheromone::links
