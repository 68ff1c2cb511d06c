// Gray pictures of a camera: from files and from what cameras deliver.
//
//   Result<Picture> picture = LoadPicture("floor.jpg");
//
// PNG, PGM and JPEG files are known by their content; colours become gray. Any thread. Errors name
// the file and the place in it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"

namespace pheromone::tracker {

struct Picture {
  int width = 0;
  int height = 0;
  std::vector<uint8_t> levels;  ///< width * height, the top row first; 0 is black

  size_t IndexOf(int column, int row) const {
    return static_cast<size_t>(row) * static_cast<size_t>(width) + static_cast<size_t>(column);
  }
};

Picture MakePicture(int width, int height);

Result<Picture> LoadPicture(const std::string& path);
/// `name` is for messages. At most 100 megapixels. JPEG data that is damaged is an error.
Result<Picture> ParsePicture(std::string_view bytes, std::string_view name);

/// YUYV (YUY2): of each pair of bytes the first is the gray level. A row has `stride` bytes. Error:
/// there are fewer bytes than the size needs.
Result<Picture> PictureOfYuyv(std::string_view bytes, int width, int height, size_t stride);

Result<std::string> EncodePng(const Picture& picture);

}  // namespace pheromone::tracker
