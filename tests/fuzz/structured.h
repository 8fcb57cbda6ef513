/*
   Systems as programs write them, sparse, up to some thousand unknowns. What is true of them is known by construction,
   and checked by sparse LU
*/
#ifndef TESTS_STRUCTURED_H
#define TESTS_STRUCTURED_H

#include "systems.h"
#include <Eigen/SparseCore>

using Sparse   = Eigen::SparseMatrix<double, Eigen::RowMajor>;
using Triplets = std::vector<Eigen::Triplet<double>>;

/* Rows of C and D that sum up to zero with these factors; without one of them the rest still determines x */
struct Dependence {
  std::vector<std::pair<int, double>> rows;
  int                                 drop;
};

struct Structured {
  std::string kind, text, options;
  Sparse      A, B, C, D; /* D: 0 x 0 where the program passes no block */
  Vector      f, g;
  Convention  convention = PLAIN;
  bool        first      = false;
  bool        diagonal   = true; /* zeros on the diagonals of A and D are stored */
  int         bs = 1, form = 0;  /* form: as in RandomSystem */
  const char *type      = MATAIJ;
  bool        symmetric = true;
  /* neither the system nor the options excuse a failure: its condition may */
  bool                    tame     = true;
  bool                    refuse   = false; /* success is wrong, whatever it leaves */
  bool                    rest     = false; /* x = 0 */
  bool                    solvable = true, unique = true;
  bool                    outer   = false; /* a Krylov method around the plugin, whose failures have no words */
  double                  decades = 0.0;   /* of coefficients */
  std::vector<Dependence> dependent;
  Vector                  motion; /* that nothing holds, where x is not unique */

  explicit Structured(Random &);

private:
  void RightHandSide(Random &, const std::vector<std::pair<int, double>> &fixed);
  void Contradict(Random &);
  void Layout(Random &);
  void Options(Random &);
};

/* What a program assembles, one element and one row after the other */
struct Model {
  struct Row {
    std::vector<std::pair<int, double>> entries, friction; /* friction: of B, beyond C */
  };
  int                                 n = 0, components = 1; /* unknowns a node */
  Triplets                            A, D;
  std::vector<Row>                    rows;
  bool                                blockD = false;
  std::vector<std::pair<int, double>> fixed; /* values of unknowns that rows of A prescribe */

  int Unknowns(int count); /* the first of so many new ones */
  /* unless another row has its first unknown: so rows are independent of those before them */
  bool Tie(const Row &);
  void Keep(int i) { touched[(size_t)i] = true; } /* from being the first of a row */
  bool Touched(int i) const { return touched[(size_t)i]; }

private:
  std::vector<bool> touched;
};

double Between(Random &, double low, double high);
double Decade(Random &, double low, double high); /* 10^u */

/* structuredmesh.cpp, structuredflow.cpp: one for each kind of program */
void DrawMesh(Random &, Model &, Structured &);
void DrawFlow(Random &, Model &, Structured &);
void DrawFold(Random &, Model &, Structured &);
void DrawNetwork(Random &, Model &, Structured &);
void DrawInterior(Random &, Model &, Structured &);
void DrawFirstOrder(Random &, Model &, Structured &);

struct StructuredFacts : Facts {
  double typical = 0.0; /* the reach of a right-hand side that is not special */
};
StructuredFacts StructuredTruth(const Structured &);
bool            StructuredPromised(const Structured &, const StructuredFacts &);
SaddleVerdict   StructuredJudge(const Structured &, const StructuredFacts &, Answer &);
PetscErrorCode  StructuredSolve(const Structured &, const PetscInt local[2], Answer &);
/* The blocks as stored, x first */
void StructuredBlocks(const Structured &, Sparse block[2][2], Vector rhs[2]);

#endif
