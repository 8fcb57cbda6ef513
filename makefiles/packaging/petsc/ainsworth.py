# For config/BuildSystem/config/packages/ of PETSc's sources: ./configure --download-ainsworth=<archive, folder or
# git://address of ainsworth>
import config.package
import os

class Configure(config.package.Package):
  def __init__(self, framework):
    config.package.Package.__init__(self, framework)
    self.version          = '0.2.0'
    self.gitcommit        = 'HEAD'
    self.download         = ['give the archive or the folder: --download-ainsworth=<where>']
    self.functions        = []
    self.includes         = []
    self.precisions       = ['double']
    self.buildLanguages   = ['Cxx']
    self.minCxxVersion    = 'c++17'
    self.linkedbypetsc    = 0
    self.builtafterpetsc  = 1
    self.skippackagewithoptions = 1

  def setupDependencies(self, framework):
    config.package.Package.setupDependencies(self, framework)
    self.sharedLibraries = framework.require('PETSc.options.sharedLibraries', self)
    self.mpi             = framework.require('config.packages.MPI', self)
    self.metis           = framework.require('config.packages.METIS', self)
    self.cmake           = framework.require('config.packages.CMake', self)
    self.deps            = [self.mpi]
    self.odeps           = [self.metis]

  def Install(self):
    if not self.checkSharedLibrariesEnabled():
      raise RuntimeError('ainsworth is loaded at run time and needs shared libraries')
    if not hasattr(self.cmake, 'cmake'): raise RuntimeError('ainsworth needs CMake: install it, or --download-cmake')
    if self.argDB['prefix'] and not 'package-prefix-hash' in self.argDB:
      prefix = os.path.abspath(os.path.expanduser(self.argDB['prefix']))
      petsc  = 'PETSC_DIR=' + prefix + ' PETSC_ARCH='
    else:
      prefix = os.path.join(self.petscdir.dir, self.arch)
      petsc  = 'PETSC_DIR=${PETSC_DIR} PETSC_ARCH=${PETSC_ARCH}'
    make = (' -f makefiles/Makefile BUILD=' + os.path.join(self.packageDir, 'build-' + self.arch) + ' CMAKE='
            + self.cmake.cmake + ' prefix=' + prefix + ' ' + petsc)
    self.include = [os.path.join(prefix, 'include')]
    self.lib     = [os.path.join(prefix, 'lib', 'libainsworth.so')]
    self.addPost(self.packageDir, ['${OMAKE}' + make + ' all', '${OMAKE}' + make + ' install'])
    self.addMakeCheck(self.packageDir, '${OMAKE}' + make + ' check')
    return self.installDir
