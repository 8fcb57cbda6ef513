/* Small saddle-point systems that are the same on any number of ranks, their dense twins in Eigen, and checks */
#ifndef TESTS_DENSE_H
#define TESTS_DENSE_H

#include <petscainsworth.h>
#include <base/petsccompat.h>
#include <Eigen/Dense>
#include <functional>
#include <string>
#include <vector>

using Dense  = Eigen::Matrix<PetscScalar, Eigen::Dynamic, Eigen::Dynamic>;
using Column = Eigen::Matrix<PetscScalar, Eigen::Dynamic, 1>;

/*
   Two bodies, each half of the unknowns, held together by C alone: A is block diagonal, each row of C ties one unknown
   of body 1 to some of body 0. Values are hashes of the seed and the indices.
*/
struct Spec {
  const char *name = "plain";
  PetscInt    n = 24, m = 5;
  PetscInt    seed      = 1;
  PetscInt    bs        = 1;
  bool        symmetric = true;
  /* body 1 floats: Ker A has dimension 1, and Ker A and Ker C have only 0 in common */
  bool      semidefinite = false;
  PetscReal jump         = 1.0;   /* stiffness of body 1 over that of body 0 */
  PetscReal rowscale     = 0.0;   /* rows of C times 10^u, u between -rowscale and rowscale */
  bool      uneven       = false; /* all rows of C on the last rank, no unknowns at all on rank 1 */
  bool      zeroRows     = false; /* every third row of C is zero, some of them stored */
};

struct System {
  Mat A = NULL, C = NULL;
  Vec f = NULL, g = NULL;
  Vec w = NULL; /* a positive weight, length n */
};

PetscReal         Uniform(PetscInt seed, PetscInt i, PetscInt j); /* in [-1, 1) */
PetscErrorCode    SystemCreate(MPI_Comm, const Spec &, System *);
PetscErrorCode    SystemDestroy(System *);
PetscErrorCode    SetRandom(Vec, PetscInt seed);
std::vector<Spec> UsualSpecs(); /* one for each difficulty */

/* [A Ct; C D] or, multipliers first, [D C; Ct A]; two of Ct, C, D may be NULL */
PetscErrorCode NestCreate(Mat A, Mat Ct, Mat C, Mat D, bool first, Mat *nest);
/* M by its products alone, or with its diagonal, or with the products of its transpose */
PetscErrorCode ShellCreate(Mat M, bool diagonal, bool transpose, Mat *shell);
/* KSPPREONLY with PCAINSWORTH and all options read */
PetscErrorCode SolverCreate(Mat, KSP *);
/*
   sets options, "-a 1 -b" for instance; at the end of its scope it clears them. Those that were not used fail the test
*/
extern std::string unusedOptions;
class Options {
public:
  explicit Options(const std::string &line);
  ~Options();
  Options(const Options &)            = delete;
  Options &operator=(const Options &) = delete;

private:
  std::vector<std::string> names;
};

/* Everything on every rank */
PetscErrorCode Gather(Vec, Column &);
PetscErrorCode Gather(Mat, Dense &); /* by products with the unit vectors */
PetscErrorCode GatherOperator(Vec in, Vec out, const std::function<PetscErrorCode(Vec, Vec)> &, Dense &);
PetscErrorCode Scatter(const Column &, Vec);

struct DenseSystem {
  Dense  A, C;
  Column f, g, w;
};
PetscErrorCode Gather(const System &, DenseSystem &);

/* The formulas of the method, from dense A, C and the diagonals of W and B */
struct DenseProjector {
  Dense S, R, P, Q;
  DenseProjector(const Dense &C, const Column &W);
};
Column DiagonalWeight(const Dense &A);
void   WeighLoose(const Dense &C, Column &W);
Column RowPenalty(const Dense &A, const Dense &C, PetscReal factor = 1.0);
Dense  ReducedOperator(const Dense &A, const Dense &C, const Dense &Q, const Column &B);
/* x and lambda of the full system, by LU with full pivoting after scaling */
void SolveSaddle(const DenseSystem &, Column &x, Column &lambda);

/* Checks: the same verdict on all ranks; a check that fails is printed with the label of Case() */
PETSC_EXTERN void Case(const char *format, ...) PETSC_ATTRIBUTE_FORMAT(1, 2);
PetscErrorCode    Check(const char *what, PetscReal got, PetscReal bound);
PetscErrorCode    CheckTrue(const char *what, bool got);
PetscErrorCode    CheckInt(const char *what, PetscInt got, PetscInt expected);
/* relative, Frobenius norm */
PetscErrorCode CheckEqual(const char *what, const Dense &got, const Dense &expected, PetscReal tolerance);
PetscErrorCode CheckText(const char *what, const std::string &got, const std::vector<std::string> &parts);
/* the action fails with this code and a message with these parts, on every rank */
PetscErrorCode CheckError(const char *what, const std::function<PetscErrorCode()> &action, PetscErrorCode code,
                          const std::vector<std::string> &parts);
PetscErrorCode ChecksFinish(int *exitcode);
/*
   Of a sanitizer, if the program has one: at its end it would be too late, as MPI unloads before what tells where its
   own memory belongs
*/
void CheckLeaks();
/* what KSPView() writes, the same on all ranks, and the text of a file, which is removed */
PetscErrorCode ViewText(KSP, std::string &, PetscViewerFormat = PETSC_VIEWER_ASCII_INFO_DETAIL);
PetscErrorCode FileText(const char *file, std::string &);
/* calls of a log event so far; needs PetscLogDefaultBegin() */
PetscErrorCode EventCount(const char *event, PetscInt *count);

#endif
