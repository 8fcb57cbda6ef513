/* Rows of A without a stored diagonal entry; unknowns in no equation; rows of C whose unknowns many rows share */
#include "situations.h"

/* v_x + 10.1 i = f, i_x + 10.01 v = f by linear elements: inner rows of v_x have no v there. Ends are held or tied */
static DenseSystem Line(PetscInt n, bool constraints)
{
  DenseSystem    d;
  const PetscInt nodes = n + 1;

  d.A = Dense::Zero(2 * nodes, 2 * nodes);
  for (PetscInt i = 0; i < nodes; i++) {
    for (int s : {-1, 0, 1}) {
      const PetscInt  j    = i + s;
      const PetscReal x    = s        ? 0.5 * s
                             : i == 0 ? -0.5
                             : i == n ? 0.5
                                      : 0.0,
                      mass = (s ? 1.0 : 4.0) / (6.0 * (PetscReal)n);

      if (j < 0 || j > n) continue;
      d.A(i, j)                 = x;
      d.A(nodes + i, nodes + j) = x;
      d.A(i, nodes + j)         = 10.1 * mass;
      d.A(nodes + i, j)         = 10.01 * mass;
    }
  }
  d.C = Dense::Zero(constraints ? 2 : 0, 2 * nodes);
  d.g = Column::Zero(d.C.rows());
  d.f.resize(2 * nodes);
  for (PetscInt i = 0; i < 2 * nodes; i++) d.f[i] = Uniform(5, i, 0) / (PetscReal)n;
  if (!constraints) return d;
  d.C(0, 0) = d.C(1, n) = d.g[0] = 1.0;
  d.C(1, 2 * n)                  = -1.0;
  return d;
}

/* Springs with further unknowns that have no stiffness: `tied` of them in a row of C each, and others in no equation */
static DenseSystem Further(PetscInt tied, PetscInt others)
{
  const DenseSystem springs = SpringsCreate(20, 3, 1.0, 4);
  const PetscInt    n       = 20 + tied + others;
  DenseSystem       d;

  d.A                       = Dense::Zero(n, n);
  d.A.topLeftCorner(20, 20) = springs.A;
  d.C                       = Dense::Zero(3 + tied, n);
  d.C.topLeftCorner(3, 20)  = springs.C;
  d.f                       = Column::Zero(n);
  d.f.head(20)              = springs.f;
  d.g                       = Column::Zero(3 + tied);
  d.g.head(3)               = springs.g;
  for (PetscInt k = 0; k < tied; k++) {
    d.C(3 + k, 20 + k) = 1.0;
    d.C(3 + k, 5 + k)  = -1.0;
  }
  return d;
}

/* An unknown that many rows share, and one row alone prescribes, beside a chain of ties: no row of S may be empty */
static DenseSystem Prescribed(PetscInt many, PetscInt chain, bool stiff)
{
  const PetscInt n = many + chain + 5;
  DenseSystem    d = Chain(n, 0, 3.0);

  d.C       = Dense::Zero(many + 1 + chain, n);
  d.f       = Column::Constant(n, 1e-3);
  d.g       = Column::Zero(many + 1 + chain);
  d.g[many] = 0.1;
  d.A.row(n - 1).setZero();
  d.A.col(n - 1).setZero();
  if (stiff) d.A(n - 1, n - 1) = 2.0;
  if (stiff) d.A(n - 1, 0) = d.A(0, n - 1) = -0.5;
  for (PetscInt i = 0; i <= many; i++) {
    if (i < many) d.C(i, i) = 1.0;
    d.C(i, n - 1) = i < many ? -1.0 : 1.0;
  }
  for (PetscInt k = 0; k < chain; k++) {
    d.C(many + 1 + k, many + k)     = 1.0;
    d.C(many + 1 + k, many + 1 + k) = -1.0;
  }
  return d;
}

/* The failure has a text, which a view shows */
static Action Refused(Parts parts)
{
  const Action failed = Failed(parts);

  parts.push_back("last failure: ");
  return Both(failed, Viewed(parts));
}

/* Two of the unknowns in no equation are declared by vectors of a null space that is attached to A */
static Action Declare(PetscInt declared)
{
  return [=](Live &s) -> PetscErrorCode {
    MatNullSpace null;
    Vec          v[2];

    PetscFunctionBeginUser;
    for (int k = 0; k < 2; k++) {
      PetscCall(VecDuplicate(s.sys.f, &v[k]));
      PetscCall(VecSetValue(v[k], 22, k ? 0.8 : 0.6, INSERT_VALUES));
      PetscCall(VecSetValue(v[k], 23, k ? -0.6 : 0.8, INSERT_VALUES));
      PetscCall(VecAssemblyBegin(v[k]));
      PetscCall(VecAssemblyEnd(v[k]));
    }
    PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, declared, v, &null));
    PetscCall(MatSetNullSpace(s.sys.A, null));
    PetscCall(MatNullSpaceDestroy(&null));
    for (Vec &w : v) PetscCall(VecDestroy(&w));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

