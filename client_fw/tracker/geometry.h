// Where on the map a point of a picture lies.
//
//   const Result<CameraFit> camera = FitCamera(lens, floor_corners);
//   const auto point = OntoPlane(camera.value().camera, {640, 480}, 0.25);  // a robot's tag
//   const auto pose = FitTag(camera.value().camera, corners, 0.12, 0.25);
//
// The map's x and y are metres, z is the height above the floor. Pictures count pixels from the
// left and from the top; the middle of the first pixel is (0.5, 0.5). A camera sees the point p at
// q = R p + t, then
//
//   (x, y) = (q_x, q_y) / q_z,  r^2 = x^2 + y^2,
//   pixel  = centre + focal (1 + k1 r^2 + k2 r^4) (x, y)
//
// (Brown 1966, radial part only; square pixels). A tag at a height is found on the plane of this
// height, so that it is not shifted away from the camera's foot as it seems in the picture.
//
// Pure; any thread.
#pragma once

#include <array>
#include <optional>
#include <span>

#include <Eigen/Dense>

#include "server/base/result.h"

namespace pheromone::tracker {

using Point = Eigen::Vector2d;
/// Of a tag's black square, in the order of libapriltag: seen with the number upright, lower left,
/// lower right, upper right, upper left.
using Corners = std::array<Point, 4>;

struct Lens {
  double focal_px = 0;
  Point centre_px = {0, 0};
  double k1 = 0;
  double k2 = 0;
};

/// The pixel of the direction (x, y, 1) seen from the camera.
Point Distort(const Lens& lens, const Point& direction);
/// The reverse; nothing where the lens bends so much that several directions have one pixel.
std::optional<Point> Undistort(const Lens& lens, const Point& pixel);

struct Camera {
  Lens lens;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< R
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();         ///< t

  /// Where it hangs.
  Eigen::Vector3d place() const { return -(rotation.transpose() * shift); }
};

/// The pixel of a point; not finite if it is behind the camera.
Point Project(const Camera& camera, const Eigen::Vector3d& point);

/// The point at a height that is seen at a pixel; nothing if none is.
std::optional<Point> OntoPlane(const Camera& camera, const Point& pixel, double height_m);

/// A point of a plane, and where it is in a picture.
struct Match {
  Point place;
  Point pixel;
};

/// H with pixel ~ H (place, 1), by the normalised direct linear transform (Hartley and Zisserman
/// 2004, algorithm 4.2), with a norm of 1. Nothing if the points do not determine
/// it: fewer than four, or all but one on a line.
std::optional<Eigen::Matrix3d> FitHomography(std::span<const Match> matches);

struct CameraFit {
  Camera camera;
  double rms_px = 0;  ///< distance of the pixels from where the camera would see the points
};

/// The camera of this lens that sees these points of the floor at these pixels: from a homography
/// (Zhang 2000, section 3.1), refined by least squares of the pixels.
Result<CameraFit> FitCamera(const Lens& lens, std::span<const Match> floor);

/// R of a rotation by |v| about v (Rodrigues).
Eigen::Matrix3d RotationOf(const Eigen::Vector3d& v);
/// v of R.
Eigen::Vector3d VectorOf(const Eigen::Matrix3d& rotation);

struct TagPose {
  Point centre = {0, 0};   ///< on the map, m
  double heading_rad = 0;  ///< from the lower to the upper edge, counter-clockwise from +x
  double edge_m = 0;       ///< as long as its edges seem at this height
  double rms_px = 0;       ///< of its corners from a square of the true size
};

/// The corners of a square on the map with this pose.
Corners SquareAt(const Point& centre, double heading_rad, double edge_m);

/// The pose of a level tag at a height whose corners are seen at `pixels`: the rigid motion with
/// the least squares between its corners and theirs on the plane of this height. Nothing if one of
/// them is not on this plane.
std::optional<TagPose> FitTag(const Camera& camera, const Corners& pixels, double edge_m,
                              double height_m);

}  // namespace pheromone::tracker
