/* The deformed cubes as a VTU file */
#include "cubes.h"
#include "vtufile.h"

/* The elements of this rank */
static PetscErrorCode PieceCreate(const CubesMesh &mesh, VtuPiece *piece, std::vector<PetscInt> *natural)
{
  const int                 vtkOrder[8] = {0, 1, 3, 2, 4, 5, 7, 6};
  std::vector<std::int64_t> place(mesh.nodes, -1);
  PetscMPIInt               rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(mesh.comm, &rank));
  piece->numbers = {
    {"body", {}},
    {"rank", {}}
  };
  for (int i = 0; i < 2; i++) {
    const CubesBody &b = mesh.body[i];

    for (PetscInt e = 0; e < b.Elements(); e++) {
      const PetscInt x = e % b.n[0], y = e / b.n[0] % b.n[1], z = e / b.n[0] / b.n[1];

      if (mesh.part[b.element + e] != rank) continue;
      for (int c : vtkOrder) {
        const PetscInt node = b.Node(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2));

        place[node] = 0;
        piece->corner.push_back(node);
      }
      piece->offset.push_back((std::int64_t)piece->corner.size());
      piece->numbers[0].second.push_back(i + 1);
      piece->numbers[1].second.push_back(rank);
      piece->type.push_back(12); /* VTK_HEXAHEDRON */
    }
  }
  for (PetscInt node = 0; node < mesh.nodes; node++) {
    if (place[node] < 0) continue;
    place[node] = (std::int64_t)natural->size();
    natural->push_back(node);
    piece->node.push_back(mesh.number[node]);
  }
  for (std::int64_t &c : piece->corner) c = place[c];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CubesViewVTU(const CubesMesh &mesh, Vec displacement, Vec force, const char file[])
{
  std::vector<PetscInt> natural;
  VtuPiece              piece;

  PetscFunctionBeginUser;
  PetscCall(PieceCreate(mesh, &piece, &natural));
  piece.vectors = {
    {"displacement",  {}},
    {"contact_force", {}}
  };
  PetscCall(VtuGetVector(mesh.comm, piece, 3, displacement, &piece.vectors[0].second));
  PetscCall(VtuGetVector(mesh.comm, piece, 3, force, &piece.vectors[1].second));
  for (size_t i = 0; i < natural.size(); i++) {
    PetscReal x[3], y[3];

    mesh.Position(natural[i], x);
    mesh.Rotate(x, y);
    for (int c = 0; c < 3; c++) piece.position.push_back((double)y[c] + piece.vectors[0].second[3 * i + c]);
  }
  PetscCall(VtuWrite(mesh.comm, piece, file));
  PetscFunctionReturn(PETSC_SUCCESS);
}
