"""Files are whole at any time; a folder belongs to one command at a time; a missing extra is named."""

import errno
import multiprocessing
import os

import pytest

from tests.processes import ran
from uuv_marl.atomic import locked, replacing, write_text
from uuv_marl.errors import MissingExtraError, ResultsError
from uuv_marl.extras import extra


def test_a_file_is_written_whole(tmp_path):
    path = tmp_path / "table.md"
    write_text(path, "á\r\nb\n")
    assert path.read_bytes() == "á\r\nb\n".encode()
    assert [p.name for p in tmp_path.iterdir()] == ["table.md"]


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError, OSError(errno.ENOSPC, "No space left on device")])
def test_a_write_that_fails_leaves_the_old_file(tmp_path, error):
    path = tmp_path / "results.json"
    path.write_text("old")

    def fail():
        with replacing(path) as partial:
            assert partial.suffix == ".json"
            partial.write_text("half")
            raise error

    with pytest.raises((KeyboardInterrupt, ValueError, ResultsError)) as caught:
        fail()
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["results.json"]
    if isinstance(error, OSError):
        assert str(path) in str(caught.value)
        assert "No space left on device" in str(caught.value)


def test_a_folder_belongs_to_one_block(tmp_path):
    folder = tmp_path / "new" / "folder"
    with locked(folder):
        message = rf"{folder} is in use by process {os.getpid()} on .* since "
        with pytest.raises(ResultsError, match=message), locked(folder):
            pass
        with locked(tmp_path / "other"):
            pass
    with locked(folder):
        pass


def _hold(folder, held, stop):
    with locked(folder):
        held.set()
        stop.wait(60)


def test_a_dead_process_frees_its_folder(tmp_path):
    spawn = multiprocessing.get_context("spawn")
    held, stop = spawn.Event(), spawn.Event()
    process = spawn.Process(target=_hold, args=(tmp_path, held, stop))
    process.start()
    try:
        assert held.wait(60)
        with pytest.raises(ResultsError, match=f"process {process.pid} on"), locked(tmp_path):
            pass
    finally:
        process.kill()
        process.join()
    with locked(tmp_path):
        pass


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(ResultsError, match=rf"{folder} can't be written.*--output"), locked(folder):
            pass


def test_a_missing_library_names_its_extra():
    with pytest.raises(MissingExtraError, match=r"pip install 'uuv_marl\[train\]'"), extra("train"):
        import nothing_of_that_name  # noqa: F401
    with pytest.raises(ModuleNotFoundError, match="No module named 'uuv_marl.nothing'"), extra("train"):
        import uuv_marl.nothing  # noqa: F401


@pytest.mark.parametrize(("module", "library", "name"), [
    ("envs.sb3", "stable_baselines3", "sb3"),
    ("envs.torchrl", "torchrl", "torchrl"),
    ("envs.benchmarl", "benchmarl", "benchmarl"),
    ("envs.rllib", "ray", "distributed"),
])  # fmt: skip
def test_modules_of_optional_libraries_name_their_extra(module, library, name):
    code = f"import sys; sys.modules[{library!r}] = None; import uuv_marl.{module}"
    assert f"pip install 'uuv_marl[{name}]'" in ran("-c", code).stderr


def test_a_folder_in_which_nothing_was_written_goes_again(tmp_path):
    with pytest.raises(RuntimeError, match="before"), locked(tmp_path / "new"):
        raise RuntimeError("before anything was written")
    assert not (tmp_path / "new").exists()
    (tmp_path / "old").mkdir()
    with locked(tmp_path / "old"):
        pass
    with locked(tmp_path / "used"):
        (tmp_path / "used" / "a.txt").write_text("a")
    assert (tmp_path / "old").exists()
    assert (tmp_path / "used" / "a.txt").exists()
