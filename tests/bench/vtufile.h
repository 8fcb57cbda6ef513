/* A VTU file for ParaView: one piece per rank, written by rank 0, arrays in base64 */
#ifndef TUTORIALS_VTUFILE_H
#define TUTORIALS_VTUFILE_H

#include "compat.h"
#include <petscvec.h>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

/* The cells of this rank, and their nodes by their number in the system */
struct VtuPiece {
  std::vector<PetscInt>                                          node;
  std::vector<double>                                            position; /* three a node */
  std::vector<std::int64_t>                                      corner;   /* places in `node`, in VTK's order */
  std::vector<std::int64_t>                                      offset;   /* in corner, of what follows each cell */
  std::vector<std::uint8_t>                                      type;     /* 9: quadrangle, 12: hexahedron */
  std::vector<std::pair<std::string, std::vector<double>>>       vectors;  /* three components a node */
  std::vector<std::pair<std::string, std::vector<std::int32_t>>> numbers;  /* one a cell */
};

/* The bs components of v at the nodes of the piece, as three. Collective */
PetscErrorCode VtuGetVector(MPI_Comm, const VtuPiece &, PetscInt bs, Vec v, std::vector<double> *values);
PetscErrorCode VtuWrite(MPI_Comm, const VtuPiece &, const char file[]);

#endif
