"""The benchmark's pictures show what they must, and all pictures have one style."""

import matplotlib as mpl

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
