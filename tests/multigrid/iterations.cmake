# Iterations over scenes: at least and at most; those of docs/multigrid.md where the sizes are alike
function(multigrid_range least most out)
  set(numbers)
  foreach(n RANGE ${least} ${most})
    list(APPEND numbers ${n})
  endforeach()
  list(JOIN numbers "|" numbers)
  set(${out} "(${numbers})" PARENT_SCOPE)
endfunction()
# A alone
function(multigrid_alone name least most)
  multigrid_range(${least} ${most} its)
  ainsworth_program_test(multigrid_alone_${name} COMMAND scenes LOAD RANKS 1 3 LABELS multigrid
    ARGS -scene ${ARGN} -pc_type blocksa PASS_REGEX "iterations=${its} reason=CONVERGED_RTOL")
endfunction()
# with constraints, inside of PCAINSWORTH
function(multigrid_inner program name least most)
  multigrid_range(${least} ${most} its)
  ainsworth_program_test(multigrid_${name} COMMAND ${program} LOAD RANKS 1 4 LABELS multigrid
    ARGS ${ARGN} -ksp_type preonly -pc_type ainsworth -ainsworth_pc_type blocksa -ainsworth_ksp_converged_reason
    PASS_REGEX "solve converged due to CONVERGED_RTOL iterations ${its}$"
    "^result: .*constraint_residual=([0-9.]*e-(1[2-9]|[2-9][0-9])|0\\.000e\\+00)$")
endfunction()

multigrid_alone(cube 7 11 cube -n 10)
multigrid_alone(cube_metis 7 11 cube -n 10 -partition metis)
multigrid_alone(cube_exact 11 15 cube -n 10 -ksp_rtol 1e-12)
multigrid_alone(cube_exact_double 11 15 cube -n 10 -ksp_rtol 1e-12 -pc_blocksa_precision double)
multigrid_alone(cube_p1 11 15 cube -n 8 -element p1)
multigrid_alone(cube_p2 16 23 cube -n 6 -element p2)
multigrid_alone(incompressible 35 44 cube -n 10 -nu 0.49)
multigrid_alone(balls 8 16 cube -n 12 -inclusion balls -contrast 1e6)
multigrid_alone(square 7 11 square -n 30 -inclusion balls -contrast 1e6)
multigrid_alone(beam 10 15 beam -n 2)
multigrid_alone(beam_coordinates 10 15 beam -n 2 -near_nullspace 0 -coordinates)
multigrid_alone(beam2d 7 14 beam2d -n 3)
multigrid_alone(heat 6 10 heat -n 16)
# elements that are far longer in two directions: an incomplete factor smooths, on each rank for itself
multigrid_alone(stretched 5 14 stretched -n 10 -aspect 10)
multigrid_alone(stretched_more 4 22 stretched -n 10 -aspect 100)
multigrid_alone(stretched_jacobi 40 70 stretched -n 10 -aspect 10 -pc_blocksa_smoother jacobi)
multigrid_alone(cube_incomplete 6 11 cube -n 10 -pc_blocksa_smoother incomplete)
# a factor that does not exist
multigrid_alone(incompressible_incomplete 35 44 cube -n 10 -nu 0.49 -pc_blocksa_smoother incomplete)

multigrid_inner(scenes tets 11 14 -scene tets -n 7)
# on 2 ranks the partition leaves single nodes of stiff balls
multigrid_inner(scenes balls_tied 13 15 -scene balls_tied -contrast 1e4 -n 13)
multigrid_inner(scenes three_blocks 8 10 -scene three_blocks -n 7)
multigrid_inner(scenes cyclic 9 12 -scene cyclic -n 9)
# slaves of a fine mesh, stiffer than their few masters
multigrid_inner(scenes plate 12 18 -scene plate_block -unknowns 3000)
multigrid_inner(scenes plate_thin 22 36 -scene plate_block -aspect 1000 -nz 1 -unknowns 3000)
multigrid_inner(scenes beam_tied 10 14 -scene beam_tied -n 2)
multigrid_inner(scenes slabs 17 20 -scene slabs -n 6)
multigrid_inner(scenes fibers_tied 17 21 -scene fibers_tied -n 7)
multigrid_inner(scenes scene_floating 8 11 -scene balls_tied -n 7 -inclusion none -floating)
ainsworth_program_test(multigrid_factor_given_up COMMAND scenes LOAD RANKS 1 LABELS multigrid
  ARGS -scene cube -n 10 -nu 0.49 -pc_type blocksa -pc_blocksa_smoother incomplete -ksp_view ::ascii_info_detail
  PASS_REGEX "an incomplete Cholesky factor is given up" "reason=CONVERGED_RTOL")
