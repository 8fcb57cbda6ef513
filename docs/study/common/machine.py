"""What all the measurements share: the build folder, how to start twocubes, and which machine they ran on."""
import ctypes
import os
import re
import resource
import signal
import subprocess
import sys
import tempfile

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", "..", ".."))
BUILD = os.path.abspath(os.environ.get("AINSWORTH_BUILD") or os.path.join(ROOT, "build"))
PEAK = os.path.join(os.path.dirname(os.path.abspath(__file__)), "peak.py")
PLUGIN = os.path.join(BUILD, "libainsworth.so")
TWOCUBES, SCENES, SOLVE, MODELS = (os.path.join(BUILD, "bench", name)
                                   for name in ("twocubes", "scenes", "solve", "models"))


def blas():
    """Kernels of OpenBLAS for a processor that is newer than itself: it would take those of one of 2004, which make a
    factorization by MUMPS twice as slow."""
    found = subprocess.run([sys.executable, "-c", "import ctypes; ctypes.CDLL('libblas.so.3')"], text=True,
                           env=dict(os.environ, OPENBLAS_VERBOSE="2"), stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    if "Core: Prescott" not in found.stdout:
        return {}
    with open("/proc/cpuinfo") as file:
        flags = file.read().split()
    kernels = "SkylakeX" if "avx512dq" in flags else "Haswell" if "avx2" in flags else None
    return {"OPENBLAS_CORETYPE": kernels} if kernels else {}


# Open MPI waits two seconds for others after a program that fails, as one does that ends after a given number of
# iterations
ENVIRONMENT = dict(blas(), **dict(os.environ, OMP_NUM_THREADS="1", OMPI_MCA_odls_base_sigkill_timeout="0"))
DEFAULTS = "-ksp_type preonly -pc_type ainsworth"
MISSED = 3  # exit status of a study that was made, but misses a bound


def require(*modules, program=TWOCUBES):
    """Ends the script with one line unless the plugin, a program of the build and these Python modules are there."""
    for path in (PLUGIN, program):
        if not os.path.exists(path):
            sys.exit("%s is missing: run sh makefiles/build.sh first, or say AINSWORTH_BUILD=<folder>" % path)
    packages = {"petsc4py": "python3-petsc4py", "numpy": "python3-numpy", "scipy": "python3-scipy",
                "gmsh": "python3-gmsh", "matplotlib": "python3-matplotlib"}
    missing = []
    for module in modules:
        try:
            __import__(module)
        except ImportError:
            missing.append(packages[module])
    if missing:
        sys.exit("Missing: %s. Install with apt, and run with /usr/bin/python3" % " ".join(missing))


def launcher(ranks):
    """As in common.sh: Open MPI must be told that root, or more ranks than cores, is meant."""
    command = ["mpiexec"]
    version = subprocess.run(["mpiexec", "--version"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                             text=True).stdout
    if "Open MPI" in version or "OpenRTE" in version:
        if os.geteuid() == 0:
            command.append("--allow-run-as-root")
        if ranks > (os.cpu_count() or 1):
            command.append("--oversubscribe")
    return command + ["-n", str(ranks)]


def processor_seconds():
    """Of all the programs that ended so far."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def output(command, limit):
    """What it prints; at the limit the launcher is told to end, so that it ends its ranks."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=ENVIRONMENT)
    try:
        return process.communicate(timeout=limit)[0]
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGTERM)
        try:
            process.communicate(timeout=20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
        raise


def run(options, ranks=1, limit=600, peak=False, program=TWOCUBES, plugin=PLUGIN,
        defaults=DEFAULTS + " -ainsworth_ksp_converged_reason"):
    """A tutorial, twocubes, with the plugin: iterations, reason, seconds and residuals, in strings and numbers;
    'processor' are seconds of the whole program.

    peak: also the sum over the ranks of the most memory that each had [MiB]."""
    command = (launcher(ranks) + ([sys.executable, PEAK] if peak else []) + [program, "-dll_append", plugin]
               + (defaults + " " + options).split())
    answer = {"iterations": None, "reason": "no answer", "setup": None, "solve": None, "constraint": None,
              "primal": None, "unknowns": None, "constraints": None}
    before = processor_seconds()
    try:
        text = output(command, limit)
    except subprocess.TimeoutExpired:
        return dict(answer, reason="time limit of %d s" % limit, output="")
    answer["output"], answer["processor"] = text, processor_seconds() - before
    found = re.search(r"Linear ainsworth_ solve (?:converged|did not converge) due to (\w+) iterations (\d+)", text)
    if found:
        answer["reason"], answer["iterations"] = found.group(1), int(found.group(2))
    else:
        found = re.search(r"^(?:scene|alone): .*\biterations=(\d+) reason=(\w+)$", text, re.MULTILINE)
        if found:
            answer["reason"], answer["iterations"] = found.group(2), int(found.group(1))
    found = re.search(r"unknowns=(\d+) constraints=(\d+) setup_s=(\S+) solve_s=(\S+) primal_residual=(\S+) "
                      r"constraint_residual=(\S+)", text)
    if found:
        answer["unknowns"], answer["constraints"] = int(found.group(1)), int(found.group(2))
        for name, number in zip(("setup", "solve", "primal", "constraint"), found.groups()[2:]):
            answer[name] = float(number)
    if peak:
        answer["peak"] = sum(int(kib) for kib in re.findall(r"^peak: (\d+)$", text, re.MULTILINE)) / 1024
    if not found and "PETSC ERROR" in text:
        errors = [line.split("PETSC ERROR:", 1)[1].strip() for line in text.splitlines() if "PETSC ERROR:" in line]
        # the kind of error, then the message, if any
        errors = [line for line in errors if line and not line.startswith("---")][:2] + ["?"]
        answer["reason"] = "error: " + errors[0 if errors[1].startswith(("See ", "?")) else 1]
    return answer


def converged(answer):
    return answer["reason"].startswith("CONVERGED")


def quickest(repeat, *arguments, **how):
    """Of several runs that with the least set-up + solve; a failure is not repeated."""
    answer = None
    for _ in range(repeat):
        again = run(*arguments, **how)
        if not converged(again):
            return again
        if answer is None or again["setup"] + again["solve"] < answer["setup"] + answer["solve"]:
            answer = again
    return answer


def write_system(options, prefix):
    """A, C, f, g of this problem in PETSc's binary format; no solver is involved."""
    command = [TWOCUBES] + options.split() + ["-write_system", prefix, "-ksp_type", "preonly", "-pc_type", "none"]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=ENVIRONMENT)
    if not os.path.exists(prefix + "_g.dat"):
        raise RuntimeError("twocubes wrote no system: " + done.stdout)


def workspace():
    """A folder for matrices, removed at the end."""
    return tempfile.TemporaryDirectory(prefix="ainsworth-study-")


def load():
    return os.getloadavg()[0]


def describe():
    """Cores, processor, versions: what a reader needs to judge the seconds."""
    with open("/proc/cpuinfo") as file:
        model = next((line.split(":", 1)[1].strip() for line in file if line.startswith("model name")),
                     "unknown processor")
    library = ctypes.CDLL(PLUGIN)
    petsc, hypre = [ctypes.c_int() for _ in range(4)], [ctypes.c_int() for _ in range(4)]
    library.PetscGetVersionNumber(*[ctypes.byref(number) for number in petsc])
    try:
        library.HYPRE_VersionNumber(*[ctypes.byref(number) for number in hypre])
        version = ".".join(str(number.value) for number in hypre[:3])
    except AttributeError:
        version = "none"
    return "%d cores, %s, PETSc %s, hypre %s" % (os.cpu_count(), model,
                                                 ".".join(str(number.value) for number in petsc[:3]), version)


def command_line():
    """The command as a reader would type it."""
    return " ".join(["python3", os.path.relpath(os.path.abspath(sys.argv[0]), ROOT)] + sys.argv[1:])
