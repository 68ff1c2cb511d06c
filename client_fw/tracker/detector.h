// Finds tags of the family tag36h11 in a picture, and says how they look: libapriltag (Olson 2011;
// Wang and Olson 2016) behind a small interface.
//
//   Detector detector;
//   for (const Detection& it : detector.Detect(picture)) { ... it.id, it.corners ... }
//
// One thread a detector: it starts none itself. libapriltag aborts the program if memory runs out.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "client_fw/tracker/geometry.h"
#include "client_fw/tracker/picture.h"

namespace pheromone::tracker {

constexpr int kMaxTag = 586;     ///< tags are 0 to kMaxTag
constexpr int kTagModules = 10;  ///< along a side, with the white frame
constexpr int kEdgeModules = 8;  ///< of the black square

struct Detection {
  int id = 0;
  Corners corners;
};

class Detector {
 public:
  /// Searches for squares in a picture that is smaller by `decimate`, 1 to 4; 2 is faster by half
  /// and more than 1, and misses tags whose black square is smaller than some 20 pixels.
  explicit Detector(double decimate = 2);
  Detector(const Detector&) = delete;
  Detector& operator=(const Detector&) = delete;
  ~Detector();

  /// In no particular order. What is no tag may be taken for one, very rarely.
  std::vector<Detection> Detect(const Picture& picture);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// Row by row from the top; true is white.
using TagModules = std::array<std::array<bool, kTagModules>, kTagModules>;

/// What is printed as tag `id`, 0 to kMaxTag.
TagModules ModulesOf(int id);

}  // namespace pheromone::tracker
