/* Systems that are tiny, singular, nearly dependent, one-sided, not finite, scaled, or stored in unusual ways */
#include "situations.h"

static const std::string jacobi12 = "-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12",
                         jacobi13 = "-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-13";

/* Another matrix in the place of a block */
static PetscErrorCode Replace(Mat *block, Mat other)
{
  PetscFunctionBeginUser;
  PetscCall(MatDestroy(block));
  *block = other;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One unknown, one row, as many rows as unknowns, fewer unknowns than ranks; dependent, singular on Ker C, one-sided */
static PetscErrorCode Small(int crossed)
{
  const PetscInt sizes[][2] = {
    {1, 0},
    {1, 1},
    {2, 1},
    {2, 2},
    {9, 1},
    {9, 8},
    {9, 9}
  };
  const Parts       names  = {"Block (0,0)", "Block (0,1)", "Block (1,0)"};
  const std::string layout = crossed ? ", crossed" : "";

  PetscFunctionBeginUser;
  for (const std::string inner :
       {"", "-ainsworth_pc_type jacobi", "-pc_ainsworth_variant paper -ainsworth_pc_type redundant"})
    for (const PetscInt *size : sizes)
      PetscCall(Row(Text("%d unknowns, %d rows, ", (int)size[0], (int)size[1]) + inner + layout,
                    Chain(size[0], size[1], 2.0), "-ainsworth_ksp_rtol 1e-13 " + inner, {Exact(1e-9)}, crossed));
  /* a chain that nothing holds, or an unknown that no spring has; C does not hold them either, and nobody says so */
  for (bool loose : {false, true})
    for (bool balanced : {false, true}) {
      DenseSystem d = Chain(8, 2, 2.0);

      d.C.setZero();
      d.C(0, 0) = d.C(1, 1) = 1.0;
      d.C(0, 3) = d.C(1, 6) = -1.0;
      if (loose) {
        d.A.row(7).setZero();
        d.A.col(7).setZero();
        d.f[7] = balanced ? 0.0 : 1.0;
      } else {
        d.A(0, 0) = d.A(7, 7) = 1.0;
        d.f.array() += (balanced ? 0.0 : 1.0) - d.f.mean();
      } /* a loose unknown is refused before the options of the inner solver are read */
      PetscCall(Row(Text("A singular on Ker C, loose unknown %d, balanced %d", loose, balanced) + layout, d,
                    loose ? "" : jacobi12, {balanced && !loose ? Solved(1e-9, 1e-12) : Failed()}, crossed));
    }
  /* row 3 is row 0 plus a distance; g tells them apart, which makes x large, or does not; close ones may fail */
  for (PetscReal distance : {1e-1, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-9, 1e-12})
    for (bool apart : {false, true}) {
      DenseSystem d = Chain(12, 4, 2.0);

      for (int i = 0; i < 3; i++)
        for (int j = 0; j < 12; j++)
          if (j % 3 != i) d.C(i, j) = 0.0;
      d.C.row(3) = d.C.row(0);
      d.C(3, 1) += distance;
      if (!apart) d.g = d.C * RandomColumn(12, 10);
      PetscCall(Row(Text("rows %g apart, told apart by g %d", (double)distance, apart) + layout, d, jacobi12,
                    {Either(Residuals(1e-7, 1e-8), distance < 1e-4 ? Fails() : nullptr),
                     [=](Live &s) { return distance >= 1e-3 ? EqualX(1e-8)(s) : PETSC_SUCCESS; }},
                    crossed));
    }
  /* A + C' D^{-1} C has rows of equal pattern, inodes, and A has none: factored with each ordering */
  for (const std::string ordering : {"natural", "nd", "rcm"}) {
    Saddle d = Chain(9, 1, 2.0);

    for (int j : {0, 7, 8}) d.C(0, j) = 0.0;
    d.D = Dense::Constant(1, 1, -0.5);
    PetscCall(Row("eliminated row, ordering " + ordering + layout, d,
                  "-ainsworth_pc_type redundant -ainsworth_redundant_pc_factor_mat_ordering_type " + ordering,
                  {Right(1e-7)}, crossed));
  }
  { /* [A -C'; C 0], two right-hand sides, and the transpose, which is said to be impossible */
    Saddle d = Chain(9, 3, 2.0);

    d.B = -d.C;
    PetscCall(
      Row("blocks C and -C'" + layout, d, jacobi13,
          {Solved(1e-11, 1e-13), Edit([](Saddle &s) { s.f = RandomColumn(9, 12), s.g = RandomColumn(3, 13); }),
           Solved(1e-11, 1e-13), TransposeRaised(PETSC_ERR_SUP, {"transpose", "blocks C and C', not C and -C'"})},
          crossed | EXPLICIT));
  }
  /* a Dirichlet condition whose row became that of the identity while its column stayed: A is not symmetric */
  for (const std::string method : {"", " -ainsworth_ksp_type gmres"}) {
    DenseSystem d = Chain(12, 3, 2.0);

    d.A.row(4).setZero();
    d.A(4, 4) = 1.0;
    PetscCall(Row("one-sided Dirichlet row" + method + layout, d, jacobi12 + method, {Right(1e-8)}, crossed));
  }
  /* values were set on the first rank alone, but not assembled: an error on every rank */
  for (int block = 0; block < 3; block++) {
    const auto chosen = [=](Live &s) { return block == 0 ? s.sys.A : (block == 1 ? s.Ct : s.sys.C); };

    PetscCall(Row(names[block] + " not assembled" + layout, Chain(9, 3, 2.0), "",
                  {[=](Live &s) -> PetscErrorCode {
                     PetscInt start, end;

                     PetscFunctionBeginUser;
                     PetscCall(MatGetOwnershipRange(chosen(s), &start, &end));
                     if (!start && end) PetscCall(MatSetValue(chosen(s), 0, 0, 0.0, ADD_VALUES));
                     PetscFunctionReturn(PETSC_SUCCESS);
                   },
                   SetUpRaised(PETSC_ERR_ARG_WRONGSTATE, {names[block], "not assembled", "MatAssemblyBegin()"}),
                   [=](Live &s) { return MatAssemblyBegin(chosen(s), MAT_FINAL_ASSEMBLY); },
                   [=](Live &s) { return MatAssemblyEnd(chosen(s), MAT_FINAL_ASSEMBLY); }},
                  crossed | EXPLICIT));
  }
  /* NaN on the right-hand side, also where C alone determines x */
  for (PetscInt m : {2, 6})
    for (bool inG : {false, true})
      PetscCall(Row(Text("NaN in %s, %d rows", inG ? "g" : "f", (int)m) + layout, Chain(6, m, 2.0), jacobi13,
                    {Edit([=](Saddle &s) { (inG ? s.g : s.f)[0] = NAN; }), Failed(), Original(), Exact(1e-9)},
                    crossed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Blocks without entries, many rows, NaN in g, tiny stiffness */
static PetscErrorCode Blocks(int crossed)
{
  const std::string layout = crossed ? ", crossed" : "", jacobi = "-ainsworth_pc_type jacobi ";
  DenseSystem       d;

  PetscFunctionBeginUser;
  for (int k = 0; k < 3; k++) /* of few unknowns */
    PetscCall(Row(Text("a shell in the place of %s, with a diagonal %d", k < 2 ? "A" : "C", k == 1) + layout,
                  Chain(12, 3, 3.0), jacobi13, {Exact(1e-10)}, crossed, [=](Live &s) -> PetscErrorCode {
                    Mat shell, *block = k < 2 ? &s.sys.A : &s.sys.C;

                    PetscFunctionBeginUser;
                    PetscCall(ShellCreate(*block, k == 1, false, &shell));
                    PetscCall(PetscObjectCompose((PetscObject)shell, "of", (PetscObject)*block));
                    PetscCall(Replace(block, shell));
                    PetscFunctionReturn(PETSC_SUCCESS);
                  }));
  /* more rows of C than unknowns; all but 3 are zero, inactive (an entry of D alone), or have an entry of D */
  for (const std::string kind : {"zero", "inactive", "penalized"})
    for (bool diagonal : {false, true}) {
      Saddle many = Chain(6, 10, 3.0);

      if (diagonal) many.A = Dense(many.A.diagonal().asDiagonal());
      if (kind != "zero") many.D = Dense::Zero(10, 10);
      for (PetscInt i = 0; i < 10; i++) {
        if (i % 4 == 1) continue;
        if (kind != "penalized") many.C.row(i).setZero();
        if (kind == "zero") many.g[i] = 0.0;
        else many.D(i, i) = -0.5 - 0.1 * i;
      }
      PetscCall(Row(kind + Text(" rows, more than unknowns, A diagonal %d", diagonal) + layout, many, jacobi13,
                    {Right(1e-8)}, crossed));
    }
  /* rows that depend on each other are left out, or refused where that was asked for */
  d = Chain(6, 8, 3.0);
  d.C.setZero();
  for (int i = 0; i < 8; i++) {
    d.C(i, i % 6) = 1.0;
    d.g[i]        = 0.5 + i % 6;
  }
  PetscCall(Row("8 dependent rows of 6 unknowns" + layout, d, jacobi, {Solved(1e-12, 1e-14)}, crossed));
  PetscCall(Row("8 dependent rows of 6 unknowns, refused" + layout, d, jacobi + "-pc_ainsworth_redundant error",
                {SetUpRaised(PETSC_ERR_MAT_CH_ZRPVT, {"2 rows of C are linear combinations of others"})}, crossed));
  /* NaN or Inf in g, on a row that is zero, dependent, or one that is kept beside such a row */
  for (PetscInt row = 1; row < 4; row++)
    for (PetscReal value : {(PetscReal)NAN, (PetscReal)INFINITY}) {
      const std::string name = Text("g is %g on row %d of a zero, a kept, a dependent one", (double)value, (int)row) +
                               layout;
      const Action bad = Edit([=](Saddle &s) { s.g[row] = value; });

      d = Chain(12, 4, 3.0);
      d.C.row(1).setZero();
      d.g[1] = 0.0;
      if (row == 3) {
        d.C.row(3) = d.C.row(0);
        d.g[3]     = d.g[0];
      }
      PetscCall(Row(name, d, jacobi13, {bad, Failed(), Original(), Solved(1e-11, 1e-12)}, crossed));
      PetscCall(
        Row(name + ", errors", d, jacobi13 + " -ksp_error_if_not_converged",
            {bad, Raised(PETSC_ERR_FP,
                         {Text("right-hand side holds NaN or Inf in row %d of the multiplier field", (int)row)})},
            crossed));
    }
  /* stiffness far from 1, and forces such that what the inner solver looks at, energies or residuals, is about 1 */
  for (PetscReal scale : {1e-200, 1e-100, 1e100, 1e200})
    for (bool symmetric : {true, false}) {
      const PetscReal force = symmetric ? PetscSqrtReal(scale) : 1.0, length = force / scale;
      DenseSystem     scaled;

      d = Chain(12, 3, 3.0);
      for (int i = 1; i < 12 && !symmetric; i++) d.A(i, i - 1) = -0.6;
      scaled = d;
      scaled.A *= scale;
      scaled.f *= force;
      scaled.g *= length;
      PetscCall(Row(Text("A times %g, symmetric %d", (double)scale, symmetric) + layout, scaled,
                    jacobi13 + (symmetric ? "" : " -ainsworth_ksp_type gmres"),
                    {Positive(),
                     [=](Live &s) {
                       s.x      = s.x / length;
                       s.lambda = s.lambda / force;
                       s.d      = d;
                       return Equal(1e-10)(s);
                     }},
                    crossed));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode OneBlockNest(Live &s)
{
  Mat nest;

  PetscFunctionBeginUser;
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 1, NULL, 1, NULL, &s.sys.A, &nest));
  PetscCall(Replace(&s.sys.A, nest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Singular()
{
  Saddle      d = SpringsCreate(12, 2, 1.0, 3);
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  d.A(3, 3) = NAN;
  PetscCall(Row("NaN in an A that has no norm", d, "", {Failed({"of A is NaN or Inf"})}, 0, OneBlockNest));
  /* a spring of D with the other sign gives what A takes: the matrix is singular, an x of 1e15 balances to rounding */
  d = SpringsCreate(20, 2, 1.0, 20);
  d.A.row(19).setZero();
  d.A.col(19).setZero();
  d.C.row(0).setZero();
  d.g.setZero();
  d.C(0, 19) = -1.0;
  d.D        = Dense::Zero(2, 2);
  d.D(0, 0) = d.A(19, 19) = 1.0;
  PetscCall(Row(
    "a spring that drives", d,
    "-ainsworth_ksp_type minres -ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-10 -pc_ainsworth_multiplier_fields 1",
    {Failed(), [=](Live &s) -> PetscErrorCode {
       std::string why;
       bool        named = size > 1 || PetscDefined(USE_COMPLEX); /* where it ends before */

       PetscFunctionBeginUser;
       PetscCall(Failure(s, why));
       /* rounding decides whether x drowns, or another solve disagrees or does not help */
       for (const char *cause :
            {"drown in the rounding of its terms", "of what they are allowed, which another solve takes for",
             "says that it converged, but row", "C x = g is not met"})
         named = named || why.find(cause) != std::string::npos;
       PetscCall(CheckTrue(why.c_str(), named));
       PetscFunctionReturn(PETSC_SUCCESS);
     }}));
  /* a block size that is part of A's type, and another of the options; without constraints the inner solver gets A */
  for (const std::string type : {MATAIJ, MATBAIJ, MATSBAIJ})
    if (!PetscDefined(USE_COMPLEX) || type != MATSBAIJ)
      PetscCall(Row("block size of " + type, SpringsCreate(20, 0, 1.0, 23), jacobi12 + " -pc_ainsworth_block_size 1",
                    {Solved()}, CROSSED, [=](Live &s) -> PetscErrorCode {
                      PetscFunctionBeginUser;
                      PetscCall(MatSetBlockSize(s.sys.A, 2));
                      PetscCall(MatSetOption(s.sys.A, MAT_SYMMETRIC, PETSC_TRUE));
                      PetscCall(MatConvert(s.sys.A, type.c_str(), MAT_INPLACE_MATRIX, &s.sys.A));
                      PetscFunctionReturn(PETSC_SUCCESS);
                    }));
  /* the program frees the communicator of its blocks, which PETSc's layouts still have */
  for (const std::string options :
       {"-ainsworth_pc_type jacobi",
        "-ainsworth_pc_type blocksa -ainsworth_pc_blocksa_coarse_eq_limit 10 -pc_ainsworth_block_size 1"})
    PetscCall(Row("a communicator that is freed, " + options, SpringsCreate(120, 6, 1.0, 23), options, {Right(1e-7)},
                  VIEW, [](Live &s) -> PetscErrorCode {
                    MPI_Comm brief;

                    PetscFunctionBeginUser;
                    PetscCallMPI(MPI_Comm_dup(PETSC_COMM_WORLD, &brief));
                    PetscCall(Stored(s, brief));
                    PetscCallMPI(MPI_Comm_free(&brief));
                    PetscFunctionReturn(PETSC_SUCCESS);
                  }));
  /* the squares of rows underflow: nothing is known of their direction, and g = 0 alone can be met without them */
  PetscCall(Row("rows of C of 1e-200", Spec(), jacobi12, {Edit([](Saddle &s) { s.C *= 1e-200; }), Failed()}, VIEW));
  for (bool uneven : {false, true}) {
    Spec spec;

    spec.uneven = uneven;
    for (bool inC : {false, true}) {
      const std::string name = Text("not finite, in C %d, uneven %d", inC, uneven);
      const Action      bad = Edit([=](Saddle &s) { (inC ? s.C(3, 6) : s.A(3, 0)) = inC ? (PetscReal)INFINITY : NAN; });

      PetscCall(Row(name, spec, jacobi12,
                    {bad, Failed({}, PC_FACTOR_OTHER), Failed({}, PC_FACTOR_OTHER), Original(), Right(1e-8)}, VIEW));
      PetscCall(Row(name + ", errors", spec, "-ksp_error_if_not_converged",
                    {bad, SetUpRaised(PETSC_ERR_FP, {"NaN or Inf", inC ? "row 3 of C" : "entry (3,0) of A"})}, VIEW));
    }
  }
  Spec zeros;
  zeros.zeroRows = true;
  PetscCall(Row(
    "right-hand side on a zero row, with errors", zeros, "-ainsworth_pc_type jacobi -ksp_error_if_not_converged",
    {Raised(PETSC_ERR_ARG_INCOMP, {"nonzero on a row of C that is zero (rows 1, 4 of", "no solution exists"})}, VIEW));
  PetscCall(
    Row("A negative definite, and again positive; Inf in f", Spec(), "-ainsworth_pc_type jacobi",
        {Edit([](Saddle &s) { s.A = -s.A; }), Either(Equal(1e-6), Fails({}, PC_SUBPC_ERROR)), Original(), Right(1e-6),
         Edit([](Saddle &s) { s.f[0] = PETSC_INFINITY; }), Failed({}, PC_SUBPC_ERROR), Original(), Right(1e-6)},
        VIEW));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Systems()
{
  PetscFunctionBeginUser;
  for (int crossed : {0, (int)CROSSED}) PetscCall(Small(crossed));
  PetscCall(Singular());
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Unusual()
{
  DenseSystem ring = Chain(41, 40, 3.0);

  PetscFunctionBeginUser;
  for (int crossed : {0, (int)CROSSED}) PetscCall(Blocks(crossed));
  /* a ring of ties, one too many, that ranks share: each keeps one between unknowns of others, rank 0 finds it */
  ring.C.setZero();
  for (PetscInt i = 0; i < 40; i++) {
    ring.C(i, i)            = 1.0;
    ring.C(i, (i + 1) % 40) = -1.0;
  }
  ring.g -= Column::Constant(40, ring.g.mean());
  PetscCall(Row("a ring", ring, "-ainsworth_pc_type jacobi -pc_ainsworth_rows_per_rank 2", {Solved(1e-12, 1e-12)}));
  PetscCall(Row("a ring, refused", ring,
                "-ainsworth_pc_type jacobi -pc_ainsworth_rows_per_rank 2 -pc_ainsworth_redundant error",
                {SetUpRaised(PETSC_ERR_MAT_CH_ZRPVT, {"1 rows of C are linear combinations of others"})}));
#if defined(PETSC_HAVE_HYPRE)
  for (bool symmetric : {true, false}) { /* Chebyshev smoothing is for a spectrum that is known to be real */
    DenseSystem d = Chain(120, 3, 3.0);

    for (int i = 1; i < 120 && !symmetric; i++) d.A(i, i - 1) = -0.6;
    PetscCall(Row(Text("BoomerAMG, symmetric %d", symmetric), d, "-ainsworth_pc_type hypre -ainsworth_ksp_rtol 1e-12",
                  {Either(EqualX(1e-9), nullptr), [=](Live &s) -> PetscErrorCode {
                     std::string text;

                     PetscFunctionBeginUser;
                     PetscCall(ViewText(s.ksp, text));
                     PetscCall(
                       CheckTrue("Chebyshev smoothing", (text.find("Chebyshev") != std::string::npos) == symmetric));
                     PetscFunctionReturn(PETSC_SUCCESS);
                   }}));
  }
#endif
  PetscFunctionReturn(PETSC_SUCCESS);
}
