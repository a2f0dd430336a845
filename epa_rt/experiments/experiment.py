"""An experiment resolved against a rig: every phase of every repetition, planned and checked before
anything moves.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.config.kinds import expect_kind
from epa_rt.config.source import Located, load_yaml, parse_yaml
from epa_rt.experiments.coordinate import Coordinate
from epa_rt.experiments.motions import Motion
from epa_rt.experiments.profiles import Profile

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig


@dataclass(frozen=True)
class ValveOrder:
    """What one muscle's valves are told when a phase begins: set (to absolute Pa), hold,
    hold_and_trim, vent, close.
    """

    muscle: str
    word: str
    target_pa: float | None = None


@dataclass(frozen=True)
class Condition:
    """Ends a phase: all valves settled (no signal), or ``sign * (signal - value) > 0`` for so many
    cycles in a row.
    """

    text: str
    signal: str | None = None
    sign: float = 1.0
    value: float = 0.0
    steady_cycles: int = 1


@dataclass(frozen=True)
class Phase:
    """One phase of the run. ``name`` is its label: 'fill[2] p0=520 kPa gauge'; ``key`` its name in
    the file.

    ``cycles``: what 'for' says, None where the motion or the conditions decide. ``duration_s``: an
    estimate where the end hangs on the rig. ``trial_index`` counts the trials of the run from 0,
    None where this is none.
    """

    name: str
    key: str
    loop: str
    coordinate: Coordinate
    motion: Motion
    orders: tuple[ValveOrder, ...] = ()
    cycles: int | None = None
    conditions: tuple[Condition, ...] = ()
    timeout_cycles: int | None = None
    trial_index: int | None = None
    repetition: int | None = None
    values: Mapping[str, str] = field(default_factory=dict)
    duration_s: float = 0.0

    def profile(self, start_position: float) -> Profile:
        """The motion from where the reference is (m, rad or N*m)."""
        return self.motion.profile(start_position)


@dataclass(frozen=True)
class Experiment:
    """A whole run; ``text`` is the file as it was read."""

    name: str
    description: str
    seed: int
    period_s: float
    phases: tuple[Phase, ...]
    path: Path
    text: str = field(repr=False, default="")

    @property
    def phase_names(self) -> tuple[str, ...]:
        return tuple(phase.name for phase in self.phases)

    @property
    def duration_s(self) -> float:
        """Estimate: exact for motions and 'for', a guess for the filling and venting of muscles."""
        return sum(phase.duration_s for phase in self.phases)

    @property
    def loops(self) -> tuple[str, ...]:
        """The loops used, each once, in order of appearance."""
        return tuple(dict.fromkeys(phase.loop for phase in self.phases))

    @property
    def trials(self) -> tuple[Phase, ...]:
        return tuple(phase for phase in self.phases if phase.trial_index is not None)


def load_experiment(path: Path | str, rig: "Rig") -> Experiment:
    """Reads an experiment file for a rig. Raises ConfigError: one sentence with file, line, found,
    expected.
    """
    return experiment_from(load_yaml(path), rig)


def experiment_from_text(text: str, path: Path | str, rig: "Rig") -> Experiment:
    """As load_experiment, from text that came from ``path`` (a log's attachment, say). Raises
    ConfigError.
    """
    return experiment_from(parse_yaml(text, path), rig)


def experiment_from(located: Located, rig: "Rig") -> Experiment:
    """The experiment of a YAML text already read. Raises ConfigError."""
    from epa_rt.config.experiment import ExperimentFile
    from epa_rt.config.source import validate
    from epa_rt.experiments.resolve import Resolver

    expect_kind(located, "experiment")
    file = validate(located, ExperimentFile)
    phases = Resolver(located, rig, file).phases()
    return Experiment(
        file.experiment,
        file.description,
        file.seed,
        rig.period_s,
        phases,
        located.path,
        located.text,
    )
