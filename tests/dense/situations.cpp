static char help[] = "Situations of PCAINSWORTH, each a row: a system, options, what is done, and what comes of it.\n\
-table <name>, of which those rows that have the text of -row in their name.\n\n";

#include "situations.h"
#include <cstdarg>
#include <cstring>
#include <map>

static std::string only; /* rows whose name has this in it */

static bool Same(const Dense &a, const Dense &b) /* bit by bit: NaN is NaN */
{
  return a.size() == b.size() && !memcmp(a.data(), b.data(), a.size() * sizeof(PetscScalar));
}

/* What differs, at places that are there or new ones */
static PetscErrorCode WriteChanges(const Dense &now, const Dense &before, Mat M)
{
  PetscInt start, end;

  PetscFunctionBeginUser;
  if (!M || Same(now, before)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetOwnershipRange(M, &start, &end));
  for (PetscInt i = start; i < end; i++)
    for (PetscInt j = 0; j < now.cols(); j++)
      if (now(i, j) != 0.0 || before(i, j) != 0.0) PetscCall(MatSetValue(M, i, j, now(i, j), INSERT_VALUES));
  PetscCall(MatAssemblyBegin(M, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(M, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Live::Write()
{
  PetscFunctionBeginUser;
  PetscCall(WriteChanges(d.A, written.A, sys.A));
  PetscCall(WriteChanges(d.C, written.C, sys.C));
  if (!(storage & VIEW)) PetscCall(WriteChanges(d.Upper(), written.Upper(), Ct));
  PetscCall(Scatter(d.f, sys.f));
  PetscCall(Scatter(d.g, sys.g));
  written = d;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode UpperCreate(Live &s)
{
  PetscFunctionBeginUser;
  if (s.storage & VIEW) PetscCall(MatCreateHermitianTranspose(s.sys.C, &s.Ct));
  if (s.storage & EXPLICIT) PetscCall(MatHermitianTranspose(s.sys.C, MAT_INITIAL_MATRIX, &s.Ct));
  if (s.d.B.size()) PetscCall(WriteChanges(s.d.Upper(), s.d.C.adjoint(), s.Ct));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Live::Create()
{
  PetscInt m;

  PetscFunctionBeginUser;
  if (d.spec.name) {
    PetscCall(SystemCreate(PETSC_COMM_WORLD, d.spec, &sys));
    PetscCall(Gather(sys, d));
    original = d;
  } else PetscCall(SystemFromDense(d, storage & CROSSED, &sys));
  for (Mat M : {sys.A, sys.C}) PetscCall(MatSetOption(M, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  PetscCall(UpperCreate(*this));
  if (d.D.size()) {
    PetscCall(VecGetLocalSize(sys.g, &m));
    PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, m, m, PETSC_DETERMINE, PETSC_DETERMINE, 1, NULL, 0, NULL, &D));
    PetscCall(WriteDense(d.D, D));
  }
  written = d;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Live::Renew(const std::string &some)
{
  const auto renewed = [&](char block) { return some.find(block) != std::string::npos; };
  Live       other(d, storage);
  Mat        old = nest;

  PetscFunctionBeginUser;
  other.d.spec.name = NULL;
  if (!some.empty()) PetscCall(other.Create());
  if (renewed('A')) std::swap(sys.A, other.sys.A);
  if (renewed('B')) std::swap(Ct, other.Ct);
  if (renewed('C')) {
    std::swap(sys.C, other.sys.C);
    std::swap(sys.f, other.sys.f);
    std::swap(sys.g, other.sys.g);
  }
  PetscCall(NestCreate(sys.A, Ct, sys.C, D, storage & FIRST, &nest));
  PetscCall(KSPSetOperators(ksp, nest, nest));
  PetscCall(MatDestroy(&old));
  PetscCall(other.Destroy());
  written = d;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Live::Solve(bool transposed)
{
  PetscFunctionBeginUser;
  PetscCall(Write());
  PetscCall(SolveFields(ksp, sys, storage & FIRST, storage & NESTED, x, lambda, transposed));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(PCGetFailedReason(pc, &failure));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Live::Destroy()
{
  PetscFunctionBeginUser;
  for (Mat *M : {&Ct, &D}) PetscCall(MatDestroy(M));
  PetscCall(RunDestroy(this));
  PetscFunctionReturn(PETSC_SUCCESS);
}

Column RandomColumn(PetscInt size, PetscInt seed)
{
  Column v(size);

  for (PetscInt i = 0; i < size; i++) v[i] = Uniform(seed, i, 0);
  return v;
}

DenseSystem Chain(PetscInt n, PetscInt m, PetscReal diagonal)
{
  DenseSystem d;

  d.A = Dense::Zero(n, n);
  d.C.resize(m, n);
  d.f.resize(n);
  d.g.resize(m);
  for (PetscInt i = 0; i < n; i++) {
    d.A(i, i) = diagonal;
    if (i) d.A(i, i - 1) = d.A(i - 1, i) = -1.0;
    d.f[i] = Uniform(8, i, 0);
  }
  for (PetscInt i = 0; i < m; i++) {
    for (PetscInt j = 0; j < n; j++) d.C(i, j) = Uniform(7, i, j);
    d.g[i] = Uniform(9, i, 0);
  }
  return d;
}

PetscErrorCode WithoutZeros(Live &s)
{
  PetscFunctionBeginUser;
  PetscCall(Stored(s, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Stored(Live &s, MPI_Comm comm)
{
  PetscFunctionBeginUser;
  for (Mat *M : {&s.sys.A, &s.sys.C}) {
    const Dense &values = M == &s.sys.A ? s.d.A : s.d.C;
    PetscInt     m, n;

    PetscCall(MatGetLocalSize(*M, &m, &n));
    PetscCall(MatDestroy(M));
    PetscCall(MatCreateAIJ(comm, m, n, values.rows(), values.cols(), 40, NULL, 40, NULL, M));
    PetscCall(MatSetOption(*M, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
    PetscCall(WriteDense(values, *M));
  }
  s.written = s.original = s.d;
  PetscCall(MatDestroy(&s.Ct));
  PetscCall(UpperCreate(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

std::string Text(const char *format, ...)
{
  char    text[256];
  va_list arguments;

  va_start(arguments, format);
  vsnprintf(text, sizeof(text), format, arguments);
  va_end(arguments);
  return text;
}

PetscErrorCode Live::Start(const std::string &line, const Action &blocks)
{
  PetscFunctionBeginUser;
  options.reset(new Options(line));
  PetscCall(Create());
  if (blocks) PetscCall(blocks(*this));
  PetscCall(NestCreate(sys.A, Ct, sys.C, D, storage & FIRST, &nest));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Row(const std::string &name, const Saddle &system, const std::string &options,
                   const std::vector<Action> &actions, int storage, const Action &blocks)
{
  Live s(system, storage);

  PetscFunctionBeginUser;
  if (name.find(only) == std::string::npos) PetscFunctionReturn(PETSC_SUCCESS);
  Case("%s", name.c_str());
  PetscCall(s.Start(options, blocks));
  for (size_t k = 0; k < actions.size(); k++) {
    Case("%s, action %d", name.c_str(), (int)k);
    const PetscErrorCode code = actions[k](s);
    if (code) fprintf(stderr, "FAILED: %s, action %d: an error\n", name.c_str(), (int)k);
    PetscCall(code);
  }
  PetscCall(s.Destroy());
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  const std::map<std::string, PetscErrorCode (*)()> tables = {
    {"dependent",  Dependent  },
    {"inner",      InnerSolver},
    {"loose",      Loose      },
    {"monitored",  Monitored  },
    {"nullspaces", NullSpaces },
    {"rebuilt",    Rebuilt    },
    {"refusals",   Refusals   },
    {"sequences",  Sequences  },
    {"stiffness",  NoStiffness},
    {"systems",    Systems    },
    {"truth",      Truth      },
    {"unusual",    Unusual    },
    {"viewed",     Views      }
  };
  char table[64] = "", part[256] = "";
  int  exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(PetscLogDefaultBegin());
  PetscCall(AinsworthInitializePackage());
  PetscCall(PetscOptionsGetString(NULL, NULL, "-table", table, sizeof(table), NULL));
  PetscCall(PetscOptionsGetString(NULL, NULL, "-row", part, sizeof(part), NULL));
  PetscCheck(tables.count(table), PETSC_COMM_WORLD, PETSC_ERR_USER, "-table %s is unknown", table);
  only = part;
  PetscCall(tables.at(table)());
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
