"""Python in processes of its own, and the command ``uuv-marl`` in this one."""

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

from typer.testing import CliRunner

from uuv_marl import load_scenario
from uuv_marl.cli import app

ROOT = Path(__file__).resolve().parent.parent
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


def page_block(library):
    """The example of docs/interfaces.md that imports from a library."""
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "interfaces.md").read_text(), flags=re.S)
    (block,) = [block for block in blocks if f"from {library}." in block]
    return block


def ran(*words, folder=None, **environment):
    """An interpreter that has run with these arguments: its status and its output."""
    command, environment = [sys.executable, *map(str, words)], {**os.environ, **environment}
    how = {"cwd": folder, "env": environment, "capture_output": True, "encoding": "utf-8", "timeout": 900}
    return subprocess.run(command, check=False, **how)


def python(*words, **how):
    """What an interpreter prints that runs a script, or code after ``-c``; it must succeed."""
    done = ran(*words, **how)
    assert done.returncode == 0, done.stderr
    return done.stdout


def cli(*words):
    """The exit status, and the output on one line without the frames of tables."""
    done = CliRunner().invoke(app, [*map(str, words)])
    if done.exception and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done.exit_code, " ".join(done.output.replace("│", " ").split())


def succeeds(*words):
    """The output of a command, which must succeed."""
    status, text = cli(*words)
    assert status == 0, text
    return text


def refused(message, *words):
    """The output of a command, which must be refused with this message."""
    status, text = cli(*words)
    assert status == 2, text
    assert message in text
    return text
