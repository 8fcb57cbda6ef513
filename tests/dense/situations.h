/* Rows of a table: a system, options, and what is done in turn; a solve comes with its outcome */
#ifndef TESTS_SITUATIONS_H
#define TESTS_SITUATIONS_H

#include "run.h"
#include <cmath>
#include <memory>

using Parts = std::vector<std::string>;

/* [A B'; C D]; where they are empty B is C and D zero. With a name in spec A, C, f and g are those of SystemCreate() */
struct Saddle : DenseSystem {
  Dense B, D;
  Spec  spec;

  Saddle(const DenseSystem &d) : DenseSystem(d) { spec.name = NULL; }
  Saddle(const Spec &s) : spec(s) { }
  Dense Upper() const { return B.size() ? B.adjoint() : C.adjoint(); }
};

/* How blocks are stored: C' as a view of C, a matrix, or absent; multipliers first; vectors nested; crossed: run.h */
enum Storage {
  CROSSED  = 1,
  VIEW     = 2,
  EXPLICIT = 4,
  FIRST    = 8,
  NESTED   = 16
};

struct Live;
using Action = std::function<PetscErrorCode(Live &)>;

/* A row at work: d is what the program means, written what its matrices and vectors hold */
struct Live : Run {
  Saddle                   d, original, written;
  int                      storage;
  Mat                      Ct = NULL, D = NULL;
  PC                       pc = NULL;
  std::unique_ptr<Options> options;

  Live(const Saddle &s, int how) : d(s), original(s), written(s), storage(how) { }
  PetscErrorCode Create(); /* matrices and vectors, without a nest */
  PetscErrorCode Start(const std::string &options, const Action &blocks = nullptr); /* all, and the solver */
  PetscErrorCode Renew(const std::string &some); /* blocks "A", "B", "C" from d, and a nest for the solver */
  PetscErrorCode Write();                        /* what differs from d */
  PetscErrorCode Solve(bool transposed = false);
  PetscErrorCode Destroy();
};

/* What changes before the next solve */
Action Edit(const std::function<void(Saddle &)> &);
Action Original();
Action Reread(const std::string &options); /* in place of those so far */
Action Inner(const std::function<PetscErrorCode(KSP inner, PC pc)> &);
Action Limit(PetscInt steps);                                          /* of the inner solver */
Action Shell(PetscErrorCode (*apply)(PC, Vec, Vec), void *ctx = NULL); /* the inner preconditioner */
/* What is asked of a solve: small residuals where D is zero, in each row of C; x, or lambda too, of dense algebra */
Action Residuals(PetscReal primal = 1e-7, PetscReal constraint = 1e-10);
Action EqualX(PetscReal tolerance);
Action Equal(PetscReal tolerance, bool transposed = false);
/* of a failure: KSP_DIVERGED_PC_FAILED, the text of PCAinsworthGetFailure(), the reason of the PC, PC_NOERROR: any */
Action Fails(const Parts &why = {}, PCFailedReason failure = PC_NOERROR);
/* Solves: the first for a positive reason, the second for a negative one, which must not be where it is empty */
Action Either(const Action &good, const Action &bad, bool transposed = false);
Action Positive();
Action Negative();
Action Solved(PetscReal primal = 1e-7, PetscReal constraint = 1e-10);
Action Right(PetscReal tolerance);
Action Exact(PetscReal tolerance, bool nested = false, PetscReal rounding = 1e-14); /* the rows of C to rounding, too */
Action Failed(const Parts &why = {}, PCFailedReason failure = PC_NOERROR);
/* An error with this text in the solve, in the set-up, in a transposed solve */
Action Raised(PetscErrorCode code, const Parts &parts);
Action SetUpRaised(PetscErrorCode code, const Parts &parts);
Action TransposeRaised(PetscErrorCode code, const Parts &parts);

Action Viewed(const Parts &parts); /* in the text of KSPView() */
Action NotViewed(const std::string &part);
Action InnerType(const std::string &);
/* How often each of these happened since it was counted last; negative: this begins now */
Action Counted(const Parts &events, PetscInt expected = -1);
Action Both(const Action &, const Action &);

PetscErrorCode Failure(const Live &, std::string &why);
Column         RandomColumn(PetscInt size, PetscInt seed);
/* A chain of springs with this diagonal, and rows of C, f and g at random */
DenseSystem Chain(PetscInt n, PetscInt m, PetscReal diagonal);
/* One row; its blocks, not yet in a nest, may be replaced by others before */
PetscErrorCode Row(const std::string &name, const Saddle &, const std::string &options, const std::vector<Action> &,
                   int storage = 0, const Action &blocks = nullptr);

PetscErrorCode WithoutZeros(Live &); /* replaces A and C by their nonzero entries, without zeros on the diagonal of A */
PetscErrorCode Stored(Live &, MPI_Comm); /* the same on a communicator with the same ranks */
std::string    Text(const char *format, ...) PETSC_ATTRIBUTE_FORMAT(1, 2);

/* Tables, and parts of them in other files */
PetscErrorCode Dependent();
PetscErrorCode InnerSolver();
PetscErrorCode Loose();
PetscErrorCode Monitored();
PetscErrorCode NoStiffness();
PetscErrorCode NullSpaces();
PetscErrorCode Rebuilt();
PetscErrorCode Refusals();
PetscErrorCode Sequences();
PetscErrorCode Systems();
PetscErrorCode Truth();
PetscErrorCode Unusual();
PetscErrorCode Views();
PetscErrorCode Mended();
PetscErrorCode Smoothers();
PetscErrorCode Stops();

#endif
