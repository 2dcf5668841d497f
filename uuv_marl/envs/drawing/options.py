"""Options of an environment's pictures."""

from typing import Annotated, Literal, TypedDict

from pydantic import ValidationError

from uuv_marl.scenario.fields import Section, within
from uuv_marl.scenario.files import frozen
from uuv_marl.scenario.messages import explain
from uuv_marl.scenario.overrides import plain

Side = Annotated[int, within(320, 4096)]


class RenderOptions(TypedDict, total=False):
    """How an environment draws. Every entry may be left out."""

    size: tuple[int, int]
    """Width and height of a picture or the window [px], 800 x 800 by default."""
    camera: Literal["follow", "map"]
    """``follow`` (the default) keeps the swarm and l(t) in view, with the map in a corner; ``map`` shows the map."""
    sonar_of: int | None
    """Index of a vehicle, to draw its sonar arrays, detections and echoes. None by default."""


class Look(Section):
    """``RenderOptions``, checked and complete."""

    size: tuple[Side, Side] = (800, 800)
    camera: Literal["follow", "map"] = "follow"
    sonar_of: Annotated[int, within(0, 16_384)] | None = None


def look(options: RenderOptions | None, num_vehicles: int, sonar_of: int | None = None) -> Look:
    """The checked options, with this ``sonar_of`` by default. Raises ValueError for what can't be used."""
    try:
        chosen = Look.model_validate(frozen(plain({} if options is None else options)))
    except ValidationError as error:
        raise ValueError(f"render_options: {explain(error, options, Look)}") from None
    if "sonar_of" not in chosen.model_fields_set:
        return chosen.model_copy(update={"sonar_of": sonar_of})
    if chosen.sonar_of is not None and chosen.sonar_of >= num_vehicles:
        raise ValueError(
            f"render_options['sonar_of'] must be the index of a vehicle, 0 to {num_vehicles - 1}, or None, "
            f"got {chosen.sonar_of}"
        )
    return chosen
