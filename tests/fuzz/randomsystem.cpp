#include "randomsystem.h"

uint64_t Random::Bits()
{
  uint64_t z = (state += 0x9e3779b97f4a7c15u); /* splitmix64 */
  z          = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z          = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

RandomSystem::RandomSystem(Random &r, bool general)
{
  Stiffness(r);
  Constraints(r);
  MultiplierBlock(r, general);
  RightHandSide(r);
}

/* Bodies of springs; a body may float, be stiff or soft, have prescribed unknowns */
void RandomSystem::Stiffness(Random &r)
{
  bs                = r.Chance(0.7) ? 1 : r.Int(2, 3);
  const int       n = bs * r.Int(1, 30 / bs), bodies = r.Int(1, 3);
  const PetscReal range  = r.Chance(0.5) ? 0.0 : r.Int(1, 12);
  bool            floats = false;

  A         = Dense::Zero(n, n);
  symmetric = true;
  difficult = false;
  for (int body = 0; body < bodies; body++) {
    const int       from = n / bs * body / bodies * bs, to = n / bs * (body + 1) / bodies * bs; /* blocks are not cut */
    const PetscReal E    = PetscPowReal(10.0, body ? r.Real(-range, range) : 0.0);
    const bool      held = r.Chance(0.7);

    floats = floats || !held;
    for (int i = from; i < to; i++) {
      if (held) A(i, i) += E * r.Real(0.05, 1.0);
      for (int j = from; j < i; j++) {
        if (!r.Chance(i - j < 3 ? 0.8 : 0.05)) continue;
        const PetscReal k = E * r.Real(0.2, 1.0), sign = r.Chance(0.8) ? 1.0 : -1.0; /* k (u_i -+ u_j)^2 */
        A(i, i) += k;
        A(j, j) += k;
        A(i, j) -= sign * k;
        A(j, i) -= sign * k;
      }
    }
  }
  for (int i = 0; i < n; i++) {
    if (!r.Chance(0.05)) continue;
    A.row(i).setZero(); /* a prescribed unknown */
    A.col(i).setZero();
    A(i, i) = 1.0;
  }
  if (range <= 2.0 && r.Chance(0.1)) { /* GMRES has no norm that is fair to soft bodies */
    A(r.Int(0, n - 1), r.Int(0, n - 1)) += A.norm() * r.Real(-1.0, 1.0) / n;
    symmetric = A == A.adjoint();
    difficult = true;
  }
  if (r.Chance(0.04)) {
    const int i = r.Int(0, n - 1);
    A(i, i)     = r.Chance(0.5) ? 0.0 : -A(i, i);
    difficult   = true;
  }
  if (A.norm() == 0.0) A(0, 0) = 1.0; /* no A at all is an error of its own */
  uneven  = range > 2.0;
  decades = range;
  text    = "n=" + std::to_string(n) + " bs=" + std::to_string(bs) + " bodies=" + std::to_string(bodies) + " range=1e" +
         std::to_string((int)range) + (floats ? " floating" : "") + (difficult ? " difficult" : "");
}

void RandomSystem::Constraints(Random &r)
{
  const int       n = (int)A.rows(), m = r.Chance(0.05) ? n : r.Int(0, PetscMin(n, 12));
  const PetscReal range = r.Chance(0.6) ? 0.0 : r.Int(1, 12), dependent = r.Chance(0.5) ? 0.0 : 0.2,
                  zero = r.Chance(0.7) ? 0.0 : 0.2;
  int copies           = 0;

  uneven = uneven || range > 2.0;
  C      = Dense::Zero(m, n);
  for (int i = 0; i < m; i++) {
    if (r.Chance(zero)) continue;
    if (i && r.Chance(dependent)) {
      for (int k = r.Int(1, 3); k > 0; k--) {
        const int other = r.Int(0, i - 1);
        if (C.row(other).norm() > 0.0) C.row(i) += C.row(other) / C.row(other).norm() * (PetscReal)r.Int(-2, 2);
      }
      copies++;
    } else {
      for (int k = r.Int(1, 4); k > 0; k--)
        C(i, r.Int(0, n - 1)) += r.Chance(0.3) ? (PetscReal)r.Int(-1, 1) : r.Real(-1.0, 1.0);
    }
    if (C.row(i).norm() < 1e-3) C.row(i).setZero();
    C.row(i) *= PetscPowReal(10.0, r.Real(-range, range));
  }
  text += " m=" + std::to_string(m) + " scales=1e" + std::to_string((int)range) +
          " dependent=" + std::to_string(copies);
}

void RandomSystem::MultiplierBlock(Random &r, bool general)
{
  const int m   = (int)C.rows();
  bool      any = r.Chance(0.2);

  blockD    = any || r.Chance(0.3);
  first     = r.Chance(0.3);
  nested    = r.Chance(0.3);
  storeZero = r.Chance(0.3);
  form      = r.Int(0, 3);
  D         = Dense::Zero(m, m);
  for (int i = 0; i < m && any; i++) {
    const PetscReal s = C.row(i).squaredNorm();
    if (s == 0.0) D(i, i) = r.Chance(0.5) ? r.Real(0.5, 2.0) : r.Real(-2.0, -0.5);
    else if (r.Chance(0.4)) D(i, i) = -s * PetscPowReal(10.0, r.Real(-3.0, 3.0));
  }
  Ct = C.adjoint();
  if (general && m && r.Chance(0.04)) { /* solvable, but nothing is promised */
    const int i = r.Int(0, m - 1);
    switch (r.Int(0, 2)) {
    case 0: /* B is not C */
      form = 0;
      Ct(r.Int(0, (int)A.rows() - 1), i) += PetscMax(C.row(i).norm(), 1e-3);
      break;
    case 1: /* D with the other sign */
      if (C.row(i).norm() == 0.0) C(i, 0) = 1.0;
      Ct      = C.adjoint();
      D(i, i) = 1.0;
      break;
    default: /* D indefinite */
      if (m > 1) D(0, 1) = D(1, 0) = 1.0;
    }
    difficult = true;
    blockD    = blockD || D.norm() > 0.0;
    text += " general";
  }
  /* of two blocks of the same size the second is the multipliers' */
  if (D.norm() > 0.0 && m == (int)A.rows()) first = false;
  if (D.norm() > 0.0) text += " D";
}

void RandomSystem::RightHandSide(Random &r)
{
  const int n = (int)A.rows(), m = (int)C.rows();
  Column    x(n), lambda(m);

  for (int i = 0; i < n; i++) x[i] = r.Real(-1.0, 1.0);
  for (int i = 0; i < m; i++) lambda[i] = C.row(i).norm() > 0.0 ? r.Real(-1.0, 1.0) / C.row(i).norm() : 0.0;
  f = A * x + Ct * lambda;
  g = C * x + D * lambda;
  if (r.Chance(0.3)) f = A.diagonal().cwiseAbs().cwiseProduct(x);
  if (r.Chance(0.2)) g.setZero();
  if (r.Chance(0.2))
    for (int i = 0; i < m; i++) g[i] = C.row(i).norm() * r.Real(-1.0, 1.0);
  if (r.Chance(0.02)) f.setZero();
}

/* Condition number of G G' without its null space */
static PetscReal SquaredCondition(const Dense &G)
{
  if (!G.size() || G.norm() == 0.0) return 1.0;
  Eigen::JacobiSVD<Dense> svd(G);
  svd.setThreshold(1e-11);
  return PetscSqr(svd.singularValues()[0] / svd.singularValues()[svd.rank() - 1]);
}

/* Pairs of rows and columns are scaled together, by powers of the largest entries: Hermitian stays Hermitian */
Truth::Truth(const RandomSystem &s)
{
  const int n = (int)s.A.rows(), m = (int)s.C.rows();
  Dense     K(n + m, n + m), scaled;
  Column    b(n + m), y;

  K << s.A, s.Ct, s.C, s.D;
  b << s.f, s.g;
  scale = Column::Ones(n + m);
  for (int i = 0; i < n; i++) {
    const PetscReal d = s.A.row(i).cwiseAbs().maxCoeff();
    if (d > 0.0) scale[i] = 1.0 / PetscSqrtReal(d);
  }
  for (int i = 0; i < m; i++) {
    const PetscReal d = PetscMax((s.C.row(i) * scale.head(n).asDiagonal()).norm(),
                                 PetscSqrtReal(PetscAbsScalar(s.D(i, i))));
    if (d > 0.0) scale[n + i] = 1.0 / d;
  }
  gram   = SquaredCondition(scale.tail(m).asDiagonal() * s.C * scale.head(n).asDiagonal());
  scaled = scale.asDiagonal() * K * scale.asDiagonal();
  b      = scale.asDiagonal() * b;
  Eigen::JacobiSVD<Dense> svd(scaled, Eigen::ComputeFullU | Eigen::ComputeFullV);
  svd.setThreshold(1e-11);
  const int rank       = (int)svd.rank();
  y                    = svd.solve(b);
  condition            = rank ? svd.singularValues()[0] / svd.singularValues()[rank - 1] : 1.0;
  x                    = y.head(n);
  size                 = y.norm();
  unique               = rank == n + m || svd.matrixV().topRightCorner(n, n + m - rank).norm() < 1e-8;
  const PetscReal lost = (scaled * y - b).norm() / PetscMax(b.norm(), PETSC_SMALL);
  consistent           = lost < 1e-11;
  /* otherwise the system is one of rounding from one that has a solution */
  contradictory = lost > 1e-5 && condition < 1e6 && !s.uneven;
}

PetscReal Truth::Residual(const RandomSystem &s, const Column &px, const Column &lambda) const
{
  const int    n = (int)s.A.rows(), m = (int)s.C.rows();
  Column       r(n + m), size(n + m);
  const Column ax = px.cwiseAbs(), al = lambda.cwiseAbs();

  r << s.A * px + s.Ct * lambda - s.f, s.C * px + s.D * lambda - s.g;
  size << s.A.cwiseAbs() * ax + s.Ct.cwiseAbs() * al + s.f.cwiseAbs(),
    s.C.cwiseAbs() * ax + s.D.cwiseAbs() * al + s.g.cwiseAbs();
  size = scale.asDiagonal() * size;
  return (scale.asDiagonal() * r).norm() / PetscMax(size.norm(), PETSC_SMALL);
}

PetscReal Truth::Error(const Column &px) const
{
  const Column scaled = scale.head(px.size()).cwiseInverse().asDiagonal() * px;
  return (scaled - x).norm() / PetscMax(size, PETSC_SMALL);
}

PetscInt RandomShare(MPI_Comm comm, Random &r, int total, int bs)
{
  PetscMPIInt rank, size;
  int         left = total / bs, mine = 0;

  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &size);
  for (int k = 0; k < size; k++) {
    int share = r.Int(0, 3) ? r.Int(0, 2 * total / bs / size + 1) : 0;

    if (share > left || k == size - 1) share = left;
    if (k == rank) mine = share;
    left -= share;
  }
  return bs * mine;
}

