/* Numbers in sentences */
#ifndef AINSWORTH_WORDS_H
#define AINSWORTH_WORDS_H

#include <string>

/* "1 row", "2 rows" */
inline std::string AinsworthCounted(size_t n, const char noun[])
{
  return std::to_string(n) + " " + noun + (n == 1 ? "" : "s");
}

#endif
