#include "client_fw/tracker/calibration.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <string>

#include "client_fw/tracker/least_squares.h"

namespace pheromone::tracker {
namespace {

constexpr size_t kMinViews = 3;
constexpr double kMaxFocalError = 0.02;
constexpr char kSameSide[] =
    "the board is seen from the same side in all pictures, which does not tell the focal length: "
    "expected pictures with the board tilted by 20 to 45 degrees, to several sides";
constexpr Eigen::Index kLensUnknowns = 5;
constexpr Eigen::Index kViewUnknowns = 6;

// 1 / f^2 by least squares of both of Zhang's constraints of each view.
std::optional<double> FocalOf(std::span<const BoardView> views, const Point& centre) {
  double along = 0;
  double square = 0;
  for (const BoardView& view : views) {
    BoardView shifted = view;
    for (Match& it : shifted) {
      it.pixel -= centre;
    }
    const auto found = FitHomography(shifted);
    if (!found) {
      continue;
    }
    // Columns of about the same length, whatever the unit of the board.
    const Eigen::Matrix3d h = *found / found->col(0).norm();
    const auto a = h.col(0);
    const auto b = h.col(1);
    const double in_plane[] = {a.x() * b.x() + a.y() * b.y(),
                               a.head<2>().squaredNorm() - b.head<2>().squaredNorm()};
    const double in_depth[] = {a.z() * b.z(), a.z() * a.z() - b.z() * b.z()};
    for (size_t i = 0; i < 2; ++i) {
      along -= in_plane[i] * in_depth[i];
      square += in_plane[i] * in_plane[i];
    }
  }
  // in_plane / f^2 + in_depth = 0
  const double inverse = along / square;
  if (!(inverse > 0) || !std::isfinite(inverse)) {
    return std::nullopt;
  }
  return std::sqrt(1 / inverse);
}

Lens LensOf(const Eigen::VectorXd& x) {
  return {x[0], {x[1], x[2]}, x[3], x[4]};
}

Eigen::VectorXd Misses(std::span<const BoardView> views, Eigen::Index corners,
                       const Eigen::VectorXd& x) {
  Eigen::VectorXd left(2 * corners);
  Eigen::Index at = 0;
  Eigen::Index unknown = kLensUnknowns;
  for (const BoardView& view : views) {
    const Camera camera{LensOf(x), RotationOf(x.segment<3>(unknown)), x.segment<3>(unknown + 3)};
    for (const Match& it : view) {
      left.segment<2>(at) = Project(camera, {it.place.x(), it.place.y(), 0}) - it.pixel;
      at += 2;
    }
    unknown += kViewUnknowns;
  }
  return left;
}

// The standard deviation of the first unknown: of the inverse normal matrix.
double DeviationOfFocal(std::span<const BoardView> views, Eigen::Index corners,
                        const Eigen::VectorXd& x, double rms) {
  const Eigen::MatrixXd slopes =
      Jacobian([&](const Eigen::VectorXd& moved) { return Misses(views, corners, moved); }, x);
  Eigen::VectorXd first = Eigen::VectorXd::Zero(x.size());
  first[0] = 1;
  const Eigen::MatrixXd normal = slopes.transpose() * slopes;
  return rms * std::sqrt(normal.ldlt().solve(first)[0]);
}

}  // namespace

BoardView ViewOf(const Board& board, std::span<const Detection> found) {
  BoardView view;
  for (const Detection& it : found) {
    const int number = it.id - board.first_tag;
    if (number < 0 || number >= board.tags()) {
      continue;
    }
    // Tags stand upright on the board: their heading is its y axis.
    const Corners square = SquareAt(board.PlaceOf(number), std::acos(0.0), board.edge_m);
    for (size_t k = 0; k < square.size(); ++k) {
      view.push_back({square[k], it.corners[k]});
    }
  }
  return view;
}

Result<LensFit> FitLens(std::span<const BoardView> all, int width, int height) {
  std::vector<BoardView> views;
  std::copy_if(all.begin(), all.end(), std::back_inserter(views),
               [](const BoardView& view) { return view.size() >= kMinCornersOfView; });
  if (views.size() < kMinViews) {
    return Error{"found " + std::to_string(views.size()) +
                 " pictures with six tags of the board or more, expected at least 3, better 10"};
  }
  const Point centre(width / 2.0, height / 2.0);
  const auto focal = FocalOf(views, centre);
  if (!focal) {
    return Error{kSameSide};
  }
  Eigen::VectorXd x(kLensUnknowns + kViewUnknowns * static_cast<Eigen::Index>(views.size()));
  x.head<kLensUnknowns>() << *focal, centre.x(), centre.y(), 0, 0;
  Eigen::Index corners = 0;
  Eigen::Index unknown = kLensUnknowns;
  LensFit fit;
  for (const BoardView& view : views) {
    PHEROMONE_TRY(const CameraFit camera, FitCamera(LensOf(x), view));
    x.segment<3>(unknown) = VectorOf(camera.camera.rotation);
    x.segment<3>(unknown + 3) = camera.camera.shift;
    unknown += kViewUnknowns;
    corners += static_cast<Eigen::Index>(view.size());
    for (const Match& it : view) {
      fit.covered = std::max(fit.covered, (it.pixel - centre).norm() / centre.norm());
    }
  }
  const double rms =
      Minimise([&](const Eigen::VectorXd& tried) { return Misses(views, corners, tried); }, &x);
  if (!std::isfinite(rms) || !(x[0] > 0)) {
    return Error{"no lens fits the pictures: expected sharp pictures of a flat board"};
  }
  fit.lens = LensOf(x);
  fit.rms_px = rms * std::sqrt(2.0);
  fit.focal_error_px = DeviationOfFocal(views, corners, x, rms);
  if (!(fit.focal_error_px < kMaxFocalError * fit.lens.focal_px)) {
    return Error{kSameSide};
  }
  return fit;
}

Result<FileCalibration> FitLensOfFiles(const Board& board, std::span<const std::string> paths) {
  FileCalibration result;
  Detector detector(1);
  std::vector<BoardView> views;
  for (const std::string& path : paths) {
    PHEROMONE_TRY(const Picture picture, LoadPicture(path));
    if (views.empty()) {
      result.width = picture.width;
      result.height = picture.height;
    } else if (picture.width != result.width || picture.height != result.height) {
      return Error{path + ": found " + std::to_string(picture.width) + " x " +
                   std::to_string(picture.height) + " pixels, expected those of " + paths.front() +
                   ", " + std::to_string(result.width) + " x " + std::to_string(result.height)};
    }
    views.push_back(ViewOf(board, detector.Detect(picture)));
    if (views.back().size() >= kMinCornersOfView) {
      ++result.used;
    }
  }
  PHEROMONE_TRY(result.fit, FitLens(views, result.width, result.height));
  return result;
}

}  // namespace pheromone::tracker
