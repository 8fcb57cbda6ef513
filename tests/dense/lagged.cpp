static char help[] = "Newton's method with -snes_lag_preconditioner, where A and C change in each step: its iterates "
                     "are those of dense linear algebra.\n\n";

#include "dense.h"
#include <petscsnes.h>

/*
   J(y) y = b with J = [A + diag(|x|^2), C(x)'; C(x), 0], C(x) = C diag(1 + |x|^2): each step solves J(y) Y = J(y) y -
   b, so that the next y is J(y)^{-1} b
*/
struct Problem {
  System      sys;
  DenseSystem d;
  Mat         A = NULL, C = NULL, nest = NULL;
  Vec         b = NULL;
  IS          is[2];
  Column      y; /* the iterate that is expected */
};

static PetscErrorCode Create(Problem *p)
{
  Spec spec;
  Mat  Ct;
  Vec  part;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &p->sys));
  PetscCall(Gather(p->sys, p->d));
  PetscCall(MatDuplicate(p->sys.A, MAT_COPY_VALUES, &p->A));
  PetscCall(MatDuplicate(p->sys.C, MAT_COPY_VALUES, &p->C));
  PetscCall(MatCreateHermitianTranspose(p->C, &Ct));
  PetscCall(NestCreate(p->A, Ct, p->C, NULL, false, &p->nest));
  PetscCall(MatDestroy(&Ct));
  PetscCall(MatNestGetISs(p->nest, p->is, NULL));
  PetscCall(MatCreateVecs(p->nest, NULL, &p->b));
  for (int k = 0; k < 2; k++) {
    PetscCall(VecGetSubVector(p->b, p->is[k], &part));
    PetscCall(VecCopy(k ? p->sys.g : p->sys.f, part));
    PetscCall(VecRestoreSubVector(p->b, p->is[k], &part));
  }
  p->y = Column::Zero(p->d.f.size() + p->d.g.size());
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Destroy(Problem *p)
{
  PetscFunctionBeginUser;
  for (Mat *M : {&p->A, &p->C, &p->nest}) PetscCall(MatDestroy(M));
  PetscCall(VecDestroy(&p->b));
  PetscCall(SystemDestroy(&p->sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Jacobian(SNES, Vec y, Mat, Mat, void *ctx)
{
  Problem *p = (Problem *)ctx;
  Vec      x, squares;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(p->sys.f, &squares));
  PetscCall(VecGetSubVector(y, p->is[0], &x));
  PetscCall(VecCopy(x, squares));
  PetscCall(VecRestoreSubVector(y, p->is[0], &x));
  PetscCall(VecAbs(squares));
  PetscCall(VecPointwiseMult(squares, squares, squares));
  PetscCall(MatCopy(p->sys.A, p->A, SAME_NONZERO_PATTERN));
  PetscCall(MatDiagonalSet(p->A, squares, ADD_VALUES));
  PetscCall(VecShift(squares, 1.0));
  PetscCall(MatCopy(p->sys.C, p->C, SAME_NONZERO_PATTERN));
  PetscCall(MatDiagonalScale(p->C, NULL, squares));
  PetscCall(VecDestroy(&squares));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Function(SNES snes, Vec y, Vec F, void *ctx)
{
  Problem *p = (Problem *)ctx;

  PetscFunctionBeginUser;
  PetscCall(Jacobian(snes, y, NULL, NULL, ctx));
  PetscCall(MatMult(p->nest, y, F));
  PetscCall(VecAXPY(F, -1.0, p->b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* This iterate, and the next one that is expected */
static PetscErrorCode Compare(SNES snes, PetscInt step, PetscReal, void *ctx)
{
  Problem           *p = (Problem *)ctx;
  Vec                y;
  Column             got, part[2];
  Dense              K;
  DenseSystem        d = p->d;
  const Eigen::Index n = d.f.size(), m = d.g.size();

  PetscFunctionBeginUser;
  PetscCall(SNESGetSolution(snes, &y));
  for (int k = 0; k < 2; k++) {
    Vec sub;

    PetscCall(VecGetSubVector(y, p->is[k], &sub));
    PetscCall(Gather(sub, part[k]));
    PetscCall(VecRestoreSubVector(y, p->is[k], &sub));
  }
  got.resize(n + m);
  got << part[0], part[1];
  if (step) PetscCall(CheckEqual(("iterate " + std::to_string(step)).c_str(), got, p->y, 1e-8));
  const Column squares = p->y.head(n).cwiseAbs2().cast<PetscScalar>();
  d.A += squares.asDiagonal();
  d.C = d.C * (Column::Ones(n) + squares).asDiagonal();
  SolveSaddle(d, part[0], part[1]);
  p->y << part[0], part[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* pmats: preconditioning matrices in all steps, negative: not said */
static PetscErrorCode Newton(const std::string &line, PetscInt pmats)
{
  Options options("-snes_linesearch_type basic -ksp_type preonly -pc_type ainsworth -ainsworth_ksp_rtol 1e-12 " + line);
  const int steps = 5;
  Problem   p;
  SNES      snes;
  Vec       y;
  PetscInt  before[2], after[2], done;

  PetscFunctionBeginUser;
  Case("%s", line.c_str());
  PetscCall(Create(&p));
  PetscCall(VecDuplicate(p.b, &y));
  PetscCall(VecSet(y, 0.0));
  PetscCall(SNESCreate(PETSC_COMM_WORLD, &snes));
  PetscCall(SNESSetFunction(snes, NULL, Function, &p));
  PetscCall(SNESSetJacobian(snes, p.nest, p.nest, Jacobian, &p));
  PetscCall(SNESMonitorSet(snes, Compare, &p, NULL));
  PetscCall(SNESSetTolerances(snes, 0.0, 0.0, 0.0, steps, PETSC_DEFAULT));
  PetscCall(SNESSetFromOptions(snes));
  PetscCall(EventCount("AinsGramMat", &before[0]));
  PetscCall(EventCount("AinsPMat", &before[1]));
  PetscCall(SNESSolve(snes, NULL, y));
  PetscCall(EventCount("AinsGramMat", &after[0]));
  PetscCall(EventCount("AinsPMat", &after[1]));
  PetscCall(SNESGetIterationNumber(snes, &done));
  PetscCall(CheckInt("steps", done, steps));
  PetscCall(CheckInt("projectors", after[0] - before[0], steps));
  if (pmats >= 0) PetscCall(CheckInt("preconditioning matrices", after[1] - before[1], pmats));
  PetscCall(SNESDestroy(&snes));
  PetscCall(VecDestroy(&y));
  PetscCall(Destroy(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(PetscLogDefaultBegin());
  PetscCall(AinsworthInitializePackage());
  for (const std::string rebuild : {"auto", "always", "never"}) {
    for (PetscInt lag : {1, 2, -2}) {
      const std::string line = " -pc_ainsworth_rebuild " + rebuild + " -snes_lag_preconditioner " + std::to_string(lag);
      const bool        kept = rebuild == "never" || lag == -2;

      PetscCall(Newton("-ainsworth_pc_type redundant" + line, kept ? 1 : -1));
      PetscCall(Newton("-ainsworth_pc_type blocksa" + line, -1));
    }
  }
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
