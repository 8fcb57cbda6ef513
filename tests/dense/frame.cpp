static char help[] = "The frame of the dominant contact normal: the rotation, M_*, A~ and null spaces in it, and that solutions do not feel it.\n\n";

#include "dense.h"
#include <Eigen/Geometry>
#include <cmath>

/* Rows of C: slip along normals near one direction, or stick */
struct Contact {
  const char *name;
  PetscInt    bs;
  PetscReal   normal[4], spread;
  bool        stick;
  bool        turned; /* is a rotation expected? */
};

static PetscErrorCode CreateC(const Contact &contact, const Spec &spec, Mat A, Mat *C)
{
  const PetscInt bs = contact.bs, nodes = spec.n / bs / 2;
  PetscInt       start, end, n;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, n, spec.m, spec.n, 8, NULL, 8, NULL, C));
  PetscCall(MatGetOwnershipRange(*C, &start, &end));
  for (PetscInt row = start; row < end; row++) {
    const PetscInt pair = contact.stick ? row / bs : row;
    for (PetscInt c = 0; c < bs; c++) {
      const PetscReal value = contact.stick ? (row % bs == c ? 1.0 : 0.0) : contact.normal[c] + contact.spread * Uniform(91, row, c);
      if (value == 0.0) continue;
      PetscCall(MatSetValue(*C, row, bs * (nodes + pair % nodes) + c, value, INSERT_VALUES));
      PetscCall(MatSetValue(*C, row, bs * (pair % nodes) + c, -0.8 * value, INSERT_VALUES));
    }
  }
  PetscCall(MatAssemblyBegin(*C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*C, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* T at every node, made by Eigen: the smallest rotation of the dominant normal onto the nearest axis */
static Dense Rotation(const Dense &C, PetscInt bs, Column &normal)
{
  Eigen::Matrix3d    N = Eigen::Matrix3d::Zero();
  Eigen::Vector3d    n;
  Eigen::Index       axis;
  const Eigen::Index nodes = C.cols() / bs;
  Dense              T     = Dense::Zero(C.cols(), C.cols());

  for (Eigen::Index i = 0; i < C.rows(); i++)
    for (Eigen::Index k = 0; k < nodes; k++)
      N.topLeftCorner(bs, bs) += (C.row(i).segment(k * bs, bs).adjoint() * C.row(i).segment(k * bs, bs)).real() / C.row(i).squaredNorm();
  n = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(N).eigenvectors().col(2);
  n.cwiseAbs().maxCoeff(&axis);
  if (n[axis] < 0) n = -n;
  normal                    = n.cast<PetscScalar>();
  const Eigen::Matrix3d one = Eigen::Quaterniond::FromTwoVectors(n, Eigen::Vector3d::Unit(axis)).toRotationMatrix();
  for (Eigen::Index k = 0; k < nodes; k++) T.block(k * bs, k * bs, bs, bs) = one.topLeftCorner(bs, bs).cast<PetscScalar>();
  return T;
}

static PetscErrorCode Frame(const Contact &contact)
{
  Spec         spec;
  System       sys;
  DenseSystem  d;
  Mat          nest, Ct, S, M;
  KSP          ksp[2], inner;
  PC           pc;
  Vec          v, b, y[2];
  PetscScalar  sum;
  MatNullSpace near;
  Dense        dense[2], T;
  Column       normal, given, got;
  std::string  text;

  PetscFunctionBeginUser;
  Case("%s", contact.name);
  spec.bs = contact.bs;
  spec.n  = 36;
  spec.m  = 6;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(MatDestroy(&sys.C));
  PetscCall(CreateC(contact, spec, sys.A, &sys.C));
  PetscCall(VecDestroy(&sys.g));
  PetscCall(MatCreateVecs(sys.C, NULL, &sys.g));
  PetscCall(SetRandom(sys.g, 71));
  PetscCall(Gather(sys, d));
  PetscCall(VecDuplicate(sys.f, &v));
  PetscCall(SetRandom(v, 70));
  PetscCall(VecSum(v, &sum));
  PetscCall(VecShift(v, -sum / (PetscReal)spec.n)); /* a second one is constant */
  PetscCall(VecNormalize(v, NULL));
  PetscCall(Gather(v, given));
  PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_TRUE, 1, &v, &near));
  PetscCall(MatSetNearNullSpace(sys.A, near));
  PetscCall(MatNullSpaceDestroy(&near));
  PetscCall(VecDestroy(&v));
  PetscCall(MatCreateHermitianTranspose(sys.C, &Ct));
  PetscCall(NestCreate(sys.A, Ct, sys.C, NULL, false, &nest));
  PetscCall(MatDestroy(&Ct));
  PetscCall(MatGetLocalSize(nest, &spec.n, NULL));
  PetscCall(VecCreateMPI(PETSC_COMM_WORLD, spec.n, PETSC_DECIDE, &b));
  PetscCall(SetRandom(b, 72));

  /* without a frame, and with one where it should be */
  T = contact.turned ? Rotation(d.C, contact.bs, normal) : Dense(Dense::Identity(d.A.rows(), d.A.rows()));
  for (int turned = 0; turned < 2; turned++) {
    const Dense turn = turned ? T : Dense(Dense::Identity(T.rows(), T.rows()));
    PetscBool   constant;
    PetscInt    nv;
    const Vec  *vecs;

    PetscCall(SolverCreate(nest, &ksp[turned]));
    PetscCall(KSPGetPC(ksp[turned], &pc));
    if (!turned) PetscCall(PCAinsworthSetFrameType(pc, PC_AINSWORTH_FRAME_NONE));
    PetscCall(KSPSetUp(ksp[turned]));
    PetscCall(ViewText(ksp[turned], text));
    PetscCall(CheckText("view", text, {turned && contact.turned ? "frame: components turned, dominant contact normal" : "frame: the program's components"}));
    PetscCall(PCAinsworthGetKSP(pc, &inner));
    PetscCall(KSPGetOperators(inner, &S, &M));
    for (int k = 0; k < 2; k++) {
      Dense op;

      PetscCall(Gather(k ? M : S, op));
      if (!turned) dense[k] = op;
      else PetscCall(CheckEqual(k ? "M in the frame" : "A~ in the frame", op, turn * dense[k] * turn.adjoint(), 1e-12));
      PetscCall(MatGetNearNullSpace(k ? M : S, &near));
      PetscCall(CheckTrue("near null space", near != NULL));
      if (!near) continue;
      PetscCall(MatNullSpaceGetVecs(near, &constant, &nv, &vecs));
      PetscCall(CheckInt("vectors of the near null space", nv + (constant ? 1 : 0), 2));
      PetscCall(CheckTrue("a constant where nothing is turned", constant == (PetscBool) !(turned && contact.turned)));
      PetscCall(Gather(vecs[0], got));
      PetscCall(CheckEqual("near null space in the frame", got, turn * given, 1e-12));
      if (nv < 2) continue;
      PetscCall(Gather(vecs[1], got));
      PetscCall(CheckEqual("constant in the frame", got, turn * Column::Ones(T.rows()) / std::sqrt((PetscReal)T.rows()), 1e-12));
    }
    PetscCall(VecDuplicate(b, &y[turned]));
    PetscCall(KSPSolve(ksp[turned], b, y[turned]));
    PetscCall(KSPDestroy(&ksp[turned]));
  }
  PetscCall(Gather(y[0], got));
  PetscCall(Gather(nest, dense[0]));
  PetscCall(Gather(b, given));
  PetscCall(CheckEqual("solution without a frame", got, dense[0].fullPivLu().solve(given), 1e-9));
  PetscCall(Gather(y[1], got));
  PetscCall(CheckEqual("solution in the frame", got, dense[0].fullPivLu().solve(given), 1e-9));
  for (Vec *vec : {&b, &y[0], &y[1]}) PetscCall(VecDestroy(vec));
  PetscCall(MatDestroy(&nest));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  const Contact contacts[] = {
    {"3-D slip, turned",        3, {0.3, -0.5, 0.8}, 0.2, false, true },
    {"3-D slip, downwards",     3, {0.9, 0.2, -1.0}, 0.1, false, true },
    {"3-D slip along an axis",  3, {0.0, 0.0, 1.0},  0.0, false, false},
    {"3-D stick",               3, {0.0, 0.0, 0.0},  0.0, true,  false},
    {"2-D slip, turned",        2, {-0.4, 0.6, 0.0}, 0.1, false, true },
    {"scalar unknowns",         1, {0.5, 0.0, 0.0},  0.1, false, false},
    {"four unknowns in a node", 4, {0.5, 0.2, 0.1},  0.1, false, false}
  };
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  {
    Options options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12");
    for (const Contact &contact : contacts) PetscCall(Frame(contact));
    Options paper("-pc_ainsworth_variant paper");
    PetscCall(Frame(contacts[0]));
  }
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
