static char help[] = "The patch test of contact: two bodies with nu = 0 and matching meshes, pressed together. "
                     "Displacement and pressure are known.\n\n";

#include "dense.h"
#include <cmath>

/*
   Two squares of k x k bilinear elements, one on the other; node (body, i, j) has 2 unknowns; everything is turned by
   an angle
*/
struct Squares {
  PetscInt  k    = 4;
  PetscReal E[2] = {1.0, 3.0}, gamma = 0.01, angle = 0.0;
  bool      stick = false;

  PetscInt  nodes() const { return (k + 1) * (k + 1); }
  PetscInt  node(int body, PetscInt i, PetscInt j) const { return body * nodes() + j * (k + 1) + i; }
  PetscReal pressure() const { return gamma / (1.0 / E[0] + 1.0 / E[1]); }
  bool      fixed(int body, PetscInt j) const { return j == (body ? k : 0); }
  /* vertical displacement: linear in each body */
  PetscReal down(int body, PetscInt j) const
  {
    const PetscReal y = (PetscReal)j / k, p = pressure();
    return body ? -gamma + p / E[1] * (1.0 - y) : -p / E[0] * y;
  }
  void turn(PetscReal x, PetscReal y, PetscReal out[2]) const
  {
    out[0] = std::cos(angle) * x - std::sin(angle) * y;
    out[1] = std::sin(angle) * x + std::cos(angle) * y;
  }
};

/* Stiffness of a square element, nu = 0, in the turned frame; 2 x 2 Gauss points; it does not depend on the size */
static Eigen::Matrix<PetscReal, 8, 8> ElementMatrix(const Squares &s)
{
  const PetscReal gauss = 1.0 / std::sqrt(3.0), corner[4][2] = {
                                                  {-1, -1},
                                                  {1,  -1},
                                                  {1,  1 },
                                                  {-1, 1 }
  };
  Eigen::Matrix<PetscReal, 8, 8> K = Eigen::Matrix<PetscReal, 8, 8>::Zero();
  const Eigen::Vector3d          D(1.0, 1.0, 0.5); /* plane strain with nu = 0, E = 1 */

  for (int q = 0; q < 4; q++) {
    Eigen::Matrix<PetscReal, 3, 8> strain = Eigen::Matrix<PetscReal, 3, 8>::Zero();
    for (int a = 0; a < 4; a++) {
      PetscReal d[2];
      /*
         gradients on the reference square [-1,1]^2: those on an element of size h are 2/h times as large, and the area
         h^2/4
      */
      s.turn(0.25 * corner[a][0] * (1 + corner[a][1] * gauss * corner[q][1]),
             0.25 * corner[a][1] * (1 + corner[a][0] * gauss * corner[q][0]), d);
      strain(0, 2 * a)     = d[0];
      strain(1, 2 * a + 1) = d[1];
      strain(2, 2 * a)     = d[1];
      strain(2, 2 * a + 1) = d[0];
    }
    K += strain.transpose() * D.asDiagonal() * strain;
  }
  return K;
}

