"""A release: the wheel, installed into an empty environment outside the checkout, does what README says there.

``make test-release``: it builds, installs from the package registry, and compiles. The content of the distributions is
tested in test_setup.py, with every run.
"""

import os
import subprocess
import sys

import pytest

from tests.processes import ROOT

pytestmark = [pytest.mark.release, pytest.mark.needs("build")]


def run(*command, **options):
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, check=False, timeout=900, **options)
    return done.returncode, done.stdout + done.stderr


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dist")
    code, output = run(sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, ROOT)
    assert code == 0, output
    (wheel,) = folder.glob("*.whl")
    return wheel


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """Runs ``uuv-marl`` of an environment that holds the wheel and what it depends on, in an empty folder."""
    folder = tmp_path_factory.mktemp("empty")
    env = folder / "env"
    assert run(sys.executable, "-m", "venv", "--without-pip", env)[0] == 0
    scripts = env / ("Scripts" if os.name == "nt" else "bin")
    pip = (sys.executable, "-m", "pip", "--python", scripts / "python", "--disable-pip-version-check")
    code, output = run(*pip, "install", "--quiet", "-c", ROOT / "constraints.txt", wheel)
    assert code == 0, output
    work = folder / "work"
    work.mkdir()
    clean = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}

    def command(*words):
        return run(scripts / "uuv-marl", *words, cwd=work, env=clean)

    command.folder = work
    return command


@pytest.mark.parametrize(("words", "says"), [
    (["--help"], "robustness"),
    (["--version"], "uuv_marl "),
    (["list"], "remus100"),
    (["list", "--show", "starter"], "num_vehicles = 5"),
    (["benchmark", "--scenario", "starter", "--seeds", "1", "--policy", "mappo", "--output", "out"], "Every seed:"),
    (["replay", "--scenario", "starter", "--output", "episode.html"], "episode.html"),
], ids=lambda value: "_".join(value[:2]) if isinstance(value, list) else "")  # fmt: skip
def test_a_command_works_outside_the_checkout(installed, words, says):
    code, output = installed(*words)
    assert code == 0, output
    assert says in output
