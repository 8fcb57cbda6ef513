static char help[] = "What random systems drew once, made by hand and small: what is known, what floats, and rows that "
                     "nearly depend.\n\n";

#include "systems.h"

static const double soft[] = {1e39, 1e129}; /* 1 / stiffness, which no program makes */

/* Half of the unknowns and of the multipliers on each of two ranks */
static PetscErrorCode Solve(Saddle &s, const std::string &line, Answer &answer)
{
  Options  options("-ainsworth_ksp_rtol 1e-12 " + line);
  PetscInt local[2] = {PETSC_DECIDE, PETSC_DECIDE}, all[2] = {(PetscInt)s.A.rows(), (PetscInt)s.C.rows()};

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) PetscCall(PetscSplitOwnership(PETSC_COMM_WORLD, &local[k], &all[k]));
  s.name = "drawn";
  SaddleStore(s);
  PetscCall(SaddleSolve(s, local, false, answer));
  PetscCall(CheckTrue(("no error: " + answer.said).c_str(), !answer.code));
  PetscCall(CheckTrue("ranks agree", answer.agreed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Right, which is all that the mathematics allows; owed: a reason is wrong, too */
static PetscErrorCode CheckRight(const Answer &answer, const Vector &x, bool owed)
{
  PetscFunctionBeginUser;
  if (answer.solved) PetscCall(Check("x", (answer.x - x).cwiseAbs().maxCoeff() / x.cwiseAbs().maxCoeff(), 1e-6));
  else if (owed) PetscCall(CheckTrue(("solved: " + answer.said).c_str(), false));
  else PetscCall(CheckTrue("a reason", !answer.said.empty()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* There is no solution */
static PetscErrorCode CheckNone(const Saddle &s, const Answer &answer)
{
  char text[128] = "a reason";

  PetscFunctionBeginUser;
  if (answer.solved)
    (void)snprintf(text, sizeof(text), "a reason: rows of the answer are left with up to %g of their terms",
                   SaddleResidual(s, answer.x, answer.lambda));
  PetscCall(CheckTrue(text, !answer.solved && !answer.said.empty()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Springs to the ground and between neighbors */
static Matrix Held(int n)
{
  Matrix A = 3.0 * Matrix::Identity(n, n);

  for (int i = 1; i < n; i++) A(i, i - 1) = A(i - 1, i) = -1.0;
  return A;
}

/*
   Unknown 2 is fixed and alone in row 0 of C, so multiplier 0 is (c x_2 - g_0) / d and pulls at unknown 5; the rest is
   held, with one tie: regular
*/
static PetscErrorCode Known(double c, double b, double d, double g, const std::string &line)
{
  Saddle       s;
  Answer       answer;
  const Vector x2 = Vector::Constant(1, 0.75);

  PetscFunctionBeginUser;
  Case("a multiplier that is known, %g x - %g l = %g, with a force of %g, %s", c, d, g, b, line.c_str());
  s.A = Held(8);
  s.A.row(2).setZero();
  s.A(2, 2) = 1.0;
  s.B = s.C = Matrix::Zero(2, 8);
  s.C(0, 2) = c;
  s.B(0, 5) = b;
  s.C(1, 0) = s.B(1, 0) = 1.0;
  s.C(1, 7) = s.B(1, 7) = -1.0;
  s.D                   = Matrix::Zero(2, 2);
  s.D(0, 0)             = d;
  s.f                   = Vector::LinSpaced(8, -1.0, 2.5);
  s.f[2]                = x2[0];
  s.g                   = Vector::Constant(2, 0.25);
  s.g[0]                = g;
  /* the other seven unknowns and multiplier 1, with what is known on the right */
  Matrix K = Matrix::Zero(9, 9);
  Vector r = Vector::Zero(9), x;

  K.topLeftCorner(8, 8)    = s.A;
  K.topRightCorner(8, 1)   = s.B.row(1).transpose();
  K.bottomLeftCorner(1, 8) = s.C.row(1);
  r.head(8)                = s.f;
  r[5] -= b * ((c * x2[0] - g) / d);
  r[8] = s.g[1];
  x    = K.fullPivLu().solve(r);
  PetscCall(Solve(s, line, answer));
  PetscCall(CheckRight(answer, x.head(8), true));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Unknowns 0 to 2 are held; 3 to 6 float, with row sums of exactly zero, and hang on 2 by a spring 1/d, or on nothing;
   a one-sided row pulls at them
*/
static PetscErrorCode Floating(double d, bool balanced, bool oneSided, const std::string &line)
{
  Saddle    s;
  Answer    answer;
  const int m = d < 0.0 ? 2 : 3;

  PetscFunctionBeginUser;
  Case("a body on a spring of 1 / %g, balanced %d, one-sided row %d, %s", d, balanced, oneSided, line.c_str());
  s.A                     = Matrix::Zero(7, 7);
  s.A.topLeftCorner(3, 3) = Held(3);
  for (int i = 3; i < 6; i++) {
    s.A(i, i) += 2.0;
    s.A(i + 1, i + 1) += 2.0;
    s.A(i, i + 1) = s.A(i + 1, i) = -2.0;
  }
  s.B = s.C = Matrix::Zero(m, 7);
  s.C(0, 0) = s.B(0, 0) = 1.0;
  s.C(0, 1) = s.B(0, 1) = -0.5;
  s.B(1, 3)             = -0.25;
  if (!oneSided) {
    s.B(1, 3) = 0.0;
    s.C(1, 1) = s.B(1, 1) = 1.0;
  }
  s.D       = Matrix::Zero(m, m);
  s.D(1, 1) = 1.0;
  if (m > 2) {
    s.C(2, 2) = s.B(2, 2) = -1.0;
    s.C(2, 4) = s.B(2, 4) = 1.0;
    s.D(2, 2)             = d;
  }
  s.f = Vector::Constant(7, 0.5);
  s.g = Vector::Constant(m, 0.125);
  /* with what the one-sided row pulls at the body, -0.25 g_1, these are -0.28125 */
  s.f.tail(4) << 1.0, -2.0, 0.5, 0.25;
  const double force = oneSided ? -0.25 * s.g[1] : 0.0;

  if (balanced) s.f[6] -= s.f.tail(4).sum() + force;
  PetscCall(Solve(s, line, answer));
  if (m == 2) {
    PetscCall(CheckNone(s, answer));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  /*
     the force in the spring balances those on the body; with it known the held part is regular, the spring says where
     unknown 4 is, and springs the rest
  */
  const double spring = s.f.tail(4).sum() + force;
  const int    extra  = oneSided ? 1 : 2;
  Matrix       K      = Matrix::Zero(3 + extra, 3 + extra);
  Vector       r(3 + extra), x(7), y;

  K.topLeftCorner(3, 3) = s.A.topLeftCorner(3, 3);
  for (int i = 0; i < extra; i++) {
    K.col(3 + i).head(3) = s.B.row(i).head(3).transpose();
    K.row(3 + i).head(3) = s.C.row(i).head(3);
    K(3 + i, 3 + i)      = -s.D(i, i);
  }
  r << s.f.head(3), s.g.head(extra);
  r[2] += spring;
  y         = K.fullPivLu().solve(r);
  x.head(3) = y.head(3);
  x[4]      = s.g[2] + d * spring + x[2];
  x[3]      = x[4] + (s.f[3] + force) / 2.0;
  x[5]      = x[4] + (s.f[5] + s.f[6]) / 2.0;
  x[6]      = x[5] + s.f[6] / 2.0;
  /* rounding of the forces decides where the body is; its own springs are right, and each row holds */
  if (answer.solved && balanced && d > 1.0) {
    PetscCall(Check("rows", SaddleResidual(s, answer.x, answer.lambda), 1e-11));
    answer.x.tail(4).array() += x[4] - answer.x[4];
  }
  PetscCall(CheckRight(answer, x, d <= 1.0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Unknown 5 has no stiffness: in its weight x_5 = g_0 and x_5 + e (x_0 - x_1) = g_1 are one row. A third row says what
   x_0 - x_1 is, off by so much
*/
static PetscErrorCode LeftOut(double e, bool third, double off, const std::string &line)
{
  Saddle    s;
  Answer    answer;
  const int m = third ? 3 : 2;
  Matrix    K = Matrix::Zero(6, 6);
  Vector    r(6), x(6);

  PetscFunctionBeginUser;
  Case("rows that differ by %g beside an unknown without stiffness, a third row %d, off by %g, %s", e, third, off,
       line.c_str());
  s.A                     = Matrix::Zero(6, 6);
  s.A.topLeftCorner(5, 5) = Held(5);
  s.C                     = Matrix::Zero(m, 6);
  s.C(0, 5) = s.C(1, 5) = 1.0;
  s.C(1, 0)             = e;
  s.C(1, 1)             = -e;
  s.f                   = Vector::Constant(6, 0.5);
  s.f[5]                = 0.0;
  s.g                   = Vector::Zero(m);
  s.g[0]                = 0.5;
  s.g[1]                = 0.5 + 0.25 * e; /* x_0 - x_1 = 0.25 */
  if (third) {
    s.C(2, 0) = 1.0;
    s.C(2, 1) = -1.0;
    s.g[2]    = 0.25 + off;
  }
  s.B = s.C;
  PetscCall(Solve(s, line, answer));
  if (off != 0.0) {
    PetscCall(CheckNone(s, answer));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  K.topLeftCorner(5, 5) = s.A.topLeftCorner(5, 5);
  K(0, 5) = K(5, 0) = 1.0;
  K(1, 5) = K(5, 1) = -1.0;
  r << s.f.head(5), 0.25;
  x    = K.fullPivLu().solve(r);
  x[5] = 0.5;
  PetscCall(CheckRight(answer, x, false));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (const char *pc : {"", "-ainsworth_pc_type jacobi",
                         "-ainsworth_pc_type redundant -ainsworth_redundant_pc_factor_zeropivot 1e-300"}) {
    const std::string line = pc, field = line + " -pc_ainsworth_multiplier_fields 1";

    for (double d : {1.0, 1e-6, 1e-14}) PetscCall(Known(1.0, 1.0, d, 0.25, field));
    /* as drawn: x of 1e28 from f of 1, and none of its digits is lost */
    PetscCall(Known(1e8, 3e7, 2e-14, 1.06e8, field));
    for (bool oneSided : {false, true}) {
      PetscCall(Floating(1.0, false, oneSided, field));
      PetscCall(Floating(-1.0, false, oneSided, field));
      for (double d : soft)
        for (bool balanced : {false, true}) PetscCall(Floating(d, balanced, oneSided, field));
    }
    PetscCall(LeftOut(1.0, false, 0.0, line));
    for (double e : {1e-4, 1e-8}) {
      PetscCall(LeftOut(e, false, 0.0, line));
      PetscCall(LeftOut(e, true, 0.0, line));
      PetscCall(LeftOut(e, true, 0.5, line));
    }
    PetscCall(LeftOut(3e-10, true, 0.0, line));
    PetscCall(LeftOut(3e-10, true, 0.5, line));
  }
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
