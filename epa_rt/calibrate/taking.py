"""Taking points one after the other: what is to be done first, the reference, then the record."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from epa_rt.calibrate.point import Point, reading_of
from epa_rt.calibrate.refusals import Scale
from epa_rt.config.rig import Rig
from epa_rt.experiments.jogging import Fill, Jogging, Vent

DISAGREE_SHARE = 0.2  # of the largest pressure: beyond it gauge and sensor do not mean the same
SETTLED_S = 0.5  # after valves and motor: gas is warm for some tenths of a second after a fill
ORDERING, ASKING, SETTLING, RECORDING, DONE = range(5)
PHASES = ("go_to", "ask", "settle", "record", "done")


@dataclass(frozen=True)
class GoTo:
    """The motor to a travel, m or rad, at a speed above zero."""

    travel: float
    speed: float


@dataclass(frozen=True)
class Step:
    """A point to be taken: the rig's own orders before it, and what it is called."""

    orders: tuple[Fill | Vent | GoTo, ...]
    words: str


@dataclass(frozen=True)
class Reference:
    """What stands at the sensor: a value in the signal's unit and its standard uncertainty.

    ``live`` is added to it in every cycle of the record and averaged: of a gauge that is read all
    the while.
    """

    value: float
    u: float
    where: str = ""
    live: Callable[[], float] | None = None
    is_mass: bool = False


class Answers(Protocol):
    """Where references come from: the operator, a file, or a simulated gauge. ``ask`` once;
    ``answer`` gives None until there is one. ``took`` tells of each point, and says whether it
    counts. ``enough``: no further point is wanted.
    """

    enough: bool

    def ask(self, step: Step, number: int, reading: float) -> None: ...

    def answer(self) -> Reference | None: ...

    def took(self, point: Point) -> bool: ...


@dataclass(frozen=True)
class Taken:
    """A point with the cycles of its record, for the log."""

    point: Point
    first_cycle: int
    last_cycle: int


class Taking:
    """``step`` once per sound cycle; True once all points are taken. ``taken`` in their order,
    ``reading`` what the signal says now (SI).

    ``native``: from the measured value to the entry's native unit (slope, intercept). ``events`` as
    a plan's, to be drained.
    """

    def __init__(
        self,
        signal: str,
        native: tuple[float, float],
        scale: Scale,
        steps: Iterator[Step],
        answers: Answers,
        period_s: float,
        settle_s: float,
        record_s: float,
    ):
        self.taken: list[Taken] = []
        self.events: list[tuple[str, str, dict[str, object]]] = []
        self.phase = ORDERING
        self.now: Step | None = None
        self.reference: Reference | None = None
        self.reading = float("nan")
        self._signal, self._native, self._scale = signal, native, scale
        self._steps, self._answers = steps, answers
        self._settle = max(1, round(settle_s / period_s))
        self._samples = np.zeros(max(10, round(record_s / period_s)))
        self._age, self._live = 0, 0.0

    def step(self, cycle: int, measured: Mapping[str, float]) -> bool:
        """Takes one cycle of a rig that needs no orders."""
        if self.phase == ORDERING and self.next() is None:
            return True
        if self.phase == ORDERING:
            self.ordered(measured)
        return self.proceed(cycle, measured)

    def next(self) -> Step | None:
        """The next point's step; None where there is none, and all is done."""
        self.now = None if self._answers.enough else next(self._steps, None)
        if self.now is None:
            self.phase = DONE
        return self.now

    def ordered(self, measured: Mapping[str, float]) -> None:
        """The rig has done what the step wants."""
        assert self.now is not None
        self.phase = ASKING
        self.reading = measured[self._signal]
        self._answers.ask(self.now, len(self.taken) + 1, self.reading)

    def proceed(self, cycle: int, measured: Mapping[str, float]) -> bool:
        """From the question to the end of the record; True where nothing more is wanted."""
        self.reading = measured[self._signal]
        if self.phase == ASKING:
            self.reference = self._answers.answer()
            if self._answers.enough:
                self.phase = DONE
            elif self.reference is not None:
                self.phase, self._age = SETTLING, 0
        elif self.phase == SETTLING:
            self._age += 1
            if self._age >= self._settle:
                self.phase, self._age, self._live = RECORDING, 0, 0.0
        elif self.phase == RECORDING:
            self._samples[self._age] = self.reading
            if self.reference is not None and self.reference.live is not None:
                self._live += self.reference.live()
            self._age += 1
            if self._age == len(self._samples):
                self._take(cycle)
        return self.phase == DONE

    def _take(self, cycle: int) -> None:
        assert self.reference is not None and self.now is not None
        slope, intercept = self._native
        mean, u, scatter, moved = reading_of((self._samples - intercept) / slope, self._scale.step)
        reference = self.reference
        where = reference.where or f"point {len(self.taken) + 1}"
        value = reference.value + self._live / len(self._samples)
        point = Point(value, reference.u, mean, u, scatter, moved, where)
        self.phase = ORDERING
        if not self._answers.took(point):
            return
        first = cycle - len(self._samples) + 1
        self.taken.append(Taken(point, first, cycle))
        self.events.append(
            (
                "calibration_point",
                f"{where}: {self._scale.shown(value)} reads {mean:.6g} {self._scale.native}",
                {
                    "signal": self._signal,
                    "reference": value,
                    "reference_u": reference.u,
                    "is_mass": reference.is_mass,
                    "first_cycle": first,
                    "last_cycle": cycle,
                },
            )
        )

    def drop_last(self) -> Taken | None:
        """Forgets the last point; None where there is none."""
        if not self.taken:
            return None
        self.events.append(("calibration_drop", f"{self.taken[-1].point.where} dropped", {}))
        return self.taken.pop()


