#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace blockid {

/// What a MAT file holds under one name.
struct MatVariable {
  std::string name;       ///< "x", a struct field "s.x", or a field "s[k].x" of element k of a struct array
  Eigen::Index rows = 0;  ///< rows x cols; for more than two dimensions cols is the product of all but the first
  Eigen::Index cols = 0;
  std::string type;      ///< MATLAB class: "double", "int16", "char", "cell", ...; "complex double",
                         ///< "sparse", "logical"
  int rank = 2;          ///< number of dimensions
  bool numeric = false;  ///< real numbers in a full matrix: readable by the functions below
};

/// A MAT file (v4, v5, v7, v7.3) held open for several reads.
///
/// Names of variables: "x"; "s.x" for a field of a struct, to any depth; "s[k].x" for element k of
/// a struct array; with "[k]" at the end for column k of a matrix; k is zero-based. Integers,
/// singles and logicals are converted to double. Reads are serialised in the process: HDF5 is not
/// thread-safe.
class MatFile {
 public:
  /// @throws Error when the file is missing, truncated or no MAT file.
  explicit MatFile(const std::filesystem::path& path);
  ~MatFile();
  MatFile(MatFile&&) noexcept;
  MatFile& operator=(MatFile&&) noexcept;

  /// All variables and struct fields in the order of the file; reads no samples.
  [[nodiscard]] std::vector<MatVariable> variables() const;

  /// The matrix under that name (rows, cols), without "[k]" at the end.
  /// @throws Error that lists the variables when the name is unknown; for complex, sparse, cell,
  /// char and struct data,
  ///   more than two dimensions and empty variables.
  [[nodiscard]] Eigen::MatrixXd matrix(std::string_view name) const;

  /// A vector (N,): a row or column vector (for which only [0] may be given), or column k of a
  /// matrix.
  /// @throws Error as matrix does; for a matrix without [k] or with k outside it.
  [[nodiscard]] Eigen::VectorXd vector(std::string_view name) const;

  /// The same of complex numbers; real ones have imaginary parts of zero.
  /// @throws Error as vector does, but for complex data.
  [[nodiscard]] Eigen::VectorXcd complex_vector(std::string_view name) const;

  /// A single number.
  /// @throws Error as matrix does; for anything but one number.
  [[nodiscard]] double scalar(std::string_view name) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// MatFile(path).variables()
[[nodiscard]] std::vector<MatVariable> list_mat(const std::filesystem::path& path);

/// MatFile(path).vector(name)
[[nodiscard]] Eigen::VectorXd read_mat_vector(const std::filesystem::path& path, std::string_view name);

/// MatFile(path).scalar(name)
[[nodiscard]] double read_mat_scalar(const std::filesystem::path& path, std::string_view name);

}  // namespace blockid
