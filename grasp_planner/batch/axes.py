"""What varies: lists, ranges and seeded samples of values."""

from __future__ import annotations

import math
import zlib
from abc import abstractmethod
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
MAX_WHOLE = 2**63 - 1
"""Largest whole number of a column."""
MAX_VALUES = 1_000_000
"""Most values of an axis."""
Whole = Annotated[int, Field(ge=-MAX_WHOLE, le=MAX_WHOLE, strict=True)]
Number = Whole | Finite
Count = Annotated[int, Field(ge=1, le=MAX_VALUES, strict=True)]


class Axis(BaseModel):
    """Values of one key."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)

    @abstractmethod
    def values(self, rng: np.random.Generator) -> list[Any]:
        """Return the values.

        Args:
            rng: Source of random numbers; used by samples only.
        """


class Range(Axis):
    """``{from, to, step}`` or ``{from, to, count}``, both ends included; ``spacing: log`` with a count."""

    start: Number = Field(alias="from")
    stop: Number = Field(alias="to")
    step: Number | None = None
    count: Count | None = None
    spacing: Literal["linear", "log"] = "linear"

    @model_validator(mode="after")
    def _check(self) -> Range:
        """Check that step and count make sense together."""
        whole = isinstance(self.start, int) and isinstance(self.stop, int)
        if self.step is not None and self.count is not None:
            raise ValueError("step or count, not both")
        if self.step is None and self.count is None and not whole:
            raise ValueError("a step or a count (only whole numbers have the step 1 by default)")
        if self.step is not None and (self.step == 0 or (self.stop - self.start) * self.step < 0):
            raise ValueError("a step from 'from' towards 'to'")
        if self.step is None and self.count is None and self.stop < self.start:
            raise ValueError("'to' not below 'from'")
        # Differences of two finite numbers, and shares of them, may have no finite number.
        if self.count is None and not self._steps() < MAX_VALUES:
            raise ValueError(f"at most {MAX_VALUES} values")
        if self.spacing == "log" and (self.count is None or self.start <= 0 or self.stop <= 0):
            raise ValueError("a count and ends > 0 with spacing: log")
        return self

    def _steps(self) -> float:
        """Return the number of steps from end to end."""
        step = 1 if self.step is None else self.step
        try:
            return float(np.floor((self.stop - self.start) / step + 1e-9))
        except (OverflowError, FloatingPointError):
            return math.inf

    def values(self, rng: np.random.Generator) -> list[Any]:
        """Return the values."""
        if self.count is not None:
            space = np.geomspace if self.spacing == "log" else np.linspace
            return [float(f"{value:.12g}") for value in space(self.start, self.stop, self.count)]
        step = 1 if self.step is None else self.step
        steps = int(self._steps())
        found = [self.start + k * step for k in range(steps + 1)]
        return [value if isinstance(value, int) else float(f"{value:.12g}") for value in found]


class Uniform(Axis):
    """``{uniform: [low, high], count}``."""

    uniform: tuple[Finite, Finite]
    count: Count

    @model_validator(mode="after")
    def _check(self) -> Uniform:
        """Check the order of the ends, and that their difference is a number."""
        if not 0.0 <= self.uniform[1] - self.uniform[0] < math.inf:
            raise ValueError("[low, high] with low <= high and a finite difference")
        return self

    def values(self, rng: np.random.Generator) -> list[Any]:
        """Return the samples."""
        return [float(value) for value in rng.uniform(*self.uniform, self.count)]


class LogUniform(Axis):
    """``{loguniform: [low, high], count}``, both ends > 0."""

    loguniform: tuple[Positive, Positive]
    count: Count

    @model_validator(mode="after")
    def _check(self) -> LogUniform:
        """Check the order of the ends, and that their difference is a number."""
        if not 0.0 <= self.loguniform[1] - self.loguniform[0] < math.inf:
            raise ValueError("[low, high] with low <= high and a finite difference")
        return self

    def values(self, rng: np.random.Generator) -> list[Any]:
        """Return the samples."""
        low, high = np.log(self.loguniform)
        return [float(value) for value in np.exp(rng.uniform(low, high, self.count))]


class Normal(Axis):
    """``{normal: [mean, deviation], count}``."""

    normal: tuple[Finite, Annotated[float, Field(ge=0.0, allow_inf_nan=False)]]
    count: Count

    def values(self, rng: np.random.Generator) -> list[Any]:
        """Return the samples."""
        return [float(value) for value in rng.normal(*self.normal, self.count)]


class Integers(Axis):
    """``{integers: [low, high], count}``, both ends included."""

    integers: tuple[Whole, Whole]
    count: Count

    @model_validator(mode="after")
    def _check(self) -> Integers:
        """Check the order of the ends."""
        if self.integers[0] > self.integers[1]:
            raise ValueError("[low, high] with low <= high")
        return self

    def values(self, rng: np.random.Generator) -> list[Any]:
        """Return the samples."""
        low, high = self.integers
        return [int(value) for value in rng.integers(low, high, self.count, endpoint=True)]


class Choice(Axis):
    """``{choice: [values], count}``, with repetition."""

    choice: list[Any] = Field(min_length=1)
    count: Count

    def values(self, rng: np.random.Generator) -> list[Any]:
        """Return the samples."""
        return [self.choice[int(index)] for index in rng.integers(0, len(self.choice), self.count)]


AXES: dict[str, type[Axis]] = {
    "from": Range,
    "uniform": Uniform,
    "loguniform": LogUniform,
    "normal": Normal,
    "integers": Integers,
    "choice": Choice,
}
"""Kinds of axes by the key that tells them."""
AXIS_HELP = (
    "a value, a list, {from, to, step}, {from, to, count}, or a sample with a count: "
    "{uniform | loguniform | integers: [low, high]}, {normal: [mean, deviation]}, {choice: [values]}"
)


def axis_stream(seed: int, block: int, key: str) -> np.random.Generator:
    """Return the random numbers of one axis, which do not depend on the other axes.

    Args:
        seed: Seed of the specification.
        block: Number of the block.
        key: Key of the axis.
    """
    return np.random.default_rng([seed, block, zlib.crc32(key.encode())])
