// The net "robot", made by pheromonectl net tables robot.toml; see net_tables.h.
#pragma once

#include "client_fw/core/tasks/net_tables.h"

// clang-format off
namespace pheromone {
namespace client {

constexpr NetPlaceRow kRobotPlaces[] = {
    {protocol::PlaceDoes::kFollow, 1},  // p1
    {protocol::PlaceDoes::kWait, 1},  // p2
    {protocol::PlaceDoes::kChoose, 0},  // p3
    {protocol::PlaceDoes::kFollow, 2},  // p4
    {protocol::PlaceDoes::kWait, 2},  // p5
    {protocol::PlaceDoes::kFollow, 3},  // p6
    {protocol::PlaceDoes::kFollow, 3},  // p7
    {protocol::PlaceDoes::kWait, 3},  // p8
    {protocol::PlaceDoes::kFollow, 6},  // p9
    {protocol::PlaceDoes::kFollow, 4},  // p10
    {protocol::PlaceDoes::kWait, 4},  // p11
    {protocol::PlaceDoes::kFollow, 5},  // p12
    {protocol::PlaceDoes::kFollow, 5},  // p13
    {protocol::PlaceDoes::kWait, 5},  // p14
};

constexpr NetTransitionRow kRobotTransitions[] = {
    {{0x00000001, 0x00000002, 0x00000000}, protocol::TransitionDoes::kPresent},  // t1 at N1
    {{0x00000002, 0x00000004, 0x00000000}, protocol::TransitionDoes::kNothing},  // t2 at P
    {{0x00000004, 0x00000008, 0x00000000}, protocol::TransitionDoes::kLeaveA},  // t3 at N5
    {{0x00000008, 0x00000010, 0x00000000}, protocol::TransitionDoes::kPresent},  // t4 at S1
    {{0x00000010, 0x00000020, 0x00000000}, protocol::TransitionDoes::kTake},  // t5 at Src
    {{0x00000020, 0x00000040, 0x00000000}, protocol::TransitionDoes::kLeave},  // t6 at S3
    {{0x00000040, 0x00000080, 0x00000000}, protocol::TransitionDoes::kPresent},  // t7 at N2
    {{0x00000080, 0x00000100, 0x00000000}, protocol::TransitionDoes::kStoreA},  // t8 at P
    {{0x00000100, 0x00000001, 0x00000000}, protocol::TransitionDoes::kLeave},  // t9 at N4
    {{0x00000004, 0x00000200, 0x00000000}, protocol::TransitionDoes::kLeaveB},  // t10 at N6
    {{0x00000200, 0x00000400, 0x00000000}, protocol::TransitionDoes::kPresent},  // t11 at S2
    {{0x00000400, 0x00000800, 0x00000000}, protocol::TransitionDoes::kTake},  // t12 at Src
    {{0x00000800, 0x00001000, 0x00000000}, protocol::TransitionDoes::kLeave},  // t13 at S4
    {{0x00001000, 0x00002000, 0x00000000}, protocol::TransitionDoes::kPresent},  // t14 at N3
    {{0x00002000, 0x00000100, 0x00000000}, protocol::TransitionDoes::kStoreB},  // t15 at P
};

constexpr NetTables kRobotNet = {0x36af2be0, 0x00000001, kRobotPlaces, kRobotTransitions, 14, 15};

}  // namespace client
}  // namespace pheromone
// clang-format on
