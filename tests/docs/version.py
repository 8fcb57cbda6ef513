"""The version of the header is that of the changelog, of CITATION.cff and of the packages: version.py <folder of the
project>
"""
import os
import re
import sys


def read(path):
    with open(os.path.join(sys.argv[1], path), encoding="utf-8") as file:
        return file.read()


version = ".".join(re.findall(r"^#define AINSWORTH_VERSION_(?:MAJOR|MINOR|SUBMINOR) +(\d+)$",
                              read("include/petscainsworth.h"), re.MULTILINE))
places = {"CHANGELOG.md": r"^## \[%s\]", "CITATION.cff": r"^version: %s$",
          "makefiles/packaging/petsc/ainsworth.py": r"'%s'", "makefiles/packaging/spack/package.py": r'version\("%s"\)',
          "makefiles/packaging/conda/meta.yaml": r'set version = "%s"'}
wrong = [path for path, text in places.items() if not re.search(text % re.escape(version), read(path), re.MULTILINE)]
print("%s is not the version in %s" % (version, ", ".join(wrong)) if wrong else "version: %s everywhere" % version)
sys.exit(bool(wrong))
