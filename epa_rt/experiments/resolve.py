"""Walks through an experiment file and lays its phases out in the order of the run, each checked
against the rig.
"""

from collections.abc import Iterator, Mapping

from epa_rt.config.experiment import ExperimentFile, PhaseFile, Until
from epa_rt.config.rig import Rig
from epa_rt.config.rig_rows import si_unit_of
from epa_rt.config.source import Located, Location
from epa_rt.experiments.bounds import LONGEST_S, MOST_PHASES, MOST_PIECES, pieces_of
from epa_rt.experiments.coordinate import coordinate_of, possible_loops
from epa_rt.experiments.experiment import Condition, Phase
from epa_rt.experiments.motions import LASTING, Motion, Situation, plan
from epa_rt.experiments.reader import Reader
from epa_rt.experiments.valve_orders import OrderBook

CONDITION_GUESS_S = 3.0  # how long filling, venting or a signal's condition is guessed to take


class Resolver:
    """Knows where the reference stands while it walks."""

    def __init__(self, located: Located, rig: Rig, file: ExperimentFile):
        self.located, self.rig, self.file = located, rig, file
        self._position_key, self._position = None, None
        self._orders = OrderBook(rig)
        self._trials = self._pieces = 0
        self._duration_s = 0.0

    def phases(self) -> tuple[Phase, ...]:
        """All phases of the run. Raises ConfigError.

        All repetitions are planned, then those before the first are left out: what is left is
        named, numbered and drawn at random as in the run of all.
        """
        self._check_names()
        self._check_repeat()
        self._check_size()
        first = self.file.first_repetition
        planned = tuple(self._phase(*item) for item in self._walk())
        return tuple(p for p in planned if p.repetition is None or p.repetition >= first)

    def _walk(self) -> Iterator[tuple[PhaseFile, Location, int | None, Mapping[str, str]]]:
        for i, phase in enumerate(self.file.before):
            yield phase, ("before", i), None, {}
        repeated = bool(self.file.repeat) or self.file.times is not None
        for repetition, values in enumerate(self._repetitions()):
            for i, phase in enumerate(self.file.phases):
                yield phase, ("phases", i), repetition if repeated else None, values
        for i, phase in enumerate(self.file.after):
            yield phase, ("after", i), None, {}

    def _repetitions(self) -> list[dict[str, str]]:
        if not self.file.repeat:
            return [{}] * (self.file.times or 1)
        return [
            dict(zip(self.file.repeat, values, strict=False))
            for values in zip(*self.file.repeat.values(), strict=False)
        ]

    def _check_repeat(self) -> None:
        repeat = self.file.repeat
        if repeat and self.file.times is not None:
            raise self.located.error(("times",), "'times' beside 'repeat'", "one of the two")
        first = next(iter(repeat), None)
        for name, values in repeat.items():
            if len(values) != len(repeat[first]):
                raise self.located.error(
                    ("repeat", name),
                    f"{len(values)} values",
                    f"as many as ${first} has, {len(repeat[first])}",
                )
            for i, value in enumerate(values):
                if value.startswith("$"):
                    raise self.located.error(
                        ("repeat", name, i), f"'{value}'", "a number with its unit"
                    )
            if f'"${name}"' not in self.file.model_dump_json(include={"phases"}):
                raise self.located.error(
                    ("repeat", name), f"'{name}', which no phase uses", f"a phase with ${name}"
                )

    def _check_size(self) -> None:
        file = self.file
        repetitions = len(next(iter(file.repeat.values()), ())) or file.times or 1
        phases = len(file.before) + repetitions * len(file.phases) + len(file.after)
        first = self.file.first_repetition
        if first and first >= repetitions:
            raise self.located.error(
                ("first_repetition",),
                f"{first} of {repetitions} repetition{'s' * (repetitions != 1)}",
                f"at most {repetitions - 1}, for they count from 0",
            )
        if phases > MOST_PHASES:
            raise self.located.error(
                ("times",) if file.times is not None else ("repeat",),
                f"{repetitions} repetitions, {phases} phases in all",
                f"at most {MOST_PHASES} phases in a run",
            )

    def _check_length(self, reader: Reader, motion: Motion, duration_s: float) -> None:
        """Raises ConfigError where the run so far is longer or larger than a run may be."""
        self._duration_s += duration_s
        self._pieces += pieces_of(motion.planned)
        if self._duration_s > LONGEST_S:
            raise reader.error(
                ("for",),
                f"a run of {self._duration_s:g} s up to here",
                f"at most a day, {LONGEST_S:g} s",
            )
        if self._pieces > MOST_PIECES:
            raise reader.error(
                (),
                f"motions of {self._pieces} pieces up to here",
                f"at most {MOST_PIECES} in a run",
            )

    def _check_names(self) -> None:
        seen: set[str] = set()
        for section in ("before", "phases", "after"):
            for i, phase in enumerate(getattr(self.file, section)):
                if phase.name in seen:
                    raise self.located.error(
                        (section, i, "name"),
                        f"the phase name '{phase.name}' a second time",
                        "each name once",
                    )
                seen.add(phase.name)

    def _phase(
        self, phase: PhaseFile, where: Location, repetition: int | None, values: Mapping[str, str]
    ) -> Phase:
        reader = Reader(self.located, self.rig, where, values)
        loop = self._loop(phase, where)
        coordinate = coordinate_of(self.rig, loop)
        if coordinate.position_key != self._position_key:
            self._position_key, self._position = (
                coordinate.position_key,
                (None if coordinate.measured else 0.0),
            )
        orders = self._orders.of(reader, phase)
        cycles = _cycles(reader, phase)
        section = ("before", "phases", "after").index(where[0])
        seed = (
            (phase.seed,)
            if phase.seed is not None
            else (self.file.seed, section, int(where[1]), repetition or 0)
        )
        duration_s = None if cycles is None else cycles * self.rig.period_s
        if duration_s is not None and duration_s > LONGEST_S:
            raise reader.error(("for",), f"'{phase.lasts}'", f"at most a day, {LONGEST_S:g} s")
        motion = plan(reader, phase, Situation(coordinate, self._position, duration_s, seed))
        self._position = motion.end
        self._check_length(reader, motion, _motion_s(cycles, motion, self.rig.period_s))
        conditions = tuple(self._condition(reader, i, until) for i, until in enumerate(phase.until))
        trial_index = self._trials if phase.trial else None
        self._trials += phase.trial
        return Phase(
            _label(phase.name, repetition, values),
            phase.name,
            loop,
            coordinate,
            motion,
            orders,
            cycles,
            conditions,
            self._timeout(reader, phase, cycles, motion),
            trial_index,
            repetition,
            values,
            _estimate(cycles, motion, conditions, self.rig.period_s),
        )

    def _loop(self, phase: PhaseFile, where: Location) -> str:
        possible, place = possible_loops(self.rig), (*where, "loop") if phase.loop else ("loop",)
        loop = phase.loop or self.file.loop
        if loop not in possible:
            raise self.located.error(
                place,
                f"the loop '{loop}'",
                f"one that the rig '{self.rig.name}' can do: {', '.join(possible)}",
            )
        return loop

    def _condition(self, reader: Reader, i: int, until: Until) -> Condition:
        if until.valves_settled:
            return Condition("valves settled")
        measured = {row.name for row in self.rig.inputs}
        where = ("until",) if ("until", i) not in self.located.lines else ("until", i)
        if until.signal not in measured:
            raise reader.error(
                (*where, "signal"),
                f"the signal '{until.signal}'",
                f"a measured one: {', '.join(sorted(measured))}",
            )
        side, written = (
            ("below", until.below) if until.below is not None else ("above", until.above)
        )
        si_unit = si_unit_of(until.signal)
        value = (
            reader.pressure((*where, side), written)
            if si_unit == "Pa"
            else reader.quantity((*where, side), written, si_unit or "1")
        )
        steady = max(
            1, round(reader.quantity((*where, "steady"), until.steady, "s") / self.rig.period_s)
        )
        return Condition(
            f"{until.signal} {side} {written}",
            until.signal,
            1.0 if side == "above" else -1.0,
            value,
            steady,
        )

    def _timeout(
        self, reader: Reader, phase: PhaseFile, cycles: int | None, motion: Motion
    ) -> int | None:
        if phase.timeout is None:
            if phase.until:
                raise reader.error(
                    ("until",), "'until' without a timeout", "'timeout: TIME' beside it"
                )
            return None
        if not phase.until:
            raise reader.error(
                ("timeout",), "a timeout without 'until'", "'until: CONDITION' beside it"
            )
        timeout = reader.cycles(("timeout",), phase.timeout)
        if timeout * self.rig.period_s > LONGEST_S:
            raise reader.error(
                ("timeout",), f"'{phase.timeout}'", f"at most a day, {LONGEST_S:g} s"
            )
        least_s = _motion_s(cycles, motion, self.rig.period_s)
        if timeout * self.rig.period_s <= least_s:
            raise reader.error(
                ("timeout",),
                f"'{phase.timeout}'",
                f"more than the {least_s:g} s that the phase takes anyway",
            )
        return timeout


