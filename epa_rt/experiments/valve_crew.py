"""Passes a phase's orders on to the valves of the muscles, and keeps the pressures that were asked
for.
"""

import math
from collections.abc import Iterable, Mapping
from typing import Protocol

from epa_rt.config.rig import Rig
from epa_rt.experiments.experiment import ValveOrder


class Valve(Protocol):
    """What a sequence asks of a muscle's valves (``SetAndHold``); the loop steps them."""

    @property
    def settled(self) -> bool: ...

    @property
    def failure(self) -> str | None: ...

    def set(self, target_pa: float) -> None: ...
    def vent(self) -> None: ...
    def hold(self) -> None: ...
    def close(self) -> None: ...
    def allow_retrim(self, allowed: bool) -> None: ...


class ValveCrew:
    """``targets``: absolute Pa last asked of each muscle, by name of its reference signal."""

    def __init__(self, rig: Rig, valves: Mapping[str, Valve]):
        self.targets: dict[str, float] = {}
        self._valves, self._atmosphere_pa = valves, rig.atmosphere_pa
        self._pressures = {muscle.name: muscle.pressure for muscle in rig.muscles}
        self._venting: set[str] = set()
        self._closed = set(valves)  # settled in their way: they hold no pressure

    def begin(self, measured: Mapping[str, float]) -> None:
        """Closes all valves; the targets are what is there (Pa)."""
        for valve in self._valves.values():
            valve.allow_retrim(False)
            valve.close()
        self._venting.clear()
        self._closed = set(self._valves)
        self.targets = {f"ref_{signal}": measured[signal] for signal in self._pressures.values()}

    def tell(self, orders: Iterable[ValveOrder]) -> None:
        """Passes orders on; a re-trim is allowed while setting, and afterwards only by
        hold_and_trim.
        """
        for order in orders:
            valve, target_key = self._valves[order.muscle], f"ref_{self._pressures[order.muscle]}"
            valve.allow_retrim(order.word in ("set", "hold_and_trim"))
            self._venting.discard(order.muscle)
            self._closed.discard(order.muscle)
            if order.word == "set":
                valve.set(order.target_pa)
                self.targets[target_key] = order.target_pa
            elif order.word == "vent":
                valve.vent()
                self.targets[target_key] = self._atmosphere_pa
                self._venting.add(order.muscle)
            elif order.word == "close":
                valve.close()
                self._closed.add(order.muscle)
            elif order.word == "hold":
                valve.hold()
            # hold_and_trim: it holds since it was set, and only now may be trimmed

    def settled(self) -> bool:
        """All valves have done what they were told; a closed one has nothing to do."""
        return all(valve.settled or name in self._closed for name, valve in self._valves.items())

    def stop(self) -> None:
        """Closes what fills. What vents goes on, and a failed valve stays as it failed: both are on
        the safe side.
        """
        for name, valve in self._valves.items():
            valve.allow_retrim(False)
            if name not in self._venting:
                valve.hold()


def finite(values: Mapping[str, float]) -> dict[str, float | None]:
    """The values, None for NaN: events become JSON, which has none."""
    return {name: value if math.isfinite(value) else None for name, value in values.items()}
