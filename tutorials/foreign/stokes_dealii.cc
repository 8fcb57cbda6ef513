/*
   Flow in a cavity that its lid drives, Taylor-Hood elements of deal.II on a mesh with hanging nodes, in one PETSc
   matrix: pressures are multipliers

   The program knows deal.II's wrapper of KSP only, which names no fields. Unknowns of velocity and pressure are mixed,
   and rows of hanging nodes have one entry.

   $ cmake -S . -B build && cmake --build build                  with CMakeLists.txt:
       find_package(deal.II 9.4 REQUIRED)
       deal_ii_initialize_cached_variables()
       project(stokes)
       add_executable(stokes_dealii stokes_dealii.cc)
       deal_ii_setup_target(stokes_dealii)
   $ mpiexec -n 2 build/stokes_dealii 3 3 1 -dll_append /path/of/libainsworth.so -ksp_type fgmres -pc_type ainsworth
   -ainsworth_ksp_converged_reason
     Linear ainsworth_ solve converged due to CONVERGED_RTOL iterations 19
     Linear ainsworth_ solve converged due to CONVERGED_RTOL iterations 20
     Linear ainsworth_ solve converged due to CONVERGED_RTOL iterations 20
   26152 unknowns, 2 steps, residual below 1e-8: yes
*/
#include <deal.II/base/function.h>
#include <deal.II/base/quadrature_lib.h>
#include <deal.II/base/utilities.h>
#include <deal.II/distributed/tria.h>
#include <deal.II/dofs/dof_tools.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/fe/fe_system.h>
#include <deal.II/fe/fe_values.h>
#include <deal.II/grid/grid_generator.h>
#include <deal.II/lac/affine_constraints.h>
#include <deal.II/lac/petsc_precondition.h>
#include <deal.II/lac/petsc_solver.h>
#include <deal.II/lac/petsc_sparse_matrix.h>
#include <deal.II/lac/petsc_vector.h>
#include <deal.II/lac/sparsity_tools.h>
#include <deal.II/numerics/vector_tools.h>
#include <iostream>
using namespace dealii;

/* The lid without its ends, so that nothing flows through the sides */
template <int dim>
class Lid : public Function<dim> {
public:
  Lid() : Function<dim>(dim + 1) { }
  double value(const Point<dim> &p, const unsigned int component) const override
  {
    return component == 0 && p[dim - 1] > 1 - 1e-9 && p[0] > 1e-9 && p[0] < 1 - 1e-9 ? 1.0 : 0.0;
  }
};

template <int dim>
void Run(int refine, int local)
{
  const MPI_Comm                            comm = MPI_COMM_WORLD;
  parallel::distributed::Triangulation<dim> mesh(comm);
  const FESystem<dim>                       element(FE_Q<dim>(2), dim, FE_Q<dim>(1), 1);
  const QGauss<dim>                         points(3);
  const FEValuesExtractors::Vector          u(0);
  const FEValuesExtractors::Scalar          p(dim);

  GridGenerator::hyper_cube(mesh, 0, 1, true);
  mesh.refine_global(refine);
  for (int k = 0; k < local; k++) {
    for (const auto &cell : mesh.active_cell_iterators())
      if (cell->is_locally_owned() && cell->center()[dim - 1] > 0.75 && cell->center()[0] > 0.6)
        cell->set_refine_flag();
    mesh.execute_coarsening_and_refinement();
  }

  DoFHandler<dim>           unknowns(mesh);
  AffineConstraints<double> constraints;
  IndexSet                  owned, relevant;
  unknowns.distribute_dofs(element);
  owned = unknowns.locally_owned_dofs();
  DoFTools::extract_locally_relevant_dofs(unknowns, relevant);
  constraints.reinit(relevant);
  DoFTools::make_hanging_node_constraints(unknowns, constraints);
  for (unsigned int side = 0; side < 2 * dim; side++)
    VectorTools::interpolate_boundary_values(unknowns, side, Lid<dim>(), constraints, element.component_mask(u));
  constraints.close();

  DynamicSparsityPattern pattern(relevant);
  DoFTools::make_sparsity_pattern(unknowns, pattern, constraints, false);
  SparsityTools::distribute_sparsity_pattern(pattern, owned, comm, relevant);
  PETScWrappers::MPI::SparseMatrix matrix;
  PETScWrappers::MPI::Vector       rhs(owned, comm), x(owned, comm), left(owned, comm);
  matrix.reinit(owned, owned, pattern, comm);

  FEValues<dim>                        values(element, points, update_values | update_gradients | update_JxW_values);
  const unsigned int                   n = element.n_dofs_per_cell();
  FullMatrix<double>                   K(n, n);
  Vector<double>                       f(n);
  std::vector<types::global_dof_index> numbers(n);
  for (const auto &cell : unknowns.active_cell_iterators()) {
    if (!cell->is_locally_owned()) continue;
    values.reinit(cell);
    K = 0;
    for (unsigned int q = 0; q < points.size(); q++)
      for (unsigned int i = 0; i < n; i++)
        for (unsigned int j = 0; j < n; j++)
          K(i, j) += (2 * values[u].symmetric_gradient(i, q) * values[u].symmetric_gradient(j, q) -
                      values[u].divergence(i, q) * values[p].value(j, q) -
                      values[p].value(i, q) * values[u].divergence(j, q)) *
                     values.JxW(q);
    cell->get_dof_indices(numbers);
    constraints.distribute_local_to_global(K, f, numbers, matrix, rhs);
  }
  matrix.compress(VectorOperation::add);
  rhs.compress(VectorOperation::add);

  SolverControl                   control(2000, 1e-9 * rhs.l2_norm());
  PETScWrappers::SolverGMRES      solver(control, comm);
  PETScWrappers::PreconditionNone none(matrix);
  solver.solve(matrix, x, rhs, none);
  matrix.vmult(left, x);
  left -= rhs;
  const double part = left.l2_norm() / rhs.l2_norm();
  if (!Utilities::MPI::this_mpi_process(comm))
    std::cout << unknowns.n_dofs() << " unknowns, " << control.last_step()
              << " steps, residual below 1e-8: " << (part < 1e-8 ? "yes" : "no") << std::endl;
}

/* stokes_dealii <dimension> <refinements of the whole> <of a corner below the lid> */
int main(int argc, char **argv)
{
  const int                        dim = std::atoi(argv[1]), refine = std::atoi(argv[2]), local = std::atoi(argv[3]);
  Utilities::MPI::MPI_InitFinalize mpi(argc, argv, 1);

  if (dim == 2) Run<2>(refine, local);
  else Run<3>(refine, local);
  return 0;
}
