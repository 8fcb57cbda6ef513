/* The deformed bodies as a VTU file: one piece per rank, written by rank 0, arrays in base64 */
#include "cubes.h"
#include <cstdint>
#include <cstring>
#include <string>

static void AppendBase64(std::string &text, const std::vector<unsigned char> &bytes)
{
  const char *const digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

  text.reserve(text.size() + 4 * (bytes.size() / 3 + 1));
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const size_t  n    = PetscMin((size_t)3, bytes.size() - i);
    std::uint32_t word = (std::uint32_t)bytes[i] << 16;

    if (n > 1) word |= (std::uint32_t)bytes[i + 1] << 8;
    if (n > 2) word |= bytes[i + 2];
    for (size_t d = 0; d < 4; d++) text += d <= n ? digits[word >> (18 - 6 * d) & 63] : '=';
  }
}

/* VTK's name of a C++ type */
static const char *TypeName(double)
{
  return "Float64";
}
static const char *TypeName(std::int64_t)
{
  return "Int64";
}
static const char *TypeName(std::int32_t)
{
  return "Int32";
}
static const char *TypeName(std::uint8_t)
{
  return "UInt8";
}

template <typename T>
static void AppendArray(std::string &text, const char name[], int components, const std::vector<T> &values)
{
  const std::uint64_t        size = values.size() * sizeof(T);
  std::vector<unsigned char> bytes(sizeof(size) + size);

  std::memcpy(bytes.data(), &size, sizeof(size));
  if (size) std::memcpy(bytes.data() + sizeof(size), values.data(), size);
  text += std::string("<DataArray type=\"") + TypeName(T()) + "\" Name=\"" + name + "\" NumberOfComponents=\"" + std::to_string(components) +
          "\" format=\"binary\">";
  AppendBase64(text, bytes);
  text += "</DataArray>\n";
}

/* The elements of this rank, and their nodes: natural numbers, rising */
struct Piece {
  std::vector<PetscInt>     node;
  std::vector<std::int64_t> corner, offset; /* corners as places in `node` */
  std::vector<std::int32_t> body, rank;
  std::vector<std::uint8_t> type;
};

static PetscErrorCode PieceCreate(const CubesMesh &mesh, Piece *piece)
{
  const int                 vtkOrder[8] = {0, 1, 3, 2, 4, 5, 7, 6};
  std::vector<std::int64_t> place(mesh.nodes, -1);
  PetscMPIInt               rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(mesh.comm, &rank));
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
      piece->body.push_back(i + 1);
      piece->rank.push_back(rank);
      piece->type.push_back(12); /* VTK_HEXAHEDRON */
    }
  }
  for (PetscInt node = 0; node < mesh.nodes; node++) {
    if (place[node] < 0) continue;
    place[node] = (std::int64_t)piece->node.size();
    piece->node.push_back(node);
  }
  for (std::int64_t &c : piece->corner) c = place[c];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The three components of v at the nodes of the piece */
