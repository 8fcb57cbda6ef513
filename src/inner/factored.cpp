/* Factorization of M_*, by our choice or by options: package, ordering and matrix format */
#include "solver.h"
#include "../base/guard.h"
#include "../base/lists.h"
#include "../projection/factor.h"
#include "../projection/graph.h"
#include <unistd.h>

/*
   Returns the type of a factorization for M_*, NULL if there is none, and its package; a complex Hermitian matrix is a
   general one for all of them
*/
PCType AinsworthSolverFactorType(const AinsworthSolver *solver, MatSolverType *package)
{
  PetscMPIInt size;
  const bool  definite = solver->saddle->symmetric && !PetscDefined(USE_COMPLEX);

  (void)MPI_Comm_size(PetscObjectComm((PetscObject)solver->inner.ksp), &size);
  *package = NULL;
#if defined(PETSC_HAVE_MUMPS)
  *package = MATSOLVERMUMPS;
#elif defined(PETSC_HAVE_SUPERLU_DIST)
  if (!definite) *package = MATSOLVERSUPERLU_DIST;
#endif
#if defined(PETSC_HAVE_SUITESPARSE)
  if (size == 1 && definite) *package = MATSOLVERCHOLMOD;
  else if (size == 1 && !*package) *package = MATSOLVERUMFPACK;
#endif
  if (size == 1 && !*package) *package = MATSOLVERPETSC;
  return *package ? definite ? PCCHOLESKY : PCLU : NULL;
}

