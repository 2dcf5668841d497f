"""Python in processes of its own, and the command ``uuv-marl`` in this one."""

import importlib.util
import os
import subprocess
import sys

from typer.testing import CliRunner

from uuv_marl import load_scenario
from uuv_marl.cli import app

QUICK = {"time_limit.factor": 0.02, "time_limit.extra_s": 5.0, "swarm.num_vehicles": 8}
SETS = [f"--set={field}={value}" for field, value in QUICK.items()]
"""Episodes of seconds, in Python and on the command line."""


def quick(name="single_obstacle", **changes):
    return load_scenario(name, overrides={**QUICK, **changes})


def module_of(path):
    """A script as a module that is not in ``sys.modules``."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def python(code, *arguments, folder=None, **environment):
    """What an interpreter prints that runs the code with warnings shown; it must succeed."""
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)], cwd=folder, env={**os.environ, **environment},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def cli(*words):
    """The exit status, and the output on one line without the frames of tables."""
    done = CliRunner().invoke(app, [*map(str, words)])
    if done.exception and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done.exit_code, " ".join(done.output.replace("│", " ").split())
