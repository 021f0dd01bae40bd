/// The dense decompositions of real matrices and the kernels of dense products, compiled once in
/// dense_decompositions.cpp instead of in every source that uses one. Precompiled into our own targets; nothing has to
/// include it.
#pragma once

#include <Eigen/Dense>

#ifndef BLOCKID_DECOMPOSITION
#define BLOCKID_DECOMPOSITION extern template
#endif

// The members named here are those of Eigen 3.4; with another version each source compiles its own, as usual.
#if EIGEN_VERSION_AT_LEAST(3, 4, 0) && !EIGEN_VERSION_AT_LEAST(3, 4, 90)
namespace Eigen {
BLOCKID_DECOMPOSITION EigenSolver<MatrixXd>& EigenSolver<MatrixXd>::compute(const EigenBase<MatrixXd>&, bool);
BLOCKID_DECOMPOSITION EigenSolver<Matrix<long double, Dynamic, Dynamic>>&
EigenSolver<Matrix<long double, Dynamic, Dynamic>>::compute(const EigenBase<Matrix<long double, Dynamic, Dynamic>>&,
                                                            bool);
BLOCKID_DECOMPOSITION SelfAdjointEigenSolver<MatrixXd>& SelfAdjointEigenSolver<MatrixXd>::compute(
    const EigenBase<MatrixXd>&, int);
BLOCKID_DECOMPOSITION JacobiSVD<MatrixXd>& JacobiSVD<MatrixXd>::compute(const MatrixXd&, unsigned int);
BLOCKID_DECOMPOSITION void HouseholderQR<MatrixXd>::computeInPlace();
BLOCKID_DECOMPOSITION void HouseholderQR<MatrixXd>::_solve_impl(const VectorXd&, VectorXd&) const;
BLOCKID_DECOMPOSITION void ColPivHouseholderQR<MatrixXd>::computeInPlace();
BLOCKID_DECOMPOSITION void ColPivHouseholderQR<MatrixXd>::_solve_impl(const VectorXd&, VectorXd&) const;
BLOCKID_DECOMPOSITION void PartialPivLU<MatrixXd>::compute();
BLOCKID_DECOMPOSITION LLT<MatrixXd>& LLT<MatrixXd>::compute(const EigenBase<MatrixXd>&);

namespace internal {
using RealTraits = gebp_traits<double, double>;
using RealColumns = const_blas_data_mapper<double, Index, ColMajor>;
using RealRows = const_blas_data_mapper<double, Index, RowMajor>;

BLOCKID_DECOMPOSITION struct gebp_kernel<double, double, Index, blas_data_mapper<double, Index, ColMajor, Unaligned, 1>,
                                         RealTraits::mr, RealTraits::nr, false, false>;
BLOCKID_DECOMPOSITION struct gemm_pack_lhs<double, Index, RealColumns, RealTraits::mr, RealTraits::LhsProgress,
                                           RealTraits::LhsPacket4Packing, ColMajor>;
BLOCKID_DECOMPOSITION struct gemm_pack_lhs<double, Index, RealRows, RealTraits::mr, RealTraits::LhsProgress,
                                           RealTraits::LhsPacket4Packing, RowMajor>;
BLOCKID_DECOMPOSITION struct gemm_pack_rhs<double, Index, RealColumns, RealTraits::nr, ColMajor>;
BLOCKID_DECOMPOSITION struct gemm_pack_rhs<double, Index, RealRows, RealTraits::nr, RowMajor>;
BLOCKID_DECOMPOSITION struct general_matrix_vector_product<Index, double, RealColumns, ColMajor, false, double,
                                                           RealRows, false>;
BLOCKID_DECOMPOSITION struct general_matrix_vector_product<Index, double, RealColumns, ColMajor, false, double,
                                                           RealColumns, false>;
BLOCKID_DECOMPOSITION struct general_matrix_vector_product<Index, double, RealRows, RowMajor, false, double,
                                                           RealColumns, false>;
}  // namespace internal
}  // namespace Eigen
#endif

#undef BLOCKID_DECOMPOSITION
