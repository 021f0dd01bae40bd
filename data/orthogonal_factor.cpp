#include <blockid/data/orthogonal_factor.hpp>

#include <Eigen/Dense>

namespace blockid {

Eigen::MatrixXd q_times(const OrthogonalFactor& q, Eigen::MatrixXd x) {
  q.applyThisOnTheLeft(x);
  return x;
}

Eigen::MatrixXd q_transpose_times(const OrthogonalFactor& q, Eigen::MatrixXd x) {
  q.transpose().applyThisOnTheLeft(x);
  return x;
}

}  // namespace blockid
