// Small-matrix algebra by four libraries (docs/decisions/0013): src/gp/linalg, Eigen as the library is compiled, Eigen
// compiled for AVX2 and FMA (this file compiled a second time, its Eigen in another namespace), and any BLAS named by
// SILA_BENCH_BLAS=path.so. Compare within one run:
//
//   bench_gp_linalg --benchmark_repetitions=15 --benchmark_enable_random_interleaving=true
#include <Eigen/Cholesky>
#include <Eigen/Core>

/// Column-major matrices without padding; lower triangles. C is n x n.
struct Algebra {
  void (*potrf)(int n, double* a);                                        ///< A -> L
  void (*trsm)(int n, const double* l, double* x);                        ///< X -> L^-1 X
  void (*syrk)(int n, const double* a, double* c);                        ///< C -> C - A A', the lower triangle
  void (*gemm)(int n, const double* a, const double* b, double* c);       ///< C -> C - A B
  void (*posterior)(int n, const double* k, const double* g, double* t);  ///< T of docs/gp.md, section 3
  /// Mean of two outputs and variance at x. Shapes: z and w n x 2, x 2, said 3.
  void (*predict)(int n, const double* z, const double* w, const double* t, const double* x, double* said);
};

namespace {

using Matrix = Eigen::Map<Eigen::MatrixXd>;
using ConstMatrix = Eigen::Map<const Eigen::MatrixXd>;

void eigen_potrf(int n, double* a) {
  Matrix matrix(a, n, n);
  Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(matrix);
}

void eigen_trsm(int n, const double* l, double* x) {
  Matrix result(x, n, n);
  ConstMatrix(l, n, n).triangularView<Eigen::Lower>().solveInPlace(result);
}

void eigen_syrk(int n, const double* a, double* c) {
  Matrix result(c, n, n);
  result.selfadjointView<Eigen::Lower>().rankUpdate(ConstMatrix(a, n, n), -1.0);
}

void eigen_gemm(int n, const double* a, const double* b, double* c) {
  Matrix(c, n, n).noalias() -= ConstMatrix(a, n, n) * ConstMatrix(b, n, n);
}

/// Reversing rows and columns makes the upper factor of I - B^-1 = S'S a lower one.
void eigen_posterior(int n, const double* k, const double* g, double* t) {
  const Eigen::LLT<Eigen::MatrixXd> lower(ConstMatrix(k, n, n));
  const Eigen::MatrixXd b = ConstMatrix(g, n, n) + Eigen::MatrixXd::Identity(n, n);
  const Eigen::LLT<Eigen::MatrixXd> factor(b);
  const Eigen::MatrixXd root = factor.matrixL().solve(Eigen::MatrixXd::Identity(n, n));
  Eigen::MatrixXd difference = Eigen::MatrixXd::Identity(n, n);
  difference.selfadjointView<Eigen::Lower>().rankUpdate(root.transpose(), -1.0);
  difference = Eigen::MatrixXd(difference.selfadjointView<Eigen::Lower>()).reverse().eval();
  difference.diagonal().array() += 1e-14;
  const Eigen::LLT<Eigen::MatrixXd> reversed(difference);
  Matrix result(t, n, n);
  result = Eigen::MatrixXd(reversed.matrixL()).reverse().transpose();
  lower.matrixL().solveInPlace<Eigen::OnTheRight>(result);
}

void eigen_predict(int n, const double* z, const double* w, const double* t, const double* x, double* said) {
  const auto points = ConstMatrix(z, n, 2).array();
  const Eigen::VectorXd k = (-0.5 * ((points.col(0) - x[0]).square() + (points.col(1) - x[1]).square())).exp().matrix();
  Eigen::Vector2d::Map(said) = ConstMatrix(w, n, 2).transpose() * k;
  const Eigen::VectorXd explained = ConstMatrix(t, n, n).triangularView<Eigen::Lower>() * k;
  said[2] = 1.0 - explained.squaredNorm();
}

}  // namespace

#ifdef SILA_ALGEBRA  // the second time
extern const Algebra SILA_ALGEBRA;
const Algebra SILA_ALGEBRA = {eigen_potrf, eigen_trsm, eigen_syrk, eigen_gemm, eigen_posterior, eigen_predict};
#else

#include <benchmark/benchmark.h>
#include <dlfcn.h>
#include <malloc.h>

#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "gp/linalg/blas.hpp"
#include "sila/gp/posterior.hpp"

extern const Algebra eigen_avx2;

