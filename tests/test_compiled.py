"""The compile cache never serves old physics, compiles no more than an edit asks for, and survives a broken file."""

import dis
import importlib
import logging
import os
import shutil
import subprocess
import sys
import time
import types
from pathlib import Path

import numpy as np
import pytest

import uuv_marl
from uuv_marl import load_scenario
from uuv_marl.sim import compiled, sources
from uuv_marl.sim.swarm import Swarm

PACKAGE = Path(uuv_marl.__file__).parent
# The smallest compiled function that calls another file's: a vehicle's drag, reached through the Runge-Kutta step.
MOVE = """
import sys
import numpy as np
import uuv_marl
from uuv_marl import load_scenario
from uuv_marl import load_scenario
from uuv_marl.sim.workspace import Columns
from uuv_marl.sim.motion import integrate
from uuv_marl.sim.vehicle import plant
assert uuv_marl.__file__.startswith(sys.argv[1]), uuv_marl.__file__
now = Columns(*np.ones((len(Columns._fields), 2)))
integrate(1, 0.1, now, plant(load_scenario("tracking")))
print(now.u[0].hex())
"""


def run(folder, cache, **environment):
    environment = {**os.environ, "PYTHONPATH": str(folder), "UUV_MARL_CACHE_DIR": str(cache), **environment}
    return subprocess.run(
        [sys.executable, "-c", MOVE, str(folder)],
        capture_output=True,
        text=True,
        check=True,
        env=environment,
        cwd=folder,
    )


