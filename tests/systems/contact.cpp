/* Contact as penalty, compliance, perturbation and friction make it */
#include "contact.h"

Blocks BlocksMake(int lower, int upper, double stiffness)
{
  const Grid   below = {lower, lower / 2, 1.0, 0.5}, above = {upper, upper / 2, 1.0, 0.5};
  const int    nl = 2 * below.Nodes();
  const Matrix Al = PlaneStrain(
                 below, [](int, int) { return 1.0; }, 0.3),
               Au = PlaneStrain(
                 above, [=](int, int) { return stiffness; }, 0.3);
  Blocks b;

  b.A       = Diagonal({Al, Au});
  b.f       = Vector::Zero(b.A.rows());
  b.normal  = Matrix::Zero(upper + 1, b.A.rows());
  b.tangent = Matrix::Zero(upper + 1, b.A.rows());
  for (int i = 0; i <= upper; i++)
    b.f[nl + 2 * above.Node(i, above.ny) + 1] = -0.01 * stiffness * (1.0 + i) / (upper + 1.0);
  for (int i = 0; i <= lower; i++)
    for (int c = 0; c < 2; c++) Clamp(b.A, b.f, 2 * below.Node(i, 0) + c);
  for (int i = 0; i <= upper; i++) Clamp(b.A, b.f, nl + 2 * above.Node(i, above.ny));
  for (int i = 0; i <= upper; i++) { /* the segment below node i, and where on it the node is */
    const int    segment = std::min(lower - 1, i * lower / upper);
    const double where   = (double)i * lower / upper - segment;

    for (int c = 0; c < 2; c++) {
      Matrix &rows = c ? b.normal : b.tangent;

      rows(i, nl + 2 * above.Node(i, 0) + c)             = 1.0;
      rows(i, 2 * below.Node(segment, below.ny) + c)     = where - 1.0;
      rows(i, 2 * below.Node(segment + 1, below.ny) + c) = -where;
    }
  }
  return b;
}

void ContactMake(Saddle &s, const Blocks &b)
{
  s.A = b.A;
  s.f = b.f;
  s.B = s.C = b.normal;
  s.g       = Vector::Zero(s.C.rows());
  for (Eigen::Index i = 0; i < s.g.size(); i++) s.g[i] = 1e-3 * std::sin(1.0 + (double)i); /* gaps */
  s.bs = 2;
}

/* Consistent mass of the interface, as mortar methods regularise with */
static Matrix LineMass(Eigen::Index m, double factor)
{
  Matrix M = Matrix::Zero(m, m);

  for (Eigen::Index i = 0; i + 1 < m; i++) {
    M(i, i) += factor / 3.0;
    M(i + 1, i + 1) += factor / 3.0;
    M(i, i + 1) += factor / 6.0;
    M(i + 1, i) += factor / 6.0;
  }
  return M;
}

/* Slipping nodes: the multiplier of the normal does work along the tangent, too */
static void Coulomb(Saddle &s, const Blocks &b, double mu)
{
  ContactMake(s, b);
  s.B = b.normal + mu * b.tangent;
}

/* A share of the nodes sticks: both components are tied, and those rows are symmetric */
static void StickSlip(Saddle &s, const Blocks &b, double mu, int stick)
{
  const Eigen::Index m = b.normal.rows();

  Coulomb(s, b, mu);
  s.B.conservativeResize(m + stick, Eigen::NoChange);
  s.C.conservativeResize(m + stick, Eigen::NoChange);
  s.g.conservativeResize(m + stick);
  for (int i = 0; i < stick; i++) {
    s.B.row(i)     = b.normal.row(i);
    s.B.row(m + i) = s.C.row(m + i) = b.tangent.row(i);
    s.g[m + i]                      = 0.0;
  }
}

/* Every value of B is off by up to this share: linearised finite sliding, Petrov-Galerkin */
static void Disturb(Saddle &s, double share)
{
  Random r = SaddleRandom(s.name);

  for (Eigen::Index i = 0; i < s.B.rows(); i++)
    for (Eigen::Index j = 0; j < s.B.cols(); j++) s.B(i, j) *= 1.0 + share * (double)r.Real(-1.0, 1.0);
}

void AddContact(Entries &all)
{
  auto compliant = [&](const std::string &name, int lower, int upper, const std::function<Matrix(int)> &D) {
    all.push_back({"compliant contact", "compliant_" + name, [=](Saddle &s) {
                     ContactMake(s, BlocksMake(lower, upper, 10.0));
                     s.D = D((int)s.C.rows());
                     if (s.D.maxCoeff() > 1e3) s.A.diagonal().array() += 1e-2; /* such a contact holds nothing */
                   }});
  };
  auto constant = [](double d) { return [=](int m) { return Matrix(Matrix::Identity(m, m) * d); }; };

  for (int e : {-16, -12, -9, -6, -3, 0, 2, 16}) compliant("1e" + std::to_string(e), 8, 6, constant(std::pow(10.0, e)));
  compliant("mixed", 10, 8, [](int m) {
    Random r = SaddleRandom("mixed");
    return Logs(r, m, -12.0, 2.0);
  });
  compliant("mixed_wide", 10, 8, [](int m) {
    Random r = SaddleRandom("wide");
    Matrix D = Logs(r, m, -16.0, 16.0);
    for (int i = 0; i < m; i += 3) D(i, i) = 0.0;
    return D;
  });
  for (int e : {-8, -2, 2})
    compliant("mass_1e" + std::to_string(e), 10, 8, [=](int m) { return LineMass(m, std::pow(10.0, e) / m); });

  for (double E : {1.0, 210e9}) {
    const std::string unit = E > 1.0 ? "_pascal" : "";

    all.push_back({"perturbed Lagrangian", "perturbed" + unit, [=](Saddle &s) {
                     ContactMake(s, BlocksMake(8, 12, 1.0));
                     s.A *= E;
                     s.f *= E;
                     s.D = Matrix::Identity(s.C.rows(), s.C.rows()) * 1e-8;
                   }});
    all.push_back({"perturbed Lagrangian", "perturbed_scaled" + unit,
                   [=](Saddle &s) { /* rows in units of their own */
                                    Random r = SaddleRandom(s.name);

                                    ContactMake(s, BlocksMake(8, 6, 0.1));
                                    const Matrix units = Logs(r, (int)s.C.rows(), -3.0, 3.0);
                                    s.A *= E;
                                    s.f *= E;
                                    s.B = s.C = units * s.C;
                                    s.g       = units * s.g;
                                    s.D       = Matrix::Identity(s.C.rows(), s.C.rows()) * 1e-8;
                   }});
  }

  for (int tenths : {2, 5, 9})
    all.push_back({"friction", "coulomb_" + std::to_string(tenths),
                   [=](Saddle &s) { Coulomb(s, BlocksMake(10, 8, 10.0), tenths / 10.0); }});
  for (int tenths : {3, 9})
    all.push_back({"friction", "stick_slip_" + std::to_string(tenths),
                   [=](Saddle &s) { StickSlip(s, BlocksMake(8, 8, 1e-3), tenths / 10.0, 3); }});
  for (int percent : {10, 30, 100})
    all.push_back({"friction", "asymmetric_" + std::to_string(percent), [=](Saddle &s) {
                     ContactMake(s, BlocksMake(10, 8, 10.0));
                     Disturb(s, percent / 100.0);
                   }});
  all.push_back({"friction", "coulomb_compliant", [](Saddle &s) {
                   Coulomb(s, BlocksMake(8, 10, 10.0), 0.4);
                   s.D = Matrix::Identity(s.C.rows(), s.C.rows()) * 1e-4;
                 }});
}
