/* Lines of options: what they choose, and what may be expected then */
#include "attack.h"

static const char *Pick(Random &r, const std::vector<const char *> &from)
{
  return from[(size_t)r.Int(0, (int)from.size() - 1)];
}

using Line = std::map<std::string, std::string>;

static void Method(Attack &a, Line &now, bool all)
{
  if (all || a.r.Chance(0.5)) {
    if (a.r.Chance(0.35)) now["-ainsworth_ksp_type"] = "projectedcg";
    else
      now["-ainsworth_ksp_type"] = Pick(a.r, {"cg",     "gmres",   "fgmres",     "minres", "cr",     "cgs",
                                              "bcgs",   "bcgsl",   "richardson", "tfqmr",  "pipecg", "gcr",
                                              "fcg",    "pipefcg", "groppcg",    "symmlq", "pipecr", "ibcgs",
                                              "lgmres", "pgmres",  "fbcgs",      "cgne",   "dgmres", "pipegcr"});
  }
  if (a.r.Chance(0.15))
    now["-ainsworth_ksp_norm_type"] = Pick(a.r, {"preconditioned", "unpreconditioned", "natural", "none"});
  if (a.r.Chance(0.15)) now["-ainsworth_ksp_pc_side"] = Pick(a.r, {"left", "right"});
  if (a.r.Chance(0.1)) now["-ainsworth_ksp_initial_guess_nonzero"] = Pick(a.r, {"true", "false"});
}

static void Preconditioner(Attack &a, Line &now, bool all)
{
  if (!all && a.r.Chance(0.5)) return;
  std::vector<const char *> types = {"jacobi", "none", "redundant", "blocksa"};
  PetscMPIInt               size;

  /*
     SOR, and with it GAMG, stop at a zero on the diagonal with an error of its rank alone, BoomerAMG where its coarsest
     matrix is zero; others wait. ICC, in PCBJACOBI and PCKSP, may go on for ever with a singular matrix
  */
  (void)MPI_Comm_size(PETSC_COMM_WORLD, &size);
  if (size == 1) types.insert(types.end(), {"gamg", "sor"});
#if defined(PETSC_HAVE_HYPRE)
  if (size == 1) types.push_back("hypre");
#endif
  now["-ainsworth_pc_type"] = a.r.Chance(0.4) ? "jacobi" : Pick(a.r, types);
  if (now["-ainsworth_pc_type"] != "blocksa") return;
  Random own = a.r; /* sequences of seeds that tests name stay what they are */
  if (own.Chance(0.6)) now["-ainsworth_pc_blocksa_coarse_eq_limit"] = Pick(own, {"1", "5", "30"});
  if (own.Chance(0.5)) now["-ainsworth_pc_blocksa_smoother"] = Pick(own, {"incomplete", "jacobi"});
}

static void Variant(Attack &a, Line &now)
{
  if (a.r.Chance(0.2)) now["-pc_ainsworth_variant"] = Pick(a.r, {"weighted", "paper"});
  if (a.r.Chance(0.1)) now["-pc_ainsworth_weight"] = Pick(a.r, {"diagonal", "identity"});
  if (a.r.Chance(0.1)) now["-pc_ainsworth_penalty"] = Pick(a.r, {"row", "norm"});
  if (a.r.Chance(0.08))
    now["-pc_ainsworth_penalty_factor"] = Pick(a.r, {"1e-300", "1e-30", "1e-12", "1", "1e12", "1e30", "1e300"});
  if (a.r.Chance(0.4)) now["-pc_ainsworth_pmat"] = Pick(a.r, {"auto", "jcb", "id", "cc", "cg", "bj_cc", "bj_cg"});
  if (a.r.Chance(0.05)) now["-pc_ainsworth_block_size"] = Pick(a.r, {"1", "2", "3", "6"});
  if (a.r.Chance(0.2)) now["-pc_ainsworth_rows_per_rank"] = Pick(a.r, {"1", "2", "5", "1000"});
  if (a.r.Chance(0.3)) now["-pc_ainsworth_rebuild"] = Pick(a.r, {"auto", "always", "never"});
  if (a.r.Chance(0.08)) now["-pc_ainsworth_redundant"] = Pick(a.r, {"drop", "error"});
  if (a.r.Chance(0.08)) now["-pc_ainsworth_monitor_error"] = Pick(a.r, {"ascii:error.txt", "csv:error.csv"});
  if (a.r.Chance(0.04)) now["-pc_ainsworth_stop"] = Pick(a.r, {"residual", "energy_error"});
  if (now.count("-pc_ainsworth_stop") && now["-pc_ainsworth_stop"] == "energy_error")
    now["-pc_ainsworth_error_rtol"] = "1e-8";
}

