#include "json.h"
#include <cstdlib>
#include <cstring>

static void Skip(const char *&at)
{
  while (*at && strchr(" \t\r\n", *at)) at++;
}

static bool Take(const char *&at, const char word[])
{
  Skip(at);
  if (strncmp(at, word, strlen(word))) return false;
  at += strlen(word);
  return true;
}

static bool Text(const char *&at, std::string &text)
{
  if (!Take(at, "\"")) return false;
  for (; *at != '"'; at++) {
    if ((unsigned char)*at < ' ') return false; /* the end, too */
    if (*at == '\\' && !strchr("\"\\/bfnrtu", *++at)) return false;
    text += *at;
  }
  at++;
  return true;
}

static Json Value(const char *&at)
{
  Json  value;
  char *end;

  if (Take(at, "{")) {
    value.type = Json::OBJECT;
    if (Take(at, "}")) return value;
    do {
      std::string name;

      if (!Text(at, name) || !Take(at, ":")) return Json();
      const Json member = Value(at);

      if (member.type == Json::INVALID || !value.object.insert({name, member}).second) return Json();
    } while (Take(at, ","));
    return Take(at, "}") ? value : Json();
  }
  if (Take(at, "[")) {
    value.type = Json::LIST;
    if (Take(at, "]")) return value;
    do {
      value.list.push_back(Value(at));
      if (value.list.back().type == Json::INVALID) return Json();
    } while (Take(at, ","));
    return Take(at, "]") ? value : Json();
  }
  if (*at == '"') {
    value.type = Text(at, value.text) ? Json::TEXT : Json::INVALID;
    return value;
  }
  value.type = Json::NOTHING;
  for (const char *word : {"null", "true", "false"})
    if (Take(at, word)) return value;
  value.number = strtod(at, &end);
  value.type   = end != at && strchr("-0123456789", *at) && *at ? Json::NUMBER : Json::INVALID;
  at           = end;
  return value;
}

Json JsonParse(const std::string &text)
{
  const char *at    = text.c_str();
  const Json  value = Value(at);

  Skip(at);
  return *at ? Json() : value;
}
