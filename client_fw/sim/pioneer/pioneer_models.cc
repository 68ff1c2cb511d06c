#include "client_fw/sim/pioneer/pioneer_models.h"

#include <algorithm>
#include <array>

namespace pheromone::sim {
namespace {

// The front and the rear array of a P3-DX; on a PeopleBot, which has the same two, a second pair
// above them follows.
constexpr std::array<SonarMount, 32> kPeopleBotSonars = {{
    {69, 136, 90},      {114, 119, 50},    {148, 78, 30},     {166, 27, 10},     {166, -27, -10},
    {148, -78, -30},    {114, -119, -50},  {69, -136, -90},   {-157, -136, -90}, {-203, -119, -130},
    {-237, -78, -150},  {-255, -27, -170}, {-255, 27, 170},   {-237, 78, 150},   {-203, 119, 130},
    {-157, 136, 90},    {-20, 136, 90},    {24, 119, 50},     {58, 78, 30},      {77, 27, 10},
    {77, -27, -10},     {58, -78, -30},    {24, -119, -50},   {-20, -136, -90},  {-191, -136, -90},
    {-237, -119, -130}, {-271, -78, -150}, {-290, -27, -170}, {-290, 27, 170},   {-271, 78, 150},
    {-237, 119, 130},   {-191, 136, 90},
}};
constexpr std::span kP3DxSonars = std::span(kPeopleBotSonars).first<16>();

constexpr std::array<SonarMount, 16> kP3AtSonars = {{
    {147, 136, 90},
    {193, 119, 50},
    {227, 79, 30},
    {245, 27, 10},
    {245, -27, -10},
    {227, -79, -30},
    {193, -119, -50},
    {147, -136, -90},
    {-144, -136, -90},
    {-189, -119, -130},
    {-223, -79, -150},
    {-241, -27, -170},
    {-241, 27, 170},
    {-223, 79, 150},
    {-189, 119, 130},
    {-144, 136, 90},
}};

constexpr std::array<SonarMount, 8> kAmigoSonars = {{
    {76, 100, 90},
    {125, 75, 41},
    {150, 30, 15},
    {150, -30, -15},
    {125, -75, -41},
    {76, -100, -90},
    {-140, -58, -145},
    {-140, 58, 145},
}};
constexpr std::array<SonarMount, 8> kAmigoShSonars = {{
    {70, 100, 90},
    {125, 75, 41},
    {144, 30, 15},
    {144, -30, -15},
    {120, -75, -41},
    {70, -100, -90},
    {-146, -58, -145},
    {-146, 58, 145},
}};

constexpr PioneerModel P3Dx(std::string_view subclass, double distance_mm) {
  PioneerModel model;
  model.subclass = subclass;
  model.distance_mm = distance_mm;
  model.diff_conv_per_mm = 0.0056;
  model.width_mm = 425;
  model.length_mm = 511;
  model.radius_mm = 250;
  model.sonars = kP3DxSonars;
  return model;
}

constexpr PioneerModel PeopleBot() {
  PioneerModel model = P3Dx("peoplebot-sh", 1.0);
  model.diff_conv_per_mm = 0.006;
  model.max_speed_mm_s = 750;
  model.length_mm = 513;
  model.radius_mm = 340;
  model.sonars = kPeopleBotSonars;
  return model;
}

constexpr PioneerModel P3At(std::string_view subclass, double distance_mm) {
  PioneerModel model;
  model.subclass = subclass;
  model.distance_mm = distance_mm;
  model.diff_conv_per_mm = 0.0034;
  model.max_speed_mm_s = 600;
  model.max_turn_deg_s = 43;
  model.top_speed_mm_s = 1200;
  model.top_turn_deg_s = 300;
  model.width_mm = 505;
  model.length_mm = 626;
  model.radius_mm = 500;
  model.sonars = kP3AtSonars;
  return model;
}

constexpr PioneerModel Amigo(std::string_view subclass, double distance_mm, double speed_mm_s,
                             int max_speed_mm_s, std::span<const SonarMount> sonars) {
  PioneerModel model;
  model.subclass = subclass;
  model.distance_mm = distance_mm;
  model.speed_mm_s = speed_mm_s;
  model.diff_conv_per_mm = 0.011;
  model.max_speed_mm_s = max_speed_mm_s;
  model.max_turn_deg_s = 50;
  model.top_speed_mm_s = 1000;
  model.top_turn_deg_s = 300;
  model.wheel_limit_mm_s = 1000;
  model.width_mm = 279;
  model.length_mm = 330;
  model.radius_mm = 180;
  model.sonars = sonars;
  return model;
}

constexpr std::array<PioneerModel, 7> kModels = {
    P3Dx("p3dx", 0.485),
    P3Dx("p3dx-sh", 1.0),
    PeopleBot(),
    P3At("p3at", 0.465),
    P3At("p3at-sh", 1.0),
    Amigo("amigo", 0.5083, 0.6154, 500, kAmigoSonars),
    Amigo("amigo-sh", 1.0, 1.0, 750, kAmigoShSonars),
};

// For ASCII, independent of the locale.
char Lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

}  // namespace

std::span<const PioneerModel> PioneerModels() {
  return kModels;
}

const PioneerModel* FindPioneerModel(std::string_view subclass) {
  const auto same = [](char a, char b) { return Lower(a) == Lower(b); };
  for (const PioneerModel& model : kModels) {
    if (std::equal(subclass.begin(), subclass.end(), model.subclass.begin(), model.subclass.end(),
                   same)) {
      return &model;
    }
  }
  return nullptr;
}

}  // namespace pheromone::sim
