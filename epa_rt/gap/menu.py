"""The experiments among which the next one is chosen, as files that ``epa run`` takes."""

import math
from typing import NamedTuple

from epa_rt.config.rig import Rig

PRESSURES_KPA = (300, 550)     # gauge, at no load
LADDER = ((0.5, 0.05, "3 s"), (2.0, 0.1, "2 s"), (8.0, 0.4, "1 s"), (30.0, 1.0, "500 ms"), (60.0, 2.0, "400 ms"))   # mm/s, m/s^2, longest dwell
APART_DEG = 8.0                # from the knee's mean: there the motor's travel mostly still reaches; an experiment that trips in simulation is passed over


class Item(NamedTuple):
    """``text`` is a whole experiment file; ``settings`` what a person would turn, with units."""

    name: str
    settings: dict[str, str]
    text: str
    says: str


def menu(rig: Rig) -> tuple[Item, ...]:
    """All experiments of the menu that this rig can run."""
    if rig.joint is not None:
        return tuple(_knee(rig))
    return tuple(_bench(rig))


def _bench(rig: Rig) -> list[Item]:
    top_mm = 1e3 * rig.motor.places.get("stretched", 0.02)
    low, middle, high = (f"{round(part * top_mm, 1):g} mm" for part in (0.05, 0.5, 0.9))
    items = []
    for kpa in PRESSURES_KPA:
        p = f"{kpa} kPa gauge"
        items += [
            _item("sealed_hold", {"pressure": p, "for": "40 s"}, "motor_position", _filled(rig, p),
                  [_trial("for: 40 s"), _move("stretch", high), _trial("for: 20 s", "hold_stretched")],
                  "air shut in, nothing moves, at no load and stretched"),
            _item("slow_strokes", {"pressure": p, "stroke": f"{low} to {high}", "speed": "4 mm/s"}, "motor_speed", _filled(rig, p),
                  [_trial(f"random_speed: {{between: [{low}, {high}], speed: 4 mm/s, acceleration: 0.2 m/s^2, dwell: [100 ms, 2 s]}}\n    for: 40 s")],
                  "slow strokes with rests: friction and creep without damping"),
            _item("fast_strokes", {"pressure": p, "stroke": f"{low} to {high}", "speed": "60 mm/s"}, "motor_speed", _filled(rig, p),
                  [_trial(f"random_speed: {{between: [{low}, {high}], speed: 60 mm/s, acceleration: 2 m/s^2, dwell: [50 ms, 400 ms]}}\n    for: 30 s")],
                  "fast strokes: damping, gas heat, lags"),
            _item("small_strokes", {"pressure": p, "peak_to_peak": "2 mm", "band": "0.2 Hz to 5 Hz"}, "motor_speed", _filled(rig, p) + [_move("go_to_mean", middle)],
                  [_trial(f"multisine: {{mean: {middle}, peak_to_peak: 2 mm, from: 0.2 Hz, to: 5 Hz, lines: 10, period: 10 s, fade: 1 s}}\n    for: 30 s")],
                  "small strokes over a wide band: pre-sliding, play, delays"),
            _item("steps", {"pressure": p, "levels": f"{middle}, {high}"}, "motor_position", _filled(rig, p) + [_move("go_to_middle", middle)],
                  [_trial(f"step: {{levels: [{high}, {middle}], rise: 300 ms, dwell: 2 s, times: 6}}")],
                  "steps and rests: creep, heat, the servo"),
        ]
    items.append(_speed_ladder(rig, low, high))
    items.append(_item("fills_at_no_load", {"pressures": "150, 550, 300, 600 kPa gauge"}, "motor_position", [_move("go_to_no_load", "no_load")],
                       [line for kpa in (150, 550, 300, 600) for line in (_fill(rig, f"{kpa} kPa gauge"), _trial("for: 4 s", f"rest_at_{kpa}"))],
                       "fills and vents with rests, nothing moves: valves, supply, heat of the gas"))
    items.append(_item("free_motion", {"pressure": "0 kPa gauge"}, "motor_speed", [_move("go_to_no_load", "no_load")],
                       [_trial(f"random_speed: {{between: [-8 mm, -1 mm], speed: 20 mm/s, acceleration: 1 m/s^2, dwell: [100 ms, 800 ms]}}\n    for: 20 s")],
                       "the strap hangs slack: the motor alone"))
    return items


