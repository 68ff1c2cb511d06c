// The Pioneers that can be simulated: the factors that turn what ARCOS reports into millimetres,
// the limits of their motion, their bodies and their sonars.
//
//   const PioneerModel* model = FindPioneerModel("P3DX-SH");   // nullptr if there is none
//   double turn_rad_s = (right_mm_s - left_mm_s) / 2 * model->diff_conv_per_mm;
//
// Factors, bodies and sonars: the parameter files of ARIA, with which the tables of P2OS drivers
// agree; other firmware of the same robots has others (a PeopleBot "perfpb": 0.485 mm), hence plain
// members to change. Headings are reported in 4096 a turn by all of them.
//
// The settings at power-up are in a robot's flash and differ from robot to robot; here they are
// those of MobileSim. Assumptions are the accelerations of rotation, the ceilings of SETA and
// SETRA, the wheel limits of a P3-AT, an AmigoBot and a PeopleBot, and the encoders: a P3-DX counts
// about 76 600 ticks a turn of its wheels of 195 mm, the others are given the same. Constants; any
// thread.
#pragma once

#include <span>
#include <string_view>

namespace pheromone::sim {

/// Where a sonar is on the robot, and where it looks: x forward, y left, counter-clockwise.
struct SonarMount {
  int x_mm = 0;
  int y_mm = 0;
  int heading_deg = 0;
};

struct PioneerModel {
  std::string_view subclass;     ///< as reported in the answer to SYNC2; a literal
  double distance_mm = 1;        ///< DistConvFactor: of one unit of X and Y
  double speed_mm_s = 1;         ///< VelConvFactor: of one unit of wheel speed
  double range_mm = 1;           ///< RangeConvFactor: of one unit of a sonar's range
  double diff_conv_per_mm = 0;   ///< DiffConvFactor: radians a millimetre of (right - left) / 2
  int vel2_unit_mm_s = 20;       ///< Vel2Divisor: of one unit of VEL2
  int max_speed_mm_s = 1000;     ///< when switched on, see SETV
  int max_turn_deg_s = 100;      ///< SETRV
  int acceleration_mm_s2 = 300;  ///< SETA, and the deceleration
  int turn_acceleration_deg_s2 = 100;  ///< SETRA, and the deceleration
  int top_speed_mm_s = 2200;           ///< ceilings of those four settings
  int top_turn_deg_s = 500;
  int top_acceleration_mm_s2 = 2000;
  int top_turn_acceleration_deg_s2 = 600;
  int wheel_limit_mm_s = 1200;  ///< what the motors can do; published for the P3-DX
  int width_mm = 0;             ///< of the body, not between the wheels
  int length_mm = 0;
  int radius_mm = 0;                   ///< RobotRadius: of the disc that obstacles stop
  int encoder_ticks_per_mm = 125;      ///< of a wheel's way
  std::span<const SonarMount> sonars;  ///< number 0, 1, 2 ...

  /// Between the wheels, as the firmware's DiffConvFactor implies; the real wheels of a P3-DX
  /// stand 320 to 330 mm apart.
  double odometry_wheelbase_mm() const { return 2 / diff_conv_per_mm; }
};

/// p3dx, p3dx-sh, peoplebot-sh, p3at, p3at-sh, amigo, amigo-sh.
std::span<const PioneerModel> PioneerModels();

/// Finds a model by subclass, ignoring case; nullptr if there is none.
const PioneerModel* FindPioneerModel(std::string_view subclass);

}  // namespace pheromone::sim
