/* A subspace that the cycle stays in, and its projector on the finest level */
#ifndef AINSWORTH_SUBSPACE_H
#define AINSWORTH_SUBSPACE_H

#include "../base/objects.h"
#include <petscksp.h>
#include <functional>
#include <memory>
#include <vector>

/* Unknowns without entries in A that coarser levels have to move */
struct AinsworthCarried {
  std::vector<PetscInt> unknowns; /* global numbers of all ranks, ascending */
  /* the rows of constraints with such unknowns; others may be empty; NULL if there are none */
  AinsworthRef<Mat> rows;
};

/*
   The range of a projector Q that changes few unknowns, the kernel of constraints on these (docs/multigrid.md, the
   cycle in Ker C)

   The smoother of the finest level is Q W Q', where W is the inverse of the diagonal of the matrix, or zero for
   unknowns that Q and the smoother leave
*/
struct AinsworthSubspace {
  /* from the unknowns of the levels, which may be more, to those of the PC; NULL: they are the same; borrowed */
  Mat map = NULL;
  /* creates A, AIJ, for the unknowns of the levels; only with a map. Collective */
  std::function<PetscErrorCode(Mat A, Mat *)> extend;
  std::vector<PetscInt>                       places; /* the local unknowns that Q or Q' changes, ascending */
  AinsworthCarried                            carried;
  /* T: coarse functions are (I - T) P; has entries in few rows; NULL for 0; borrowed */
  Mat correction = NULL;
  /* marks local unknowns that others move, and those without entries in A; NULL on all ranks if there are none */
  std::shared_ptr<const std::vector<char>> embedded;
  std::vector<PetscReal>                   weight; /* W at the places */
  /* x' W^{-1} x grows by this part of itself at most when Q is applied; 0: it never grows, and Q W = W Q' */
  PetscReal excess = 0.0;
  /* adjoints of few rows whose kernel coarser levels have to keep; borrowed from `project` */
  std::vector<Vec> rows;
  Vec              values = NULL; /* work space for their values; borrowed */
  /* replaces the values by those of Q x or Q' x. Collective */
  std::function<PetscErrorCode(bool adjoint, Vec)> project;
};

/* The subspace as the finest level sees it, with its unknowns node by node */
class AinsworthLevelSubspace {
public:
  AinsworthLevelSubspace(const std::shared_ptr<const AinsworthSubspace> &, const std::vector<PetscInt> &order);
  /* width: that of the multivector; get and set are called with a place and the number of a vector */
  PetscErrorCode project(bool adjoint, PetscInt width, Vec) const;
  template <class Get, class Set>
  PetscErrorCode project(bool adjoint, PetscInt width, Get get, Set set) const
  {
    PetscScalar *v;

    PetscFunctionBegin;
    for (PetscInt j = 0; j < width; j++) {
      PetscCall(VecGetArrayWrite(space->values, &v));
      for (size_t k = 0; k < at.size(); k++) v[k] = get(at[k], j);
      PetscCall(VecRestoreArrayWrite(space->values, &v));
      PetscCall(space->project(adjoint, space->values));
      PetscCall(VecGetArray(space->values, &v));
      for (size_t k = 0; k < at.size(); k++) set(at[k], j, v[k]);
      PetscCall(VecRestoreArray(space->values, &v));
    }
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  std::shared_ptr<const AinsworthSubspace> space;
  std::vector<PetscInt>                    at; /* the places among the level's unknowns */
};

PetscErrorCode AinsworthSubspacePCCreate(const std::shared_ptr<const AinsworthLevelSubspace> &, PetscInt width, PC,
                                         PC *);
PetscErrorCode AinsworthSubspacePCWrap(PC, const char[], PC *);
PetscErrorCode AinsworthSubspacePCGetInner(PC, PC *);

#endif
