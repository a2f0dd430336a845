"""What a scenario is, and the catalogue of all: every fault as it is put into a run, and what an
operator may expect.
"""

from dataclasses import dataclass, field

# What stops the rig. Category 1: the drive brakes and holds while the muscles vent, then power
# goes. Category 0: power goes at once. Alone: nobody is left to take the power away.
BRAKES, OFF, ALONE = "brakes and holds", "power off", "brakes and holds by itself"

REACTION_CYCLES = 20  # the rig files' `reaction: 20 ms`, in cycles of 1 ms
# the slaves' 100 ms, the cycle in which the last frame came, and the one in which it is judged
WATCHDOG_CYCLES = 102


@dataclass(frozen=True)
class Scenario:
    """``faults`` (as ``faults.add`` takes them) begin once the rig has been in the situation
    ``when`` for ``after`` cycles.

    ``says``: what the sentence must contain. ``code``: exit code; 0 for a run that goes on.
    ``stop``: how a run that ends stops the rig. ``within``: cycles until it does so, from the first
    bad cycle that a master can see; that is ``visible`` cycles after the injection, or, where it is
    None, the one in which the loop noticed it, because the plant has to move before anybody can.
    ``stuck``: valves that cannot obey. ``bad_cycles``: how many a run that goes on counts (in real
    time: at least). ``again``: a second run on the same bus must complete. ``pressure``: of the
    muscles; empty for the rig's usual one. ``gap``: what the loop does not notice yet.
    """

    faults: tuple[dict, ...]
    words: str
    seen_by: str
    code: int
    says: str = ""
    stop: str = BRAKES
    when: str = "moving"
    after: int = 400
    rig: str = "bench"
    seconds: float = 1.2
    pressure: str = ""
    within: int = REACTION_CYCLES
    visible: int | None = 0
    stuck: tuple[str, ...] = ()
    again: bool = False
    real_time: bool = False
    settings: dict = field(default_factory=dict)
    bad_cycles: int = 0
    gap: str = ""

    @property
    def goes_on(self) -> bool:
        return self.code == 0

    @property
    def compares(self) -> bool:
        """Whether the plant's path is compared with that of the undisturbed run."""
        return self.goes_on and bool(self.faults) and not self.real_time

    @property
    def vents(self) -> bool:
        """Whether the run ends with a watched vent."""
        return self.when == "venting" or "while venting" in self.says

    @property
    def alone_cycles(self) -> int:
        """How long the plant is watched after the run: until a rig is at rest that the run has
        left to itself.
        """
        return {BRAKES: 0, OFF: 1200, ALONE: 3500}[self.stop]

    @property
    def kinds(self) -> set[str]:
        return {fault["kind"] for fault in self.faults}

    def plan(self) -> dict:
        """What the traced bus is told."""
        return {"faults": self.faults, "when": self.when, "after": self.after}


def one(kind: str, where: str = "", **more: object) -> tuple[dict, ...]:
    """A single fault."""
    return ({"kind": kind, "where": where, **more},)


def all_scenarios() -> dict[str, Scenario]:
    """By name, in the order of the table."""
    from tests.bus.faults import of_bus, of_plant

    return {**of_bus.SCENARIOS, **of_plant.SCENARIOS, **of_bus.REAL_TIME}
