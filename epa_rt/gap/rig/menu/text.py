"""An experiment of the menu, and its lines as ``epa run`` takes them."""

import re
from collections.abc import Callable, Mapping
from typing import NamedTuple

from epa_rt.config.rig import Rig


class Lines(NamedTuple):
    """What an experiment is written of: the loop that the run keeps to, what makes ready, and what
    is run.
    """

    loop: str
    before: list[str]
    phases: list[str]


class Item(NamedTuple):
    """``text`` is a whole experiment file; ``settings`` what a person would turn, with units.
    ``rounds``: the same with its trials so many times, where it can be had; ``lines``: what another
    experiment can be appended to, where one can.
    """

    name: str
    settings: dict[str, str]
    text: str
    says: str
    rounds: "Callable[[int], Item] | None" = None
    lines: Lines | None = None


def line(name: str, rest: str) -> str:
    """A phase of one line."""
    return f"  - {{name: {name}, {rest}}}"


def move(name: str, place: str) -> str:
    """The motor to a place, named or with its unit ('14 mm'), at 20 mm/s."""
    return line(name, f"move: {{to: {place}, speed: 20 mm/s}}")


def fill(rig: Rig, pressure: str, loop: str | None = None, name: str = "fill") -> str:
    """All muscles to one pressure, as an experiment file writes it ('300 kPa gauge')."""
    return fill_each(
        {muscle.name: pressure for muscle in rig.muscles}, loop, f"{name}_{pressure.split()[0]}"
    )


def fill_each(pressures: Mapping[str, str], loop: str | None, name: str) -> str:
    """Every muscle to a pressure of its own."""
    chosen = ", ".join(f"{muscle}: {{set: {pressure}}}" for muscle, pressure in pressures.items())
    return line(
        name,
        (f"loop: {loop}, " if loop else "")
        + f"valves: {{{chosen}}}, until: valves_settled, timeout: 60 s",
    )


def filled(rig: Rig, pressure: str) -> list[str]:
    """At no load, filled and trimmed."""
    return [
        move("go_to_no_load", "no_load"),
        fill(rig, pressure),
        line("settle", "for: 3 s, valves: {all: hold_and_trim}"),
        fill(rig, pressure, name="trim"),
    ]


def trial(profile: str, name: str = "trial") -> str:
    """A phase that is judged; no valve opens in it."""
    return f"  - name: {name}\n    trial: true\n    {profile}\n    valves: {{all: hold}}"


def item(
    name: str, settings: dict[str, str], loop: str, before: list[str], phases: list[str], says: str
) -> Item:
    """A whole experiment: ``before`` once, ``phases`` in every round, then back to no load and
    vented.
    """
    back = "loop: motor_position, " if loop == "joint_angle" else ""
    after = [
        line("return", back + "move: {to: no_load, speed: 20 mm/s}"),
        line("vent", back + "valves: {all: vent}, until: valves_settled, timeout: 60 s"),
    ]
    text = "\n".join(
        [
            f"# Proposed by 'epa gap plan': {says}.",
            f"experiment: {name}",
            f'description: "{says}"',
            f"loop: {loop}",
            "seed: 1",
            *(["before:", *before] if before else []),
            "phases:",
            *phases,
            "after:",
            *after,
            "",
        ]
    )

    def rounds(times: int) -> Item:
        more = [
            renamed(phase, str(n)) if n > 1 else phase
            for n in range(1, times + 1)
            for phase in phases
        ]
        return item(name, {**settings, "rounds": str(times)}, loop, before, more, says)

    return Item(name, settings, text, says, rounds, Lines(loop, before, phases))


def joined(first: Item, second: Item) -> Item | None:
    """Both in one file, one after the other, the second from no load again; None where a run cannot
    hold both. Between two places and at rest the motor's loops do the same, so that what keeps its
    place goes along with what moves by speed; a knee's loop goes with itself alone.
    """
    if first.lines is None or second.lines is None:
        return None
    loops = {first.lines.loop, second.lines.loop}
    if len(loops) > 1 and loops != {"motor_speed", "motor_position"}:
        return None
    loop = "motor_speed" if len(loops) > 1 else first.lines.loop
    back = [
        line(
            "between",
            ("loop: motor_position, " if loop == "joint_angle" else "")
            + "move: {to: no_load, speed: 20 mm/s}",
        )
    ]
    then = [renamed(phase, "then") for phase in (*back, *second.lines.before, *second.lines.phases)]
    settings = {f"{key} of {first.name}": value for key, value in first.settings.items()}
    for key, value in second.settings.items():
        said = f"{key} of {second.name}"  # of one experiment with two settings both are said
        settings[said] = (
            f"{settings[said]}, then {value}" if settings.get(said, value) != value else value
        )
    phases = [
        *first.lines.before,
        *first.lines.phases,
        *then,
    ]  # all of them in every round: each needs its own pressure again
    return item(
        f"{first.name}_and_{second.name}",
        settings,
        loop,
        [],
        phases,
        f"{first.says}; then {second.says}",
    )


def renamed(phase: str, more: str) -> str:
    """A phase with more to its name: no two of an experiment have one name."""
    return re.sub(r"name: (\w+)", rf"name: \1_{more}", phase, count=1)
