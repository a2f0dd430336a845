"""The Subject of this house's rigs: links over the plant's blocks, knobs of the catalogue, free
run, patched plant files.
"""

import copy
import os
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from epa_rt.calibrate.prior import reading_priors
from epa_rt.config.rig import Rig, load_rig
from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.house import smooth
from epa_rt.gap.rig.house.channels import Channel, channels_of
from epa_rt.gap.rig.house.commands import commands_of, lost_rows
from epa_rt.gap.rig.house.doubt.subject import DoubtedSubject
from epa_rt.gap.rig.house.evaluate import Bench
from epa_rt.gap.rig.house.judged import judged
from epa_rt.gap.rig.house.known import AllKnown, Known
from epa_rt.gap.rig.house.links import links_of
from epa_rt.gap.rig.house.noise import noise_of
from epa_rt.gap.rig.house.prepared import Prepared, followed, prepare, unsteady
from epa_rt.gap.rig.house.reach import applies, reached
from epa_rt.gap.rig.house.readings import phase_of, read
from epa_rt.gap.rig.house.residuals import RESIDUALS, at_rate
from epa_rt.gap.rig.house.states import features
from epa_rt.gap.rig.house.whole import on_grid, run_whole, with_gaps
from epa_rt.gap.subject import Link, Plain, Values
from epa_rt.models.blocks.load import FIXED
from epa_rt.models.catalogue import CATALOGUE, NOMINAL, knob
from epa_rt.models.effect import Effect, Knob
from epa_rt.models.knobs import write_knob
from epa_rt.models.parameters import copied
from epa_rt.models.parameters import effects as effect_rows
from epa_rt.models.plant_file import PlantFile, load_plant, save_plant
from epa_rt.models.tables_load import split

MOST_KEPT = 16  # sets of parameters
MOST_RESIDUALS = 512  # of a recording, some twenty kilobytes each: fits ask for many again


