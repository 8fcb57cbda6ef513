/* As much of JSON as a test needs: is a text valid, and what is in it? */
#ifndef TESTS_JSON_H
#define TESTS_JSON_H

#include <map>
#include <string>
#include <vector>

struct Json {
  enum Type {
    INVALID,
    NOTHING,
    NUMBER,
    TEXT,
    LIST,
    OBJECT
  } type                             = INVALID;
  double                      number = 0.0;
  std::string                 text;
  std::vector<Json>           list;
  std::map<std::string, Json> object;
};

/* INVALID where the text, all of it, is no JSON, or an object has a name twice */
Json JsonParse(const std::string &text);

#endif