/*
   AinsworthSolverLeastMemory - gets the memory of the smallest machine of all ranks in bytes, as if all ranks were on
   that one; collective
*/
PetscErrorCode AinsworthSolverLeastMemory(MPI_Comm comm, PetscReal *memory)
{
  PetscFunctionBegin;
  *memory = (PetscReal)sysconf(_SC_PHYS_PAGES) * (PetscReal)sysconf(_SC_PAGESIZE);
  if (!(*memory > 0.0)) *memory = PETSC_MAX_REAL;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, memory, 1, MPIU_REAL, MPIU_MIN, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSolverChoosePackage - sets the package of a factorization unless the program has; options may still change
   it
*/
PetscErrorCode AinsworthSolverChoosePackage(const AinsworthSolver *solver, PC inner)
{
  MatSolverType package, given = NULL;
  PCType        type    = AinsworthSolverFactorType(solver, &package);
  PetscBool     factors = PETSC_FALSE;

  PetscFunctionBegin;
  if (type) PetscCall(PetscObjectTypeCompare((PetscObject)inner, type, &factors));
  if (factors) PetscCall(PCFactorGetMatSolverType(inner, &given));
  if (factors && !given) PetscCall(PCFactorSetMatSolverType(inner, package));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Orders the unknowns of a graph of nodes for a factorization */
static PetscErrorCode OrderNodes(Mat graph, PetscInt bs, AinsworthCost *cost, IS *order)
{
  MatOrderingType       ordering;
  IS                    nodes;
  std::vector<PetscInt> list;

  PetscFunctionBegin;
  PetscCall(AinsworthFactorPredictBest(graph, bs, cost, &ordering, &nodes));
  PetscCall(AinsworthISToList(nodes, &list));
  PetscCall(ISDestroy(&nodes));
  PetscCall(ISCreateBlock(PETSC_COMM_SELF, bs, (PetscInt)list.size(), list.data(), PETSC_COPY_VALUES, order));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSolverOrderPmat - orders the unknowns for a factorization of the sum of parts, AIJ, and predicts its cost.
   Collective

   Rank 0 orders the nodes, whose graph is far smaller than that of the unknowns
*/
PetscErrorCode AinsworthSolverOrderPmat(AinsworthSolver *solver, const std::vector<Mat> &parts, AinsworthCost *cost)
{
  MPI_Comm    comm = PetscObjectComm((PetscObject)solver->inner.ksp);
  PetscInt    bs   = solver->saddle->bs;
  PetscMPIInt rank, error = PETSC_SUCCESS;
  PetscBool   whole;
  Mat        *graph;

  PetscFunctionBegin;
  solver->inner.order.reset();
  PetscCall(AinsworthBlocksDivide(solver->saddle->A, bs, &whole));
  if (!whole) bs = 1;
  PetscCall(AinsworthGraphOfNodes(parts, bs, &graph));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (!rank) error = (PetscMPIInt)AinsworthGuarded<OrderNodes>(graph[0], bs, cost, solver->inner.order.out());
  PetscCall(MatDestroySubMatrices(1, &graph));
  PetscCallMPI(MPI_Bcast(&error, 1, MPI_INT, 0, comm));
  PetscCall((PetscErrorCode)error);
  PetscCallMPI(MPI_Bcast(cost, 2, MPIU_REAL, 0, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gives CHOLMOD an ordering of M, the one of the prediction if there was one, unless the program chooses */
static PetscErrorCode SetOrdering(AinsworthSolver *solver, Mat aij, PC inner)
{
  PetscOptions  options;
  const char   *prefix = AinsworthSolverPrefix(solver);
  AinsworthCost cost;
  PetscBool     type, ordering;

  PetscFunctionBegin;
  PetscCall(PetscObjectGetOptions((PetscObject)inner, &options));
  PetscCall(PetscOptionsHasName(options, prefix, "-pc_type", &type));
  PetscCall(PetscOptionsHasName(options, prefix, "-pc_factor_mat_ordering_type", &ordering));
  if (ordering ||
      /* after PCSetType() it may have chosen by a call, which cannot be known */
      !(type || solver->inner.plan.preconditioner == AINSWORTH_INNER_FACTOR)) {
    solver->inner.order.reset();
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!solver->inner.order) PetscCall(AinsworthSolverOrderPmat(solver, {aij}, &cost));
  PetscCall(PCFactorSetMatOrderingType(inner, AinsworthPredicted));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSolverConvertPmat - converts M_*, or A without constraints, to the format of its factorization */
PetscErrorCode AinsworthSolverConvertPmat(AinsworthSolver *solver)
{
  PC        inner;
  PetscBool cholmod;
  Mat       M;

  PetscFunctionBegin;
  if (solver->inner.format != AINSWORTH_PMAT_FACTOR) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  PetscCall(AinsworthFactorIsPackage(inner, MATSOLVERCHOLMOD, &cholmod));
  if (!solver->inner.M) PetscCall(AinsworthGetAIJ(solver->saddle->P, solver->inner.M.out()));
  if (!cholmod) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SetOrdering(solver, solver->inner.M, inner));
  /* that of the program must not change */
  if (solver->inner.M == solver->saddle->P)
    PetscCall(MatDuplicate(solver->saddle->P, MAT_COPY_VALUES, solver->inner.M.out()));
  M = solver->inner.M;
  /* the interface to CHOLMOD wraps this type in place, but only with block size 1 */
  PetscCall(MatSetBlockSize(M, 1));
  PetscCall(MatSetOption(M, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatConvert(M, MATSEQSBAIJ, MAT_INPLACE_MATRIX, &M));
  PetscCall(MatSetOption(M, MAT_SPD, PETSC_TRUE));
  if (solver->inner.order) PetscCall(AinsworthOrderingAttach(solver->inner.order, solver->inner.M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSolverSetUpPreconditioner - calls PCSetUp() without the error that CHOLMOD raises if M_* is not positive
   definite
*/
PetscErrorCode AinsworthSolverSetUpPreconditioner(AinsworthSolver *solver, PC inner, PetscBool *definite)
{
  PetscBool cholmod, indefinite = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(AinsworthFactorIsPackage(inner, MATSOLVERCHOLMOD, &cholmod));
  if (cholmod)
    PetscCall(AinsworthFactorTryCholmod((PetscObject)inner, solver->inner.order != NULL, [=] { return PCSetUp(inner); },
                                        &indefinite));
  else PetscCall(PCSetUp(inner));
  if (indefinite) PetscCall(PCReset(inner));
  solver->inner.order.reset();
  *definite = (PetscBool)!indefinite;
  PetscFunctionReturn(PETSC_SUCCESS);
}