class Stepping:
    """A jog's source that goes from point to point: fills and moves, waits, takes, ends vented.

    A muscle is filled no further than its largest pressure by the reference's own word: a sensor
    that reads low must not lead beyond it.
    """

    def __init__(self, taking: Taking, rig: Rig, signal: str):
        self._taking, self._signal = taking, signal
        self._orders: Iterator[Fill | Vent | GoTo] = iter(())
        self._now: Fill | Vent | GoTo | None = None
        self._age = self._rest = 0
        self._failed = False
        self._settled = max(1, round(SETTLED_S / rig.period_s))
        self._muscle = next((m for m in rig.muscles if m.pressure == signal), None)
        self._shift = rig.atmosphere_pa if rig.row(signal).reads == "gauge" else 0.0
        self._atmosphere_pa = rig.atmosphere_pa
        self._ratio = 1.0  # of what the reference says over what the sensor says, gauge

    def step(self, jog: Jogging, cycle: int) -> None:
        """Takes one cycle of the jog."""
        taking, measured = self._taking, jog.measured
        if self._failed:
            return
        self._age += 1
        if taking.phase == ORDERING:
            if self._now is None and not self._begin(jog, cycle):
                jog.quit(cycle)
                return
            if not self._obeyed(jog, cycle):
                return
            jog.hold()  # a trim under way would move what is recorded
            taking.ordered(measured)
        was_asking = taking.phase == ASKING
        if taking.proceed(cycle, measured):
            jog.quit(cycle)
        elif was_asking and taking.phase == SETTLING and taking.reference is not None:
            self._compare(jog, taking.reference, measured[self._signal], cycle)
        jog.events += taking.events
        taking.events.clear()

    def _begin(self, jog: Jogging, cycle: int) -> bool:
        """The next step that does not lead beyond what the muscle may have; False: none."""
        while (step := self._taking.next()) is not None:
            if not jog.found_zero and any(isinstance(order, GoTo) for order in step.orders):
                self._fail(
                    jog,
                    "found no zero of travel, expected one to go to travels by: epa home",
                    cycle,
                )
                return True  # the failure ends the jog
            most = max((o.target_pa for o in step.orders if isinstance(o, Fill)), default=0.0)
            gauge_pa = max(self._ratio, 1.0) * (most - self._atmosphere_pa)
            if self._muscle is None or gauge_pa <= self._muscle.pressure_max - self._atmosphere_pa:
                self._orders = iter(step.orders)
                self._tell(jog, cycle)
                return True
            jog.events.append(
                (
                    "calibration_skip",
                    f"{step.words} is left out: by the reference it would be"
                    f" {gauge_pa / 1e3:.4g} kPa gauge, above pressure_max",
                    {},
                )
            )
        return False

    def _tell(self, jog: Jogging, cycle: int) -> None:
        self._now, self._age, self._rest = next(self._orders, None), 0, 0
        order = self._now
        if isinstance(order, GoTo):
            jog.move_by(order.travel - jog.travel, order.speed, cycle)
        elif isinstance(order, Fill):
            if not jog.fill(order.muscle, order.target_pa, cycle):
                self._fail(jog, jog.note, cycle)
        elif isinstance(order, Vent):
            jog.vent(order.muscles)

    def _obeyed(self, jog: Jogging, cycle: int) -> bool:
        """Waits for the order on hand, gives the next one; True once there is none."""
        if self._now is None:
            return True
        is_done = jog.arrived if isinstance(self._now, GoTo) else jog.settled()
        self._rest = self._rest + 1 if is_done and self._age > 1 else 0
        if self._rest >= self._settled:
            self._tell(jog, cycle)
        return self._now is None and not self._failed

    def _compare(self, jog: Jogging, reference: Reference, value: float, cycle: int) -> None:
        """Holds the reference against what the sensor says before anything is filled further."""
        muscle = self._muscle
        if muscle is None:
            return
        believed, most = value - self._shift, muscle.pressure_max - self._shift
        said = reference.value + (reference.live() if reference.live is not None else 0.0)
        gauge_pa = said + self._shift - self._atmosphere_pa
        believed_gauge_pa = value - self._atmosphere_pa
        if believed_gauge_pa > 0.1 * muscle.pressure_max:
            self._ratio = gauge_pa / believed_gauge_pa
        if abs(said - believed) > DISAGREE_SHARE * most:
            sentence = (
                f"the reference says {said / 1e3:.4g} kPa where {self._signal} says"
                f" {believed / 1e3:.4g} kPa: they differ by more than"
                f" {100.0 * DISAGREE_SHARE:g} % of the largest pressure; check the unit, gauge or"
                " absolute, the hose"
            )
        elif said > most:
            sentence = (
                f"the reference says {said / 1e3:.4g} kPa, above the largest pressure of"
                f" {most / 1e3:.4g} kPa: {self._signal} reads low; take lower steps"
            )
        else:
            return
        self._fail(jog, sentence, cycle)

    def _fail(self, jog: Jogging, sentence: str, cycle: int) -> None:
        self._failed = True
        jog.fail(sentence, cycle)


def points_of(taken: Sequence[Taken]) -> list[Point]:
    """The points alone, in their order."""
    return [one.point for one in taken]
