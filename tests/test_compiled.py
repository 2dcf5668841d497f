"""The compile cache is never out of date, compiles only what an edit changes, and tolerates broken files."""

import compileall
import dis
import importlib
import os
import shutil
import time
from pathlib import Path

import numba
import numpy as np
import pytest

import uuv_marl
from tests.processes import ran
from tests.swarms import started
from uuv_marl.sim import compiled, sources

PACKAGE = Path(uuv_marl.__file__).parent
# The smallest compiled function that calls another file's: a vehicle's drag, reached through the Runge-Kutta step.
MOVE = """
import sys
import numpy as np
import uuv_marl
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
    environment |= {"PYTHONPATH": str(folder), "UUV_MARL_CACHE_DIR": str(cache)}
    done = ran("-c", MOVE, folder, folder=folder.parent, **environment)
    assert done.returncode == 0, done.stderr
    return done


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
    cold = run(copy, cache)
    assert "Compiling a part of uuv_marl" in cold.stderr
    edit(package / "sim" / "vehicle.py", '"""Nu\' = M^-1', '"""Another wording of: Nu\' = M^-1')
    for name, text in (("sim/motion.py", "# a comment\n"), ("envs/vector_env.py", "\n\n_SOMETHING_ELSE = 1\n")):
        with (package / name).open("a") as file:
            file.write(text)
    assert "Compiling" not in run(copy, cache).stderr, "a docstring, a comment or what nothing here uses was compiled"

    edit(package / "sim" / "vehicle.py", "(p.X_u + p.X_uu * abs(u)) * u", "(p.X_u + p.X_uu * abs(u)) * u * 2.0")
    edited = run(copy, cache)
    assert edited.stdout != cold.stdout, "old physics"

    bounds = run(copy, cache, NUMBA_BOUNDSCHECK="1")
    assert bounds.stdout == edited.stdout
    assert "Compiling" in bounds.stderr, "code without bounds checks was served where they were asked for"


def test_broken_files_of_the_cache_are_compiled_again(copy, tmp_path):
    cache = tmp_path / "cache"
    good = run(copy, cache).stdout
    for pattern in ("motion.integrate*.nbi", "motion.integrate*.nbc"):
        for path in cache.rglob(pattern):
            path.write_bytes(path.read_bytes()[:40])
        done = run(copy, cache)
        assert done.stdout == good
        assert "Compiling" in done.stderr
    assert "Compiling" not in run(copy, cache).stderr


def test_byte_code_without_sources_never_runs_old_physics(copy, tmp_path):
    """It has no key, so it is compiled at every start."""
    done = []
    for k in range(2):
        if k:
            edit(copy / "uuv_marl" / "sim" / "vehicle.py", "p.X_uu * abs(u)) * u", "p.X_uu * abs(u)) * u * 2.0")
        place = tmp_path / f"byte code {k}"
        shutil.copytree(copy, place)
        compileall.compile_dir(place, quiet=1, legacy=True)
        for path in place.rglob("*.py"):
            path.unlink()
        done.append(run(place, tmp_path / "cache"))
    assert done[0].stdout != done[1].stdout
    assert not list((tmp_path / "cache").rglob("*.nbi"))


def test_every_function_of_compiled_code_is_part_of_its_key():
    """Every global name of a compiled function belongs to a module that the key covers, or to a library."""
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
            used = {i.argval for i in dis.get_instructions(function) if i.opname == "LOAD_GLOBAL"}
            found = [function.__globals__[name] for name in used & function.__globals__.keys()]
            homes = {getattr(each, "__module__", None) or getattr(each, "__name__", "") for each in found}
            ours = {home for home in homes if home.startswith("uuv_marl")}
            assert ours <= sources.reached_modules(module.__name__), function.__qualname__
    assert functions > 150