/* The program's own Krylov method */
static void Outer(Attack &a, Line &now, bool all)
{
  /* without C or C' the MatNest is not the operator; not all methods can do with nested vectors */
  if (a.s.form > 1 || a.s.nested) return;
  if (!all && a.r.Chance(0.6)) return;
  now["-ksp_type"] = a.r.Chance(0.6)
                       ? "preonly"
                       : Pick(a.r, {"gmres", "fgmres", "cg", "minres", "gcr", "bcgs", "richardson", "dgmres"});
  if (a.r.Chance(0.1)) now["-ksp_pc_side"] = Pick(a.r, {"left", "right"});
}

void AttackChooseOptions(Attack &a, bool all)
{
  Line        now;
  std::string line;

  Method(a, now, all);
  Preconditioner(a, now, all);
  Variant(a, now);
  Outer(a, now, all);
  for (const auto &option : now) {
    line += " " + option.first + " " + option.second;
    a.choices[option.first] = option.second;
  }
  a.options.reset();
  a.options.reset(new Options(line));
  a.story += "; options" + line;
}

bool AttackTame(const Attack &a)
{
  const auto is = [&a](const char *option, const std::vector<const char *> &values) {
    const auto found = a.choices.find(option);

    if (found == a.choices.end()) return true;
    for (const char *value : values)
      if (found->second == value) return true;
    return false;
  };

  const auto      method = a.choices.find("-ainsworth_ksp_type");
  const PetscReal load   = PetscMax(a.s.f.cwiseAbs().maxCoeff(), a.s.g.size() ? a.s.g.cwiseAbs().maxCoeff() : 0.0);

  /* for which r' z < 1e-50 is negative */
  if (method != a.choices.end() && method->second == "minres" && load < 1e-20) return false;
  /* of which block is A nothing tells */
  if ((a.storage == STORE_NEST || a.storage == STORE_SHELL) && !a.s.D.isZero(0.0)) return false;
  /* a zero on the diagonal of A looks like a multiplier's */
  if (a.shape == SHAPE_DIAGONAL || !AttackAdjoint(a.s)) return false;
  return is("-ainsworth_ksp_type", {"projectedcg", "cg", "gmres", "fgmres", "minres"}) &&
         is("-ainsworth_pc_type", {"jacobi", "blocksa"}) && is("-pc_ainsworth_block_size", {"1"}) &&
         is("-ainsworth_ksp_norm_type", {}) && is("-ainsworth_ksp_pc_side", {}) &&
         is("-ainsworth_ksp_initial_guess_nonzero", {"false"}) && is("-pc_ainsworth_penalty_factor", {"1"}) &&
         is("-pc_ainsworth_redundant", {"drop"}) && is("-pc_ainsworth_rebuild", {"auto", "always"}) &&
         is("-pc_ainsworth_stop", {"residual"}) && is("-ksp_type", {"preonly", "gmres", "fgmres"}) &&
         is("-ksp_pc_side", {}) && !(a.s.uneven && !is("-ainsworth_ksp_type", {"projectedcg", "cg"})) &&
         !(a.s.uneven && !(is("-pc_ainsworth_variant", {"weighted"}) && is("-pc_ainsworth_weight", {"diagonal"}) &&
                           is("-pc_ainsworth_penalty", {"row"})));
}
