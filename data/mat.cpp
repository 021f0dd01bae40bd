#include "blockid/data/mat.hpp"

#include <hdf5.h>
#include <matio.h>

#include <algorithm>
#include <complex>
#include <cstdint>
#include <mutex>
#include <optional>
#include <utility>

#include "blockid/data/error.hpp"
#include "blockid/data/mat_integrity.hpp"
#include "blockid/data/mat_name.hpp"

namespace blockid {

// With linkage: MatFile::Impl holds them.
namespace mat {

struct CloseFile {
  void operator()(mat_t* file) const { Mat_Close(file); }
};
struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using File = std::unique_ptr<mat_t, CloseFile>;
using Variable = std::unique_ptr<matvar_t, FreeVariable>;

}  // namespace mat

namespace {

using mat::File;
using mat::NamePart;
using mat::Variable;

/// One reader at a time, and HDF5 keeps its complaints to itself meanwhile; matio is silent unless
/// its log is set up.
class LibraryGuard {
 public:
  LibraryGuard() : lock_(mutex()) {
    H5Eget_auto2(H5E_DEFAULT, &printer_, &printer_data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  LibraryGuard(const LibraryGuard&) = delete;
  LibraryGuard& operator=(const LibraryGuard&) = delete;
  ~LibraryGuard() { H5Eset_auto2(H5E_DEFAULT, printer_, printer_data_); }

 private:
  static std::mutex& mutex() {
    static std::mutex instance;
    return instance;
  }
  std::unique_lock<std::mutex> lock_;
  H5E_auto2_t printer_ = nullptr;
  void* printer_data_ = nullptr;
};

std::string class_name(const matvar_t& variable) {
  switch (variable.class_type) {
    case MAT_C_EMPTY:
      return "empty";
    case MAT_C_CELL:
      return "cell";
    case MAT_C_STRUCT:
      return "struct";
    case MAT_C_OBJECT:
      return "object";
    case MAT_C_CHAR:
      return "char";
    case MAT_C_SPARSE:
      return "sparse";
    case MAT_C_DOUBLE:
      return "double";
    case MAT_C_SINGLE:
      return "single";
    case MAT_C_INT8:
      return "int8";
    case MAT_C_UINT8:
      return "uint8";
    case MAT_C_INT16:
      return "int16";
    case MAT_C_UINT16:
      return "uint16";
    case MAT_C_INT32:
      return "int32";
    case MAT_C_UINT32:
      return "uint32";
    case MAT_C_INT64:
      return "int64";
    case MAT_C_UINT64:
      return "uint64";
    case MAT_C_FUNCTION:
      return "function handle";
    default:
      return "object";
  }
}

std::string type_of(const matvar_t& variable) {
  if (variable.isLogical != 0) return "logical";
  return (variable.isComplex != 0 ? "complex " : "") + class_name(variable);
}

bool is_numeric_class(const matvar_t& variable) {
  return variable.class_type >= MAT_C_DOUBLE && variable.class_type <= MAT_C_UINT64;
}

Eigen::Index row_count(const matvar_t& variable) {
  return variable.rank > 0 && variable.dims != nullptr ? static_cast<Eigen::Index>(variable.dims[0]) : 0;
}

Eigen::Index column_count(const matvar_t& variable) {
  if (variable.rank == 0 || variable.dims == nullptr) return 0;
  std::size_t count = 1;
  for (int i = 1; i < variable.rank; ++i) count *= variable.dims[i];
  return static_cast<Eigen::Index>(count);
}

std::size_t element_count(const matvar_t& variable) {
  return static_cast<std::size_t>(row_count(variable) * column_count(variable));
}

std::vector<std::string> field_names(const matvar_t& variable) {
  const unsigned count = Mat_VarGetNumberOfFields(const_cast<matvar_t*>(&variable));
  char* const* const names = Mat_VarGetStructFieldnames(&variable);
  if (names == nullptr) return {};
  return {names, names + count};
}

matvar_t* field(const matvar_t& variable, const std::string& name, std::size_t element) {
  return Mat_VarGetStructFieldByName(const_cast<matvar_t*>(&variable), name.c_str(), element);
}

void list(const std::string& name, const matvar_t& variable, std::vector<MatVariable>& found) {
  constexpr std::size_t kMostElements = 16;  // a longer struct array is a data base, not a few records
  const std::size_t elements = element_count(variable);
  const std::vector<std::string> fields =
      variable.class_type == MAT_C_STRUCT ? field_names(variable) : std::vector<std::string>();
  if (fields.empty() || elements == 0 || elements > kMostElements) {
    const bool numeric = is_numeric_class(variable) && variable.isComplex == 0;
    found.push_back({name, row_count(variable), column_count(variable), type_of(variable), variable.rank, numeric});
    return;
  }
  for (std::size_t k = 0; k < elements; ++k) {
    const std::string element = elements == 1 ? name : compose(name, "[", k, "]");
    for (const std::string& field_name : fields) {
      const matvar_t* const value = field(variable, field_name, k);
      if (value != nullptr) list(element + "." + field_name, *value, found);
    }
  }
}

template <class T>
Eigen::MatrixXd converted(const matvar_t& variable, const void* data) {
  using Source = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>;
  return Eigen::Map<const Source>(static_cast<const T*>(data), row_count(variable), column_count(variable))
      .template cast<double>();
}

/// `data`: elements of the variable's class.
Eigen::MatrixXd to_matrix(const matvar_t& variable, const void* data) {
  switch (variable.class_type) {
    case MAT_C_DOUBLE:
      return converted<double>(variable, data);
    case MAT_C_SINGLE:
      return converted<float>(variable, data);
    case MAT_C_INT8:
      return converted<std::int8_t>(variable, data);
    case MAT_C_UINT8:
      return converted<std::uint8_t>(variable, data);
    case MAT_C_INT16:
      return converted<std::int16_t>(variable, data);
    case MAT_C_UINT16:
      return converted<std::uint16_t>(variable, data);
    case MAT_C_INT32:
      return converted<std::int32_t>(variable, data);
    case MAT_C_UINT32:
      return converted<std::uint32_t>(variable, data);
    case MAT_C_INT64:
      return converted<std::int64_t>(variable, data);
    default:
      return converted<std::uint64_t>(variable, data);
  }
}

/// Column of a matrix that the last index of a name chooses; the whole of a vector.
template <class Matrix>
Eigen::Matrix<typename Matrix::Scalar, Eigen::Dynamic, 1> chosen_column(const Matrix& values,
                                                                        std::optional<std::size_t> index,
                                                                        std::string_view name,
                                                                        const std::string& source) {
  const bool is_vector = values.rows() == 1 || values.cols() == 1;
  const Eigen::Index columns = is_vector ? 1 : values.cols();
  if (!is_vector && !index) {
    fail(source, ": '", name, "' is ", values.rows(), " x ", values.cols(), ", expected a vector; add [k] for ",
         "column k, 0 to ", columns - 1);
  }
  const std::size_t k = index.value_or(0);
  if (k >= static_cast<std::size_t>(columns)) {
    fail(source, ": '", name, "': column outside 0 to ", columns - 1, " of a ", values.rows(), " x ", values.cols(),
         is_vector ? " vector" : " matrix");
  }
  if (is_vector) return values.reshaped();
  return values.col(static_cast<Eigen::Index>(k));
}

}  // namespace

class MatFile::Impl {
 public:
  explicit Impl(const std::filesystem::path& path) : path_(path), source_(path.string()) {
    std::error_code code;
    if (!std::filesystem::exists(path, code)) fail(source_, ": cannot read: no such file");
    if (std::filesystem::is_directory(path, code)) fail(source_, ": cannot read: is a folder");
    file_.reset(Mat_Open(path.c_str(), MAT_ACC_RDONLY));
    if (!file_) fail(source_, ": cannot read: not a MAT file, or damaged");
    if (Mat_GetVersion(file_.get()) == MAT_FT_MAT73) {
      check_hdf5();
    } else {
      mat::check_not_truncated(path);
    }
  }

