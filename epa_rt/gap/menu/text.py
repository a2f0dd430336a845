"""An experiment of the menu, and its lines as ``epa run`` takes them."""

import re
from collections.abc import Callable, Mapping
from typing import NamedTuple

from epa_rt.config.rig import Rig


class Item(NamedTuple):
    """``text`` is a whole experiment file; ``settings`` what a person would turn, with units. ``rounds``: the same with its trials so many times, where it can be had."""

    name: str
    settings: dict[str, str]
    text: str
    says: str
    rounds: "Callable[[int], Item] | None" = None


def line(name: str, rest: str) -> str:
    """A phase of one line."""
    return f"  - {{name: {name}, {rest}}}"


def move(name: str, place: str) -> str:
    """The motor to a place, named or with its unit ('14 mm'), at 20 mm/s."""
    return line(name, f"move: {{to: {place}, speed: 20 mm/s}}")


def fill(rig: Rig, pressure: str, loop: str | None = None, name: str = "fill") -> str:
    """All muscles to one pressure, as an experiment file writes it ('300 kPa gauge')."""
    return fill_each({muscle.name: pressure for muscle in rig.muscles}, loop, f"{name}_{pressure.split()[0]}")


def fill_each(pressures: Mapping[str, str], loop: str | None, name: str) -> str:
    """Every muscle to a pressure of its own."""
    chosen = ", ".join(f"{muscle}: {{set: {pressure}}}" for muscle, pressure in pressures.items())
    return line(name, (f"loop: {loop}, " if loop else "") + f"valves: {{{chosen}}}, until: valves_settled, timeout: 60 s")


def filled(rig: Rig, pressure: str) -> list[str]:
    """At no load, filled and trimmed."""
    return [move("go_to_no_load", "no_load"), fill(rig, pressure), line("settle", "for: 3 s, valves: {all: hold_and_trim}"),
            fill(rig, pressure, name="trim")]


def trial(profile: str, name: str = "trial") -> str:
    """A phase that is judged; no valve opens in it."""
    return f"  - name: {name}\n    trial: true\n    {profile}\n    valves: {{all: hold}}"


def item(name: str, settings: dict[str, str], loop: str, before: list[str], phases: list[str], says: str) -> Item:
    """A whole experiment: ``before`` once, ``phases`` in every round, then back to no load and vented."""
    back = "loop: motor_position, " if loop == "joint_angle" else ""
    after = [line("return", back + "move: {to: no_load, speed: 20 mm/s}"),
             line("vent", back + "valves: {all: vent}, until: valves_settled, timeout: 60 s")]
    text = "\n".join([f"# Proposed by epa gap plan: {says}.", f"experiment: {name}", f"description: \"{says}\"", f"loop: {loop}", "seed: 1",
                      *(["before:", *before] if before else []), "phases:", *phases, "after:", *after, ""])

    def rounds(times: int) -> Item:
        more = [_renamed(phase, n) for n in range(1, times + 1) for phase in phases]
        return item(name, {**settings, "rounds": str(times)}, loop, before, more, says)

    return Item(name, settings, text, says, rounds)


def _renamed(phase: str, n: int) -> str:
    """A phase of round ``n``: no two of an experiment have one name."""
    return re.sub(r"name: (\w+)", rf"name: \1_{n}", phase, count=1) if n > 1 else phase
