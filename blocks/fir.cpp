#include <blockid/blocks/fir.hpp>

#include <blockid/data/error.hpp>

namespace blockid {
namespace {

Rational checked(Index nb, Index nk) {
  if (nb < 0 || nk < 0) fail("fir: nb and nk are a degree and a delay, expected >= 0, got nb=", nb, ", nk=", nk);
  return {nb, 0, nk};
}

}  // namespace

Fir::Fir(Index nb, Index nk) : filter_(checked(nb, nk)) {}

Arguments Fir::arguments() const {
  Arguments result = {{"nb", std::to_string(nb())}};
  if (nk() > 0) result.emplace_back("nk", std::to_string(nk()));
  return result;
}

void Fir::push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                       std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own) const {
  filter_.push_forward(theta, x, memory, u, y, tangents, own);
}

Rescaled Fir::with_scaled_input(std::span<const double> theta, double k) const {
  return with_scaled_output(theta, 1.0 / k);
}

Rescaled Fir::with_scaled_output(std::span<const double> theta, double k) const {
  return {*this, k * Eigen::Map<const Eigen::VectorXd>(theta.data(), static_cast<Index>(theta.size()))};
}

}  // namespace blockid