  [[nodiscard]] std::vector<MatVariable> variables() {
    std::vector<MatVariable> found;
    Mat_Rewind(file_.get());
    while (const Variable variable{Mat_VarReadNextInfo(file_.get())}) {
      if (variable->name != nullptr) list(variable->name, *variable, found);
    }
    return found;
  }

  /// The value at the end of the path; an index in its last part is left to the caller.
  [[nodiscard]] const matvar_t& find(const std::vector<NamePart>& path, std::string_view name) {
    const matvar_t* value = &top(path[0].name, name);
    for (std::size_t i = 1; i < path.size(); ++i) {
      if (value->class_type != MAT_C_STRUCT) fail_unknown(name);
      const std::size_t elements = element_count(*value);
      if (!path[i - 1].index && elements > 1) {
        fail(source_, ": '", name, "': '", path[i - 1].name, "' is an array of ", elements,
             " structs; choose one with ", path[i - 1].name, "[k], k = 0 to ", elements - 1);
      }
      const std::size_t element = path[i - 1].index.value_or(0);
      value = element < elements ? field(*value, path[i].name, element) : nullptr;
      if (value == nullptr) fail_unknown(name);
    }
    return *value;
  }

  [[nodiscard]] Eigen::MatrixXd numbers(const matvar_t& value, std::string_view name) const {
    check_full(value, name, "real numbers", value.isComplex == 0);
    return to_matrix(value, value.data);
  }

  [[nodiscard]] Eigen::MatrixXcd complex_numbers(const matvar_t& value, std::string_view name) const {
    check_full(value, name, "complex or real numbers", true);
    if (value.isComplex == 0) return to_matrix(value, value.data).cast<std::complex<double>>();
    const auto* const parts = static_cast<const mat_complex_split_t*>(value.data);
    if (parts->Re == nullptr || parts->Im == nullptr) fail_damaged(name);
    Eigen::MatrixXcd result(row_count(value), column_count(value));
    result.real() = to_matrix(value, parts->Re);
    result.imag() = to_matrix(value, parts->Im);
    return result;
  }