def test_a_cache_that_cannot_be_used_is_explained_and_the_run_goes_on(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    done = run(PACKAGE.parent, blocked / "cache")
    assert "UUV_MARL_CACHE_DIR" in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """The cache, looked up again at every call."""
    monkeypatch.setenv("UUV_MARL_CACHE_DIR", str(tmp_path))

    def ask():
        compiled.cache.cache_clear()
        return compiled.cache()

    yield ask
    compiled.cache.cache_clear()


def test_a_cache_that_others_can_write_to_is_not_executed(cache, tmp_path, caplog):
    own = tmp_path / "uuv_marl-compiled"
    assert cache() == own / f"numba-{numba.__version__}"
    for folder in (own, cache()):
        for mode in (0o777, 0o775):
            folder.chmod(mode)
            assert cache() is None
            assert "others may write to it" in caplog.text
            caplog.clear()
        folder.chmod(0o755)
    assert cache() is not None


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="there are no owners")
def test_a_cache_that_root_prepared_is_read_by_others_and_one_of_theirs_is_not(cache, monkeypatch, caplog):
    folder, owner = cache(), os.getuid()
    stat = Path.stat

    def owned_by(uid):
        def found(path, **how):
            result = stat(path, **how)
            return os.stat_result((*result[:4], uid if result.st_uid == owner else result.st_uid, *result[5:]))

        monkeypatch.setattr(Path, "stat", found)

    monkeypatch.setattr(os, "getuid", lambda: 4711)
    owned_by(0)
    assert cache() == folder
    owned_by(1234)
    assert cache() is None
    assert "it belongs to another user" in caplog.text


def test_without_a_home_folder_there_is_no_cache_and_a_word(cache, monkeypatch, caplog, tmp_path):
    """A container with any user: no HOME, and no entry in passwd."""
    monkeypatch.delenv("UUV_MARL_CACHE_DIR")
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.delenv("HOME", raising=False)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("pwd.getpwuid", lambda uid: {}[uid])
    assert cache() is None
    assert "every start compiles again" in caplog.text
    assert list(tmp_path.iterdir()) == []


def test_the_cache_can_lie_in_the_home_folder(cache, monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("UUV_MARL_CACHE_DIR", "~/mine")
    assert cache().is_relative_to(tmp_path / "mine")


def test_only_old_files_of_the_cache_are_deleted(cache, tmp_path):
    """Other folders and files stay."""
    now, own = cache(), tmp_path / "uuv_marl-compiled"
    key = "0123456789abcdef"
    theirs = [
        "numba-study/run.nbi", "numba-study/run_of_my_thesis.csv", "numba-study/empty/", "compiled-results/model.nbi",
        "compiled-results/model.onnx", f"numba-1/step-{key}.py311.nbi", "uuv_marl-compiled/notes.nbi",
        f"uuv_marl-compiled/numba-1/step-{key}.py311.csv", "uuv_marl-compiled/numba-3/empty/",
    ]  # fmt: skip
    ours = [f"numba-{v}/step-{key}.py311{end}" for v in (1, 2) for end in (".nbi", ".1.nbc", f".nbi.tmp.{key}")]
    fresh = f"uuv_marl-compiled/{now.name}/step-{key}.py311.nbi"
    for name in [*theirs, *(f"uuv_marl-compiled/{name}" for name in ours), fresh]:
        path = tmp_path / name
        (path if name.endswith("/") else path.parent).mkdir(parents=True, exist_ok=True)
        if not name.endswith("/"):
            path.write_text("")
    for path in tmp_path.rglob("*"):
        if path != tmp_path / fresh:
            os.utime(path, (time.time() - 40 * 86400,) * 2)
    compiled.prune(own)
    assert all((tmp_path / name).exists() for name in [*theirs, fresh])
    assert not any((own / name).exists() for name in ours)
    assert not (own / "numba-2").exists()


def test_inner_functions_refuse_python_and_do_not_crash():
    """They have no Python wrapper, so that a call would crash."""
    from uuv_marl.sim import world

    swarm = started("starter")
    swarm.step(np.zeros((1, 5, 2)))
    with pytest.raises(TypeError, match="clear_facts can be called by compiled code only"):
        world.clear_facts(0, swarm.facts)


def test_threads_without_work_sleep():
    """Threads that spin while they wait slow others down: a batch during a training took ten times as long."""
    swarm, action = started("single_obstacle", worlds=8), np.zeros((8, 54, 2), np.float32)
    swarm.step(action)
    spent = time.process_time()
    time.sleep(0.3)
    assert time.process_time() - spent < 0.1
    code = (
        "import numba, numpy, uuv_marl; envs = uuv_marl.vector_env(16); envs.reset(seed=0)\n"
        "envs.step(numpy.zeros((16, 54, 2), numpy.float32)); numba.threading_layer()"
    )
    assert "Threading layer is not initialized" in ran("-c", code).stderr, "Numba's threads were started"
