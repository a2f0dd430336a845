"""A component rig and its plant as the diagnosis wants them: one ``Subject`` for every kind."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Generic, TypeVar
from zlib import crc32

import numpy as np

from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.foreign.baseline import Baseline
from epa_rt.gap.rig.foreign.component import Experiment, Parameter, scaled
from epa_rt.gap.rig.foreign.plant_file import ForeignPlant, plant_text, sized
from epa_rt.gap.rig.foreign.read_again import Readings, read_again, readings_of
from epa_rt.gap.rig.foreign.readings import as_read
from epa_rt.gap.rig.foreign.repeats import colourless, lap_differences, lap_samples
from epa_rt.gap.rig.foreign.reversals import Turning, row_variance
from epa_rt.gap.rig.foreign.rig_file import ForeignRig
from epa_rt.gap.rig.foreign.signals import Signals, lowpass, on_grid
from epa_rt.gap.side_by_side import WORKERS
from epa_rt.gap.subject import Link, Plain, Values
from epa_rt.models.effect import Effect, Knob

# to which part of itself an effect's strength is known that the plant file has: as viscous friction
KNOWN_TO = 0.5

Made = TypeVar("Made")


@dataclass(frozen=True)
class Ready:
    """A recording ready for residuals. ``judged``: by link, (n,) bool at the residual's rate;
    ``work``: the component's own; ``undetermined``: (n,) where no law foresees the outputs, which
    is judged nowhere; ``variance``: by link, (n,), beyond the noise (reversals.py).
    """

    signals: Signals
    work: object
    judged: Mapping[str, np.ndarray]
    undetermined: np.ndarray
    beside: Mapping[str, np.ndarray]  # by link, (n,): what a baseline takes off
    variance: Mapping[str, np.ndarray]
    recording: Recording


class _Last(Generic[Made]):
    """What was made of the last recordings: twins are asked for one log after another."""

    def __init__(self, make: Callable[[Recording], Made]) -> None:
        self._make = make
        self._kept: tuple[tuple[Recording, Made], ...] = ()

    def of(self, recording: Recording) -> Made:
        """As ``make`` has it; nobody may change it."""
        kept = self._kept  # another thread may be here too
        for known, made in kept:
            if known is recording:
                return made
        made = self._make(recording)
        self._kept = ((recording, made), *kept)[:WORKERS]
        return made


class ForeignSubject(Plain):
    """See ``gap/subject.py``. ``settings``: numbers of the rig that are known; ``baseline``: a
    repeat that stands for the plant; ``even``: no row has a variance beyond the noise, for what
    knows better how much is left around reversals.
    """

    def __init__(
        self,
        rig: ForeignRig,
        plant: ForeignPlant,
        leave_out: frozenset[str] = frozenset(),
        baseline: Baseline | None = None,
        even: bool = False,
    ) -> None:
        component = rig.component
        self.name, self.rate_hz, self.lowpass_hz = rig.name, rig.rate_hz, rig.lowpass_hz
        unsaid = {
            channel.role: f"cmd_{channel.role}"
            for channel in component.channels
            if not channel.required
        }
        rig = replace(rig, channels={**unsaid, **rig.channels})
        self.rig, self.plant, self.leave_out, self.baseline = rig, plant, leave_out, baseline
        self._unsure = component.turning is not None and baseline is None and not even
        self.links: tuple[Link, ...] = tuple(
            link._replace(channel=rig.channels.get(role, link.channel))
            for link, role in component.links
        )
        self._roles = {link.name: role for link, role in component.links}
        self._parameters = {
            row.key: row for row in (sized(row, rig.settings) for row in component.parameters)
        }
        every = {key: _knob(row, plant.numbers[key]) for key, row in self._parameters.items()}
        self._readings, self._variances = _Last(self._readings_of), _Last(self._variances_of)
        self.without_stop = False  # what runs on before and after a trial is not known
        self.nominal: tuple[Knob, ...] = tuple(
            knob for knob in every.values() if knob.effect is None
        )
        self.catalogue: tuple[Effect, ...] = tuple(
            self._in_si(effect) for effect in component.effects if effect.name not in leave_out
        )
        self.knobs = {
            key: knob
            for key, knob in every.items()
            if knob.effect is None or knob.effect not in leave_out
        }

    def _in_si(self, effect: Effect) -> Effect:
        sizes = [
            scaled(row.scale, self.rig.settings)
            for row in self.rig.component.parameters
            for key in effect.knobs
            if row.key == key
        ]
        order = [row.key for row in self.rig.component.parameters if row.key in effect.knobs]
        size = dict(zip(order, sizes, strict=True))
        return effect._replace(
            starts=tuple(
                tuple(v * size[k] for v, k in zip(start, effect.knobs, strict=True))
                for start in effect.starts
            )
        )

    def role_of(self, link: str) -> str:
        """The role of the channel that a link's output is measured in."""
        return self._roles[link]

    def touched(self, key: str) -> tuple[str, ...]:
        """As Subject.touched; KeyError for an unknown number."""
        return self._parameters[key].links

    def evenly(self) -> "ForeignSubject":
        """The same rig and plant, without a baseline, in which no row has a variance beyond the
        noise.
        """
        return ForeignSubject(self.rig, self.plant, self.leave_out, even=True)

    def prepare(self, recording: Recording) -> Ready:
        """Raises KeyError where the recording lacks a column that the rig file names."""
        ready = self._ready(recording, self._channels(recording))
        if self._unsure:
            read = recording.twin_of
            varies = self._variances_by(ready) if read is None else self._variances.of(read)
            return replace(ready, variance=varies)
        if self.baseline is None:
            return ready
        plain = self.evenly()
        beside = {
            link.name: self.baseline.taken_off(plain, ready, link.name) for link in self.links
        }
        judged = {name: ready.judged[name] & np.isfinite(beside[name]) for name in beside}
        return replace(ready, beside=beside, judged=judged)

    def _ready(self, recording: Recording, channels: dict[str, str]) -> Ready:
        signals = on_grid(recording, channels, self.rate_hz, self.rig.lowpass_hz)
        work = self.rig.component.prepare(signals, self._numbers({}))
        asked = self.rig.component.undetermined
        undetermined = (
            asked(work, self._numbers({})) if asked else np.zeros(signals.samples, bool)
        )[:: signals.stride]
        return Ready(
            signals,
            work,
            {link.name: self._judged(signals, link.name) & ~undetermined for link in self.links},
            undetermined,
            {},
            {},
            recording,
        )

    def turning(self, prepared: Ready) -> Turning | None:
        """The motion whose direction the outputs hang on; None of a kind that has none."""
        asked = self.rig.component.turning
        return asked(prepared.work, self._numbers({})) if asked is not None else None

    def _variances_of(self, recording: Recording) -> dict[str, np.ndarray]:
        return self._variances_by(self._ready(recording, self._channels(recording)))

    def _variances_by(self, ready: Ready) -> dict[str, np.ndarray]:
        return {link.name: self._variance(ready, link.name) for link in self.links}

    def _variance(self, ready: Ready, link: str) -> np.ndarray:
        turning = self.turning(ready)
        assert turning is not None
        output = ready.signals.columns[self._roles[link]]
        return row_variance(ready.signals, turning, output, self.residual(ready, {}, link))

    def _channels(self, recording: Recording) -> dict[str, str]:
        optional = {channel.role for channel in self.rig.component.channels if not channel.required}
        return {
            role: name
            for role, name in self.rig.channels.items()
            if role not in optional or name in recording.columns
        }

    def _judged(self, signals: Signals, link: str) -> np.ndarray:
        needed = (self._roles[link], *self.rig.component.needs.get(link, ()))
        valid = np.logical_and.reduce([signals.valid[role] for role in needed])
        return signals.settled(valid, self.rig.component.settled)[:: signals.stride]

    def _numbers(self, values: Values) -> dict[str, float]:
        unknown = [key for key in values if key not in self._parameters]
        if unknown:
            raise KeyError(
                f"found {unknown[0]}, expected a parameter of a {self.rig.component.kind}"
            )
        return {**self.rig.settings, **self.plant.numbers, **values}

    def residual(self, prepared: Ready, values: Values, link: str) -> np.ndarray:
        """As Subject.residual, behind ``lowpass``; KeyError for an unknown number or link,
        ValueError where ``lowpass`` raises it.
        """
        component, numbers = self.rig.component, self._numbers(values)
        left = component.residual(prepared.work, numbers, link)
        if component.at_load is not None:
            left = component.at_load(left, prepared.signals, numbers)
        left = lowpass(left, prepared.signals.rate_hz, self.rig.lowpass_hz)[
            :: prepared.signals.stride
        ]
        if link in prepared.beside:
            left = left - prepared.beside[link]
        return np.where(prepared.judged[link], left, np.nan)

    def row_variance(self, prepared: Ready, link: str) -> np.ndarray | None:
        """As Subject.row_variance; None with a baseline, which has what reversals leave."""
        return prepared.variance.get(link)

    def features(self, prepared: Ready, link: str) -> Mapping[str, np.ndarray]:
        """As Subject.features: the component's own, thinned out to ``rate_hz`` without a
        low-pass.
        """
        found = self.rig.component.features(prepared.work, link)
        return {
            name: np.asarray(values)[:: prepared.signals.stride] for name, values in found.items()
        }

    def free_run(self, recording: Recording, values: Values, seed: int | None) -> Recording | None:
        """As Subject.free_run; KeyError for an unknown number, or where the recording lacks a
        column that the rig file names.
        """
        component = self.rig.component
        if component.free_run is None:
            return None
        ready = self._ready(recording, self._channels(recording))
        run = dict(component.free_run(ready.work, self._numbers(values)))
        rng = np.random.default_rng(seed)
        for role in () if seed is None else [role for role in run if role in ready.signals.columns]:
            run[role] = as_read(run[role], ready.signals, role, self.rig, rng)
        return self._with(recording, run)

    def _with(self, recording: Recording, made: Mapping[str, np.ndarray]) -> Recording:
        """The recording with other readings, by role: in the rows that it has; in all where it has
        none.
        """
        columns, places = (
            dict(recording.columns),
            np.asarray(recording.cycle - recording.cycle[0], dtype=np.int64),
        )
        for role, values in made.items():
            read = np.isfinite(recording.columns[self.rig.channels[role]])
            columns[self.rig.channels[role]] = (
                np.where(read, values[places], np.nan) if read.any() else values[places]
            )
        return replace(recording, columns=columns)

    def read_again(
        self, recording: Recording, values: Values, seed: int | None
    ) -> Recording | None:
        """A twin of a recording: the same motion, another noise (none without a ``seed``), outputs
        by these values. None where a repeat stands for the plant, or outputs are not foreseen from
        other channels.
        """
        if self.baseline is not None or not self.rig.component.output_is_foreseen:
            return None
        random = (
            None if seed is None else np.random.default_rng([seed, crc32(recording.name.encode())])
        )  # another noise in every log
        readings = self._readings.of(recording)
        made = read_again(self.rig.component, readings, self._numbers(values), random)
        return replace(self._with(recording, made), twin_of=recording)

    def _readings_of(self, recording: Recording) -> Readings:
        signals = on_grid(recording, self._channels(recording), self.rate_hz, self.rig.lowpass_hz)
        return readings_of(self.rig.component, signals, self.rig.steps)

    def repeats(
        self, recording: Recording, values: Values | None = None
    ) -> dict[str, np.ndarray] | None:
        """By link what laps of a recording (or the runs it is held against) differ by, NaN between;
        else what the rig file says, or None.
        """
        if self.baseline is not None:
            plain = self.evenly()
            found = {link.name: self.baseline.apart(plain, link.name) for link in self.links}
            return found if all(x is not None for x in found.values()) else None
        ready = self._ready(recording, self._channels(recording))
        measured = {
            role: ready.signals.columns[role]
            for role in self.rig.channels
            if role in ready.signals.columns
        }
        lap = lap_samples(measured, ready.signals.rate_hz)
        if lap is None:
            return self._said(ready)
        apart = {
            link.name: lap_differences(
                self.residual(ready, values or {}, link.name), lap / ready.signals.stride
            )
            for link in self.links
        }
        return (
            {name: colourless(x) for name, x in apart.items()} if self.rig.component.flat else apart
        )

    def _said(self, ready: Ready) -> dict[str, np.ndarray] | None:
        """White noise of the size to which the rig file says that runs repeat; None where it does
        not say so.
        """
        sizes = {link.name: self.rig.repeats_to.get(self._roles[link.name]) for link in self.links}
        if None in sizes.values():
            return None
        random = np.random.default_rng(0)
        return {
            name: size * random.standard_normal(len(ready.judged[name]))
            for name, size in sizes.items()
        }

    def patched(self, values: Values, effects: Sequence[str]) -> str:
        """Text of a plant file with these values, which reads back to the same numbers."""
        return plant_text(
            replace(self.plant, numbers={**self.plant.numbers, **values}), self.rig, tuple(effects)
        )

    def menu(self) -> tuple[Experiment, ...]:
        """Experiments that this rig could run next; none where its kind has no model of the
        whole.
        """
        return self.rig.component.menu(self.rig.settings) if self.rig.component.menu else ()

    def against(self, *runs: Recording, by: str = "time") -> "ForeignSubject":
        """The same rig with repeats in the plant's place: what the plant leaves of them counts as
        known.

        ``by``: 'time' where the runs are in step; 'stroke' where they go through the same places in
        the same directions. Two runs or more give the floor as well.
        """
        return ForeignSubject(self.rig, self.plant, self.leave_out, Baseline(runs, by))


def _knob(row: Parameter, value: float) -> Knob:
    spread = row.spread if row.effect is not None or row.absolute else row.spread * abs(value)
    if row.effect is not None and row.neutral is not None and value != row.neutral:
        spread = min(spread, KNOWN_TO * abs(value - row.neutral))
    return Knob(
        row.key,
        row.unit,
        value,
        row.low,
        row.high,
        spread,
        row.effect,
        row.neutral if row.effect is not None else None,
    )