static PetscErrorCode PieceValues(const CubesMesh &mesh, const Piece &piece, Vec v, std::vector<double> *values)
{
  std::vector<PetscInt> number;
  const PetscScalar    *a;
  VecScatter            scatter;
  Vec                   local;
  IS                    from;

  PetscFunctionBeginUser;
  for (PetscInt node : piece.node) number.push_back(mesh.number[node]);
  PetscCall(ISCreateBlock(mesh.comm, 3, (PetscInt)number.size(), number.data(), PETSC_USE_POINTER, &from));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, 3 * (PetscInt)number.size(), &local));
  PetscCall(VecScatterCreate(v, from, local, NULL, &scatter));
  PetscCall(VecScatterBegin(scatter, v, local, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter, v, local, INSERT_VALUES, SCATTER_FORWARD));
  values->resize(3 * number.size());
  PetscCall(VecGetArrayRead(local, &a));
  for (size_t i = 0; i < values->size(); i++) (*values)[i] = (double)PetscRealPart(a[i]);
  PetscCall(VecRestoreArrayRead(local, &a));
  PetscCall(VecScatterDestroy(&scatter));
  PetscCall(VecDestroy(&local));
  PetscCall(ISDestroy(&from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PieceText(const CubesMesh &mesh, Vec displacement, Vec force, std::string *text)
{
  std::vector<double> u, r, position;
  Piece               piece;

  PetscFunctionBeginUser;
  PetscCall(PieceCreate(mesh, &piece));
  PetscCall(PieceValues(mesh, piece, displacement, &u));
  PetscCall(PieceValues(mesh, piece, force, &r));
  if (piece.type.empty()) PetscFunctionReturn(PETSC_SUCCESS); /* more ranks than elements */
  for (size_t i = 0; i < piece.node.size(); i++) {
    PetscReal x[3], y[3];

    mesh.Position(piece.node[i], x);
    mesh.Rotate(x, y);
    for (int c = 0; c < 3; c++) position.push_back((double)y[c] + u[3 * i + c]);
  }
  *text = "<Piece NumberOfPoints=\"" + std::to_string(piece.node.size()) + "\" NumberOfCells=\"" + std::to_string(piece.type.size()) + "\">\n<Points>\n";
  AppendArray(*text, "position", 3, position);
  *text += "</Points>\n<PointData Vectors=\"displacement\">\n";
  AppendArray(*text, "displacement", 3, u);
  AppendArray(*text, "contact_force", 3, r);
  *text += "</PointData>\n<CellData Scalars=\"body\">\n";
  AppendArray(*text, "body", 1, piece.body);
  AppendArray(*text, "rank", 1, piece.rank);
  *text += "</CellData>\n<Cells>\n";
  AppendArray(*text, "connectivity", 1, piece.corner);
  AppendArray(*text, "offsets", 1, piece.offset);
  AppendArray(*text, "types", 1, piece.type);
  *text += "</Cells>\n</Piece>\n";
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0 writes its piece and then those of the others, one after the other, in messages that MPI can count */
static PetscErrorCode WritePieces(MPI_Comm comm, FILE *out, const char file[], std::string &text)
{
  const std::uint64_t chunk = 1 << 28;
  PetscMPIInt         rank, size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  for (PetscMPIInt r = 0; r < size; r++) {
    std::uint64_t length = text.size();

    if (rank == 0 && r > 0) {
      PetscCallMPI(MPI_Recv(&length, sizeof(length), MPI_BYTE, r, 0, comm, MPI_STATUS_IGNORE));
      text.resize(length);
    } else if (rank == r && r > 0) PetscCallMPI(MPI_Send(&length, sizeof(length), MPI_BYTE, 0, 0, comm));
    for (std::uint64_t done = 0; r > 0 && done < length; done += chunk) {
      const PetscMPIInt count = (PetscMPIInt)PetscMin(chunk, length - done);

      if (rank == 0) PetscCallMPI(MPI_Recv(&text[done], count, MPI_BYTE, r, 1, comm, MPI_STATUS_IGNORE));
      else if (rank == r) PetscCallMPI(MPI_Send(&text[done], count, MPI_BYTE, 0, 1, comm));
    }
    if (rank == 0)
      PetscCheck(std::fwrite(text.data(), 1, text.size(), out) == text.size(), PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE,
                 "Cannot write all of %s: is the disk full?", file);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CubesViewVTU(const CubesMesh &mesh, Vec displacement, Vec force, const char file[])
{
#if defined(PETSC_WORDS_BIGENDIAN)
  const char *const order = "BigEndian";
#else
  const char *const order = "LittleEndian";
#endif
  std::string text;
  FILE       *out;

  PetscFunctionBeginUser;
  PetscCall(PieceText(mesh, displacement, force, &text));
  PetscCall(PetscFOpen(mesh.comm, file, "w", &out));
  PetscCall(PetscFPrintf(
    mesh.comm, out,
    "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"%s\" header_type=\"UInt64\">\n<UnstructuredGrid>\n", order));
  PetscCall(WritePieces(mesh.comm, out, file, text));
  PetscCall(PetscFPrintf(mesh.comm, out, "</UnstructuredGrid>\n</VTKFile>\n"));
  PetscCall(PetscFClose(mesh.comm, out));
  PetscFunctionReturn(PETSC_SUCCESS);
}