def _cycles(reader: Reader, phase: PhaseFile) -> int | None:
    kind = phase.motion
    if phase.lasts is None:
        if kind in LASTING:
            raise reader.error((kind,), f"a {kind} without 'for'", "'for: TIME' beside it")
        if kind is None and not phase.until:
            raise reader.error(
                (), f"the phase '{phase.name}' without an end", "a motion, 'for' or 'until'"
            )
        return None
    if kind is not None and kind not in LASTING:
        raise reader.error(("for",), f"'for' beside '{kind}'", f"no 'for': a {kind} ends by itself")
    return reader.cycles(("for",), phase.lasts)


def _motion_s(cycles: int | None, motion: Motion, period_s: float) -> float:
    if cycles is not None:
        return cycles * period_s
    return motion.planned.duration_s if motion.planned is not None else 0.0


def _estimate(
    cycles: int | None, motion: Motion, conditions: tuple[Condition, ...], period_s: float
) -> float:
    return _motion_s(cycles, motion, period_s) + (CONDITION_GUESS_S if conditions else 0.0)


def _label(name: str, repetition: int | None, values: Mapping[str, str]) -> str:
    if repetition is None:
        return name
    return " ".join([f"{name}[{repetition}]", *(f"{key}={value}" for key, value in values.items())])
