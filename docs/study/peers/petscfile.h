/* Files of PETSc's binary format, for programs without PETSc */
#include <algorithm>
#include <cstdint>
#include <istream>
#include <stdexcept>
#include <vector>

static const int32_t MATRIX = 1211216, VECTOR = 1211214; /* PETSc's numbers for what a file holds */

/* Big-endian numbers */
template <class T>
std::vector<T> read(std::istream &in, size_t n)
{
  std::vector<T> values(n);

  in.read((char *)values.data(), (std::streamsize)(n * sizeof(T)));
  if (!in) throw std::runtime_error("a file is missing or too short");
  for (T &value : values) std::reverse((char *)&value, (char *)(&value + 1));
  return values;
}
