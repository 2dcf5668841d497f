"""Make a virtual environment and install uuv_marl into it: setup_venv.py NAME. Explains what is missing.

Written for any Python 3, so that one that is too old hears why.
"""

import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
# Name: folder, extras, constraints. BenchMARL and RLlib pin what the others have newer, so they live apart.
ENVIRONMENTS = {
    "base": (".venv", "", "constraints.txt"),
    "dev": (".venv", "[dev]", "constraints.txt"),
    "benchmarl": (".venv-benchmarl", "[benchmarl,test]", "constraints-benchmarl.txt"),
    "rllib": (".venv-rllib", "[distributed,render,test]", "constraints-rllib.txt"),
}
# What perf/compare.py measures beside uuv_marl, without it, and perf/training.py with it.
PEERS = {
    "perf-mpe2": ("mpe2", "stable-baselines3"),
    "perf-vmas": ("vmas", "stable-baselines3"),
    "perf-jaxmarl": ("jaxmarl",),
    "perf-supersuit": ("-e", ".[train]", "supersuit"),
}


def stop(message):
    """End with a message and no traceback."""
    sys.stderr.write(message + "\n")
    raise SystemExit(1)


def supported():
    """Lowest version and the first one too new, from pyproject.toml."""
    with open(os.path.join(ROOT, "pyproject.toml")) as file:
        low, high = re.search(r'requires-python = ">=(\d+\.\d+),<(\d+\.\d+)"', file.read()).groups()
    return tuple(map(int, low.split("."))), tuple(map(int, high.split(".")))


def check_python():
    """Stop where this interpreter can't carry uuv_marl."""
    low, high = supported()
    if not low <= sys.version_info[:2] < high:
        stop(
            "uuv_marl needs Python %d.%d or later, before %d.%d (Numba and PettingZoo end there); this is %s at %s.\n"
            "Install a fitting one, or name it: make benchmark PYTHON=python3.12"
            % (low + high + (sys.version.split()[0], sys.executable))
        )
    try:
        import ensurepip  # noqa: F401
        import venv  # noqa: F401
    except ImportError:
        stop(
            "%s can't make virtual environments: its modules ensurepip and venv are missing.\n"
            "On Debian and Ubuntu: apt-get install python%d.%d-venv. Elsewhere install a complete Python, or name one: "
            "make benchmark PYTHON=/path/to/python3" % ((sys.executable,) + sys.version_info[:2])
        )


def run(*command):
    """Run a command, or stop with what it was."""
    if subprocess.call(command, cwd=ROOT) != 0:
        stop("This failed: %s\nRead the lines above; 'make clean' removes half-made environments." % " ".join(command))


def main(name):
    """Make the environment of this name."""
    check_python()
    if name in PEERS:
        folder, wanted, constraints = ".venv-" + name, PEERS[name], "constraints-%s.txt" % name
    else:
        folder, extras, constraints = ENVIRONMENTS[name]
        wanted = ("-e", "." + extras)
    venv = os.path.join(ROOT, folder)
    python = os.path.join(venv, "bin", "python")
    if not os.path.exists(python):
        print("Making %s with Python %s" % (folder, sys.version.split()[0]))
        run(sys.executable, "-m", "venv", venv)
    made_with = (
        subprocess.check_output([python, "-c", "import sys; print('%d.%d' % sys.version_info[:2])"]).decode().strip()
    )
    if made_with != "%d.%d" % sys.version_info[:2]:
        stop(
            "The %s here is of Python %s, not of this %s; 'make clean' first."
            % (folder, made_with, sys.version.split()[0])
        )
    print("Installing %s into %s; the first time takes a few minutes" % (" ".join(wanted), folder))
    run(python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-c", constraints, *wanted)
    with open(os.path.join(venv, name + ".stamp"), "w"):
        pass


if __name__ == "__main__":
    main(sys.argv[1])
