#include "client_fw/tracker/detector.h"

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>

#include <cassert>
#include <cstdlib>

namespace pheromone::tracker {
namespace {

constexpr int kMaxCorrectedBits = 2;  // of 36, at a distance of 11

struct FamilyEnd {
  void operator()(apriltag_family_t* family) const { tag36h11_destroy(family); }
};
using Family = std::unique_ptr<apriltag_family_t, FamilyEnd>;

struct DetectorEnd {
  void operator()(apriltag_detector_t* detector) const { apriltag_detector_destroy(detector); }
};

}  // namespace

class Detector::Impl {
 public:
  explicit Impl(double decimate)
      : family_(tag36h11_create()), detector_(apriltag_detector_create()) {
    apriltag_detector_add_family_bits(detector_.get(), family_.get(), kMaxCorrectedBits);
    detector_->nthreads = 1;
    detector_->quad_decimate = static_cast<float>(decimate);
    detector_->refine_edges = true;
    // A floor has a texture, a tag has black and white.
    detector_->qtp.min_white_black_diff = 20;
  }

  std::vector<Detection> Detect(const Picture& picture) {
    // The library reads it only, but does not say so.
    image_u8_t image = {picture.width, picture.height, picture.width,
                        const_cast<uint8_t*>(picture.levels.data())};
    zarray_t* const found = apriltag_detector_detect(detector_.get(), &image);
    std::vector<Detection> result;
    for (int i = 0; i < zarray_size(found); ++i) {
      apriltag_detection_t* tag = nullptr;
      zarray_get(found, i, &tag);
      Detection detection{tag->id, {}};
      for (size_t k = 0; k < detection.corners.size(); ++k) {
        detection.corners[k] = {tag->p[k][0], tag->p[k][1]};
      }
      result.push_back(detection);
    }
    apriltag_detections_destroy(found);
    return result;
  }

 private:
  Family family_;
  std::unique_ptr<apriltag_detector_t, DetectorEnd> detector_;  // destroyed first
};

Detector::Detector(double decimate) : impl_(std::make_unique<Impl>(decimate)) {}

Detector::~Detector() = default;

std::vector<Detection> Detector::Detect(const Picture& picture) {
  return impl_->Detect(picture);
}

TagModules ModulesOf(int id) {
  assert(id >= 0 && id <= kMaxTag);
  const Family family(tag36h11_create());
  image_u8_t* const image = apriltag_to_image(family.get(), id);
  TagModules modules{};
  for (size_t row = 0; row < modules.size(); ++row) {
    for (size_t column = 0; column < modules.size(); ++column) {
      modules[row][column] = image->buf[row * static_cast<size_t>(image->stride) + column] > 127;
    }
  }
  std::free(image->buf);  // image_u8_destroy is not exported by Debian's library
  std::free(image);
  return modules;
}

}  // namespace pheromone::tracker
