"""The rigs as they are delivered, a muscle's valves that settle after a while, and a rig that
follows at once.
"""

from functools import cache
from pathlib import Path

from epa_rt.config.rig import Rig, load_rig
from epa_rt.experiments.experiment import Experiment, experiment_from_text
from epa_rt.experiments.sequence import Sequence

ROOT = Path(__file__).resolve().parents[2]


@cache
def rig(name: str) -> Rig:
    return load_rig(ROOT / "config" / "rigs" / f"{name}.yaml")


class StubValve:
    """Settles so many cycles after it was told to set or vent; keeps what it was told."""

    def __init__(self, settle_cycles: int = 50):
        self.settle_cycles, self.left, self.failure = settle_cycles, 0, None
        self.told: list[tuple] = []
        self.retrim = True

    @property
    def settled(self) -> bool:
        return self.left == 0

    def set(self, target_pa: float) -> None:
        self.left = self.settle_cycles
        self.told.append(("set", target_pa))

    def vent(self) -> None:
        self.left = self.settle_cycles
        self.told.append(("vent",))

    def hold(self) -> None:
        self.told.append(("hold",))

    def close(self) -> None:
        self.told.append(("close",))

    def allow_retrim(self, allowed: bool) -> None:
        self.retrim = allowed

    def step(self) -> None:
        self.left = max(0, self.left - 1)


class PerfectRun:
    """A sequence on a rig whose measured signals are the references of the cycle before."""

    def __init__(
        self,
        experiment: Experiment,
        on: Rig,
        start: dict[str, float] | None = None,
        settle_cycles: int = 50,
    ):
        self.valves = {muscle.name: StubValve(settle_cycles) for muscle in on.muscles}
        self.sequence = Sequence(experiment, on, self.valves)
        self.measured = {row.name: 0.0 for row in on.inputs} | (start or {})
        self.reference = dict.fromkeys(self.sequence.reference_names, float("nan"))
        self.events: list[tuple] = []
        self.cycle = 0
        self.sequence.begin(self.measured)

    def step(self) -> None:
        self.sequence.step(self.measured, self.reference, self.cycle)
        self.cycle += 1
        for valve in self.valves.values():
            valve.step()
        for name, value in self.reference.items():
            if value == value and name[4:] in self.measured:
                self.measured[name[4:]] = value
        self.events += self.sequence.events
        self.sequence.events.clear()

    def until_finished(self, at_most: int = 2_000_000) -> "PerfectRun":
        while not self.sequence.finished:
            assert self.cycle < at_most, "the sequence does not end"
            self.step()
        return self


def written(text: str, on: str = "bench") -> Experiment:
    """An experiment from a text, against a delivered rig."""
    return experiment_from_text(text, "test.yaml", rig(on))