/* M_*, or A without constraints, has all of its diagonal: what cannot precondition it ends as a reason, no error */
static PetscErrorCode FirstOrder(PetscInt n, bool constraints, const std::string &options, bool solved = false)
{
  const DenseSystem d       = Line(n, constraints);
  const Action      entries = [=](Live &s) -> PetscErrorCode {
    MatInfo info;

    PetscFunctionBeginUser;
    PetscCall(MatGetInfo(s.sys.A, MAT_GLOBAL_SUM, &info));
    PetscCall(CheckInt("entries of the program's A", (PetscInt)info.nz_used, (PetscInt)(d.A.array() != 0.0).count()));
    PetscFunctionReturn(PETSC_SUCCESS);
  };

  PetscFunctionBeginUser;
  PetscCall(Row(
    Text("first order, %d cells, constraints %d, ", (int)n, constraints) + options, d,
    "-ainsworth_ksp_rtol 1e-11 " + options,
    {entries, Either(Residuals(1e-8, 1e-10), solved ? nullptr : Both(Fails(), Viewed({"last failure: "}))), entries}, 0,
    WithoutZeros));
  PetscCall(CheckTrue("diagonal entries are missing", (d.A.diagonal().array() == 0.0).any()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode NoStiffness()
{
  const PetscInt others[] = {1, 3, 9};
  const Parts    names    = {"Unknowns 22 of", "Unknowns 22, 23, 24 of", "26 and 4 more of the primal"};

  PetscFunctionBeginUser;
  for (bool constraints : {true, false}) {
    PetscCall(FirstOrder(20, constraints, "", true));
    PetscCall(FirstOrder(310, constraints, "")); /* too large to be factored at once */
    for (const std::string type :
         {"jacobi", "gamg", "blocksa", "bjacobi", "bjacobi -ainsworth_sub_pc_type lu", "hypre"})
      if (type != "hypre" || PetscDefined(HAVE_HYPRE))
        PetscCall(FirstOrder(20, constraints, "-ainsworth_pc_type " + type));
  }
  for (int crossed : {0, (int)CROSSED}) {
    /* unknowns in no equation are named, whether A stores zeros on their diagonal or nothing, and on any rank */
    for (int k = 0; k < 3; k++)
      for (bool stored : {false, true}) {
        const DenseSystem d      = Further(2, others[k]);
        const Action      blocks = stored ? Action() : WithoutZeros;
        const std::string name   = names[k] + Text("no equation, stored %d, crossed %d", stored, crossed);

        PetscCall(
          Row(name, d, "", {Refused({names[k], "are in no equation", "give them a stiffness"})}, crossed, blocks));
        PetscCall(Row(name + ", errors", d, "-ksp_error_if_not_converged",
                      {Raised(PETSC_ERR_MAT_LU_ZRPVT, {names[k], "are in no equation"})}, crossed, blocks));
      }
    /* with a row of C for each, or a spring, the same unknowns are solved for */
    PetscCall(Row(Text("unknowns in rows of C alone, crossed %d", crossed), Further(5, 0), "", {Solved()}, crossed,
                  WithoutZeros));
    PetscCall(Row(Text("refused, and then given a stiffness, crossed %d", crossed), Further(2, 2), "",
                  {Refused({"Unknowns 22, 23 of"}), Edit([](Saddle &s) { s.A(22, 22) = s.A(23, 23) = 2.0; }), Solved()},
                  crossed));
  }
  for (bool column : {false, true}) { /* A that is not symmetric may have a column of zeros, or a row */
    DenseSystem d = Further(0, 1);

    (column ? d.A(20, 7) : d.A(7, 20)) = 1.0;
    PetscCall(Row(column ? "a zero column of A" : "a zero row of A", d, "",
                  {Refused({column ? "Unknowns 20 of the primal field are in no equation"
                                   : "Equations 20 of the primal field have no unknown"})},
                  0, WithoutZeros));
  }
  PetscCall(Row("one of two unknowns in no equation in a null space", Further(2, 2), "",
                {Declare(1), Refused({"Unknowns 22, 23 of"})}));
  PetscCall(
    Row("two of two unknowns in no equation in a null space", Further(2, 2), "",
        {Declare(2), Solved(), [](Live &s) { return Check("the declared unknowns", s.x.tail(2).norm(), 1e-8); }}));
  for (bool stiff : {false, true})
    for (const std::string options :
         {"", "-ainsworth_pc_type jacobi -pc_ainsworth_pmat jcb", "-ainsworth_pc_type jacobi -pc_ainsworth_pmat cg",
          "-ainsworth_pc_type jacobi -pc_ainsworth_pmat bj_cc"})
      PetscCall(Row(Text("an unknown of many rows is prescribed, stiffness %d, ", stiff) + options,
                    Prescribed(120, 60, stiff), "-ainsworth_ksp_rtol 1e-11 " + options, {Solved()}, 0, WithoutZeros));
  PetscFunctionReturn(PETSC_SUCCESS);
}
