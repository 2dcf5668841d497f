"""What the documents say is executed, or compared with the code."""

import importlib.util
import re
import warnings
from pathlib import Path

import pytest
from typer.testing import CliRunner

from uuv_marl import load_scenario
from uuv_marl.cli import app

pytestmark = pytest.mark.docs
ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
ELSEWHERE = {"benchmarl.md", "rllib.md"}
"""Pages whose Python runs in tests/adapters, where their libraries are."""


def blocks(language, pages=PAGES):
    return [
        pytest.param(block, id=f"{page.name}-{k}")
        for page in pages
        for k, block in enumerate(re.findall(rf"```{language}\n(.*?)```", page.read_text(), flags=re.S))
    ]


@pytest.mark.parametrize("block", blocks("python", [page for page in PAGES if page.name not in ELSEWHERE]))
def test_python_blocks_run(block, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", module="torchrl|tensordict")
        exec(compile(block, "README.md", "exec"), {"__name__": "example"})


def test_examples_are_short():
    for param in blocks("python"):
        assert len(param.values[0].splitlines()) < 30, param.id


@pytest.mark.parametrize("page", sorted(ELSEWHERE))
def test_pages_of_other_environments_are_run_there(page):
    test = ROOT / "tests" / "adapters" / f"test_{page.removesuffix('.md')}.py"
    assert f'"{page}"' in test.read_text()


def stop(*args, **kwargs):
    raise KeyboardInterrupt


def stop_at_once(*args, **kwargs):
    yield from iter(stop, None)


@pytest.mark.parametrize(
    "line",
    sorted(
        {
            line.split("#")[0].strip()
            for param in blocks("console")
            for line in param.values[0].splitlines()
            if "uuv-marl" in line
        }
    ),
)
def test_commands_are_understood(line, monkeypatch, tmp_path):
    """Parsed as written, options and names checked, then stopped before the long work."""
    for work in (
        "benchmark.runner.run_missing",
        "benchmark.tuning.tune",
        "reproduce.job.make",
        "reproduce.identify.identify",
        "heldout.job.run",
    ):
        monkeypatch.setattr(f"uuv_marl.{work}", stop)
    monkeypatch.setattr("uuv_marl.train.training.train", stop_at_once)
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, line.split()[1:])
    # Ray has an environment of its own; without it a command says so once its options are understood.
    assert done.exit_code in (0, 130) or "needs ray" in done.output, done.output


@pytest.mark.parametrize("block", blocks("toml"))
def test_toml_blocks_are_scenarios(block, tmp_path):
    (tmp_path / "mine.toml").write_text(block)
    assert load_scenario(tmp_path / "mine.toml").title


def test_make_targets_named_in_the_readme_exist():
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"^make (\w+)", (ROOT / "README.md").read_text(), flags=re.M):
        assert re.search(rf"^{target}:", makefile, flags=re.M), target


def test_generated_tables_are_those_of_the_code():
    spec = importlib.util.spec_from_file_location("write_tables", ROOT / "tools" / "write_tables.py")
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    assert tool.PAGE.read_text() == tool.text()
    assert tool.README.read_text() == tool.readme()


def test_links_to_files_lead_somewhere():
    for page in PAGES:
        for link in re.findall(r"\]\((?!https?:)([^)#]+)", page.read_text()):
            assert (page.parent / link).exists(), f"{page.name}: {link}"
