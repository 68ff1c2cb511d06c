// The lens of a camera, from pictures of a printed board of tags.
//
//   std::vector<BoardView> views = ...;      // ViewOf(board, detections) of each picture
//   const auto lens = FitLens(views, 1280, 960);
//
// The board is flat. Its pictures show it from several sides, tilted by 20 to 45 degrees, and
// together they cover the picture. Any thread.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "client_fw/tracker/detector.h"
#include "client_fw/tracker/geometry.h"

namespace pheromone::tracker {

/// Tags in rows, the first at the upper left, numbered along rows. Its x and y axes lie along the
/// printed rows and up the sheet.
struct Board {
  int first_tag = 560;
  int columns = 6;
  int rows = 4;
  double edge_m = 0.032;   ///< of a black square
  double pitch_m = 0.044;  ///< from a tag to the next one

  int tags() const { return columns * rows; }
  Point PlaceOf(int number) const {
    return {pitch_m * (number % columns), -pitch_m * (number / columns)};
  }
};

using BoardView = std::vector<Match>;

constexpr size_t kMinCornersOfView = 24;  ///< fewer, of six tags, and a view is not used

/// The corners of the board's tags that were found.
BoardView ViewOf(const Board& board, std::span<const Detection> found);

struct LensFit {
  Lens lens;
  double rms_px = 0;
  double focal_error_px = 0;  ///< standard deviation of the focal length
  double covered = 0;         ///< part of the picture's radius up to which there were corners
};

/// The lens by which all views come out of one camera: the focal length from their homographies
/// (Zhang 2000, eq. (3) and (4), for square pixels and a centre in the middle), then everything by
/// least squares of the pixels. Errors: too few views, or all from the same side.
Result<LensFit> FitLens(std::span<const BoardView> views, int width, int height);

/// The same of pictures in files, all of one size.
struct FileCalibration {
  LensFit fit;
  int width = 0;
  int height = 0;
  size_t used = 0;  ///< pictures with enough of the board
};
Result<FileCalibration> FitLensOfFiles(const Board& board, std::span<const std::string> paths);

}  // namespace pheromone::tracker