# elements that are flat at a tie, and where bodies slip: the factor ends at the constrained nodes
set(flat -n1 10 -n2 8 -nz1 10 -nz2 8 -E2 10 -near_nullspace)
multigrid_inner(twocubes cubes_flat 6 12 ${flat} -height 0.25)
multigrid_inner(twocubes cubes_flatter 9 17 ${flat} -height 0.1 -stick 0)
multigrid_inner(twocubes cubes_flat_jacobi 19 28 ${flat} -height 0.25 -ainsworth_pc_blocksa_smoother jacobi)
set(cubes -n1 9 -n2 8)
multigrid_inner(twocubes cubes 8 11 ${cubes} -near_nullspace)
multigrid_inner(twocubes cubes_exact 13 15 ${cubes} -near_nullspace -ainsworth_ksp_rtol 1e-12)
multigrid_inner(twocubes cubes_exact_double 13 15 ${cubes} -near_nullspace -ainsworth_ksp_rtol 1e-12
  -ainsworth_pc_blocksa_precision double)
multigrid_inner(twocubes cubes_incomplete 6 11 ${cubes} -near_nullspace -ainsworth_pc_blocksa_smoother incomplete)
multigrid_inner(twocubes cubes_soft 12 19 ${cubes} -E2 1e-3)
multigrid_inner(twocubes cubes_stiff 9 15 ${cubes} -E2 1e12)
multigrid_inner(twocubes cubes_turned 8 10 ${cubes} -rotate 20,35,50 -stick 0 -near_nullspace)
multigrid_inner(twocubes cubes_floating 22 26 ${cubes} -floating)
multigrid_inner(twocubes cubes_translations 16 19 ${cubes})
# one cycle as the preconditioner of an outer method, which need not be flexible; that alone is no answer
foreach(method gmres fgmres minres bcgs)
  ainsworth_program_test(multigrid_outer_${method} COMMAND twocubes LOAD RANKS 1 3 LABELS multigrid
    ARGS ${cubes} -near_nullspace -ksp_type ${method} -ksp_rtol 1e-8 -pc_type ainsworth -ainsworth_ksp_type preonly
    -ksp_converged_reason -ksp_view ::ascii_info_detail
    PASS_REGEX "solve converged due to CONVERGED_RTOL iterations ([5-9]|10)$" "type: blocksa"
    "^result: .*constraint_residual=([0-9.]*e-(1[2-9]|[2-9][0-9])|0\\.000e\\+00)$")
endforeach()
ainsworth_program_test(multigrid_outer_preonly COMMAND twocubes LOAD FAILS RANKS 1 2 LABELS multigrid
  ARGS ${cubes} -ksp_type preonly -pc_type ainsworth -ainsworth_ksp_type preonly -ksp_converged_reason
  PASS_REGEX "did not converge due to DIVERGED_PC_FAILED")
# the default is this multigrid
ainsworth_program_test(multigrid_default COMMAND scenes LOAD RANKS 1 2 LABELS multigrid
  ARGS -scene tets -n 7 -ksp_type preonly -pc_type ainsworth -ksp_view ::ascii_info_detail
  PASS_REGEX "type: blocksa" "type: chebyshevsingle" "block smoothed aggregation, threshold"
  "single precision, eigenvalues used: min")
