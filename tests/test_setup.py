"""What is missing on a machine is explained, not a traceback."""

import importlib.util
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture
def setup():
    spec = importlib.util.spec_from_file_location("setup_venv", ROOT / "tools" / "setup_venv.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_this_python_will_do(setup):
    setup.check_python()


class Version(tuple):
    """Stands in for sys.version_info."""


@pytest.mark.parametrize("version", [(3, 10, 2), (3, 15, 0), (4, 0, 0)])
def test_too_old_and_too_new_pythons_are_explained(setup, monkeypatch, capsys, version):
    monkeypatch.setattr(setup.sys, "version_info", Version(version))
    with pytest.raises(SystemExit):
        setup.check_python()
    assert "needs Python 3.11 or later, before 3.15" in capsys.readouterr().err


def test_a_missing_ensurepip_is_explained(setup, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "ensurepip", None)
    with pytest.raises(SystemExit):
        setup.check_python()
    assert "apt-get install python3." in capsys.readouterr().err


def test_a_missing_interpreter_is_explained(tmp_path):
    pins = [path.name for path in ROOT.glob("constraints*.txt")]
    for name in ("Makefile", "pyproject.toml", "tools/setup_venv.py", *pins):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text((ROOT / name).read_text())
    done = subprocess.run(
        ["make", "benchmark", "PYTHON=python3.nowhere"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode != 0
    assert "There is no 'python3.nowhere' here" in done.stdout


def test_every_environment_has_its_extras_and_pins(setup):
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    for _, wanted, constraints in setup.ENVIRONMENTS.values():
        assert set(wanted.strip("[]").split(",")) - {""} <= set(extras)
        assert "torch==2.13.0" in (ROOT / constraints).read_text().splitlines()
