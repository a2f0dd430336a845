"""What the diagnosis works on: a rig cut into links, each a block with measured inputs and a
measured output.

Everything above this file (screening, refits, verdict, remainder, shrinkage) knows only a Subject.
The rigs of this house are one (``gap/house``); a carriage, a sealed chamber or a servo joint of
somebody else are others (``gap/foreign``).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol, Self

import numpy as np

from epa_rt.gap.recording import Recording
from epa_rt.models.effect import Effect, Knob

FINITE_STEP = 0.01  # of a knob's spread, for derivatives, where a subject wants no other
CHANGED = "_changed"  # how an effect ends that is another number than a baseline's
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


@dataclass(frozen=True)
class Usual:
    """What healthy runs of one rig differ by. ``runs``: how many there were; spreads of a subject's
    nominal parameters are theirs. ``off``: by link by how much chi-square per sample differs from
    one run to the next, a deviation.
    """

    runs: int
    off: Mapping[str, float]


class Subject(Protocol):
    """A rig and its nominal plant, ready to be held against recordings.

    What only some rigs can say has an answer for those that cannot: see ``Plain``.
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
    lowpass_hz: float  # what the residuals have passed where that is less than half their rate
    finite_step: float  # part of a knob's spread over which its derivatives are taken
    has_change: bool  # whether ``change`` says anything
    usual: Usual | None  # what its healthy runs differ by; None where none are known

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

    def row_variance(self, prepared: object, link: str) -> np.ndarray | None:
        """(n,) variance by which a right plant's residual may be off beyond its noise, unit^2: what
        the recording does not tell of the time between its rows, say. None where there is none.
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

    def only(self, recordings: Sequence[Recording]) -> Sequence[Recording]:
        """The recordings with those trials alone that the subject judges."""

    def of_any_run(self) -> "Subject":
        """The same without a number for any single run."""

    def told(self, recording: Recording) -> bool:
        """Whether all that the rig was told is known, so that free run can follow it."""

    def repeats(
        self, recording: Recording, values: Values | None = None
    ) -> Mapping[str, np.ndarray] | None:
        """By link what laps of one recording differ by, (n,); None where it has none."""

    def read_again(
        self, recording: Recording, values: Values, seed: int | None
    ) -> Recording | None:
        """A twin of a recording: the same motion with another noise, or with none where ``seed`` is
        None, and an output by these values; None where the rig has a model of the whole, or cannot.
        """

    def doubted(self, prepared: Mapping[str, object]) -> "Subject | None":
        """The same rig with a catalogue of places, each with an error of its own; None where it has
        none. ``prepared``: by recording name.
        """

    def rougher(self, far: bool) -> "Subject | None":
        """The same rig with a quicker free run whose changes by a knob are nearly as good, with
        ``far`` those by an effect of typical strength; None where it has none.
        """

    def upto(self, recording: Recording, samples: int) -> Recording | None:
        """The beginning of a recording, which runs as the whole one does up to there; None where a
        run is not cut.
        """

    def change(self, prepared: object, values: Values, at: Values, far: bool) -> np.ndarray | None:
        """Of its one link's residual from one set of values to another where that is had quicker
        than both, (n,); None where it is not.
        """


class Plain:
    """What a Subject says of itself that can no more than the others must: inherit, and override
    what the rig can say.
    """

    lowpass_hz = np.inf
    finite_step = FINITE_STEP
    has_change = False
    usual: Usual | None = None

    def only(self, recordings: Sequence[Recording]) -> Sequence[Recording]:
        """All of them, whole."""
        return recordings

    def of_any_run(self) -> Self:
        """No run has a number of its own."""
        return self

    def told(self, recording: Recording) -> bool:
        """Of every recording."""
        return True

    def repeats(
        self, recording: Recording, values: Values | None = None
    ) -> Mapping[str, np.ndarray] | None:
        """No laps."""
        return None

    def row_variance(self, prepared: object, link: str) -> np.ndarray | None:
        """Of no row."""
        return None

    def read_again(
        self, recording: Recording, values: Values, seed: int | None
    ) -> Recording | None:
        """No motion is read again."""
        return None

    def doubted(self, prepared: Mapping[str, object]) -> "Subject | None":
        """No places."""
        return None

    def rougher(self, far: bool) -> "Subject | None":
        """No rougher run."""
        return None

    def upto(self, recording: Recording, samples: int) -> Recording | None:
        """No run is cut."""
        return None

    def change(self, prepared: object, values: Values, at: Values, far: bool) -> np.ndarray | None:
        """Nothing is quicker."""
        return None
