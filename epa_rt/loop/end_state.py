"""The state in which a run left the rig, as measured, and its words for the operator."""

from dataclasses import dataclass, replace

from epa_rt.config.rig import Rig

# SI unit of a row: how a person reads it
_SHOWN = {
    "m": (1e3, "mm"),
    "m/s": (1e3, "mm/s"),
    "rad": (57.29577951308232, "deg"),
    "rad/s": (57.29577951308232, "deg/s"),
}


@dataclass(frozen=True)
class EndState:
    """What was measured at the end. ``at_rest``, ``vented``, ``off``: None where nobody knows.

    ``axes``: positions and speed by row, SI. ``pressures``: by row, absolute Pa, filtered.
    ``current_a``: of a drive on wires. ``off_by``: what told that the drive is off. ``beyond``: how
    far outside its limits motion and speed went while the run ended.
    ``unknown``: a sentence for each thing that is not known, with its cause. ``let_down``: whether
    the motor was let down before its power went, in words; empty where nothing pulled.
    """

    axes: dict[str, float]
    pressures: dict[str, float]
    current_a: float | None
    at_rest: bool | None
    vented: bool | None
    off: bool | None
    off_by: str
    timed_out: bool
    beyond: dict[str, float]
    unknown: tuple[str, ...] = ()
    let_down: str = ""

    @property
    def is_quiet(self) -> bool:
        """At rest, vented and without power, all of it measured."""
        return bool(self.at_rest and self.vented and self.off)

    def heard_at_closing(self, off: bool | None) -> "EndState":
        """The same, with what the drive said last, where the bus heard it."""
        return self if off is None else replace(self, off=off)

    def lost(self, sentence: str) -> "EndState":
        """The same figures, of which nothing holds any more: the bus was lost."""
        return replace(self, at_rest=None, vented=None, off=None, unknown=(*self.unknown, sentence))

    def figures(self, rig: Rig) -> str:
        """Travel, speed and pressures with their units."""
        shown = [
            _shown(rig, name, value)
            if name == rig.motor.speed
            else f"{_spoken(rig, name)} {_shown(rig, name, value)}"
            for name, value in self.axes.items()
        ]
        shown += [
            f"{muscle.name} {self.pressures[muscle.pressure] / 1e3:.0f} kPa abs"
            for muscle in rig.muscles
            if muscle.pressure in self.pressures
        ]
        return ", ".join(shown) or "nothing measured"

    def text(self, rig: Rig, waited_s: float) -> str:
        """One line for the closing text. ``waited_s``: the longest wait, of the rig file."""
        rest = _word(self.at_rest, "at rest", "NOT at rest", "rest: not known")
        vented = _word(self.vented, "vented", self._held(rig), "vented: not known")
        off = _word(
            self.off,
            f"drive off, by its {self.off_by or 'closing answer'}",
            "the drive did NOT confirm that it is off",
            "drive off or not: not measured",
        )
        parts = [
            f"{self.figures(rig)} ({rest}; {vented})"
            if rig.muscles
            else f"{self.figures(rig)} ({rest})",
            off,
        ]
        if self.current_a is not None and self.off_by == "current":
            parts[1] += f" ({self.current_a:.3f} A)"
        for name, value in self.beyond.items():
            limits = rig.row(name).limits or (value, value)
            low, high = (_shown(rig, name, limit) for limit in limits)
            what = f"{_spoken(rig, name)} went to {_shown(rig, name, value)}"
            parts.append(f"while ending, {what}, outside {low} to {high}")
        if self.let_down:
            parts.append(f"the motor was {self.let_down}")
        if self.timed_out:
            parts.append(f"waited for {waited_s:g} s")
        parts += [f"not known: {sentence}" for sentence in self.unknown]
        return "end: " + "; ".join(parts)

    def _held(self, rig: Rig) -> str:
        """Which muscles hold pressure, and what to look at."""
        names = [m.name for m in rig.muscles if m.pressure in self.pressures]
        return (
            f"NOT vented: air is stored in {' or '.join(names) or 'a muscle'};"
            " exhaust stuck closed, or inlet stuck open?"
        )

    def facts(self) -> dict[str, object]:
        """For the log: figures in SI, words as booleans or null."""
        return {
            "axes": self.axes,
            "pressures_pa": self.pressures,
            "current_a": self.current_a,
            "at_rest": self.at_rest,
            "vented": self.vented,
            "drive_off": self.off,
            "timed_out": self.timed_out,
            "beyond": self.beyond,
            "unknown": list(self.unknown),
            "let_down": self.let_down,
        }


def _word(known: bool | None, yes: str, no: str, unknown: str) -> str:
    return unknown if known is None else yes if known else no


def _shown(rig: Rig, name: str, value: float) -> str:
    factor, unit = _SHOWN.get(rig.row(name).si_unit, (1.0, rig.row(name).si_unit))
    digits = 1 if abs(value * factor) < 1e3 else 0
    return f"{round(value * factor, digits) + 0.0:.{digits}f} {unit}"


def _spoken(rig: Rig, name: str) -> str:
    """'motor travel' for motor_travel_m."""
    unit = rig.row(name).si_unit.replace("/", "_")
    return name.removesuffix(f"_{unit}").replace("_", " ")
