"""What the diagnosis works on: a rig cut into links, each a block with measured inputs and a
measured output.

Everything above this file (screening, refits, verdict, remainder, shrinkage) knows only a Subject.
The rigs of this house are one (``gap/house``); a carriage, a sealed chamber or a servo joint of
somebody else are others (``gap/foreign``).
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from epa_rt.gap.recording import Recording
from epa_rt.models.effect import Effect, Knob

OF_RUN = "run."  # how the key of a run's own level begins: a nuisance, of no plant file
Values = Mapping[str, float]  # knob key to value; keys left out stay as the plant file says


class Link(NamedTuple):
    """One block fed with measured inputs: ``channel`` is the measured output that its prediction is
    held against.
    """

    name: str  # "muscle0"; unique
    block: str  # a block of the plant: "muscle"
    channel: str  # "muscle_force_n"
    unit: str
    says: str  # "pressure, length and speed to force"


class Subject(Protocol):
    """A rig and its nominal plant, ready to be held against recordings.

    A subject may also have what only some rigs can say: ``only(recordings)``, those trials alone
    that it judges (aside.py); ``repeats(recording, values)``, what laps of one recording differ by
    (floor.py); ``read_again(recording, values, seed)``, of a rig without a model of the whole a
    twin of a recording, the same motion with another noise and an output by these values
    (astray.py); ``doubted(prepared)``, the same rig with a catalogue of places, each with an error
    of its own (origin.py); ``told(recording)``, whether all that the rig was told is known, so that
    free run can follow it (ground.py); ``rougher(far)``, the same rig with a quicker free run whose
    changes by a knob are nearly as good, with ``far`` those by an effect of typical strength
    (as_one.py); ``upto(recording, samples)``, the beginning of a recording, which runs as the whole
    one does up to there (as_one.py); ``own_loop``, the link that a maker's own loop makes, which
    may be another one than the plant's, and the one that shows whether the motion it is fed with is
    sound (own_loop.py); ``change(prepared, values, at, far)``, of its one link's residual from one
    set of values to another where that is had quicker than both, None where it is not (problem.py);
    ``finite_step``, the part of a knob's spread over which its derivatives are taken (problem.py);
    ``lowpass_hz``, what its residuals have passed where that is less than half their rate
    (floor.py).
    """

    name: str
    rate_hz: float  # rate of the residuals, after a zero-phase low-pass and decimation
    links: tuple[Link, ...]
    nominal: tuple[Knob, ...]  # parameters that compete with every effect
    catalogue: tuple[Effect, ...]  # effects that this rig can have at all
    knobs: Mapping[str, Knob]  # of nominal and catalogue, by key
    # whether free run is as good outside of trials: no end stop is ever met, whose contact nobody
    # knows
    without_stop: bool

    def touched(self, key: str) -> tuple[str, ...]:
        """Names of the links whose residual may change with a knob."""

    def prepare(self, recording: Recording) -> object:
        """What every evaluation on a recording needs and no knob changes; made once. Two threads
        may call it at once.
        """

    def residual(self, prepared: object, values: Values, link: str) -> np.ndarray:
        """Measured minus predicted of a link at ``rate_hz``, (n,), in the link's unit; NaN where it
        is not judged.

        Which samples are NaN depends on the recording alone, never on ``values``. Deterministic and
        free of shared state, so that two threads may call it at once.
        """

    def features(self, prepared: object, link: str) -> Mapping[str, np.ndarray]:
        """Measured states that a link's residual may depend on, (n,) each, named with unit
        ('muscle_speed_m_s'). Two threads may call it at once.
        """

    def free_run(self, recording: Recording, values: Values, seed: int | None) -> Recording | None:
        """The same commands through the whole plant: a recording as the rig would have made it.

        With ``seed`` the sensors are noisy (at the level found in the recording) and quantised,
        without it neither. None where the rig has no model of the whole. Two threads may call it at
        once; with a seed, for one recording, with one set of ``values`` alone.
        """

    def patched(self, values: Values, effects: Sequence[str]) -> str:
        """Text of a plant file with these values and effects, which loads to the same numbers."""
