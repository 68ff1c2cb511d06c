#include "client_fw/tracker/geometry.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "client_fw/tracker/least_squares.h"

namespace pheromone::tracker {
namespace {

constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();

// Moves points to a mean of 0 and a mean distance of sqrt(2).
struct Normalised {
  Eigen::Matrix3d transform;
  std::vector<Point> points;
};

template <typename Get>
std::optional<Normalised> Normalise(std::span<const Match> matches, const Get& get) {
  const auto count = static_cast<double>(matches.size());
  Point mean = {0, 0};
  for (const Match& it : matches) {
    mean += get(it) / count;
  }
  double distance = 0;
  for (const Match& it : matches) {
    distance += (get(it) - mean).norm() / count;
  }
  if (!(distance > 0)) {
    return std::nullopt;
  }
  const double scale = std::numbers::sqrt2 / distance;
  Normalised result;
  result.transform << scale, 0, -scale * mean.x(), 0, scale, -scale * mean.y(), 0, 0, 1;
  for (const Match& it : matches) {
    result.points.emplace_back(scale * (get(it) - mean));
  }
  return result;
}

// The camera of a homography from the floor to directions.
Camera Decompose(const Lens& lens, const Eigen::Matrix3d& h) {
  const double scale = 2 / (h.col(0).norm() + h.col(1).norm());
  Eigen::Matrix3d axes;
  axes.col(0) = scale * h.col(0);
  axes.col(1) = scale * h.col(1);
  axes.col(2) = axes.col(0).cross(axes.col(1));
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(axes, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {lens, svd.matrixU() * svd.matrixV().transpose(), scale * h.col(2)};
}

}  // namespace

Point Distort(const Lens& lens, const Point& direction) {
  const double r2 = direction.squaredNorm();
  return lens.centre_px + lens.focal_px * (1 + r2 * (lens.k1 + r2 * lens.k2)) * direction;
}

std::optional<Point> Undistort(const Lens& lens, const Point& pixel) {
  constexpr int kMaxSteps = 30;
  const Point bent = (pixel - lens.centre_px) / lens.focal_px;
  const double target = bent.norm();
  if (target == 0) {
    return bent;
  }
  double r = target;  // Newton's method along the radius
  for (int i = 0; i < kMaxSteps; ++i) {
    const double r2 = r * r;
    const double slope = 1 + r2 * (3 * lens.k1 + r2 * 5 * lens.k2);
    if (!(slope > 0)) {
      return std::nullopt;
    }
    const double step = (r * (1 + r2 * (lens.k1 + r2 * lens.k2)) - target) / slope;
    r -= step;
    if (std::abs(step) < 1e-12) {
      return bent * (r / target);
    }
  }
  return std::nullopt;
}

Point Project(const Camera& camera, const Eigen::Vector3d& point) {
  const Eigen::Vector3d seen = camera.rotation * point + camera.shift;
  if (!(seen.z() > 0)) {
    return {kNowhere, kNowhere};
  }
  return Distort(camera.lens, seen.head<2>() / seen.z());
}

std::optional<Point> OntoPlane(const Camera& camera, const Point& pixel, double height_m) {
  const auto direction = Undistort(camera.lens, pixel);
  if (!direction) {
    return std::nullopt;
  }
  const Eigen::Vector3d from = camera.place();
  const Eigen::Vector3d ray =
      camera.rotation.transpose() * Eigen::Vector3d(direction->x(), direction->y(), 1);
  const double distance = (height_m - from.z()) / ray.z();
  if (!std::isfinite(distance) || distance <= 0) {
    return std::nullopt;
  }
  return Point((from + distance * ray).head<2>());
}

std::optional<Eigen::Matrix3d> FitHomography(std::span<const Match> matches) {
  constexpr double kNoRank = 1e-7;
  const auto places = Normalise(matches, [](const Match& it) { return it.place; });
  const auto pixels = Normalise(matches, [](const Match& it) { return it.pixel; });
  if (matches.size() < 4 || !places || !pixels) {
    return std::nullopt;
  }
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(2 * matches.size()), 9);
  for (size_t i = 0; i < matches.size(); ++i) {
    const Eigen::RowVector3d place(places->points[i].x(), places->points[i].y(), 1);
    const Point& pixel = pixels->points[i];
    const auto row = static_cast<Eigen::Index>(2 * i);
    rows.block<1, 3>(row, 0) = place;
    rows.block<1, 3>(row, 6) = -pixel.x() * place;
    rows.block<1, 3>(row + 1, 3) = place;
    rows.block<1, 3>(row + 1, 6) = -pixel.y() * place;
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(rows, Eigen::ComputeFullV);
  if (svd.singularValues()[7] < kNoRank * svd.singularValues()[0]) {
    return std::nullopt;
  }
  const Eigen::VectorXd h = svd.matrixV().col(8);
  Eigen::Matrix3d normal;
  normal << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8];
  const Eigen::Matrix3d result = pixels->transform.inverse() * normal * places->transform;
  return result / result.norm();
}

Result<CameraFit> FitCamera(const Lens& lens, std::span<const Match> floor) {
  std::vector<Match> straight;
  for (const Match& it : floor) {
    if (const auto direction = Undistort(lens, it.pixel)) {
      straight.push_back({it.place, *direction});
    }
  }
  if (straight.size() < floor.size()) {
    return Error{"a floor tag is where [lens] has no inverse: expected the lens of this camera"};
  }
  const auto h = FitHomography(straight);
  if (!h) {
    return Error{"the floor tags are on one line: expected them around the robots' area"};
  }
  // A homography has no sign: the floor is in front of the camera.
  const Point& first = straight.front().place;
  const double depth = h->row(2).dot(Eigen::Vector3d(first.x(), first.y(), 1));
  const Camera start = Decompose(lens, depth < 0 ? -*h : *h);
  Eigen::VectorXd x(6);
  x << VectorOf(start.rotation), start.shift;
  const auto camera_of = [&lens](const Eigen::VectorXd& unknowns) {
    return Camera{lens, RotationOf(unknowns.head<3>()), unknowns.tail<3>()};
  };
  const double rms = Minimise(
      [&](const Eigen::VectorXd& unknowns) {
        const Camera camera = camera_of(unknowns);
        Eigen::VectorXd left(static_cast<Eigen::Index>(2 * floor.size()));
        for (size_t i = 0; i < floor.size(); ++i) {
          const Point& place = floor[i].place;
          left.segment<2>(static_cast<Eigen::Index>(2 * i)) =
              Project(camera, {place.x(), place.y(), 0}) - floor[i].pixel;
        }
        return left;
      },
      &x);
  const CameraFit fit{camera_of(x), rms * std::numbers::sqrt2};
  if (!std::isfinite(rms) || fit.camera.place().z() <= 0) {
    return Error{"the floor tags are not where [[floor_tag]] says: their order is mirrored"};
  }
  return fit;
}

Eigen::Matrix3d RotationOf(const Eigen::Vector3d& v) {
  const double angle = v.norm();
  return angle > 0 ? Eigen::AngleAxisd(angle, v / angle).toRotationMatrix()
                   : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
}

Eigen::Vector3d VectorOf(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turned(rotation);
  return turned.angle() * turned.axis();
}

Corners SquareAt(const Point& centre, double heading_rad, double edge_m) {
  const Point ahead = Point(std::cos(heading_rad), std::sin(heading_rad)) * (edge_m / 2);
  const Point left(-ahead.y(), ahead.x());
  return {centre - ahead + left, centre - ahead - left, centre + ahead - left,
          centre + ahead + left};
}

std::optional<TagPose> FitTag(const Camera& camera, const Corners& pixels, double edge_m,
                              double height_m) {
  Corners seen;
  TagPose pose;
  for (size_t i = 0; i < pixels.size(); ++i) {
    const auto point = OntoPlane(camera, pixels[i], height_m);
    if (!point) {
      return std::nullopt;
    }
    seen[i] = *point;
    pose.centre += seen[i] / 4;
  }
  const Corners model = SquareAt({0, 0}, 0, edge_m);
  double along = 0;
  double across = 0;
  for (size_t i = 0; i < seen.size(); ++i) {
    const Point from_centre = seen[i] - pose.centre;
    along += model[i].dot(from_centre);
    across += model[i].x() * from_centre.y() - model[i].y() * from_centre.x();
  }
  pose.heading_rad = std::atan2(across, along);
  pose.edge_m = std::hypot(along, across) / (2 * edge_m);  // the model's squares: 4 (edge^2 / 2)
  const Corners square = SquareAt(pose.centre, pose.heading_rad, edge_m);
  double sum = 0;
  for (size_t i = 0; i < square.size(); ++i) {
    sum += (Project(camera, {square[i].x(), square[i].y(), height_m}) - pixels[i]).squaredNorm();
  }
  pose.rms_px = std::sqrt(sum / 4);
  return pose;
}

}  // namespace pheromone::tracker
