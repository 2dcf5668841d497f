"""The benchmark's pictures show what they must, and all pictures have one style."""

import matplotlib as mpl
import pytest

from tests.processes import ran
from uuv_marl.benchmark import style


def test_the_style_is_left_behind_and_the_same_picture_is_the_same_file(tmp_path):
    before = dict(mpl.rcParams)

    def draw(path):
        with style.house_style():
            figure, (ax, _) = style.panels(2)
            ax.plot([0, 1], label="line")
            style.legend(figure)
            return style.save(figure, path)

    first, second = draw(tmp_path / "a" / "x.png"), draw(tmp_path / "y.png")
    assert first.read_bytes() == second.read_bytes()
    assert dict(mpl.rcParams) == before
    assert tuple(mpl.rcParams["axes.prop_cycle"].by_key()["color"]) != style.COLOURS
    with style.house_style():
        assert tuple(mpl.rcParams["axes.prop_cycle"].by_key()["color"]) == style.COLOURS


MODULES = ("benchmark.figures", "benchmark.robustness.figure", "benchmark.style", "envs.drawing.ink", "train.curve")


@pytest.mark.needs("pandas")
@pytest.mark.needs("pygame")
@pytest.mark.needs("torch")
def test_a_backend_that_is_none_is_named_in_one_line_before_the_work(tmp_path):
    """By commands, and where Python imports what draws."""
    code = f"""
import importlib
from typer.testing import CliRunner
from uuv_marl.cli import app
done = CliRunner().invoke(app, ["benchmark", "--scenario=starter", "--seeds=1", "--policy=idle"])
print(done.exit_code, done.output.strip())
for module in {MODULES}:
    try:
        importlib.import_module(f"uuv_marl.{{module}}")
    except ValueError as error:
        print(2, f"Error: {{error}}")
"""
    done = ran("-c", code, folder=tmp_path, MPLBACKEND="nonsense")
    line = "2 Error: MPLBACKEND must be a backend of Matplotlib, got 'nonsense'; unset it, or set it to agg"
    assert done.stdout.splitlines() == [line] * (1 + len(MODULES)), done.stderr
    assert not list(tmp_path.iterdir())