namespace {

using sila::detail::PaddedMatrix;

const Algebra eigen = {eigen_potrf, eigen_trsm, eigen_syrk, eigen_gemm, eigen_posterior, eigen_predict};

void own_posterior(int n, const double* k, const double* g, double* t) {
  PaddedMatrix lower(Eigen::MatrixXd(ConstMatrix(k, n, n))), b = PaddedMatrix::reversed(ConstMatrix(g, n, n));
  b.matrix().diagonal().array() += 1.0;
  benchmark::DoNotOptimize(sila::detail::potrf(lower) && sila::detail::potrf(b));
  PaddedMatrix difference(n, n);
  difference.matrix().diagonal().setOnes();
  sila::detail::syrk_triangular(difference, sila::detail::trtri(b));
  difference.matrix().diagonal().array() += 1e-14;
  benchmark::DoNotOptimize(sila::detail::potrf(difference));
  PaddedMatrix result = transposed_reversed(difference);
  sila::detail::trsm_right_triangular(result, lower);
  Matrix(t, n, n) = result.matrix();
}

// A BLAS that is loaded when the program runs, by the names of its Fortran interface.
extern "C" {
using Potrf = void(const char*, const int*, double*, const int*, int*);
using Trsm = void(const char*, const char*, const char*, const char*, const int*, const int*, const double*,
                  const double*, const int*, double*, const int*);
using Syrk = void(const char*, const char*, const int*, const int*, const double*, const double*, const int*,
                  const double*, double*, const int*);
using Gemm = void(const char*, const char*, const int*, const int*, const int*, const double*, const double*,
                  const int*, const double*, const int*, const double*, double*, const int*);
}
Potrf* dpotrf = nullptr;
Trsm* dtrsm = nullptr;
Syrk* dsyrk = nullptr;
Gemm* dgemm = nullptr;
constexpr double plus_one = 1.0, minus_one = -1.0;

void blas_potrf(int n, double* a) {
  int info = 0;
  dpotrf("L", &n, a, &n, &info);
}

void blas_trsm(int n, const double* l, double* x) {
  dtrsm("L", "L", "N", "N", &n, &n, &plus_one, l, &n, x, &n);
}

void blas_syrk(int n, const double* a, double* c) {
  dsyrk("L", "N", &n, &n, &minus_one, a, &n, &plus_one, c, &n);
}

void blas_gemm(int n, const double* a, const double* b, double* c) {
  dgemm("N", "N", &n, &n, &n, &minus_one, a, &n, b, &n, &plus_one, c, &n);
}

void blas_posterior(int n, const double* k, const double* g, double* t) {
  Eigen::MatrixXd lower = ConstMatrix(k, n, n), b = ConstMatrix(g, n, n) + Eigen::MatrixXd::Identity(n, n);
  blas_potrf(n, lower.data());
  blas_potrf(n, b.data());
  Eigen::MatrixXd root = Eigen::MatrixXd::Identity(n, n), difference = root;
  blas_trsm(n, b.data(), root.data());
  dsyrk("L", "T", &n, &n, &minus_one, root.data(), &n, &plus_one, difference.data(), &n);
  Eigen::MatrixXd reversed = Eigen::MatrixXd(difference.selfadjointView<Eigen::Lower>()).reverse();
  reversed.diagonal().array() += 1e-14;
  blas_potrf(n, reversed.data());
  Matrix(t, n, n) = Eigen::MatrixXd(reversed.triangularView<Eigen::Lower>()).reverse().transpose();
  dtrsm("R", "L", "N", "N", &n, &n, &plus_one, lower.data(), &n, t, &n);
}

const Algebra blas = {blas_potrf, blas_trsm, blas_syrk, blas_gemm, blas_posterior, nullptr};

struct Matrices {
  Eigen::MatrixXd general, other, positive, lower, information;

