/*
   Saddle points as programs write them: small seeded generators, each with its truth in extended precision

       [ A  B' ] [ x ]   [ f ]
       [ C -D  ] [ l ] = [ g ]
*/
#ifndef TESTS_SYSTEMS_H
#define TESTS_SYSTEMS_H

#include "randomsystem.h"

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

/* How the program stores what is above */
enum Convention {
  PLAIN,   /* as above */
  NEGATED, /* all of it with the other sign */
  FLIPPED, /* [A B'; -C D]: the second equation with the other sign */
  OPPOSITE /* [A -B'; C D]: the multipliers with the other sign */
};

struct Saddle {
  std::string family, name;
  Matrix      A, B, C, D; /* D: 0 x 0 where the program passes no block */
  Vector      f, g;
  Convention  convention = PLAIN;
  bool        first      = false; /* the multipliers come first */
  int         bs         = 1;
  bool        solvable = true, unique = true; /* what the generator means it to be; the truth is asked whether it is */
  Matrix      block[2][2];                    /* as stored, x first */
  Vector      rhs[2];
};

/* Generators are called when their system is wanted */
struct Entry {
  std::string                   family, name;
  std::function<void(Saddle &)> make;
};
using Entries = std::vector<Entry>;

/* One file for each kind of program that writes such systems */
void AddContact(Entries &);
void AddMultipliers(Entries &); /* other layouts of contact: active sets, double multipliers, signs */
void AddOptimization(Entries &);
void AddFlow(Entries &);
void AddStructures(Entries &);
void AddPrograms(Entries &);

Random SaddleRandom(const std::string &name); /* another stream for each name */

/* fem.cpp: Q1 elements on nx x ny rectangles of a box; node (i, j) is j (nx + 1) + i, as in all of these */
struct Grid {
  int    nx, ny;
  double lx = 1.0, ly = 1.0;
  int    Nodes() const { return (nx + 1) * (ny + 1); }
  int    Node(int i, int j) const { return j * (nx + 1) + i; }
};
using Coefficient = std::function<double(int i, int j)>; /* of element (i, j) */
Matrix Laplacian(const Grid &, const Coefficient &);
Matrix Mass(const Grid &);
Matrix PlaneStrain(const Grid &, const Coefficient &E, double nu); /* unknowns 2 node + component */
/* row and column of an identity, times the diagonal that was there */
void   Clamp(Matrix &A, Vector &f, int unknown);
Matrix Diagonal(const std::vector<Matrix> &);           /* block diagonal */
Matrix Logs(Random &, int n, double low, double high);  /* diagonal, 10^u, u between low and high */
Matrix SparseRows(Random &, int m, int n, int entries); /* entries of size 1 at random places */
Vector Uniform(Random &, int n);                        /* in [-1, 1) */

/*
   Where the scale of a system with n unknowns x, of N, begins: one power of 2 for all of x, and one for the row and for
   the column of each multiplier. The units of A, and of each row of C and of B, say nothing of the size of x
*/
class SaddleUnits {
public:
  SaddleUnits(int n, int N) : n(n), row((size_t)N, 0.0L), column((size_t)N, 0.0L) { }
  void Take(int i, int j, long double entry);
  void Find(); /* of the entries that were taken */

  const int                n;
  std::vector<long double> row, column; /* the largest entries beside unknowns x; then powers of 2 */
};

/* What is true of a system, found by LU with complete pivoting in long double */
struct Facts {
  bool   decided;          /* otherwise it is one of rounding from another that has, or has not, an answer */
  bool   solvable, unique; /* unique: x */
  double left;             /* of the equations, relative to their terms, by the best answer */
  double reach;            /* error in x that rounding the system to double precision may cause */
  /* of x in its own units, at least a trace of that of x and lambda: where g = 0 x may be rounding */
  double size;
  Vector x, scale; /* scale: of the columns of x, in units of which errors are measured */
};
Facts SaddleFacts(const Saddle &);
/*
   Is x right to 113 binary digits, up to bound, or so many times what rounding does? Asked where long double says that
   it is not
*/
bool SaddleConfirms(const Saddle &, const Vector &x, double bound, double beyond);
/* x in units of its own, relative to the reference; the largest row of both equations relative to its terms */
double SaddleError(const Facts &, const Vector &x);
double SaddleResidual(const Saddle &, const Vector &x, const Vector &lambda);
/* What a refusal may speak of */
struct SaddleTraits {
  bool                  solvable, unique, symmetric, negated;
  std::function<bool()> indefinite, dependent; /* dependent: rows, exactly or nearly */
};
/* Is what the text says true of this system? */
bool SaddleSaysTrue(const SaddleTraits &, const std::string &text);
bool SaddleSaysTrue(const Saddle &, const Facts &, const std::string &text);
bool SaddleSymmetric(const Saddle &);  /* of its blocks, whatever the signs that they are stored with */
bool SaddleIndefinite(const Saddle &); /* A, on the kernel of the constraints, of a symmetric one */

struct Answer {
  PetscErrorCode code   = PETSC_SUCCESS;        /* that KSPSolve() returned */
  bool           solved = false, agreed = true; /* a positive reason; the same on all ranks */
  PetscInt       iterations = -1;
  Vector         x, lambda;
  std::string    said; /* of a failure */
  double         residual = NAN, error = NAN;
};
enum SaddleVerdict {
  SADDLE_RIGHT,   /* a positive reason, both equations hold row by row, and x is the reference's */
  SADDLE_REFUSED, /* a reason or an error that is true of the system */
  SADDLE_OWED,    /* the same where there is an answer, and x is unique: it could have been solved */
  SADDLE_UNTRUE,  /* what the refusal says is not so */
  SADDLE_WRONG,   /* another answer, or ranks that do not agree */
  SADDLE_VERDICTS
};
/*
   With so many rows of x and of lambda on this rank; mumps: its Cholesky or LU with its defaults, otherwise what the
   options say
*/
PetscErrorCode SaddleSolve(const Saddle &, const PetscInt local[2], bool mumps, Answer &);
/* The same of matrices; *ksp is destroyed, unless it ends with an error */
PetscErrorCode SaddleSolveNest(Mat nest, KSP *ksp, const Vector rhs[2], const PetscInt local[2], bool first, Answer &);
/* listen: to what a refusal says; beyond: so many times what rounding may change in x is not wrong yet */
SaddleVerdict SaddleJudge(const Saddle &, const Facts &, bool listen, Answer &, double beyond = 1e3);
/* Fills what is stored from A, B, C, D, f, g and the convention */
void SaddleStore(Saddle &);

#endif
