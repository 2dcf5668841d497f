"""What the documents say is executed, or compared with the code."""

import importlib.util
import json
import re
import shlex
import sys
import warnings
from fnmatch import fnmatch
from types import ModuleType
from typing import Literal, get_args, get_origin

import numpy as np
import pytest
from typer.testing import CliRunner

from research.episodes import measured, read_rows, select
from tests.processes import ROOT, module_of
from uuv_marl import load_scenario
from uuv_marl.baselines import POLICIES
from uuv_marl.cli import app
from uuv_marl.scenario import Scenario
from uuv_marl.tasks import TASKS
from uuv_marl.tasks.maps.kinds import KINDS

pytestmark = pytest.mark.docs
README, CONTRIBUTING, INDEX = ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "docs" / "README.md"
POLICY = [ROOT / name for name in ("SECURITY.md",)]
TUTORIALS = sorted((ROOT / "docs" / "tutorials").glob("*.py"))
PAGES = [README, CONTRIBUTING, *POLICY, *sorted((ROOT / "docs").rglob("*.md")), *TUTORIALS]
ELSEWHERE = {"benchmarl": "from benchmarl.", "rllib": "from ray.rllib."}
"""Imports by which the examples are known that run in tests/adapters, where their libraries are."""


def blocks(language, pages=PAGES):
    return [
        pytest.param(block, id=f"{page.name}-{k}")
        for page in pages
        for k, block in enumerate(re.findall(rf"```{language}\n(.*?)```", page.read_text(), flags=re.S))
    ]


LONG = re.compile(r"\.learn\([\d_]+\)")
"""A training of Stable-Baselines3 as a page prints it: minutes."""


def begun(block):
    """The block, but its trainings end after their first step."""
    if "from torchrl.objectives" in block:
        assert block.count("range(20)") == 1
        return block.replace("range(20)", "range(1)")
    return LONG.sub(".learn(1, callback=lambda *_: False)", block)


def is_run_here(block):
    return not any(line in block for line in ELSEWHERE.values())


