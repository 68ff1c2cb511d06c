#include "server/formats/ros/names.h"

#include <gtest/gtest.h>

#include <limits>

namespace pheromone::ros {
namespace {

TEST(RosNamesTest, PartsOfTopicsAreThoseThatRosAllows) {
  EXPECT_EQ(TopicPart("radio-a"), "radio_a");
  EXPECT_EQ(TopicPart("no-go area"), "no_go_area");
  EXPECT_EQ(TopicPart("2nd.link"), "n2nd_link");
  EXPECT_EQ(TopicPart("a- _b"), "a_b");
  EXPECT_EQ(TopicPart("\xC3\xA4"), "_");
  EXPECT_EQ(TopicPart(""), "n");
}

TEST(RosNamesTest, EachNameHasAPartOfItsOwn) {
  TopicNames names;
  EXPECT_EQ(names.PartOf("a b"), "a_b");
  EXPECT_EQ(names.PartOf("a-b"), "a_b_2");
  EXPECT_EQ(names.PartOf("a_b"), "a_b_3");
  EXPECT_EQ(names.PartOf("a b 3"), "a_b_3_2");
  EXPECT_EQ(names.PartOf("a_"), "a_");
  EXPECT_EQ(names.PartOf("a-"), "a_2");
  EXPECT_EQ(names.PartOf("a-b"), "a_b_2");
}

TEST(RosNamesTest, APartIsFreeWhenItsNameIsForgotten) {
  TopicNames names({"halt"});
  EXPECT_EQ(names.PartOf("a b"), "a_b");
  EXPECT_EQ(names.PartOf("a-b"), "a_b_2");
  names.Forget("a b");
  EXPECT_EQ(names.PartOf("a-b"), "a_b_2");
  EXPECT_EQ(names.PartOf("a.b"), "a_b");
  EXPECT_EQ(names.PartOf("a b"), "a_b_3");
  names.Forget("halt");  // never had a part
  EXPECT_EQ(names.PartOf("halt"), "halt_2");
}

TEST(RosNamesTest, NoPheromoneHasTheNameOfAnotherTopic) {
  TopicNames names = PheromoneNames();
  EXPECT_EQ(names.PartOf("obstacles"), "obstacles_2");
  EXPECT_EQ(names.PartOf("path"), "path");
}

TEST(RosNamesTest, LevelsAreZeroToNinetyEightAndSomethingIsMoreThanNothing) {
  EXPECT_EQ(LevelOf(0), 0);
  EXPECT_EQ(LevelOf(1e-9), 1);
  EXPECT_EQ(LevelOf(0.5), 49);
  EXPECT_EQ(LevelOf(1), 98);
  EXPECT_EQ(LevelOf(7), 98);
  EXPECT_EQ(LevelOf(-1), 0);
  EXPECT_EQ(LevelOf(std::numeric_limits<double>::quiet_NaN()), 0);
}

}  // namespace
}  // namespace pheromone::ros
