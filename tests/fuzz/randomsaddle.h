/* Random systems of the normal form [A B'; C -D], and options, beyond those of randomsystem.h */
#ifndef TESTS_RANDOMSADDLE_H
#define TESTS_RANDOMSADDLE_H

#include "systems.h"

struct RandomSaddle {
  Saddle      s;
  std::string text, options;
  bool        symmetric; /* A and its constraints */
  bool        tame;      /* neither the system nor the options excuse a failure: its condition may */

  explicit RandomSaddle(Random &);

private:
  void Rows(Random &);
  void Massless(Random &);
  void Compliance(Random &);
  void OneSided(Random &);
  void Asymmetry(Random &);
  void Fixed(Random &);
  void RightHandSide(Random &);
  void Options(Random &);
};

/* Is an answer owed? */
bool RandomSaddlePromised(const RandomSaddle &, const Facts &);

#endif