@pytest.mark.parametrize("block", [param for param in blocks("python") if is_run_here(param.values[0])])
def test_python_blocks_run_and_show_something(block, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    example = ModuleType("example")
    monkeypatch.setitem(sys.modules, "example", example)  # its classes have names module:Class
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", module="torchrl|tensordict")
        exec(compile(begun(block), "README.md", "exec"), vars(example))
    assert capsys.readouterr().out or block.startswith("# mine.py")


def test_the_gallery_shows_every_task_and_is_as_its_tool_makes_it():
    gallery = module_of(ROOT / "tools" / "make_gallery.py")
    assert (ROOT / "docs" / "gallery.md").read_text() == gallery.page()
    films = list(gallery.FOLDER.iterdir())
    assert {path.stem for path in films} == {film.name for film in gallery.FILMS}
    assert sum(path.stat().st_size for path in films) < 3_000_000
    shown = {load_scenario(film.scenario).task.name for film in gallery.FILMS}
    assert shown == set(TASKS) - {"reach"}
    assert {film.kind for film in gallery.FILMS} - {""} == set(KINDS)


def test_the_site_s_menu_has_every_page():
    menu = re.findall(r"^(?:.*<)?([^\s:<>`]+)>?$", (ROOT / "docs" / "site" / "navigation.txt").read_text(), flags=re.M)
    pages = {page.relative_to(ROOT).with_suffix("").as_posix() for page in PAGES} - {"README"}
    assert {page for page in pages if not any(fnmatch(page, entry) for entry in menu)} == set()


@pytest.mark.parametrize("source", TUTORIALS, ids=lambda path: path.stem)
def test_a_notebook_has_the_cells_of_its_source_and_one_that_installs(source):
    import jupytext  # not in every environment in which this file is collected

    path = source.with_suffix(".ipynb")
    first, *stored = json.loads(path.read_text())["cells"]
    assert "%pip install" in "".join(first["source"])
    made = [
        cell for cell in jupytext.read(source, fmt="py:percent").cells if "check" not in cell.metadata.get("tags", ())
    ]
    kept = [(cell["cell_type"], "".join(cell["source"])) for cell in stored]
    assert kept == [(cell.cell_type, cell.source) for cell in made], "make notebooks"
    assert all(cell["outputs"] for cell in stored if cell["cell_type"] == "code")
    assert path.stat().st_size < 300_000


CONSOLE = "\n".join(param.values[0] for param in blocks("console")).splitlines()
COMMANDS = {line.split("#")[0].strip() for line in CONSOLE if "uuv-marl" in line or "-m research." in line}


def stop(*args, **kwargs):
    raise KeyboardInterrupt


def stop_at_once(*args, **kwargs):
    yield from iter(stop, None)


@pytest.mark.parametrize("line", sorted(COMMANDS))
def test_commands_are_understood(line, monkeypatch, tmp_path):
    """Parsed as written, options and names checked, then stopped before the long work."""
    for work in (
        "benchmark.runner.run_missing", "benchmark.tuning.tune", "benchmark.robustness.job.run",
        "replay.record.record", "benchmark.results.read_content",
    ):  # fmt: skip
        monkeypatch.setattr(f"uuv_marl.{work}", stop)
    for work in (
        "paper.reproduce.make", "dynamics.__main__.identify", "heldout.__main__.make_page", "verify.check.check",
        "leaderboard.__main__.made", "leaderboard.__main__.load", "messages.__main__.make_page",
    ):  # fmt: skip
        monkeypatch.setattr(f"research.{work}", stop)
    monkeypatch.setattr("uuv_marl.train.run.train", stop_at_once)
    monkeypatch.syspath_prepend(ROOT / "examples" / "extending")
    monkeypatch.chdir(tmp_path)
    line = line.replace(" docs/", f" {ROOT / 'docs'}/")
    line = re.sub(r"--policy (runs/\S+|mine:\w+)", "--policy mappo", line)  # a reader's own
    words = shlex.split(line.removeprefix("python -m "))
    command = app if words[0] == "uuv-marl" else importlib.import_module(f"{words[0]}.__main__").app
    done = CliRunner().invoke(command, words[1:])
    missing = "holds no training to resume"  # a training that goes on has a folder
    assert done.exit_code in (0, 130) or missing in " ".join(done.output.split()), done.output


@pytest.mark.parametrize("block", blocks("toml"))
def test_toml_blocks_are_scenarios(block, tmp_path):
    (tmp_path / "mine.toml").write_text(block)
    assert load_scenario(tmp_path / "mine.toml").title


def test_generated_tables_are_those_of_the_code():
    tables = module_of(ROOT / "tools" / "write_tables.py")
    for page in tables.PAGES:
        assert page.read_text() == tables.written(page), f"{page.name}: run python tools/write_tables.py"
    marked = re.findall(r"^<!-- (\w+) -->$", "".join(page.read_text() for page in tables.PAGES), flags=re.M)
    assert sorted(marked) == sorted(tables.TABLES)


def links(page):
    """Targets of a page's links to files of the repository, and their anchors."""
    found = re.findall(r"\]\((?!https?:)([^)#]*)#?([^)]*)\)", page.read_text())
    return [((page.parent / link).resolve() if link else page, anchor) for link, anchor in found]


def anchors(page):
    """Anchors of a page's headings, as GitHub makes them."""
    text = re.sub(r"```.*?```", "", page.read_text(), flags=re.S)
    headings = re.findall(r"^#+ (.*)$", text, flags=re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    for target, anchor in links(page):
        assert target.exists(), target
        assert not anchor or anchor in anchors(target), f"{target.name}#{anchor}"


def test_the_table_of_policies_is_right():
    text = (ROOT / "docs" / "policies.md").read_text().partition("\n## ")[0]
    rows = re.findall(r"^\| (`.*?) \| .* \| (.*) \|$", text, flags=re.M)
    needs = {name: need for names, need in rows for name in re.findall(r"`(\w+)`", names)}
    assert set(needs) == set(POLICIES)
    for name, policy in POLICIES.items():
        required = policy.requirements
        further = [f"with `{name}=true` {', '.join(own)}" for name, own in required.channels_if.items()]
        parts = [*required.channels, *further, *(["yaw damping"] if required.yaw_damping_nms else [])]
        assert needs[name] == (", ".join(parts) or "nothing"), name


def switches(model, prefix=""):
    """Fields of a scenario that turn something on or off, or choose among words."""
    for name, info in model.model_fields.items():
        inner = [part for part in (info.annotation, *get_args(info.annotation)) if hasattr(part, "model_fields")]
        if inner:
            yield from switches(inner[0], f"{prefix}{name}.")
        elif info.annotation is bool or get_origin(info.annotation) is Literal:
            yield f"{prefix}{name}"


@pytest.mark.parametrize("field", list(switches(Scenario)))
def test_every_switch_of_a_scenario_is_on_a_page(field):
    assert any(field.rpartition(".")[2] in page.read_text() for page in PAGES)


@pytest.mark.parametrize("policy", ["bio_inspired", "sff", "sdc"])
def test_the_table_is_that_of_other_shipped_episodes(policy):
    rows = select(read_rows(ROOT / "docs" / "paper.csv.gz"), scenario="single_obstacle", policy=policy)
    middle = np.sort(measured(rows, "task_time_s"))[len(rows) // 4 : -len(rows) // 4].mean()
    (line,) = re.findall(rf"\| (`{policy}`.*?) \|(?= \||\s*<)", " ".join(README.read_text().split()))
    assert line.split(" | ")[1].split(", ")[0] == f"{middle + 1e-9:.1f} s"


def test_make_help_lists_every_target_that_is_named():
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"(?:^|`|; |: )make ([a-z-]+)", README.read_text(), re.M):
        assert re.search(rf'@echo "make {target}\b', makefile) or target == "help", target
