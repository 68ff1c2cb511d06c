// The configuration for the scene of scene.h, as text.
#pragma once

#include <fmt/format.h>

#include <string>

#include "client_fw/tracker/testing/scene.h"

namespace pheromone::tracker {

inline std::string SettingsOfTheScene() {
  const RenderedCamera camera = CameraOfTheScene();
  std::string text = fmt::format(
      "[server]\ntracker = \"127.0.0.1:4960\"\n[camera]\nwidth_px = {}\nheight_px = {}\n"
      "focal_px = {}\ncentre_x_px = {}\ncentre_y_px = {}\nk1 = {}\nk2 = {}\n"
      "[tags]\nfloor_edge_m = {}\nrobot_edge_m = {}\n",
      camera.width, camera.height, camera.lens.focal_px, camera.lens.centre_px.x(),
      camera.lens.centre_px.y(), camera.lens.k1, camera.lens.k2, kFloorEdgeM, kRobotEdgeM);
  for (const RenderedTag& it : FloorOfTheScene()) {
    text += fmt::format("[[floor_tag]]\ntag = {}\nx_m = {}\ny_m = {}\nheading_deg = {:.6f}\n",
                        it.id, it.x_m, it.y_m, it.heading_rad * 180 / 3.14159265358979323846);
  }
  for (int tag = 1; tag <= 12; ++tag) {
    text +=
        fmt::format("[[robot]]\ntag = {}\nlink = \"radio-a\"\nheight_m = {}\n", tag, kRobotHeightM);
  }
  return text;
}

}  // namespace pheromone::tracker