PetscErrorCode RandomFill(MPI_Comm comm, const Dense &values, PetscInt localRows, PetscInt localColumns, int bs,
                          bool storeZero, Mat *M)
{
  PetscInt start, end;

  PetscFunctionBeginUser;
  PetscCall(MatCreate(comm, M));
  PetscCall(MatSetSizes(*M, localRows, localColumns, values.rows(), values.cols()));
  PetscCall(MatSetBlockSize(*M, bs));
  PetscCall(MatSetType(*M, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(*M, PetscMax(1, (PetscInt)values.cols()), NULL));
  PetscCall(MatMPIAIJSetPreallocation(*M, PetscMax(1, localColumns), NULL, PetscMax(1, (PetscInt)values.cols()), NULL));
  PetscCall(MatGetOwnershipRange(*M, &start, &end));
  for (PetscInt i = start; i < end; i++)
    for (PetscInt j = 0; j < values.cols(); j++)
      if (values(i, j) != 0.0 || (i == j && values.rows() == values.cols()) || (storeZero && (i + j) % 5 == 0))
        PetscCall(MatSetValue(*M, i, j, values(i, j), INSERT_VALUES));
  PetscCall(MatAssemblyBegin(*M, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*M, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The fields of a vector of the nest */
static PetscErrorCode Fields(const RandomSystem &s, Mat nest, IS *primal, IS *multiplier)
{
  IS is[2];

  PetscFunctionBeginUser;
  PetscCall(MatNestGetISs(nest, is, NULL));
  *primal     = is[s.first ? 1 : 0];
  *multiplier = is[s.first ? 0 : 1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode RandomNestCreate(MPI_Comm comm, const RandomSystem &s, Random &r, Mat *nest, Vec *b)
{
  const PetscInt n = RandomShare(comm, r, (int)s.A.rows(), s.bs), m = RandomShare(comm, r, (int)s.C.rows(), 1);
  Mat            A, C = NULL, Ct = NULL, D = NULL;
  IS             is[2];
  Vec            sub, fields[2];

  PetscFunctionBeginUser;
  PetscCall(RandomFill(comm, s.A, n, n, s.bs, s.storeZero, &A));
  if (s.form != 3) PetscCall(RandomFill(comm, s.C, m, n, 1, s.storeZero, &C));
  if (s.form == 0 || s.form == 3) PetscCall(RandomFill(comm, s.Ct, n, m, 1, s.storeZero, &Ct));
  else if (s.form == 1) PetscCall(MatCreateHermitianTranspose(C, &Ct));
  if (s.blockD) PetscCall(RandomFill(comm, s.D, m, m, 1, s.storeZero, &D));
  PetscCall(NestCreate(A, Ct, C, D, s.first, nest));
  for (Mat *M : {&A, &C, &Ct, &D}) PetscCall(MatDestroy(M));
  PetscCall(Fields(s, *nest, &is[0], &is[1]));
  PetscCall(VecCreateMPI(comm, n, s.A.rows(), &fields[0]));
  PetscCall(VecCreateMPI(comm, m, s.C.rows(), &fields[1]));
  PetscCall(Scatter(s.f, fields[0]));
  PetscCall(Scatter(s.g, fields[1]));
  if (s.nested) {
    IS  order[2] = {is[s.first ? 1 : 0], is[s.first ? 0 : 1]};
    Vec parts[2] = {fields[s.first ? 1 : 0], fields[s.first ? 0 : 1]};
    PetscCall(VecCreateNest(comm, 2, order, parts, b));
  } else {
    PetscCall(VecCreateMPI(comm, n + m, PETSC_DECIDE, b));
    for (int k = 0; k < 2; k++) {
      PetscCall(VecGetSubVector(*b, is[k], &sub));
      PetscCall(VecCopy(fields[k], sub));
      PetscCall(VecRestoreSubVector(*b, is[k], &sub));
    }
  }
  for (Vec &v : fields) PetscCall(VecDestroy(&v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode RandomNestSplit(const RandomSystem &s, Mat nest, Vec y, Column &x, Column &lambda)
{
  IS  is[2];
  Vec sub;

  PetscFunctionBeginUser;
  PetscCall(Fields(s, nest, &is[0], &is[1]));
  for (int k = 0; k < 2; k++) {
    PetscCall(VecGetSubVector(y, is[k], &sub));
    PetscCall(Gather(sub, k ? lambda : x));
    PetscCall(VecRestoreSubVector(y, is[k], &sub));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
