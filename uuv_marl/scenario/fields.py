"""Types of a scenario's fields: plausible ranges, names, and the base class of sections."""

from typing import Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

MAX_RANGE_M = 4096.0  # largest position in a percept, so that observations are bounded


def within(low: float, high: float) -> Any:
    """A number's plausible range, both ends included."""
    return Field(ge=low, le=high)


def _ordered(pair: tuple[float, float]) -> tuple[float, float]:
    if pair[0] > pair[1]:
        raise ValueError(f"must be [low, high] with low <= high, got {list(pair)}")
    return pair


ORDERED = AfterValidator(_ordered)
"""For a pair of numbers, the lower one first."""

Signed = Annotated[float, within(-1_000_000, 1_000_000)]
Positive = Annotated[float, within(0.001, 1_000_000)]
NonNegative = Annotated[float, within(0, 1_000_000)]
NonPositive = Annotated[float, within(-1_000_000, 0)]
Speed = Annotated[float, within(0, 100)]
Radius = Annotated[float, within(0.001, MAX_RANGE_M)]
Clock = Annotated[float, within(0.0001, 3_600)]
Lag = Annotated[float, within(0, 3_600)]
NAME = "^[A-Za-z0-9_-]+$"
Name = Annotated[str, Field(pattern=NAME, max_length=100)]
VehicleName = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+(\+[A-Za-z0-9_-]+)*$", max_length=100)]
"""A vehicle's name, with a plus before each variant."""


class Section(BaseModel):
    """A part of a scenario: frozen, without unknown fields or silent conversion."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, use_attribute_docstrings=True)

    @model_validator(mode="after")
    def _checked(self) -> Self:
        self._check()
        return self

    def _check(self) -> None:
        """Raise ValueError if fields contradict each other."""
