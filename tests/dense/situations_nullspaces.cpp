/* Null spaces of the whole matrix, which a program attaches to its nest */
#include "situations.h"

static PetscErrorCode VecOfFields(const Live &s, const Column &x, const Column &lambda, Vec *v)
{
  const int primal = s.storage & FIRST ? 1 : 0;
  IS        is[2];
  Vec       part;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(s.nest, v, NULL));
  PetscCall(MatNestGetISs(s.nest, is, NULL));
  for (int k = 0; k < 2; k++) {
    PetscCall(VecGetSubVector(*v, is[k], &part));
    PetscCall(Scatter(k == primal ? x : lambda, part));
    PetscCall(VecRestoreSubVector(*v, is[k], &part));
  }
  PetscCall(VecNormalize(*v, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Attach(Mat mat, PetscInt n, const Vec v[])
{
  MatNullSpace space;

  PetscFunctionBeginUser;
  PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, n, v, &space));
  PetscCall(MatSetNullSpace(mat, space));
  PetscCall(MatNullSpaceDestroy(&space));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Both inner matrices have a constant as their null space */
static PetscErrorCode CheckConstant(Live &s)
{
  Mat mats[2];

  PetscFunctionBeginUser;
  PetscCall(KSPSetUp(s.ksp));
  PetscCall(Inner([&](KSP inner, PC) { return KSPGetOperators(inner, &mats[0], &mats[1]); })(s));
  for (Mat mat : mats) {
    PetscBool    constant = PETSC_FALSE;
    PetscInt     vectors  = 0;
    const Vec   *vecs;
    MatNullSpace space;
    Column       one;

    PetscCall(MatGetNullSpace(mat, &space));
    if (space) PetscCall(MatNullSpaceGetVecs(space, &constant, &vectors, &vecs));
    PetscCall(CheckInt("dimension of the null space", vectors + (constant ? 1 : 0), 1));
    if (vectors != 1) continue;
    PetscCall(Gather(vecs[0], one));
    PetscCall(Check("distance from a constant", (one - Column::Constant(one.size(), one.mean())).norm(), 1e-13));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Springs without ground, A 1 = 0, ties with C 1 = 0: told of both matrices, of Amat alone, with a second vector */
static Action Whole(int declared)
{
  return [=](Live &s) -> PetscErrorCode {
    const Column second = s.d.f - Column::Constant(s.d.f.size(), s.d.f.mean()); /* no null vector of K, nor of A */
    Mat          other;
    Vec          v[2];

    PetscFunctionBeginUser;
    PetscCall(VecOfFields(s, Column::Ones(second.size()), Column::Zero(s.d.g.size()), &v[0]));
    PetscCall(VecOfFields(s, second, Column::Zero(s.d.g.size()), &v[1]));
    PetscCall(NestCreate(s.sys.A, s.Ct, s.sys.C, NULL, s.storage & FIRST, &other));
    PetscCall(Attach(s.nest, declared == 2 ? 2 : 1, v));
    if (declared == 1) PetscCall(KSPSetOperators(s.ksp, s.nest, other));
    PetscCall(CheckConstant(s));
    if (declared < 2) { /* a right-hand side that has a solution, which is not unique */
      s.d.g = s.d.C * second;
      s.d.f = s.d.A * second + s.d.Upper() * RandomColumn(s.d.g.size(), 80);
      PetscCall(Positive()(s));
      PetscCall(CheckEqual("A x + C' lambda", s.d.A * s.x + s.d.Upper() * s.lambda, s.d.f, 1e-10));
      PetscCall(CheckEqual("C x", s.d.C * s.x, s.d.g, 1e-10));
    }
    for (Vec &vec : v) PetscCall(VecDestroy(&vec));
    PetscCall(MatDestroy(&other));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

/* Two equal rows: their multipliers have a null vector, in which the program left a rounding error of x */
static PetscErrorCode Mixed(Live &s)
{
  Vec v;

  PetscFunctionBeginUser;
  PetscCall(VecOfFields(s, 1e-17 * RandomColumn(12, 5), Column::LinSpaced(2, 1.0, -1.0), &v));
  PetscCall(Attach(s.nest, 1, &v));
  PetscCall(VecDestroy(&v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode WholeNullSpaces()
{
  DenseSystem d = Chain(9, 3, 2.0);

  PetscFunctionBeginUser;
  d.A(0, 0) = d.A(8, 8) = 1.0;
  d.C.setZero();
  for (int i = 0; i < 3; i++) {
    d.C(i, i)     = 1.0;
    d.C(i, i + 5) = -1.0;
  }
  for (int crossed : {0, (int)CROSSED})
    for (int declared = 0; declared < 3; declared++)
      for (int first : {0, (int)FIRST})
        PetscCall(Row(Text("null space of the whole, declared %d, first %d, crossed %d", declared, first, crossed), d,
                      "-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-13", {Whole(declared)},
                      crossed | first | VIEW));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode MixedNullSpaces()
{
  PetscFunctionBeginUser;
  for (PetscReal stiffness : {1.0, 1e60}) { /* where lambda is 1e60 times x a KSP makes noise of x */
    DenseSystem d = SpringsCreate(12, 2, stiffness, 4);

    d.C.row(1) = d.C.row(0);
    d.g[1]     = d.g[0];
    PetscCall(Row(Text("a null space with rounding errors, stiffness %g", (double)stiffness), d,
                  "-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12",
                  {Solved(), Mixed, stiffness > 1.0 ? Failed() : Solved()}));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
