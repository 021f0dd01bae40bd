// The best linear approximation line by line, without a model, with its variances.
#pragma once

#include <blockid/blocks/block.hpp>
#include <blockid/data/data_set.hpp>
#include <blockid/data/frequency_response.hpp>

#include <Eigen/Core>
#include <limits>
#include <vector>

namespace blockid {

/// Y_k = G_k U_k + (noise and nonlinear distortion)_k at F lines. G_k belongs to a class of inputs: distortion is what
/// changes from one realisation to the next, noise what changes from one period to the next.
///
/// Variances are those of complex numbers, E |G_k - E G_k|^2. A vector that the data cannot give is empty.
struct NonparametricBla {
  /// G with the square root of total_variance, or of noise_variance where there is no other.
  FrequencyResponse response;
  /// (F,) mean square of the input in the band that each line stands for.
  Eigen::VectorXd input_power;
  /// (F,) variance of G from noise alone, and its complex degrees of freedom.
  Eigen::VectorXd noise_variance;
  Index noise_dof = 0;
  /// (F,) variance of G from noise and distortion together, and its complex degrees of freedom.
  Eigen::VectorXd total_variance;
  Index total_dof = 0;
  /// (F,) realisations (total_variance - noise_variance): what one realisation of the input leaves in G. An unbiased
  /// estimate, so that single values are below zero where there is little distortion.
  Eigen::VectorXd distortion_variance;
  /// (F,) mean square of noise and distortion in the output in the band of each line.
  Eigen::VectorXd rest_power;
  Index realisations = 1;
  /// Whole periods used of each realisation; 0 for arbitrary inputs.
  Index periods = 0;
  /// Every so many lines estimates are independent.
  Index independent_step = 1;
};

struct PeriodicBlaOptions {
  /// Periods at the start of each record that are dropped.
  Index transient_periods = 0;
  /// DFT lines of one period, 1 .. (period - 1) / 2, increasing; empty: all that are excited in every record.
  std::vector<Index> lines = {};
  /// Amplitude of an excited line over the largest amplitude of its record.
  double excited = 1e-3;
};

/// Robust method for periodic inputs; each record is a realisation of `period` samples, seen P >= 1 times:
///
///     G_m = mean over p of Y_mp / U_mp,   G = mean over m of G_m
///     noise variance = mean over m of var_p(Y_mp / U_mp) / (M P),   M (P - 1) degrees of freedom
///     total variance = var_m(G_m) / M,                               M - 1 degrees of freedom
///
/// One realisation gives the noise variance only, one period the total variance only. Records with different numbers of
/// whole periods: the smallest number is used, the last ones of each. Line 0 is left out.
/// Source: Pintelon and Schoukens 2012, section 4.3.1.
///
/// Throws Error for records without a period or with different ones, with missing samples, without a whole period
/// behind the transient, for one period of one realisation, and for lines that are not excited.
NonparametricBla periodic_bla(const DataSet& data, const PeriodicBlaOptions& options = {});

struct LocalPolynomialOptions {
  /// Complex degrees of freedom of each variance: the half window n is as small as they allow.
  Index degrees_of_freedom = 12;
  /// Lines from one estimate to the next; 0: as wide as the window, so that all estimates are independent.
  Index spacing = 0;
  /// Amplitude of an excited band over that of the strongest.
  double excited = 1e-3;
};

/// Local polynomial method for arbitrary inputs. Over the lines k - n .. k + n
///
///     Y_{k+r} = (g_0 + g_1 r + g_2 r^2) U_{k+r} + t_0 + t_1 r + t_2 r^2 + V_{k+r}
///
/// by least squares; G_k = g_0, the t are the transients of each record, var V = residual / degrees of freedom.
/// Records are cut to one length. Source: Schoukens, Vandersteen, Barbé, Pintelon 2009; Pintelon and Schoukens 2012,
/// section 7.2.
///
/// Throws Error for missing samples, constant inputs and records too short for one window.
NonparametricBla local_polynomial_bla(const DataSet& data, const LocalPolynomialOptions& options = {});

/// Mean squares of the parts of the output in the bands of all lines, in unit^2; not a number where unknown.
struct BlaPowers {
  /// sum_k (|G_k|^2 - var G_k) input_power_k: without what noise and distortion add to |G_k|^2.
  double linear = 0.0;
  double distortion = std::numeric_limits<double>::quiet_NaN();
  /// Standard deviation of `distortion` as if all lines were independent: true of noise, too small where strong
  /// distortion is shared by neighbouring lines.
  double distortion_deviation = std::numeric_limits<double>::quiet_NaN();
  double noise = std::numeric_limits<double>::quiet_NaN();
  /// Noise and distortion together.
  double rest = std::numeric_limits<double>::quiet_NaN();
};
BlaPowers powers(const NonparametricBla& bla);

/// Probability by which a test is allowed to see what is not there.
inline constexpr double kSignificance = 0.01;

enum class Nonlinearity {
  unknown,  ///< noise and distortion cannot be told apart
  none,     ///< no distortion that is significant beside the noise
  weak,     ///< below 1 % of the linear output's amplitude
  clear,    ///< 1 .. 10 %
  strong    ///< above
};

/// What the powers say about the system.
struct NonlinearityVerdict {
  Nonlinearity kind = Nonlinearity::unknown;
  BlaPowers powers;
  /// 10 log10(power / linear power); not a number where unknown, -infinity for none.
  double distortion_db = std::numeric_limits<double>::quiet_NaN();
  double noise_db = std::numeric_limits<double>::quiet_NaN();
  double rest_db = std::numeric_limits<double>::quiet_NaN();
  /// Of distortion as large by chance when there is none, from its standard deviation.
  double p_value = std::numeric_limits<double>::quiet_NaN();
};
NonlinearityVerdict nonlinearity(const NonparametricBla& bla, double significance = kSignificance);

/// Test of the hypothesis that G_k = 0 at all lines, as with an even nonlinearity.
struct VanishingBla {
  /// The hypothesis stands: p_value >= significance.
  bool vanishes = false;
  /// 2 nu sum_k ln(1 + |G_k|^2 / (nu var G_k)) with nu = total_dof: chi-square when G = 0.
  double statistic = 0.0;
  /// Two for each independent line.
  Index degrees_of_freedom = 0;
  double p_value = 0.0;
  double significance = kSignificance;
  /// Linear power over linear power and rest.
  double explained = 0.0;
};

/// Fisher's sum of the p-values (1 + |G_k|^2 / (nu var G_k))^-nu of F(2, 2 nu) at independent lines.
/// Throws Error when the total variance is unknown: noise alone is not what G must be compared with.
VanishingBla bla_vanishes(const NonparametricBla& bla, double significance = kSignificance);

}  // namespace blockid
