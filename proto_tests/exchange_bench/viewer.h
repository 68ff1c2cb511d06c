// A viewer of the map while robots are served.
#pragma once

#include <sys/types.h>

#include <string>

namespace pheromone::bench {

/// A process that requests the same raster of the map as `pheromonectl watch`, over the server's
/// Unix socket in `folder`, ten times a second. Ends with its owner.
class Viewer {
 public:
  explicit Viewer(const std::string& folder);
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;
  ~Viewer();

  /// Whole pictures, up to now.
  int pictures() const { return *pictures_; }

 private:
  volatile int* pictures_ = nullptr;  // shared with the process
  pid_t process_ = -1;
};

}  // namespace pheromone::bench
