// Pictures of a swarm as a camera would take them: a floor with a texture, tags on it, robots with
// tags above it, cables that hide parts of them; blurred by the lens and with noise.
//
//   Renderer renderer(camera, floor_tags, cables, blemishes);
//   const Picture picture = renderer.Render(robots);
//
// Every pixel is traced along its rays to what they meet: it calls nothing of geometry.h, whose
// Lens it has, and so the two judge each other. One thread. The same calls give the same pictures.
#pragma once

#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "client_fw/tracker/detector.h"
#include "client_fw/tracker/geometry.h"
#include "client_fw/tracker/picture.h"

namespace pheromone::tracker {

/// Above (x, y) at the height z, it looks down; then it is turned about the vertical, and tilted
/// upwards about its horizontal.
struct RenderedCamera {
  int width = 1280;
  int height = 960;
  Lens lens = {.focal_px = 1000, .centre_px = {640, 480}};
  double x_m = 0;
  double y_m = 0;
  double z_m = 3;
  double turn_rad = 0;
  double tilt_rad = 0;
};

struct RenderedTag {
  int id = 0;
  double x_m = 0;
  double y_m = 0;
  double heading_rad = 0;
  double edge_m = 0.12;
  double height_m = 0;  ///< of a robot: on a dark disc of this height
};

/// From one point to another.
struct RenderedCable {
  double x1_m = 0;
  double y1_m = 0;
  double x2_m = 0;
  double y2_m = 0;
  double width_m = 0.01;
  double height_m = 1;
};

struct Blemishes {
  double noise = 4;      ///< standard deviation, of 255 levels
  double blur_px = 0.7;  ///< standard deviation; 0: none
  double shade = 0.4;    ///< how much darker the right edge of the floor is than the left one
  uint32_t seed = 1;
};

class Renderer {
 public:
  Renderer(const RenderedCamera& camera, std::span<const RenderedTag> floor,
           std::span<const RenderedCable> cables, const Blemishes& blemishes);

  /// With these robots, the first one lowest.
  Picture Render(std::span<const RenderedTag> robots);

 private:
  struct Ray {  // metres on the map for each metre down
    float east = 0;
    float north = 0;
  };
  struct Block {  // of pixels: the least and the most of its rays
    Ray least;
    Ray most;
  };
  struct Tag {
    RenderedTag tag;
    TagModules modules;
    float cosine;
    float sine;
  };

  void TraceRays();
  void PaintFloor(std::span<const RenderedTag> floor);
  void PaintCables(std::span<const RenderedCable> cables);
  void PaintRobot(const RenderedTag& robot, std::vector<float>* levels) const;
  void Blur(std::vector<float>* levels) const;
  static float LevelOf(const Tag& tag, float x, float y);
  static Tag MakeTag(const RenderedTag& tag);

  RenderedCamera camera_;
  Blemishes blemishes_;
  std::vector<Ray> rays_;  // kSamples for each pixel
  std::vector<Block> blocks_;
  std::vector<float> floor_;
  std::vector<float> covered_;  // by cables, as parts of a pixel
  std::vector<float> noise_;
  std::mt19937 random_;
};

}  // namespace pheromone::tracker
