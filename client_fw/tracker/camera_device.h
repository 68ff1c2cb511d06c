// A camera of Linux: Video4Linux2, by frames that the driver maps into memory.
//
//   Result<CameraDevice> camera = CameraDevice::Open("/dev/video0", 1280, 960);
//   Result<Picture> picture = camera.value().Next();
//
// Takes YUYV, else MJPEG. What the driver does is here and nowhere else; it has been tried with
// proto_tests/camera_shim.c only, never with a camera. One thread.
#pragma once

#include <string>
#include <vector>

#include "client_fw/tracker/picture.h"
#include "server/base/descriptor.h"
#include "server/base/result.h"

namespace pheromone::tracker {

class CameraDevice {
 public:
  /// Errors: there is no such device, another program has it, or it delivers neither this size nor
  /// one of these formats.
  static Result<CameraDevice> Open(const std::string& path, int width, int height);
  CameraDevice(CameraDevice&&) = default;
  CameraDevice& operator=(CameraDevice&&) = delete;
  ~CameraDevice();

  /// The newest picture; waits for one if there is none, at most two seconds. Older ones that were
  /// not fetched are dropped. Errors: the camera is gone, or is silent. A picture that is damaged
  /// is skipped.
  Result<Picture> Next();

 private:
  struct Mapped {
    void* at = nullptr;
    size_t size = 0;
  };

  CameraDevice() = default;
  Status SetFormat(int width, int height);
  Status Start();
  Result<Picture> Decode(size_t buffer, size_t size) const;

  std::string path_;
  Descriptor descriptor_;
  std::vector<Mapped> mapped_;
  int width_ = 0;
  int height_ = 0;
  size_t stride_ = 0;
  bool jpeg_ = false;
};

}  // namespace pheromone::tracker