@pytest.fixture
def copy(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "code" / "uuv_marl", ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path / "code"


def edit(path, before, after):
    text = path.read_text()
    assert text.count(before) == 1
    path.write_text(text.replace(before, after))


def test_an_edit_compiles_what_uses_it_and_nothing_else(copy, tmp_path):
    cache, package = tmp_path / "cache", copy / "uuv_marl"
    cold, warm = run(copy, cache), run(copy, cache)
    assert "Compiling a part of uuv_marl" in cold.stderr
    assert warm.stdout == cold.stdout
    assert "Compiling" not in warm.stderr
    kept = set(cache.rglob("*.nbi"))

    edit(package / "sim" / "vehicle.py", '"""Nu\' = M^-1', '"""Another wording of: Nu\' = M^-1')
    with (package / "envs" / "vector_env.py").open("a") as file:
        file.write("# a comment\n")
    edit(package / "sim" / "workspace.py", "Squared length of the action as pushed.", "Another wording.")
    with (package / "sim" / "motion.py").open("a") as file:
        file.write("\n\n_SOMETHING_ELSE = 1\n")
    assert "Compiling" not in run(copy, cache).stderr, "a docstring, a comment or a neighbour was compiled"

    edit(package / "sim" / "vehicle.py", "(p.X_u + p.X_uu * abs(u)) * u", "(p.X_u + p.X_uu * abs(u)) * u * 2.0")
    edited = run(copy, cache)
    assert edited.stdout != cold.stdout, "old physics"
    functions = {path.name.split("-")[0] for path in set(cache.rglob("*.nbi")) - kept}
    assert functions == {
        "motion.integrate",
        "vehicle.advance",
        "vehicle.advance_lagging",
        "vehicle.derivative",
        "vehicle.acceleration",
        "vehicle.damping",
    }

    bounds = run(copy, cache, NUMBA_BOUNDSCHECK="1")
    assert bounds.stdout == edited.stdout
    assert "Compiling" in bounds.stderr, "code without bounds checks was served where they were asked for"

    edit(package / "sim" / "vehicle.py", "import compiled_inline\n", "import compiled, compiled_inline\n")
    edit(package / "sim" / "vehicle.py", "@compiled_inline\ndef wrap", "@compiled\ndef wrap")
    assert "Compiling" in run(copy, cache).stderr, "a function that is no longer copied into its callers"


def test_broken_files_of_the_cache_are_compiled_anew(copy, tmp_path):
    cache = tmp_path / "cache"
    good = run(copy, cache).stdout
    for pattern in ("motion.integrate*.nbi", "motion.integrate*.nbc"):
        for path in cache.rglob(pattern):
            path.write_bytes(path.read_bytes()[:40])
        done = run(copy, cache)
        assert done.stdout == good
        assert "Compiling" in done.stderr
        assert "Compiling" not in run(copy, cache).stderr


def test_every_global_of_compiled_code_is_part_of_its_key():
    """Whatever a compiled function looks up in its module is code that the key covers, or belongs to a library."""
    functions = 0
    for path in PACKAGE.rglob("*.py"):
        if "@compiled" not in path.read_text():
            continue
        module = importlib.import_module(".".join(["uuv_marl", *path.relative_to(PACKAGE).with_suffix("").parts]))
        for value in vars(module).values():
            function = getattr(value, "py_func", None)
            if function is None or function.__module__ != module.__name__:
                continue
            functions += 1
            names = {name for _, name in sources.reached(function)}
            used = {i.argval for i in dis.get_instructions(function) if i.opname == "LOAD_GLOBAL"}
            used &= function.__globals__.keys()
            ours = {n for n in used if not isinstance(function.__globals__[n], types.ModuleType)}
            ours -= {n for n in ours if getattr(function.__globals__[n], "__module__", "").startswith("numba.")}
            assert {getattr(function.__globals__[n], "__name__", n) for n in ours} <= names, function.__qualname__
    assert functions > 150


def package_of(folder, **texts):
    folder.mkdir(exist_ok=True)
    (folder / "__init__.py").write_text("")
    for name, text in texts.items():
        (folder / f"{name}.py").write_text(text)


def key_of(name):
    for module in [m for m in sys.modules if m.startswith(name)]:
        del sys.modules[module]
    importlib.invalidate_caches()
    sources._statements.cache_clear()
    sources._content.cache_clear()
    return sources.source_key(importlib.import_module(f"{name}.kernel").step)


KERNEL = """
from keyed import other
from keyed.other import LIMIT, Plant, scaled as by

def step(x, p: Plant):
    return by(x) + p.mass + LIMIT + other.dotted(x)

def neighbour():
    return 1
"""
OTHER = """
from typing import NamedTuple

LIMIT = 2.0

class Plant(NamedTuple):
    mass: float
    drag: float

    def of(self):
        return neighbour

def scaled(x):
    return _FACTOR * x

_FACTOR, _REST = 3.0, 4.0

def dotted(x):
    return 5 * x

def neighbour():
    return 1
"""


@pytest.mark.parametrize(
    ("before", "after", "changes"),
    [
        ("LIMIT = 2.0", "LIMIT = 2.5", True),
        ("_FACTOR, _REST = 3.0", "_FACTOR, _REST = 3.5", True),
        ("    mass: float\n    drag: float", "    drag: float\n    mass: float", True),
        ("return _FACTOR * x", "return x * _FACTOR", True),
        ("return 5 * x", "return 6 * x", True),
        ("return _FACTOR * x", '"""A docstring."""\n    return _FACTOR * x  # and a comment', False),
        ("        return neighbour", "        return LIMIT", False),
        ("    return 1", "    return 2", False),
    ],
)
def test_the_key_follows_names_through_files(tmp_path, monkeypatch, before, after, changes):
    monkeypatch.syspath_prepend(str(tmp_path))
    package_of(tmp_path / "keyed", kernel=KERNEL, other=OTHER)
    first = key_of("keyed")
    assert before in OTHER
    package_of(tmp_path / "keyed", other=OTHER.replace(before, after))
    assert (key_of("keyed") != first) is changes


def test_a_cache_that_cannot_be_used_is_explained_and_the_run_goes_on(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    done = run(PACKAGE.parent, blocked / "cache")
    assert "UUV_MARL_CACHE_DIR" in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout


def test_a_cache_that_others_can_write_to_is_not_executed(tmp_path, monkeypatch, caplog):
    import numba

    folder = tmp_path / f"numba-{numba.__version__}"
    folder.mkdir()
    folder.chmod(0o777)
    monkeypatch.setenv("UUV_MARL_CACHE_DIR", str(tmp_path))
    compiled.cache_dir.cache_clear()
    try:
        with caplog.at_level(logging.WARNING, logger="uuv_marl"):
            assert compiled.cache_dir() is None
        assert "everybody may write to it" in caplog.text
        folder.chmod(0o700)
        compiled.cache_dir.cache_clear()
        assert compiled.cache_dir() == folder
    finally:
        compiled.cache_dir.cache_clear()


def test_code_that_nobody_used_for_a_month_is_deleted(tmp_path):
    old, new = tmp_path / "compiled-0123" / "sim_ab", tmp_path / "numba-1"
    (tmp_path / "mine").mkdir()
    for folder in (old, new):
        folder.mkdir(parents=True)
        for name in ("step.py311.nbi", "step.py311.1.nbc"):
            (folder / name).write_text("")
            if folder == old:
                os.utime(folder / name, (time.time() - 40 * 86400,) * 2)
    compiled.prune(tmp_path)
    assert sorted(path.name for path in tmp_path.rglob("*")) == [
        "mine",
        "numba-1",
        "step.py311.1.nbc",
        "step.py311.nbi",
    ]


def test_compiled_code_gives_what_python_gives():
    """The decorator changes how fast a function is, not what it computes."""
    from uuv_marl.sim.vehicle import wrap

    for angle in np.linspace(-20.0, 20.0, 101):
        assert wrap(angle) == wrap.py_func(angle)


def test_inner_functions_refuse_python_and_do_not_crash():
    """They have no door for Python, and entering where there is none would end the process."""
    from uuv_marl.sim import world

    swarm = Swarm(load_scenario("starter"))
    swarm.reset(0)
    swarm.step(np.zeros((1, 5, 2)))
    with pytest.raises(TypeError, match="clear_facts can be called by compiled code only"):
        world.clear_facts(0, swarm.facts)


@pytest.mark.skipif(sys.platform != "linux", reason="GNU's OpenMP says what it was told")
@pytest.mark.parametrize(("told", "taken"), [({}, "2000"), ({"GOMP_SPINCOUNT": "77"}, "77")], ids=["ours", "user's"])
def test_threads_without_work_soon_leave_their_core_to_others(told, taken):
    spins = "GOMP_SPINCOUNT", "OMP_WAIT_POLICY"
    environment = {key: value for key, value in os.environ.items() if key not in spins}
    code = "import os, uuv_marl.sim.swarm, numba.np.ufunc.omppool; print(os.environ.get('GOMP_SPINCOUNT'))"
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env={**environment, **told, "OMP_DISPLAY_ENV": "verbose"},
    )
    assert f"GOMP_SPINCOUNT = '{taken}'" in done.stderr
    assert done.stdout.strip() == str(told.get("GOMP_SPINCOUNT")), "the environment of the process stays as it is"
