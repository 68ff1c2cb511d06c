// Levenberg and Marquardt's method for few unknowns, with numeric derivatives. Pure; any thread.
//
//   Eigen::VectorXd x = guess;
//   const double rms = Minimise([](const Eigen::VectorXd& x) { return Residuals(x); }, &x);
//
// Source: Marquardt 1963, with the scaling of the diagonal of his eq. (27).
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>

namespace pheromone::tracker {

/// The derivatives of residuals by their unknowns, one column for each unknown, from both sides.
template <typename Residuals>
Eigen::MatrixXd Jacobian(const Residuals& residuals, const Eigen::VectorXd& x) {
  Eigen::MatrixXd slopes;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const double width = 1e-6 * std::max(1.0, std::abs(x[i]));
    Eigen::VectorXd moved = x;
    moved[i] += width;
    const Eigen::VectorXd more = residuals(moved);
    moved[i] -= 2 * width;
    slopes.conservativeResize(more.size(), x.size());
    slopes.col(i) = (more - residuals(moved)) / (2 * width);
  }
  return slopes;
}

/// Improves `x` until the sum of squares changes by less than a billionth of itself, in at most 60
/// steps. Returns the root of the mean square of what is left. Residuals that are not finite, such
/// as those of a point behind the camera, reject a step; at the start they make the result
/// infinite.
template <typename Residuals>
double Minimise(const Residuals& residuals, Eigen::VectorXd* x) {
  constexpr int kMaxSteps = 60;
  constexpr double kMaxDamping = 1e12;
  Eigen::VectorXd left = residuals(*x);
  double sum = left.squaredNorm();
  if (!std::isfinite(sum)) {
    return std::numeric_limits<double>::infinity();
  }
  double damping = 1e-3;
  for (int step = 0; step < kMaxSteps && damping < kMaxDamping; ++step) {
    const Eigen::MatrixXd slopes = Jacobian(residuals, *x);
    const Eigen::MatrixXd normal = slopes.transpose() * slopes;
    const Eigen::VectorXd down = slopes.transpose() * left;
    bool better = false;
    double gain = 0;
    while (!better && damping < kMaxDamping) {
      Eigen::MatrixXd damped = normal;
      damped.diagonal() += damping * normal.diagonal();
      const Eigen::VectorXd next = *x - damped.ldlt().solve(down);
      const Eigen::VectorXd next_left = residuals(next);
      const double next_sum = next_left.squaredNorm();
      better = std::isfinite(next_sum) && next_sum <= sum;
      if (better) {
        gain = sum - next_sum;
        *x = next;
        left = next_left;
        sum = next_sum;
        damping /= 10;
      } else {
        damping *= 10;
      }
    }
    if (gain <= 1e-9 * sum) {
      break;
    }
  }
  return std::sqrt(sum / static_cast<double>(left.size()));
}

}  // namespace pheromone::tracker
