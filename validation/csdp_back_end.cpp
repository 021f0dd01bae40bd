#include <blockid/validation/csdp_back_end.hpp>

#include <blockid/data/error.hpp>
#include <blockid/validation/isolated_call.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>
#include <tuple>

#ifdef BLOCKID_HAS_CSDP
#include <csdp/declarations.h>
#include <dlfcn.h>
#endif

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

void check_entries(const SemidefiniteProgramme& programme, const std::vector<SemidefiniteEntry>& entries) {
  std::set<std::tuple<Index, Index, Index>> seen;
  for (const SemidefiniteEntry& e : entries) {
    if (e.block < 0 || e.block >= static_cast<Index>(programme.blocks.size())) {
      fail("semidefinite programme: expected a block below ", programme.blocks.size(), ", got ", e.block);
    }
    const SemidefiniteBlock& block = programme.blocks[static_cast<std::size_t>(e.block)];
    if (e.row < 0 || e.row > e.column || e.column >= block.size || (block.diagonal && e.row != e.column)) {
      fail("semidefinite programme: expected an entry of the upper triangle of a ",
           block.diagonal ? "diagonal" : "symmetric", " block of size ", block.size, ", got (", e.row, ", ", e.column,
           ")");
    }
    if (!std::isfinite(e.value)) fail("semidefinite programme: expected finite entries, got ", e.value);
    if (!seen.emplace(e.block, e.row, e.column).second) {
      fail("semidefinite programme: entry (", e.row, ", ", e.column, ") of block ", e.block, " is given twice");
    }
  }
}

void check(const SemidefiniteProgramme& programme) {
  const Index count = programme.cost.size();
  if (count < 1 || static_cast<Index>(programme.matrices.size()) != count) {
    fail("semidefinite programme: expected as many matrices as costs, at least 1, got ", programme.matrices.size(),
         " and ", count);
  }
  if (!programme.cost.allFinite()) fail("semidefinite programme: expected finite costs");
  for (const SemidefiniteBlock& block : programme.blocks) {
    if (block.size < 1) fail("semidefinite programme: expected blocks of size 1 or more, got ", block.size);
  }
  check_entries(programme, programme.constant);
  for (const std::vector<SemidefiniteEntry>& matrix : programme.matrices) check_entries(programme, matrix);
}

#ifdef BLOCKID_HAS_CSDP

/// Zeros in an array that CSDP may free; the end of the child when there is no memory.
template <class T>
T* allocated(std::size_t count) {
  void* memory = std::calloc(count, sizeof(T));
  if (memory == nullptr) std::abort();
  return static_cast<T*>(memory);
}

blockmatrix block_matrix(const SemidefiniteProgramme& programme) {
  blockmatrix c{};
  c.nblocks = static_cast<int>(programme.blocks.size());
  c.blocks = allocated<blockrec>(programme.blocks.size() + 1);
  for (std::size_t b = 0; b < programme.blocks.size(); ++b) {
    const std::size_t size = static_cast<std::size_t>(programme.blocks[b].size);
    blockrec& record = c.blocks[b + 1];
    record.blocksize = static_cast<int>(size);
    record.blockcategory = programme.blocks[b].diagonal ? DIAG : MATRIX;
    if (programme.blocks[b].diagonal) {
      record.data.vec = allocated<double>(size + 1);
    } else {
      record.data.mat = allocated<double>(size * size);
    }
  }
  for (const SemidefiniteEntry& e : programme.constant) {
    const std::size_t b = static_cast<std::size_t>(e.block);
    const std::size_t size = static_cast<std::size_t>(programme.blocks[b].size);
    const std::size_t row = static_cast<std::size_t>(e.row);
    const std::size_t column = static_cast<std::size_t>(e.column);
    if (programme.blocks[b].diagonal) {
      c.blocks[b + 1].data.vec[row + 1] = e.value;
    } else {
      c.blocks[b + 1].data.mat[row + column * size] = e.value;
      c.blocks[b + 1].data.mat[column + row * size] = e.value;
    }
  }
  return c;
}

/// The entries of one matrix in one block, counted from 1; null when there are none.
sparseblock* sparse_block(const SemidefiniteProgramme& programme, std::size_t matrix, Index block) {
  const std::vector<SemidefiniteEntry>& all = programme.matrices[matrix];
  const auto in_block = [block](const SemidefiniteEntry& e) { return e.block == block && e.value != 0.0; };
  const std::size_t count = static_cast<std::size_t>(std::count_if(all.begin(), all.end(), in_block));
  if (count == 0) return nullptr;
  sparseblock* sparse = allocated<sparseblock>(1);
  sparse->entries = allocated<double>(count + 1);
  sparse->iindices = allocated<int>(count + 1);
  sparse->jindices = allocated<int>(count + 1);
  sparse->blocknum = static_cast<int>(block + 1);
  sparse->blocksize = static_cast<int>(programme.blocks[static_cast<std::size_t>(block)].size);
  sparse->constraintnum = static_cast<int>(matrix + 1);
  for (const SemidefiniteEntry& e : all) {
    if (!in_block(e)) continue;
    const int k = ++sparse->numentries;
    sparse->entries[k] = e.value;
    sparse->iindices[k] = static_cast<int>(e.row + 1);
    sparse->jindices[k] = static_cast<int>(e.column + 1);
  }
  return sparse;
}