class HouseSubject(Plain):
    """A rig of this house and its nominal plant; see gap/subject.py for what each method
    promises.
    """

    roughly = False  # how the plant is integrated

    def __init__(self, rig: Rig, plant: PlantFile, leave_out: frozenset[str] = frozenset()) -> None:
        self.rig, self.plant, self.name = rig, plant, rig.name
        self.channels: dict[str, Channel] = channels_of(rig)
        self.rate_hz = 1.0 / (rig.period_s * smooth.EVERY)
        self.links: tuple[Link, ...] = links_of(rig, self.channels, plant.params)
        names = tuple(link.name for link in self.links)
        self._reach: dict[str, tuple[str, ...]] = {}
        self._made: dict[tuple, np.ndarray] = {}
        self._all_known = AllKnown()
        self.without_stop = bool(plant.params["load"]["kind_code"][0] == FIXED)
        self.nominal: tuple[Knob, ...] = tuple(
            knob(n.key, plant.params) for n in NOMINAL if self._touch(n.key, names)
        )
        self._own = {k.key for k in self.nominal}
        self.catalogue: tuple[Effect, ...] = tuple(
            self._without_inert(effect, names)
            for effect in CATALOGUE
            if not {effect.name, effect.family} & leave_out
            and applies(effect, plant.params)
            and self._touch(effect.knobs[0], names)
        )  # the first one is its strength
        self.knobs: Mapping[str, Knob] = {k.key: k for k in self.nominal} | {
            key: knob(key, plant.params)
            for effect in self.catalogue
            for key in effect.knobs
            if key not in self._own
        }
        self.knobs = {**self.knobs, **self._calibrated()}

    def _calibrated(self) -> dict[str, Knob]:
        """Scale and zero of every reading that has a calibration, with what that states of them."""
        priors, found = reading_priors(self.rig), {}
        for port, channel in self.channels.items():
            stem, suffix = split(port)
            prior = priors.get(channel.column)
            for key, stated in (
                (f"sensors.{stem}_gain_ratio", prior and prior.gain_ratio_std),
                (f"sensors.{stem}_offset{suffix}", prior and prior.offset_std * abs(channel.scale)),
            ):
                if stated and key in self.knobs and key not in self._own:
                    found[key] = self.knobs[key]._replace(stated=stated)
        return found

    def _touch(self, key: str, names: tuple[str, ...]) -> tuple[str, ...]:
        if key not in self._reach:
            self._reach[key] = tuple(
                name for name in reached(key, self.plant.params, self.channels) if name in names
            )
        return self._reach[key]

    def _without_inert(self, effect: Effect, names: tuple[str, ...]) -> Effect:
        """Without the knobs that this rig has no use for: a weight on a carriage hangs at no
        lever.
        """
        kept = [i for i, key in enumerate(effect.knobs) if self._touch(key, names)]
        starts = dict.fromkeys(tuple(start[i] for i in kept) for start in effect.starts)
        return effect._replace(knobs=tuple(effect.knobs[i] for i in kept), starts=tuple(starts))

    def touched(self, key: str) -> tuple[str, ...]:
        return self._touch(key, tuple(link.name for link in self.links))

    def params(self, values: Values) -> np.ndarray:
        """A copy of the nominal plant's parameters with these values, shape (1,), PARAMS."""
        found = copied(self.plant.params)
        for key, value in values.items():
            write_knob(found, key, value)
        return found

    def _params_once(self, values: Values) -> np.ndarray:
        """As ``params``, to be read only: the same values are asked for by every link of every
        recording, from several threads.
        """
        key = tuple(values.items())
        found = self._made.get(key)
        if found is None:
            if len(self._made) >= MOST_KEPT:
                self._made = {}
            self._made[key] = found = self.params(values)
        return found

    def prepare(self, recording: Recording) -> Prepared:
        """As Subject.prepare; KeyError where the recording lacks a column of the rig."""
        made = prepare(self.rig, self.channels, self._hold_s(), recording)
        for link in self.links:
            made.judged[link.name] = judged(made, self.plant.params, link.name)
        return made

    def residual(self, prepared: Prepared, values: Values, link: str) -> np.ndarray:
        """As Subject.residual; KeyError for an unknown number or link."""
        params = self._params_once(values)
        key = link, params.tobytes()
        found = prepared.residuals.get(key)
        if found is None:
            found = at_rate(RESIDUALS[link](Bench(prepared, params)), prepared.judged[link])
            if len(prepared.residuals) >= MOST_RESIDUALS:
                prepared.residuals.clear()
            prepared.residuals[key] = found
        return found

    def features(self, prepared: Prepared, link: str) -> Mapping[str, np.ndarray]:
        """As Subject.features: by the nominal plant, behind the residuals' low-pass."""
        return features(Bench(prepared, self.plant.params), link)

    def doubted(self, prepared: Mapping[str, Prepared]) -> DoubtedSubject:
        """The same rig with its places for a catalogue (origin.py). ``prepared``: recording name to
        what ``prepare`` gave.
        """
        return DoubtedSubject(self, prepared)

    def free_run(self, recording: Recording, values: Values, seed: int | None) -> Recording | None:
        """As Subject.free_run, from rest and never None; KeyError for an unknown number, or where
        the recording lacks a column of the rig.
        """
        known = self._all_known.of(
            recording,
            lambda: phase_of(self.channels, self._hold_s(), recording),
            lambda: commands_of(self.rig, on_grid(recording)[0]),
        )
        if seed is None:
            return self._run(recording, values, None, 0, known)
        noise = known.noise(values, self._apart, lambda: self._noise(recording, values, known))
        return with_gaps(self.rig, recording, self._run(recording, values, noise, seed, known))

    def told(self, recording: Recording) -> bool:
        """Whether what was lost of a recording, or of its commands alone, if anything, can be made
        up for: targets that leap cannot, nor a command that is missing for long, and the motor
        would be elsewhere ever after.
        """
        columns, _ = on_grid(recording)
        return all(followed(self.rig, columns).values()) and not (
            lost_rows(self.rig, columns).any() and unsteady(commands_of(self.rig, columns))
        )

    def on_channels(self, channels: dict[str, Channel]) -> "HouseSubject":
        """The same rig whose instruments read otherwise."""
        made = copy.copy(self)
        made.channels, made._all_known = channels, AllKnown()
        return made

    def rougher(self, far: bool = False) -> "HouseSubject | None":
        """The same rig integrated in half as many sub-steps: too coarse for its readings, not for
        what a knob changes of them. ``far``: by the midpoint rule besides, good enough for a change
        as large as an effect of typical strength. None where there is no half.
        """
        if self.plant.substeps < 2:
            return None
        made = copy.copy(self)
        made.plant, made.roughly, made._all_known = (
            replace(self.plant, substeps=self.plant.substeps // 2),
            far,
            AllKnown(),
        )
        return made

    def upto(self, recording: Recording, samples: int) -> Recording:
        """The first of a recording's samples: a run knows nothing of what comes after."""
        columns = {name: values[:samples] for name, values in recording.columns.items()}
        spans = tuple(
            replace(span, stop=min(span.stop, samples))
            for span in recording.spans
            if span.start < samples
        )
        return replace(
            recording,
            cycle=recording.cycle[:samples],
            columns=columns,
            spans=spans,
            t_ns=None if recording.t_ns is None else recording.t_ns[:samples],
        )

    def _run(
        self,
        recording: Recording,
        values: Values,
        noise: dict[str, float] | None,
        seed: int,
        known: Known,
    ) -> Recording:
        return run_whole(
            self.channels,
            self.params(values),
            self.plant.substeps,
            recording,
            known.told,
            noise,
            seed,
            known.phase,
            known.motions,
            self.roughly,
        )

    def _hold_s(self) -> float:
        return float(self.plant.params["sensors"]["encoder_hold_s"][0])

    def _noise(self, recording: Recording, values: Values, known: Known) -> dict[str, float]:
        """Port to noise: what this plant leaves of the recording."""
        made = with_gaps(self.rig, recording, self._run(recording, values, None, 0, known))
        seen, run = (read(self.channels, self._hold_s(), one) for one in (recording, made))
        return noise_of(seen, self.channels, run)

    def _apart(self, values: Values, others: Values) -> float:
        """Largest difference of a nominal parameter between two plants, in spreads; infinite where
        effects differ.
        """
        if any(
            values.get(key) != others.get(key)
            for key in (values.keys() | others.keys()) - self._own
        ):
            return np.inf
        return max(
            (
                abs(values.get(k.key, k.value) - others.get(k.key, k.value)) / k.spread
                for k in self.nominal
            ),
            default=0.0,
        )

    def patched(self, values: Values, effects: Sequence[str]) -> str:
        """As Subject.patched, without effects that no plant file names; KeyError for an unknown
        number.
        """
        known = effect_rows()
        plant = replace(
            self.plant,
            params=self.params(values),
            effects=tuple(
                dict.fromkeys([*self.plant.effects, *(name for name in effects if name in known)])
            ),
        )
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "plant.yaml"
            save_plant(path, plant)
            return path.read_text(encoding="utf-8")


def open_house(
    rig_path: str | os.PathLike,
    plant_path: str | os.PathLike,
    leave_out: frozenset[str] = frozenset(),
) -> HouseSubject:
    """The subject of a rig file and its nominal plant file; effects and families in ``leave_out``
    are not in its catalogue.

    Raises ConfigError.
    """
    return HouseSubject(load_rig(rig_path), load_plant(plant_path), leave_out)
