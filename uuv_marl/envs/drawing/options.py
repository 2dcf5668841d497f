"""Options of an environment's pictures."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple, TypedDict

import numpy as np

from uuv_marl.envs.drawing.camera import CAMERAS

_SIDE_PX = (320, 4096)


class RenderOptions(TypedDict, total=False):
    """How an environment draws. Every entry may be left out."""

    size: tuple[int, int]
    """Width and height of a picture or the window [px], 800 x 800 by default."""
    camera: Literal["follow", "map"]
    """``follow`` (the default) keeps the swarm and l(t) in view, with the map in a corner; ``map`` shows the map."""
    sonar_of: int | None
    """Index of a vehicle, to draw its sonar arrays, detections and echoes. None by default."""


class Look(NamedTuple):
    """``RenderOptions``, checked and complete."""

    size: tuple[int, int] = (800, 800)
    camera: str = "follow"
    sonar_of: int | None = None


def look(options: RenderOptions | None, num_vehicles: int, sonar_of: int | None = None) -> Look:
    """The checked options, with this ``sonar_of`` by default. Raises ValueError for what can't be used."""
    options_given: Any = {} if options is None else options
    if not isinstance(options_given, Mapping):
        raise ValueError(f"render_options must be a dictionary such as {{'camera': 'map'}}, got {options_given!r}")
    if unknown := [name for name in options_given if name not in Look._fields]:
        raise ValueError(f"render_options has no {unknown[0]!r}; it has {', '.join(Look._fields)}")
    chosen, (low, high) = Look(**{"sonar_of": sonar_of, **options_given}), _SIDE_PX
    if not _is_size(chosen.size):
        raise ValueError(
            f"render_options['size'] must be (width, height), whole numbers of pixels from {low} to {high}, "
            f"got {chosen.size!r}"
        )
    if not isinstance(chosen.camera, str) or chosen.camera not in CAMERAS:
        raise ValueError(f"render_options['camera'] must be one of {list(CAMERAS)}, got {chosen.camera!r}")
    i = chosen.sonar_of
    if i is not None and not (_whole(i) and 0 <= i < num_vehicles):
        raise ValueError(
            f"render_options['sonar_of'] must be the index of a vehicle, 0 to {num_vehicles - 1}, or None, got {i!r}"
        )
    return chosen._replace(size=(int(chosen.size[0]), int(chosen.size[1])))


def _whole(number: Any) -> bool:
    return isinstance(number, int | np.integer) and not isinstance(number, bool)


def _is_size(size: Any) -> bool:
    low, high = _SIDE_PX
    sides = size if isinstance(size, Sequence) and len(size) == 2 else ()
    return len(sides) == 2 and all(_whole(side) and low <= side <= high for side in sides)
