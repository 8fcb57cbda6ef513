static char help[] = "What PCAINSWORTH leaves out of a scene that does not need it: counts of log events, messages and "
                     "reductions, and the view.\n\n";

#include "dense.h"
#include <map>

/*
   A chain of unit springs fixed at both ends, and rows that tie `per` neighbouring unknowns: rows start every `step`
   unknowns from the first
*/
struct Chain {
  const char *name;
  PetscInt    n = 60, m = 4, per = 2, step = 2;
  bool        homogeneous = false;
};

static PetscErrorCode Create(const Chain &chain, System *sys)
{
  PetscInt start, end;

  PetscFunctionBeginUser;
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, chain.n, chain.n, 3, NULL, 2, NULL, &sys->A));
  PetscCall(MatGetOwnershipRange(sys->A, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    for (PetscInt j = PetscMax(i - 1, 0); j <= PetscMin(i + 1, chain.n - 1); j++)
      PetscCall(MatSetValue(sys->A, i, j, i == j ? 2.0 + 0.1 * Uniform(1, i, i) : -1.0, INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(sys->A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(sys->A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatCreateVecs(sys->A, &sys->f, NULL));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, end - start, chain.m, chain.n, chain.per, NULL, chain.per,
                         NULL, &sys->C));
  PetscCall(MatGetOwnershipRange(sys->C, &start, &end));
  for (PetscInt i = start; i < end; i++)
    for (PetscInt k = 0; k < chain.per; k++)
      PetscCall(MatSetValue(sys->C, i, i * chain.step + k, 1.0 + 0.5 * Uniform(2, i, k), INSERT_VALUES));
  PetscCall(MatAssemblyBegin(sys->C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(sys->C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatCreateVecs(sys->C, NULL, &sys->g));
  PetscCall(SetRandom(sys->f, 3));
  PetscCall(VecDuplicate(sys->f, &sys->w));
  PetscCall(VecSet(sys->w, 1.0));
  if (!chain.homogeneous) PetscCall(SetRandom(sys->g, 4));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const char *const counted[] = {
  "AinsGramMat", "AinsGramFact", "AinsGramSolve",  "AinsInvGram",   "AinsPMat",       "AinsPMatCopy",   "AinsProjector",
  "AinsMatMult", "AinsRHS",      "AinsMultiplier", "MatMatMultNum", "MatCholFctrNum", "MatLUFactorNum", "MatMult"};
using Counts = std::map<std::string, PetscInt>;

static PetscErrorCode Count(Counts &counts)
{
  PetscFunctionBeginUser;
  for (const char *event : counted) PetscCall(EventCount(event, &counts[event]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Three iterations; what they cost with the set-up, the view, and messages and reductions of this rank's projections */
static PetscErrorCode Run(const Chain &chain, const std::string &more, Counts &cost, std::string &view,
                          PetscLogDouble exchanged[2])
{
  Options options("-ainsworth_ksp_max_it 3 -ainsworth_ksp_convergence_test skip -ainsworth_pc_type jacobi " + more);
  System  sys;
  Mat     nest;
  KSP     ksp;
  Vec     b, y, sub;
  IS      is[2];
  Counts  before, after;
  PetscLogEvent      id;
  PetscEventPerfInfo info[2];

  PetscFunctionBeginUser;
  Case("%s %s", chain.name, more.c_str());
  PetscCall(Create(chain, &sys));
  PetscCall(NestCreate(sys.A, NULL, sys.C, NULL, false, &nest));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(MatNestGetISs(nest, is, NULL));
  PetscCall(MatCreateVecs(nest, &y, &b));
  for (int k = 0; k < 2; k++) {
    PetscCall(VecGetSubVector(b, is[k], &sub));
    PetscCall(VecCopy(k ? sys.g : sys.f, sub));
    PetscCall(VecRestoreSubVector(b, is[k], &sub));
  }
  PetscCall(Count(before));
  PetscCall(KSPSolve(ksp, b, y));
  PetscCall(Count(after));
  for (const char *event : counted) cost[event] = after[event] - before[event];
  PetscCall(PetscLogEventGetId("AinsProjector", &id));
  PetscCall(PetscLogEventGetPerfInfo(0, id, &info[0]));
  PetscCall(KSPSolve(ksp, b, y)); /* again: the first exchange of a matrix also sets up how it is done */
  PetscCall(PetscLogEventGetPerfInfo(0, id, &info[1]));
  exchanged[0] = info[1].numMessages - info[0].numMessages;
  exchanged[1] = info[1].numReductions - info[0].numReductions;
  PetscCall(ViewText(ksp, view));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&y));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckNone(const Counts &cost, const std::vector<const char *> &events)
{
  PetscFunctionBeginUser;
  for (const char *event : events) PetscCall(CheckInt(event, cost.at(event), 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  const char *const factor = PetscDefined(USE_COMPLEX) ? "MatLUFactorNum" : "MatCholFctrNum";
  int               exitcode;
  Counts            cost, other;
  std::string       view;
  PetscLogDouble    exchanged[2];
  PetscMPIInt       rank, size;
  PetscInt          own;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(PetscLogDefaultBegin());
  PetscCall(AinsworthInitializePackage());
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  own = 60 / size + (60 % size > rank);

  PetscCall(Run({"no constraints", 60, 0}, "", cost, view, exchanged));
  PetscCall(CheckNone(cost, {"AinsGramMat", "AinsGramFact", "AinsGramSolve", "AinsInvGram", "AinsPMat", "AinsPMatCopy",
                             "AinsProjector", "AinsMatMult", "AinsRHS", "AinsMultiplier", "MatMatMultNum"}));
  PetscCall(CheckText("view", view, {"left out: no constraints: neither projector nor copy of A\n", "type: cg"}));

  PetscCall(Run({"S diagonal"}, "", cost, view, exchanged));
  PetscCall(CheckInt("AinsGramFact", cost["AinsGramFact"], 0));
  PetscCall(CheckNone(cost, {"MatCholFctrNum", "MatLUFactorNum", "AinsMatMult"})); /* projected CG applies A, not A~ */
  PetscCall(CheckText("view", view, {"S is diagonal: no factorization", "C' B C is not applied"}));
  if (size > 1)
    PetscCall(CheckText("view", view,
                        {std::to_string(size - 1) + " of " + std::to_string(size) + " ranks without constraints"}));
  /* the rows are tied to the first 8 unknowns, which rank 0 has: no other rank takes part in a projection */
  PetscCall(CheckTrue("messages of a rank without constraints", rank == 0 || own < 8 || exchanged[0] == 0));
  PetscCall(CheckTrue("reductions of a projection", exchanged[1] == 0));

  PetscCall(Run({"S diagonal, g = 0", 60, 4, 2, 2, true}, "", other, view, exchanged));
  PetscCall(CheckText("view", view, {"g = 0: neither R g nor A R g"}));
  PetscCall(CheckInt("solves with S that g = 0 spares", cost["AinsGramSolve"] - other["AinsGramSolve"], 1));
  PetscCall(CheckInt("products with A and C that g = 0 spares", cost["MatMult"] - other["MatMult"], 1));

  PetscCall(Run({"S in small components", 60, 4, 3, 2}, "", cost, view, exchanged));
  PetscCall(CheckNone(cost, {"MatCholFctrNum", "MatLUFactorNum"}));
  PetscCall(CheckText("view", view,
                      {"S is in small components: dense inverses, no factorization", "type: vpbjacobi",
                       "1 connected component, the largest of 4 rows"}));

  PetscCall(Run({"S in one large piece", 60, 40, 3, 1}, "", cost, view, exchanged));
  if (view.find("type: " + std::string(PetscDefined(USE_COMPLEX) ? "lu" : "cholesky")) == std::string::npos)
    PetscCall(CheckTrue("factorization in the view", false));
  own = cost[factor];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &own, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  PetscCall(CheckInt("ranks that factor", own, 1));

  PetscCall(Run({"jcb"}, "-pc_ainsworth_pmat jcb", cost, view, exchanged));
  PetscCall(Run({"id"}, "-pc_ainsworth_pmat id", other, view, exchanged));
  PetscCall(CheckText("view", view, {"preconditioning matrix of type id: no product with A"}));
  /* C' B C comes with one; S for the rows where the program has them; 6 of some rows, to predict its size */
  PetscCall(CheckInt("products of matrices for jcb", cost["MatMatMultNum"], 7 + 6));
  PetscCall(CheckInt("products of matrices for id", other["MatMatMultNum"], 2)); /* S and C' B C */
  PetscCall(CheckInt("AinsInvGram for id", other["AinsInvGram"], 0));

  PetscCall(Run({"plain CG"}, "-pc_ainsworth_variant paper", cost, view, exchanged));
  PetscCall(CheckTrue("A~ in plain CG", cost["AinsMatMult"] > 0));
  PetscCall(CheckTrue("C' B C in plain CG", view.find("C' B C is not applied") == std::string::npos));

  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
