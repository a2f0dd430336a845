"""What a law of friction or of a stray force is, and the motion that it is asked about.

Every law is an addition to the force that the drive must give, exactly zero at its neutral numbers.
A law of your own is one file of the room ``laws`` (docs/add-an-effect.md).
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from operator import itemgetter
from typing import Any, Concatenate, NamedTuple, ParamSpec, TypeVar

import numpy as np

from epa_rt.gap.rig.foreign.component import Numbers, Parameter, effect
from epa_rt.gap.rig.foreign.signals import shifted, slope, slope_as_read
from epa_rt.models.effect import Effect

LINK = ("force",)
# of the typical speed: where the sign of a speed is rounded off, far below any speed of interest
REST_RATIO = 1e-3
KEPT = 4  # of each thing that is asked of a motion: at a point and a step off, in two threads
KEPT_BYTES = 2**25  # of one motion at most

Asked = ParamSpec("Asked")
Made = TypeVar("Made")


@dataclass(frozen=True)
class Motion:
    """A sliding part's measured motion, (N,) each; ``place_ratio``: -1 to 1 over the stroke;
    ``filtered``: whether a low-pass has left nothing of it above a quarter of the rate. ``known``:
    what ``kept`` has of it, by what made it, the last first.

    ``read_``: the position as it was read, and its slopes. What goes in proportion to them passes
    the residual's low-pass alone, as the force does: a filter more would take from one what it
    leaves of the other.
    """

    position_m: np.ndarray
    speed_m_s: np.ndarray
    acceleration_m_s2: np.ndarray
    read_m: np.ndarray
    read_speed_m_s: np.ndarray
    read_acceleration_m_s2: np.ndarray
    sign: np.ndarray
    place_ratio: np.ndarray
    time_s: np.ndarray
    period_s: float
    filtered: bool
    known: "dict[Callable[..., Any], tuple[_Known, ...]]" = field(
        init=False, repr=False, compare=False, default_factory=dict
    )


class _Known(NamedTuple):
    """What was ``found``, beside ``more`` arguments; ``read``: the numbers that were asked for, by
    key, and as ``values`` of what ``ask`` takes out of all.
    """

    more: tuple[Any, ...]
    read: Numbers
    ask: Callable[[Numbers], Any]
    values: Any
    found: Any


class _Read(Mapping[str, float]):
    """``every`` number, and those of them that were read."""

    def __init__(self, every: Numbers) -> None:
        self.every = every
        self.read: dict[str, float] = {}

    def __getitem__(self, key: str) -> float:
        value = self.read[key] = self.every[key]
        return value

    def __iter__(self) -> Iterator[str]:
        return iter(self.every)

    def __len__(self) -> int:
        return len(self.every)


def kept(
    made: Callable[Concatenate[Motion, Numbers, Asked], Made],
    m: Motion,
    n: Numbers,
    *more: Asked.args,
    **_none: Asked.kwargs,
) -> Made:
    """``made`` of a motion, numbers and what else it asks for: what it found before, where those of
    the numbers that it read are the same. Nobody may change what it returns.
    """
    every = n.every if isinstance(n, _Read) else n
    known = m.known.get(made, ())
    for one in known:
        if one.more == more and one.values == one.ask(every):
            break
    else:
        reads = _Read(every)
        found = made(m, reads, *more)
        ask = itemgetter(*reads.read) if reads.read else _nothing
        one = _Known(more, reads.read, ask, ask(every), found)
        if sum(map(len, [*m.known.values()])) * m.position_m.nbytes > KEPT_BYTES:
            m.known.clear()
    if not known or known[0] is not one:  # another thread may do the same: then one is made again
        m.known[made] = (one, *(other for other in known if other is not one))[:KEPT]
    if isinstance(n, _Read):
        n.read.update(one.read)
    return one.found


def _nothing(n: Numbers) -> tuple[()]:
    return ()


@dataclass(frozen=True)
class Law:
    """One law: its effect, its numbers, and its force (N,) from motion and numbers. ``asks``: what
    of it a carriage has and a piston has not.
    """

    effect: Effect
    parameters: tuple[Parameter, ...]
    force_n: Callable[[Motion, Numbers], np.ndarray]
    asks: frozenset[str] = frozenset()

    @cached_property
    def strengths(self) -> tuple[str, ...]:
        """Keys of the numbers that are zero where the law is not; it gives no force there."""
        return tuple(p.key for p in self.parameters if p.neutral == 0.0)


def motion(
    position_m: np.ndarray,
    read_m: np.ndarray,
    rate_hz: float,
    typical_speed_m_s: float,
    middle_m: float,
    stroke_m: float,
    filtered: bool,
) -> Motion:
    """Speed, acceleration and direction of a position, low-passed and as it was ``read_m``.
    ``filtered``: as ``Motion`` has it.
    """
    speed = slope(position_m, rate_hz, filtered)
    read_speed = slope_as_read(read_m, rate_hz)
    sign = _direction(speed, typical_speed_m_s)
    return Motion(
        position_m,
        speed,
        slope(speed, rate_hz, filtered),
        read_m,
        read_speed,
        slope_as_read(read_speed, rate_hz),
        sign,
        (position_m - middle_m) / (0.5 * stroke_m),
        np.arange(len(speed)) / rate_hz,
        1.0 / rate_hz,
        filtered,
    )


def late(m: Motion, rows: float, typical_speed_m_s: float) -> Motion:
    """The motion as it was so many rows ago, whole or not. Its direction turns round where the
    speed does, between two rows as well: dry friction shifted by part of a row would be blurred.
    """
    speed = shifted(m.speed_m_s, rows)
    return replace(
        m,
        position_m=shifted(m.position_m, rows),
        speed_m_s=speed,
        acceleration_m_s2=shifted(m.acceleration_m_s2, rows),
        read_m=shifted(m.read_m, rows),
        read_speed_m_s=shifted(m.read_speed_m_s, rows),
        read_acceleration_m_s2=shifted(m.read_acceleration_m_s2, rows),
        sign=_direction(speed, typical_speed_m_s),
        place_ratio=shifted(m.place_ratio, rows),
    )


def _direction(speed_m_s: np.ndarray, typical_speed_m_s: float) -> np.ndarray:
    """(N,) -1 to 1, rounded off about a rest."""
    found: np.ndarray = speed_m_s / np.hypot(speed_m_s, REST_RATIO * typical_speed_m_s)
    return found


def either_way(m: Motion, n: Numbers) -> tuple[Motion, Motion]:
    """The same motion as if it went one way throughout, and as if it went the other."""
    return kept(_either_way, m, n)


def _either_way(m: Motion, n: Numbers) -> tuple[Motion, Motion]:
    forth, back = (replace(m, sign=np.full_like(m.sign, sign)) for sign in (1.0, -1.0))
    return forth, back


def sloped_otherwise(m: Motion) -> Motion:
    """The same motion with slopes of the other order: what the two differ by is about how well rows
    so far apart tell speed and acceleration.
    """
    rate_hz, filtered = 1.0 / m.period_s, not m.filtered
    speed = slope(m.position_m, rate_hz, filtered)
    read_speed = slope(m.read_m, rate_hz, filtered=True)
    return replace(
        m,
        speed_m_s=speed,
        acceleration_m_s2=slope(speed, rate_hz, filtered),
        read_speed_m_s=read_speed,
        read_acceleration_m_s2=slope(read_speed, rate_hz, filtered=True),
    )


def number(
    name: str,
    unit: str,
    of: str,
    low: float,
    high: float,
    spread: float,
    scale: str,
    neutral: float = 0.0,
) -> Parameter:
    """One number of the law ``of``; bounds, ``spread`` and ``neutral`` in units of ``scale``, of
    which the catalogue's page has examples ('typical_force'); '' is the SI unit itself.
    """
    return Parameter(f"friction.{name}", unit, neutral, low, high, spread, LINK, of, scale)


def law(
    name: str,
    family: str,
    says: str,
    equation: str,
    source: str,
    numbers: tuple[Parameter, ...],
    starts: tuple[tuple[float, ...], ...],
    force_n: Callable[[Motion, Numbers], np.ndarray],
) -> Law:
    """A law; its first number is its strength. ``starts``: values of its numbers from which fits
    begin, in units of their scales, a typical strength first.
    """
    return Law(
        effect(
            name, family, "friction", tuple(p.key for p in numbers), starts, says, equation, source
        ),
        numbers,
        force_n,
    )
