"""What a knee can run next."""

import math

from epa_rt.config.rig import Rig
from epa_rt.gap.rig.menu.free_motion import free_motions
from epa_rt.gap.rig.menu.text import Item, fill, fill_each, item, line, trial

PRESSURES_KPA = (150, 185)  # absolute
# from the knee's mean: there the motor's travel mostly still reaches; an experiment that trips in
# simulation is passed over
APART_DEG = 8.0
RANGE_KPA = (
    140,
    280,
    200,
    # absolute: all muscles on the side where gravity pulls to; one muscle, and the others, far on
    # the other side
)
RANGE_DEG = (-9.0, 20.0)  # from the knee's mean


def knee_menu(rig: Rig) -> list[Item]:
    """Chirps and rests about the mean and beside it, the motor alone, and both ends of the knee's
    range.
    """
    names = [muscle.name for muscle in rig.muscles]
    about = [
        one
        for kpa in PRESSURES_KPA
        for one in (*_chirps(rig, kpa, names), *_places(rig, kpa), _hold(rig, kpa))
    ]
    return about + free_motions(rig, -20.0, -2.0) + [_range(rig, strong) for strong in names]


def _ready(rig: Rig, kpa: int) -> list[str]:
    """Filled, trimmed and at rest at the mean."""
    return [
        line("go_to_no_load", "loop: motor_position, move: {to: no_load, speed: 20 mm/s}"),
        fill(rig, f"{kpa} kPa abs", "motor_position"),
        line("settle", "loop: motor_position, for: 3 s, valves: {all: hold_and_trim}"),
        fill(rig, f"{kpa} kPa abs", "motor_position", "trim"),
        line("go_to_mean", "move: {to: mean, speed: 10 deg/s}, valves: {all: hold}"),
        line("rest_at_mean", "for: 2 s"),
    ]


def _chirps(rig: Rig, kpa: int, names: list[str]) -> list[Item]:
    items = []
    for band, degrees in (
        ("0.1 Hz to 0.5 Hz", "12 deg"),
        ("0.5 Hz to 2 Hz", "10 deg"),
        ("1 Hz to 4 Hz", "2 deg"),
    ):
        low, high = band.split(" to ")
        items.append(
            item(
                "knee_chirp",
                {"pressure": f"{kpa} kPa abs", "band": band, "peak_to_peak": degrees},
                "joint_angle",
                _ready(rig, kpa),
                [
                    trial(
                        f"chirp: {{mean: mean, peak_to_peak: {degrees}, from: {low}, to: {high},"
                        " fade: 2 s}\n    for: 30 s"
                    )
                ],
                f"chirp of the knee, {band}, with {', '.join(names)} at {kpa} kPa",
            )
        )
    return items


def _places(rig: Rig, kpa: int) -> list[Item]:
    below, above = _angle(rig, -APART_DEG), _angle(rig, APART_DEG)
    chirp = (
        "chirp: {{mean: {}, peak_to_peak: 8 deg, from: 0.2 Hz, to: 1 Hz, fade: 2 s}}\n    for: 30 s"
    )
    return [
        item(
            "knee_places",
            {"pressure": f"{kpa} kPa abs", "means": f"{first}, {above}", "peak_to_peak": "8 deg"},
            "joint_angle",
            _ready(rig, kpa),
            [
                line("go_first", f"move: {{to: {first}, speed: 10 deg/s}}, valves: {{all: hold}}"),
                trial(chirp.format(first), "first_place"),
                line("go_up", f"move: {{to: {above}, speed: 10 deg/s}}"),
                trial(chirp.format(above), "above"),
            ],
            "chirps about two angles: what pulls by the angle against what leans or is off",
        )
        for first in ("mean", below)
    ]


def _hold(rig: Rig, kpa: int) -> Item:
    return item(
        "knee_hold",
        {"pressure": f"{kpa} kPa abs", "for": "40 s"},
        "joint_angle",
        _ready(rig, kpa),
        [trial("for: 40 s")],
        "the knee held still: leaks, drift, holding torque",
    )


def _range(rig: Rig, strong: str) -> Item:
    """One end of what the motor's travel reaches and the other; each needs pressures of its own,
    and which muscle must be the ``strong`` one only a run can say.
    """
    weak_kpa, strong_kpa, others_kpa = RANGE_KPA
    names, phases = [muscle.name for muscle in rig.muscles], []
    weak = dict.fromkeys(names, f"{weak_kpa} kPa abs")
    apart = {name: f"{strong_kpa if name == strong else others_kpa} kPa abs" for name in names}
    for side, by_deg, pressures in (("below", RANGE_DEG[0], weak), ("above", RANGE_DEG[1], apart)):
        at = _angle(rig, by_deg)
        phases += [
            line(f"to_no_load_{side}", "loop: motor_position, move: {to: no_load, speed: 20 mm/s}"),
            fill_each(pressures, "motor_position", f"fill_{side}"),
            line(f"settle_{side}", "loop: motor_position, for: 3 s, valves: {all: hold_and_trim}"),
            fill_each(pressures, "motor_position", f"trim_{side}"),
            line(f"mean_{side}", "move: {to: mean, speed: 10 deg/s}, valves: {all: hold}"),
            line(f"go_{side}", f"move: {{to: {at}, speed: 10 deg/s}}"),
            trial(
                f"chirp: {{mean: {at}, peak_to_peak: 6 deg, from: 0.2 Hz, to: 1 Hz, fade: 2 s}}\n  "
                "  for: 40 s",
                side,
            ),
        ]
    settings = {
        "pressures": (
            f"{weak_kpa} kPa abs, then {strong} {strong_kpa} and others {others_kpa} kPa abs"
        ),
        "means": " and ".join(_angle(rig, by_deg) for by_deg in RANGE_DEG),
        "peak_to_peak": "6 deg",
    }
    return item(
        "knee_range",
        settings,
        "joint_angle",
        [],
        phases,
        "chirps at both ends of the knee's range: what bends over the angle",
    )


def _angle(rig: Rig, by_deg: float) -> str:
    """So far from the knee's mean."""
    return f"{round(math.degrees(rig.joint.places.get('mean', 0.0)) + by_deg, 1):g} deg"
