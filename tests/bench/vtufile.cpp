#include "vtufile.h"
#include <cstring>

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
  text += std::string("<DataArray type=\"") + TypeName(T()) + "\" Name=\"" + name + "\" NumberOfComponents=\"" +
          std::to_string(components) + "\" format=\"binary\">";
  AppendBase64(text, bytes);
  text += "</DataArray>\n";
}

PetscErrorCode VtuGetVector(MPI_Comm comm, const VtuPiece &piece, PetscInt bs, Vec v, std::vector<double> *values)
{
  const PetscInt     n = (PetscInt)piece.node.size();
  const PetscScalar *a;
  VecScatter         scatter;
  Vec                local;
  IS                 from;

  PetscFunctionBeginUser;
  PetscCall(ISCreateBlock(comm, bs, n, piece.node.data(), PETSC_USE_POINTER, &from));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, bs * n, &local));
  PetscCall(VecScatterCreate(v, from, local, NULL, &scatter));
  PetscCall(VecScatterBegin(scatter, v, local, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter, v, local, INSERT_VALUES, SCATTER_FORWARD));
  values->assign(3 * n, 0);
  PetscCall(VecGetArrayRead(local, &a));
  for (PetscInt i = 0; i < n; i++) {
    for (PetscInt c = 0; c < PetscMin(bs, 3); c++) (*values)[3 * i + c] = (double)PetscRealPart(a[bs * i + c]);
  }
  PetscCall(VecRestoreArrayRead(local, &a));
  PetscCall(VecScatterDestroy(&scatter));
  PetscCall(VecDestroy(&local));
  PetscCall(ISDestroy(&from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static std::string PieceText(const VtuPiece &piece)
{
  std::string text;

  if (piece.type.empty()) return text; /* more ranks than cells */
  text = "<Piece NumberOfPoints=\"" + std::to_string(piece.node.size()) + "\" NumberOfCells=\"" +
         std::to_string(piece.type.size()) + "\">\n<Points>\n";
  AppendArray(text, "position", 3, piece.position);
  text += "</Points>\n<PointData Vectors=\"" + (piece.vectors.empty() ? std::string() : piece.vectors[0].first) +
          "\">\n";
  for (const auto &v : piece.vectors) AppendArray(text, v.first.c_str(), 3, v.second);
  text += "</PointData>\n<CellData Scalars=\"" + (piece.numbers.empty() ? std::string() : piece.numbers[0].first) +
          "\">\n";
  for (const auto &v : piece.numbers) AppendArray(text, v.first.c_str(), 1, v.second);
  text += "</CellData>\n<Cells>\n";
  AppendArray(text, "connectivity", 1, piece.corner);
  AppendArray(text, "offsets", 1, piece.offset);
  AppendArray(text, "types", 1, piece.type);
  text += "</Cells>\n</Piece>\n";
  return text;
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

PetscErrorCode VtuWrite(MPI_Comm comm, const VtuPiece &piece, const char file[])
{
#if defined(PETSC_WORDS_BIGENDIAN)
  const char *const order = "BigEndian";
#else
  const char *const order = "LittleEndian";
#endif
  std::string text = PieceText(piece);
  FILE       *out;

  PetscFunctionBeginUser;
  PetscCall(PetscFOpen(comm, file, "w", &out));
  PetscCall(PetscFPrintf(comm, out,
                         "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
                         "byte_order=\"%s\" header_type=\"UInt64\">\n<UnstructuredGrid>\n",
                         order));
  PetscCall(WritePieces(comm, out, file, text));
  PetscCall(PetscFPrintf(comm, out, "</UnstructuredGrid>\n</VTKFile>\n"));
  PetscCall(PetscFClose(comm, out));
  PetscFunctionReturn(PETSC_SUCCESS);
}