  [[nodiscard]] const std::string& source() const { return source_; }

 private:
  [[noreturn]] void fail_damaged(std::string_view name) const {
    fail(source_, ": '", name, "' cannot be read; the file is damaged");
  }

  /// `expected` names what `fits` says about the class.
  void check_full(const matvar_t& value, std::string_view name, const char* expected, bool fits) const {
    if (!is_numeric_class(value) || !fits) {
      fail(source_, ": '", name, "' holds ", type_of(value), " data, expected ", expected, " in a full matrix");
    }
    if (value.rank != 2) fail(source_, ": '", name, "' has ", value.rank, " dimensions, expected 2");
    if (element_count(value) == 0) {
      fail(source_, ": '", name, "' is empty (", row_count(value), " x ", column_count(value), ")");
    }
    const bool complex = value.isComplex != 0;
    const std::size_t bytes = element_count(value) * Mat_SizeOfClass(value.class_type);
    if (value.data == nullptr || (!complex && value.nbytes < bytes)) fail_damaged(name);
  }

  /// Fields of one struct are mostly asked for in a row, so the last variable read is kept.
  const matvar_t& top(const std::string& variable_name, std::string_view name) {
    if (!last_ || last_->name == nullptr || variable_name != last_->name) {
      last_.reset();
      const Variable info(Mat_VarReadInfo(file_.get(), variable_name.c_str()));
      if (!info) fail_unknown(name);
      verify_once();
      last_.reset(Mat_VarRead(file_.get(), variable_name.c_str()));
      if (!last_) fail_damaged(name);
    }
    return *last_;
  }

  /// matio takes a truncated HDF5 file for one without variables.
  void check_hdf5() const {
    const hid_t file = H5Fopen(path_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    if (file < 0) fail(source_, ": cannot read: truncated or damaged HDF5 file (MAT v7.3)");
    H5Fclose(file);
  }

  /// Listing variables does not need it, and it takes as long as reading the file.
  void verify_once() {
    if (verified_) return;
    mat::check_compressed_data(path_);
    verified_ = true;
  }

  [[noreturn]] void fail_unknown(std::string_view name) {
    constexpr std::size_t kMostNames = 30;
    const std::vector<MatVariable> found = variables();
    std::string names;
    for (std::size_t i = 0; i < std::min(found.size(), kMostNames); ++i) {
      names += compose(i == 0 ? "" : ", ", found[i].name, " (", found[i].rows, " x ", found[i].cols, " ", found[i].type,
                       ")");
    }
    if (found.size() > kMostNames) names += ", ...";
    fail(source_, ": no variable '", name, "'; the file holds ", names.empty() ? "nothing" : names);
  }

  std::filesystem::path path_;
  std::string source_;
  bool verified_ = false;
  File file_;
  Variable last_;
};

MatFile::MatFile(const std::filesystem::path& path) {
  const LibraryGuard guard;
  impl_ = std::make_unique<Impl>(path);
}

MatFile::~MatFile() {
  if (!impl_) return;
  const LibraryGuard guard;
  impl_.reset();
}

MatFile::MatFile(MatFile&&) noexcept = default;

MatFile& MatFile::operator=(MatFile&& other) noexcept {
  std::swap(impl_, other.impl_);
  return *this;
}

std::vector<MatVariable> MatFile::variables() const {
  const LibraryGuard guard;
  return impl_->variables();
}

Eigen::MatrixXd MatFile::matrix(std::string_view name) const {
  const LibraryGuard guard;
  const std::vector<NamePart> path = mat::parse_name(name, impl_->source());
  if (path.back().index) fail(impl_->source(), ": '", name, "' is one column, expected the name of a whole matrix");
  return impl_->numbers(impl_->find(path, name), name);
}

Eigen::VectorXd MatFile::vector(std::string_view name) const {
  const LibraryGuard guard;
  const std::vector<NamePart> path = mat::parse_name(name, impl_->source());
  return chosen_column(impl_->numbers(impl_->find(path, name), name), path.back().index, name, impl_->source());
}

Eigen::VectorXcd MatFile::complex_vector(std::string_view name) const {
  const LibraryGuard guard;
  const std::vector<NamePart> path = mat::parse_name(name, impl_->source());
  return chosen_column(impl_->complex_numbers(impl_->find(path, name), name), path.back().index, name, impl_->source());
}

double MatFile::scalar(std::string_view name) const {
  const Eigen::VectorXd values = vector(name);
  if (values.size() != 1) fail(impl_->source(), ": '", name, "' has ", values.size(), " elements, expected one number");
  return values[0];
}

std::vector<MatVariable> list_mat(const std::filesystem::path& path) { return MatFile(path).variables(); }

Eigen::VectorXd read_mat_vector(const std::filesystem::path& path, std::string_view name) {
  return MatFile(path).vector(name);
}

double read_mat_scalar(const std::filesystem::path& path, std::string_view name) { return MatFile(path).scalar(name); }

}  // namespace blockid