constraintmatrix* constraint_matrices(const SemidefiniteProgramme& programme) {
  constraintmatrix* matrices = allocated<constraintmatrix>(programme.matrices.size() + 1);
  for (std::size_t i = 0; i < programme.matrices.size(); ++i) {
    // From the last block to the first: each goes before those that are there.
    for (Index b = static_cast<Index>(programme.blocks.size()) - 1; b >= 0; --b) {
      sparseblock* sparse = sparse_block(programme, i, b);
      if (sparse == nullptr) continue;
      sparse->next = matrices[i + 1].blocks;
      matrices[i + 1].blocks = sparse;
    }
  }
  return matrices;
}

/// The library and its BLAS in one thread; null when it is not there. Only the child asks.
void* load_csdp() {
  setenv("OPENBLAS_NUM_THREADS", "1", 1);
  setenv("OMP_NUM_THREADS", "1", 1);
  void* library = dlopen("libsdp.so.0", RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return nullptr;
  // For a BLAS that was there already and has read the environment.
  if (void* set_threads = dlsym(library, "openblas_set_num_threads"); set_threads != nullptr) {
    reinterpret_cast<void (*)(int)>(set_threads)(1);
  }
  return library;
}

/// code, primal, dual, y.
std::vector<double> run_csdp(const SemidefiniteProgramme& programme) {
  void* library = load_csdp();
  if (library == nullptr) return {};
  const auto start = reinterpret_cast<decltype(&initsoln)>(dlsym(library, "initsoln"));
  const auto solve = reinterpret_cast<decltype(&easy_sdp)>(dlsym(library, "easy_sdp"));
  if (start == nullptr || solve == nullptr) return {};
  int order = 0;
  for (const SemidefiniteBlock& block : programme.blocks) order += static_cast<int>(block.size);
  const int count = static_cast<int>(programme.cost.size());
  const blockmatrix c = block_matrix(programme);
  constraintmatrix* matrices = constraint_matrices(programme);
  double* cost = allocated<double>(static_cast<std::size_t>(count) + 1);
  std::copy(programme.cost.begin(), programme.cost.end(), cost + 1);
  blockmatrix x{};
  blockmatrix z{};
  double* y = nullptr;
  std::vector<double> answer(3);
  start(order, count, c, cost, matrices, &x, &y, &z);
  answer[0] = solve(order, count, c, cost, matrices, 0.0, &x, &y, &z, &answer[1], &answer[2]);
  answer.insert(answer.end(), y + 1, y + 1 + count);
  return answer;
}

#endif

}  // namespace

SemidefiniteProgramme hankel_form(const UncertaintyProgramme& programme, double gamma) {
  const Index rows = programme.a.rows();
  const Index n = programme.a.cols();
  if (rows < 1 || n < 1 || programme.w.size() != rows) {
    fail("hankel form: expected as many rows as samples of w, at least 1, got ", rows, " and ", programme.w.size());
  }
  if (!(gamma >= 0.0)) fail("hankel form: expected a noise bound of at least 0, got ", gamma);
  SemidefiniteProgramme form;
  form.blocks = {{n, false}, {n, false}, {2 * rows, true}};
  form.cost = VectorXd::Unit(n + 1, n);
  form.matrices.resize(static_cast<std::size_t>(n + 1));
  for (Index t = 0; t < rows; ++t) {
    form.constant.push_back({2, t, t, programme.w[t] - gamma});
    form.constant.push_back({2, rows + t, rows + t, -programme.w[t] - gamma});
  }
  for (Index k = 0; k < n; ++k) {
    std::vector<SemidefiniteEntry>& matrix = form.matrices[static_cast<std::size_t>(k)];
    for (Index i = 0; 2 * i <= n - 1 - k; ++i) {
      matrix.push_back({0, i, n - 1 - k - i, 1.0});
      matrix.push_back({1, i, n - 1 - k - i, -1.0});
    }
    for (Index t = 0; t < rows; ++t) {
      matrix.push_back({2, t, t, programme.a(t, k)});
      matrix.push_back({2, rows + t, rows + t, -programme.a(t, k)});
    }
  }
  for (Index i = 0; i < n; ++i) {
    form.matrices.back().push_back({0, i, i, 1.0});
    form.matrices.back().push_back({1, i, i, 1.0});
  }
  return form;
}

#ifdef BLOCKID_HAS_CSDP

bool csdp_available() {
  const auto loads = [] { return std::vector<double>{load_csdp() != nullptr ? 1.0 : 0.0}; };
  return call_isolated(loads, 60.0) == std::vector<double>{1.0};
}

CsdpSolution solve_with_csdp(const SemidefiniteProgramme& programme, double time_limit_s) {
  check(programme);
  const std::vector<double> answer = call_isolated([&] { return run_csdp(programme); }, time_limit_s);
  if (answer.size() != 3 + programme.matrices.size()) fail("CSDP: the library libsdp.so.0 cannot be loaded");
  return {static_cast<int>(answer[0]), answer[1], answer[2],
          Eigen::Map<const VectorXd>(answer.data() + 3, programme.cost.size())};
}

#else

bool csdp_available() { return false; }

CsdpSolution solve_with_csdp(const SemidefiniteProgramme& programme, double) {
  check(programme);
  fail("CSDP: blockid was built without its header csdp/declarations.h (Debian: libsdp-dev)");
}

#endif

}  // namespace blockid