def _speed_ladder(rig: Rig, low: str, high: str) -> Item:
    """The same motion at speeds two octaves apart: friction over the logarithm of speed, where laws differ that agree about any one speed."""
    p = f"{PRESSURES_KPA[-1]} kPa gauge"
    rungs = [_trial(f"random_speed: {{between: [{low}, {high}], speed: {mm_s:g} mm/s, acceleration: {acceleration:g} m/s^2, dwell: [100 ms, {dwell}]}}\n    for: 20 s",
                    f"rung_{n}") for n, (mm_s, acceleration, dwell) in enumerate(LADDER, 1)]
    return _item("speed_ladder", {"pressure": p, "stroke": f"{low} to {high}", "speeds": ", ".join(f"{mm_s:g}" for mm_s, *_ in LADDER) + " mm/s"}, "motor_speed",
                 _filled(rig, p), rungs, "strokes at speeds over two decades: what friction, damping and creep are made of")


def _knee(rig: Rig) -> list[Item]:
    names = [muscle.name for muscle in rig.muscles]
    items = []
    for kpa in (150, 185):
        fill = [_line("go_to_no_load", "loop: motor_position, move: {to: no_load, speed: 20 mm/s}"), _fill(rig, f"{kpa} kPa abs", "motor_position"),
                _line("settle", "loop: motor_position, for: 3 s, valves: {all: hold_and_trim}"),
                _fill(rig, f"{kpa} kPa abs", "motor_position", "trim"),
                _line("go_to_mean", "move: {to: mean, speed: 10 deg/s}, valves: {all: hold}"), _line("rest_at_mean", "for: 2 s")]
        for hertz, amplitude in (("0.1 Hz to 0.5 Hz", "12 deg"), ("0.5 Hz to 2 Hz", "10 deg"), ("1 Hz to 4 Hz", "2 deg")):
            low, high = hertz.split(" to ")
            items.append(_item("knee_chirp", {"pressure": f"{kpa} kPa abs", "band": hertz, "peak_to_peak": amplitude}, "joint_angle", fill,
                               [_trial(f"chirp: {{mean: mean, peak_to_peak: {amplitude}, from: {low}, to: {high}, fade: 2 s}}\n    for: 30 s")],
                               f"chirp of the knee, {hertz}, with {', '.join(names)} at {kpa} kPa"))
        middle = math.degrees(rig.joint.places.get("mean", 0.0))
        below, above = (f"{round(middle + by, 1):g} deg" for by in (-APART_DEG, APART_DEG))
        chirp = "chirp: {{mean: {}, peak_to_peak: 8 deg, from: 0.2 Hz, to: 1 Hz, fade: 2 s}}\n    for: 30 s"
        for first in ("mean", below):
            start = [] if first == "mean" else [_line("go_down", f"move: {{to: {below}, speed: 10 deg/s}}, valves: {{all: hold}}")]
            items.append(_item("knee_places", {"pressure": f"{kpa} kPa abs", "means": f"{first}, {above}", "peak_to_peak": "8 deg"}, "joint_angle", fill + start,
                               [_trial(chirp.format(first), "first_place"), _line("go_up", f"move: {{to: {above}, speed: 10 deg/s}}"), _trial(chirp.format(above), "above")],
                               "chirps about two angles: what pulls by the angle against what leans or is off"))
        items.append(_item("knee_hold", {"pressure": f"{kpa} kPa abs", "for": "40 s"}, "joint_angle", fill, [_trial("for: 40 s")],
                           "the knee held still: leaks, drift, holding torque"))
    return items


def _line(name: str, rest: str) -> str:
    return f"  - {{name: {name}, {rest}}}"


def _move(name: str, place: str) -> str:
    return _line(name, f"move: {{to: {place}, speed: 20 mm/s}}")


def _fill(rig: Rig, pressure: str, loop: str | None = None, name: str = "fill") -> str:
    chosen = ", ".join(f"{muscle.name}: {{set: {pressure}}}" for muscle in rig.muscles)
    return _line(f"{name}_{pressure.split()[0]}", (f"loop: {loop}, " if loop else "") + f"valves: {{{chosen}}}, until: valves_settled, timeout: 60 s")


def _filled(rig: Rig, pressure: str) -> list[str]:
    return [_move("go_to_no_load", "no_load"), _fill(rig, pressure), _line("settle", "for: 3 s, valves: {all: hold_and_trim}"),
            _fill(rig, pressure, name="trim")]


def _trial(profile: str, name: str = "trial") -> str:
    return f"  - name: {name}\n    trial: true\n    {profile}\n    valves: {{all: hold}}"


def _item(name: str, settings: dict[str, str], loop: str, before: list[str], phases: list[str], says: str) -> Item:
    back = "loop: motor_position, " if loop == "joint_angle" else ""
    after = [_line("return", back + "move: {to: no_load, speed: 20 mm/s}"),
             _line("vent", back + "valves: {all: vent}, until: valves_settled, timeout: 60 s")]
    text = "\n".join([f"# Proposed by epa gap plan: {says}.", f"experiment: {name}", f"description: \"{says}\"", f"loop: {loop}", "seed: 1",
                      "before:", *before, "phases:", *phases, "after:", *after, ""])
    return Item(name, settings, text, says)