static PetscErrorCode Assemble(const Squares &s, Mat *A, Mat *C, Vec *f, Vec *g)
{
  const auto     K = ElementMatrix(s);
  const PetscInt n = 4 * s.nodes(), m = (s.stick ? 2 : 1) * (s.k + 1);
  PetscInt       start, end, local;

  PetscFunctionBeginUser;
  PetscCall(MatCreate(PETSC_COMM_WORLD, A));
  PetscCall(MatSetSizes(*A, PETSC_DECIDE, PETSC_DECIDE, n, n));
  PetscCall(MatSetBlockSize(*A, 2));
  PetscCall(MatSetType(*A, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(*A, 18, NULL));
  PetscCall(MatMPIAIJSetPreallocation(*A, 18, NULL, 18, NULL));
  PetscCall(MatCreateVecs(*A, f, NULL));
  PetscCall(MatGetOwnershipRange(*A, &start, &end));
  for (int body = 0; body < 2; body++) {
    for (PetscInt e = 0; e < s.k * s.k; e++) {
      const PetscInt i = e % s.k, j = e / s.k, level[4] = {j, j, j + 1, j + 1};
      const PetscInt node[4] = {s.node(body, i, j), s.node(body, i + 1, j), s.node(body, i + 1, j + 1),
                                s.node(body, i, j + 1)};

      for (int a = 0; a < 8; a++) {
        const PetscInt row = 2 * node[a / 2] + a % 2;
        if (row < start || row >= end || s.fixed(body, level[a / 2])) continue;
        for (int b = 0; b < 8; b++) {
          PetscReal known[2];
          if (!s.fixed(body, level[b / 2]))
            PetscCall(MatSetValue(*A, row, 2 * node[b / 2] + b % 2, s.E[body] * K(a, b), ADD_VALUES));
          else { /* what is prescribed goes to the right-hand side */ s.turn(0.0, s.down(body, level[b / 2]), known);
            PetscCall(VecSetValue(*f, row, -s.E[body] * K(a, b) * known[b % 2], ADD_VALUES));
          }
        }
      }
    }
    for (PetscInt i = 0; i <= s.k; i++) {
      const PetscInt j = body ? s.k : 0, row = 2 * s.node(body, i, j);
      PetscReal      known[2];
      s.turn(0.0, s.down(body, j), known);
      for (PetscInt c = 0; c < 2 && row >= start && row < end; c++) {
        PetscCall(MatSetValue(*A, row + c, row + c, s.E[body], ADD_VALUES));
        PetscCall(VecSetValue(*f, row + c, s.E[body] * known[c], ADD_VALUES));
      }
    }
  }
  PetscCall(MatAssemblyBegin(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(VecAssemblyBegin(*f));
  PetscCall(VecAssemblyEnd(*f));

  /* upper node minus lower node, along the normal; stick: along the tangent too */
  PetscCall(MatGetLocalSize(*A, &local, NULL));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, local, m, n, 4, NULL, 4, NULL, C));
  PetscCall(MatGetOwnershipRange(*C, &start, &end));
  for (PetscInt row = start; row < end; row++) {
    const PetscInt i = row % (s.k + 1), node[2] = {s.node(0, i, s.k), s.node(1, i, 0)};
    PetscReal      direction[2];

    s.turn(row > s.k ? 1.0 : 0.0, row > s.k ? 0.0 : 1.0, direction);
    for (int body = 0; body < 2; body++)
      for (PetscInt c = 0; c < 2; c++)
        if (PetscAbsReal(direction[c]) > 1e-12)
          PetscCall(MatSetValue(*C, row, 2 * node[body] + c, (body ? 1.0 : -1.0) * direction[c], INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(*C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatCreateVecs(*C, NULL, g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Displacement and contact forces against the exact ones, with the default inner solver */
static PetscErrorCode Patch(const Squares &s)
{
  Mat                A, C, nest;
  Vec                f, g, b, y, parts[2];
  IS                 is[2];
  KSP                ksp;
  KSPConvergedReason reason;
  const PetscInt     m = (s.stick ? 2 : 1) * (s.k + 1);
  Column             got, x(4 * s.nodes()), lambda = Column::Zero(m);

  PetscFunctionBeginUser;
  Case("E %g, angle %g, %s", (double)s.E[1], (double)s.angle, s.stick ? "stick" : "slip");
  PetscCall(Assemble(s, &A, &C, &f, &g));
  PetscCall(NestCreate(A, NULL, C, NULL, false, &nest));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(MatNestGetISs(nest, is, NULL));
  PetscCall(VecDuplicate(f, &parts[0]));
  PetscCall(VecDuplicate(g, &parts[1]));
  PetscCall(VecCreateNest(PETSC_COMM_WORLD, 2, is, parts, &y));
  PetscCall(VecDestroy(&parts[0]));
  PetscCall(VecDestroy(&parts[1]));
  parts[0] = f;
  parts[1] = g;
  PetscCall(VecCreateNest(PETSC_COMM_WORLD, 2, is, parts, &b));
  PetscCall(KSPSolve(ksp, b, y));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckTrue(KSPConvergedReasons[reason], reason > 0));
  for (int body = 0; body < 2; body++) {
    for (PetscInt node = 0; node < s.nodes(); node++) {
      PetscReal u[2];
      s.turn(0.0, s.down(body, node / (s.k + 1)), u);
      x[2 * (body * s.nodes() + node)]     = u[0];
      x[2 * (body * s.nodes() + node) + 1] = u[1];
    }
  }
  /*
     contact pushes the upper body up by -C' lambda: a uniform pressure, half a share of it at the ends, and no friction
  */
  for (PetscInt i = 0; i <= s.k; i++) lambda[i] = -s.pressure() / s.k * (i == 0 || i == s.k ? 0.5 : 1.0);
  PetscCall(VecGetSubVector(y, is[0], &parts[0]));
  PetscCall(Gather(parts[0], got));
  PetscCall(VecRestoreSubVector(y, is[0], &parts[0]));
  PetscCall(CheckEqual("displacement", got, x, 1e-10));
  PetscCall(VecGetSubVector(y, is[1], &parts[1]));
  PetscCall(Gather(parts[1], got));
  PetscCall(VecRestoreSubVector(y, is[1], &parts[1]));
  PetscCall(CheckEqual("contact forces", got, lambda, 1e-8));
  for (Vec *v : {&f, &g, &b, &y}) PetscCall(VecDestroy(v));
  PetscCall(KSPDestroy(&ksp));
  for (Mat *mat : {&A, &C, &nest}) PetscCall(MatDestroy(mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (const char *variant : {"weighted", "paper"}) {
    Options options(std::string("-ainsworth_ksp_rtol 1e-13 -pc_ainsworth_variant ") + variant);
    for (PetscReal E : {3.0, 1e-3, 1e4}) {
      for (PetscReal angle : {0.0, 0.5}) {
        for (bool stick : {false, true}) {
          Squares squares;
          squares.E[1]  = E;
          squares.angle = angle;
          squares.stick = stick;
          PetscCall(Patch(squares));
        }
      }
    }
  }
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