  explicit Matrices(int n) {
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    const auto draw = [&] { return normal(random); };
    general = Eigen::MatrixXd::NullaryExpr(n, n, draw);
    other = Eigen::MatrixXd::NullaryExpr(n, n, draw);
    information = other * other.transpose();
    positive = general * general.transpose() + n * Eigen::MatrixXd::Identity(n, n);
    lower = positive.llt().matrixL();
  }
};

/// Each operation begins with a copy of what it overwrites.
template <class Start, class Operation>
void add(const std::string& name, const Start& start, Operation operation) {
  benchmark::RegisterBenchmark(name.c_str(),
                               [start, operation](benchmark::State& state) {
                                 const Matrices of(static_cast<int>(state.range(0)));
                                 const auto original = start(of);
                                 auto result = original;
                                 const auto in_place = operation(of);
                                 for (auto _ : state) {
                                   result = original;
                                   in_place(result);
                                   benchmark::DoNotOptimize(result);
                                 }
                               })
      ->Arg(20)
      ->Arg(60)
      ->Arg(120)
      ->Unit(benchmark::kMicrosecond);
}

const auto positive = [](const Matrices& of) { return of.positive; };
const auto general = [](const Matrices& of) { return of.general; };
int size(const Eigen::MatrixXd& a) {
  return static_cast<int>(a.rows());
}

void add(const std::string& name, const Algebra& algebra, bool lapack) {
  using Eigen::MatrixXd;
  const Algebra* const a = &algebra;
  if (lapack)
    add("potrf/" + name, positive, [a](const Matrices&) { return [a](MatrixXd& x) { a->potrf(size(x), x.data()); }; });
  add("trsm/" + name, general,
      [a](const Matrices& of) { return [a, &of](MatrixXd& x) { a->trsm(size(x), of.lower.data(), x.data()); }; });
  add("syrk/" + name, positive,
      [a](const Matrices& of) { return [a, &of](MatrixXd& x) { a->syrk(size(x), of.general.data(), x.data()); }; });
  add("gemm/" + name, positive, [a](const Matrices& of) {
    return [a, &of](MatrixXd& x) { a->gemm(size(x), of.general.data(), of.other.data(), x.data()); };
  });
  if (a->predict)
    add("predict/" + name, general, [a](const Matrices& of) {
      return [a, &of](MatrixXd& x) {
        const double* const z = of.general.data();
        a->predict(size(x), z, of.other.data(), of.lower.data(), of.other.data(), x.data());
      };
    });
  if (!lapack) return;
  add("posterior/" + name, general, [a](const Matrices& of) {
    return [a, &of](MatrixXd& x) { a->posterior(size(x), of.positive.data(), of.information.data(), x.data()); };
  });
}

void add_own() {
  const auto padded_positive = [](const Matrices& of) { return PaddedMatrix(of.positive); };
  const auto padded_general = [](const Matrices& of) { return PaddedMatrix(of.general); };
  add("potrf/own", padded_positive,
      [](const Matrices&) { return [](PaddedMatrix& x) { benchmark::DoNotOptimize(sila::detail::potrf(x)); }; });
  add("trsm/own", padded_general, [](const Matrices& of) {
    return [l = PaddedMatrix::factor(of.lower)](PaddedMatrix& x) { sila::detail::trsm_left(x, l); };
  });
  add("syrk/own", padded_positive, [](const Matrices& of) {
    return [a = PaddedMatrix(of.general)](PaddedMatrix& x) { sila::detail::gemmt(x, a, transposed(a)); };
  });
  add("gemm/own", padded_positive, [](const Matrices& of) {
    return [a = PaddedMatrix(of.general), b = PaddedMatrix(of.other)](PaddedMatrix& x) { sila::detail::gemm(x, a, b); };
  });
  add("predict/own", general, [](const Matrices& of) {
    const Eigen::MatrixXd z = of.general.leftCols(2).transpose();
    const sila::SparseGp prior = sila::prior_gp({1.0, Eigen::Vector2d::Ones()}, 0.1, z, Eigen::Vector2d::Zero());
    const sila::Posterior posterior(sila::condition(prior, z, of.other.leftCols(2)));
    const Eigen::Vector2d at = of.other.col(0).head(2);
    return [posterior, at](Eigen::MatrixXd& x) {
      const sila::FlowPrediction said = posterior.predict_flow(at);
      x(0, 0) = said.mean.x(), x(1, 0) = said.mean.y(), x(2, 0) = said.variance;
    };
  });
  add("posterior/own", general, [](const Matrices& of) {
    return [&of](Eigen::MatrixXd& x) { own_posterior(size(x), of.positive.data(), of.information.data(), x.data()); };
  });
}

template <class Function>
void find(void* library, const char* name, Function*& function) {
  function = reinterpret_cast<Function*>(dlsym(library, name));
}

}  // namespace

int main(int argc, char** argv) {
  mallopt(M_TRIM_THRESHOLD, 1 << 30);  // else each call may fetch its memory from the system anew
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  add_own();
  add("eigen", eigen, true);
  add("eigen_avx2", eigen_avx2, true);
  if (const char* path = std::getenv("SILA_BENCH_BLAS")) {
    void* const library = dlopen(path, RTLD_NOW);
    if (!library) return 1;
    find(library, "dpotrf_", dpotrf), find(library, "dtrsm_", dtrsm), find(library, "dsyrk_", dsyrk);
    find(library, "dgemm_", dgemm);
    add("blas", blas, dpotrf != nullptr);
  }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
#endif
