// MAT files made for a test.
#pragma once

#include <matio.h>

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace blockid::testing {

class MatWriter {
 public:
  MatWriter(const std::filesystem::path& path, mat_ft version) : file_(Mat_CreateVer(path.c_str(), nullptr, version)) {
    if (!file_) throw std::runtime_error("cannot create " + path.string());
  }

  /// Real numbers of the class of Scalar; logical on request.
  template <class Derived>
  void add(const std::string& name, const Eigen::MatrixBase<Derived>& values, int flags = 0) {
    put(make(name.c_str(), values, flags));
  }

  void add_complex(const std::string& name, const Eigen::VectorXcd& values) {
    Eigen::VectorXd re = values.real();
    Eigen::VectorXd im = values.imag();
    mat_complex_split_t parts{re.data(), im.data()};
    std::size_t dims[2] = {static_cast<std::size_t>(values.size()), 1};
    put(Variable(Mat_VarCreate(name.c_str(), MAT_C_DOUBLE, MAT_T_DOUBLE, 2, dims, &parts, MAT_F_COMPLEX)));
  }

  void add_text(const std::string& name, std::string text) {
    std::size_t dims[2] = {1, text.size()};
    put(Variable(Mat_VarCreate(name.c_str(), MAT_C_CHAR, MAT_T_UINT8, 2, dims, text.data(), 0)));
  }

  void add_cell(const std::string& name) {
    std::size_t dims[2] = {1, 1};
    matvar_t* content[1] = {make(nullptr, Eigen::Vector2d(1, 2), 0).release()};
    put(Variable(Mat_VarCreate(name.c_str(), MAT_C_CELL, MAT_T_CELL, 2, dims, static_cast<void*>(content), 0)));
  }

  void add_cube(const std::string& name) {
    std::size_t dims[3] = {2, 2, 2};
    double values[8] = {};
    put(Variable(Mat_VarCreate(name.c_str(), MAT_C_DOUBLE, MAT_T_DOUBLE, 3, dims, values, 0)));
  }

  /// A 1 x n struct array with the fields u (column vector) and inner.fs (number); element k holds u + k.
  void add_struct(const std::string& name, const Eigen::VectorXd& u, double fs, std::size_t n) {
    const char* fields[2] = {"u", "inner"};
    const char* inner_fields[1] = {"fs"};
    std::size_t dims[2] = {1, n};
    std::size_t one[2] = {1, 1};
    Variable array(Mat_VarCreateStruct(name.c_str(), 2, dims, fields, 2));
    for (std::size_t k = 0; k < n; ++k) {
      const Eigen::VectorXd shifted = u.array() + static_cast<double>(k);
      Mat_VarSetStructFieldByName(array.get(), "u", k, make(nullptr, shifted, 0).release());
      matvar_t* const inner = Mat_VarCreateStruct("inner", 2, one, inner_fields, 1);
      Mat_VarSetStructFieldByName(inner, "fs", 0, make(nullptr, Eigen::VectorXd::Constant(1, fs), 0).release());
      Mat_VarSetStructFieldByName(array.get(), "inner", k, inner);
    }
    put(std::move(array));
  }

 private:
  struct Close {
    void operator()(mat_t* file) const { Mat_Close(file); }
  };
  struct Free {
    void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
  };
  using Variable = std::unique_ptr<matvar_t, Free>;

  template <class Scalar>
  static std::pair<matio_classes, matio_types> kind() {
    if constexpr (std::is_same_v<Scalar, double>) return {MAT_C_DOUBLE, MAT_T_DOUBLE};
    if constexpr (std::is_same_v<Scalar, float>) return {MAT_C_SINGLE, MAT_T_SINGLE};
    if constexpr (std::is_same_v<Scalar, std::int8_t>) return {MAT_C_INT8, MAT_T_INT8};
    if constexpr (std::is_same_v<Scalar, std::uint8_t>) return {MAT_C_UINT8, MAT_T_UINT8};
    if constexpr (std::is_same_v<Scalar, std::int16_t>) return {MAT_C_INT16, MAT_T_INT16};
    if constexpr (std::is_same_v<Scalar, std::uint16_t>) return {MAT_C_UINT16, MAT_T_UINT16};
    if constexpr (std::is_same_v<Scalar, std::int32_t>) return {MAT_C_INT32, MAT_T_INT32};
    if constexpr (std::is_same_v<Scalar, std::uint32_t>) return {MAT_C_UINT32, MAT_T_UINT32};
    if constexpr (std::is_same_v<Scalar, std::int64_t>) return {MAT_C_INT64, MAT_T_INT64};
    if constexpr (std::is_same_v<Scalar, std::uint64_t>) return {MAT_C_UINT64, MAT_T_UINT64};
  }

  template <class Derived>
  static Variable make(const char* name, const Eigen::MatrixBase<Derived>& values, int flags) {
    using Scalar = typename Derived::Scalar;
    Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> copy = values;
    std::size_t dims[2] = {static_cast<std::size_t>(copy.rows()), static_cast<std::size_t>(copy.cols())};
    const auto [class_type, data_type] = kind<Scalar>();
    return Variable(Mat_VarCreate(name, class_type, data_type, 2, dims, copy.data(), flags));
  }

  void put(Variable variable) {
    if (!variable || Mat_VarWrite(file_.get(), variable.get(), MAT_COMPRESSION_ZLIB) != 0) {
      throw std::runtime_error("cannot write a MAT variable");
    }
  }

  std::unique_ptr<mat_t, Close> file_;
};

}  // namespace blockid::testing
