"""Files of PETSc's binary format."""


def reader(path, comm):
    """Of a file without its .info, whose block sizes would be options and hold for all that is loaded later."""
    from petsc4py import PETSc
    viewer = PETSc.Viewer().create(comm=comm)
    viewer.setType("binary")
    viewer.setFileMode("r")
    PETSc.Options()["viewer_binary_skip_info"] = True
    viewer.setFromOptions()
    viewer.setFileName(path)
    return viewer
