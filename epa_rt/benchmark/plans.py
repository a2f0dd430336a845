"""What the cases' logs are recorded with: experiment files for three logs and one that is held out.

A plan excites much ("rich"; "short" is the same for a quarter as long), nothing ("still": air shut
in, nothing moves), or one point only ("narrow": one pressure, one small sine). Pressures, strokes
and seeds differ from case to case.
"""

import re
from collections import Counter
from typing import NamedTuple

import numpy as np

RICH, SHORT, STILL, NARROW = "rich", "short", "still", "narrow"
_TRIAL_S = re.compile(r"(?<=for: )[\d.]+(?= s\b)")


class Plan(NamedTuple):
    """Texts of experiment files."""

    logs: tuple[str, ...]
    holdout: tuple[str, ...]


def plan_of(rig: str, kind: str, rng: np.random.Generator) -> Plan:
    """The experiments of one case on the rig 'bench' or 'knee'."""
    if kind == SHORT:
        whole = plan_of(rig, RICH, rng)
        return Plan(*(tuple(map(_quartered, texts)) for texts in whole))
    if rig == "knee":
        return _knee(kind, rng)
    return {RICH: _bench_rich, STILL: _bench_still, NARROW: _bench_narrow}[kind](rng)


def _quartered(text: str) -> str:
    """An experiment file whose trials take a quarter of the time."""
    return "\n".join(
        _TRIAL_S.sub(lambda s: f"{0.25 * float(s.group()):g}", line)
        if "trial: true" in line
        else line
        for line in text.split("\n")
    )


def _text(name: str, loop: str, seed: int, phases: list[str]) -> str:
    """An experiment file; a run keeps to one mode of the drive, so that the bench's phases all take
    the file's loop.
    """
    phases = list(phases)
    if loop != "joint_angle":
        phases = [
            phase.replace("loop: motor_position, ", "").replace("loop: motor_speed, ", "")
            for phase in phases
        ]
    seen: Counter[str] = Counter()
    for i, phase in enumerate(phases):  # a phase that comes again is numbered
        word = phase.split("name: ", 1)[1].split(",", 1)[0]
        seen[word] += 1
        if seen[word] > 1:
            phases[i] = phase.replace(f"name: {word}", f"name: {word}_{seen[word]}", 1)
    return (
        "\n".join(
            [
                f"experiment: {name}",
                f"loop: {loop}",
                f"seed: {seed}",
                "phases:",
                *(f"  - {phase}" for phase in phases),
            ]
        )
        + "\n"
    )


def _fill(kpa: float, loop: str = "motor_position") -> list[str]:
    gas = f"valves: {{all: {{set: {kpa:.0f} kPa gauge}}}}, until: valves_settled, timeout: 30 s"
    return [
        f"{{name: fill, loop: {loop}, {gas}}}",
        f"{{name: settle, loop: {loop}, for: 1 s, valves: {{all: hold_and_trim}}}}",
        f"{{name: trim, loop: {loop}, {gas}}}",
    ]


START = ["{name: go_to_no_load, loop: motor_position, move: {to: no_load, speed: 20 mm/s}}"]
END = [
    "{name: return, loop: motor_position, move: {to: no_load, speed: 30 mm/s}}",
    "{name: vent, loop: motor_position, valves: {all: vent}, until: valves_settled, timeout: 30 s}",
]


def _go(mm: float) -> str:
    return (
        f"{{name: go, loop: motor_position, move: {{to: {mm:.1f} mm, speed: 20 mm/s}}, valves:"
        " {all: hold}}"
    )


def _trial(name: str, motion: str, seconds: float, loop: str = "motor_speed") -> str:
    motion = f"{motion}, " if motion else ""
    return (
        f"{{name: {name}, trial: true, loop: {loop}, {motion}for: {seconds:g} s, valves: {{all:"
        " hold}}"
    )


def _strokes(low: float, high: float, speed: float, dwell: str = "[50 ms, 500 ms]") -> str:
    return (
        f"random_speed: {{between: [{low:.1f} mm, {high:.1f} mm], speed: {speed:.0f} mm/s,"
        f" acceleration: {max(speed * 0.03, 0.2):.2f} m/s^2, dwell: {dwell}}}"
    )


def _lines(mean: float, stroke: float, low: float, high: float, lines: int) -> str:
    return (
        f"multisine: {{mean: {mean:.1f} mm, peak_to_peak: {stroke:.1f} mm, from: {low:g} Hz, to:"
        f" {high:g} Hz, lines: {lines}, period: 5 s, fade: 500 ms}}"
    )


def _bench_rich(rng: np.random.Generator) -> Plan:
    low, high = rng.uniform(300, 380), rng.uniform(500, 600)
    middle, mean = 0.5 * (low + high) + rng.uniform(-30, 30), rng.uniform(11, 15)
    seeds = rng.integers(1, 1_000_000, 4)
    fast = [
        *START,
        *_fill(low),
        _trial("fast", _strokes(1, 27, rng.uniform(45, 60)), 10),
        _trial("slow", _strokes(2, 26, rng.uniform(5, 10), "[100 ms, 1.5 s]"), 8),
        *END,
    ]
    wide = [
        *START,
        *_fill(high),
        _go(mean),
        _trial("small", _lines(mean, 2.0, 0.2, 5.0, 8), 10),
        _trial("large", _lines(mean, 10.0, 0.2, 1.8, 5), 10),
        *END,
    ]
    rests = [
        *START,
        (
            "{name: free, trial: true, random_speed: {between: [-8 mm, -1 mm], speed: 25 mm/s,"
            " acceleration: 1 m/s^2}, for: 5 s}"
        ),
        *START,
        *_fill(rng.uniform(140, 220)),
        _trial("rest_low", "", 3, "motor_position"),
        *_fill(high),
        _trial("rest_high", "", 6, "motor_position"),
        _go(rng.uniform(18, 24)),
        _trial("rest_stretched", "", 6, "motor_position"),
        *END,
    ]
    other = [
        *START,
        *_fill(middle),
        _trial("strokes", _strokes(3, 25, rng.uniform(25, 40)), 10),
        _go(mean),
        _trial("lines", _lines(mean, 5.0, 0.2, 3.0, 6), 6),
        *END,
    ]
    loops = ("motor_speed", "motor_speed", "motor_position")
    return Plan(
        tuple(
            _text(f"log_{c}", loop, int(seed), p)
            for c, loop, seed, p in zip("abc", loops, seeds, (fast, wide, rests), strict=False)
        ),
        (_text("log_d", "motor_speed", int(seeds[3]), other),),
    )


def _bench_still(rng: np.random.Generator) -> Plan:
    kpa, place = rng.uniform(350, 500), rng.uniform(8, 20)
    phases = [*START, _go(place), _trial("rest", "", 12, "motor_position"), *END[:1]]
    texts = [
        _text(
            f"log_{c}",
            "motor_position",
            1,
            [
                *phases[:2],
                *(_fill(kpa) if c != "a" else []),
                *phases[2:],
                *(END[1:] if c != "a" else []),
            ],
        )
        for c in "abcd"
    ]
    return Plan(tuple(texts[:3]), (texts[3],))


def _bench_narrow(rng: np.random.Generator) -> Plan:
    kpa, mean, stroke = rng.uniform(350, 550), rng.uniform(10, 18), rng.uniform(1.5, 3.0)
    sine = (
        f"sine: {{mean: {mean:.1f} mm, peak_to_peak: {stroke:.1f} mm, frequency: 1 Hz, fade: 1 s}}"
    )
    texts = [
        _text(
            f"log_{c}",
            "motor_speed",
            1,
            [*START, *_fill(kpa), _go(mean), _trial("sine", sine, 12), *END],
        )
        for c in "abcd"
    ]
    return Plan(tuple(texts[:3]), (texts[3],))


def _knee(kind: str, rng: np.random.Generator) -> Plan:
    def text(name: str, spam: float, ppam: float, trials: list[str]) -> str:
        gas = (
            f"valves: {{spam: {{set: {spam:.0f} kPa abs}}, ppam: {{set: {ppam:.0f} kPa abs}}}},"
            " until: valves_settled, timeout: 30 s"
        )
        return _text(
            name,
            "joint_angle",
            1,
            [
                *START,
                f"{{name: fill, loop: motor_position, {gas}}}",
                "{name: settle, loop: motor_position, for: 1 s, valves: {all: hold_and_trim}}",
                f"{{name: trim, loop: motor_position, {gas}}}",
                "{name: go_to_mean, move: {to: mean, speed: 10 deg/s}, valves: {all: hold}}",
                "{name: rest_at_mean, for: 1 s}",
                *trials,
                "{name: rest, for: 500 ms}",
                *END,
            ],
        )

    def chirp(low: float, high: float, degrees: float, seconds: float) -> str:
        motion = (
            f"chirp: {{mean: mean, peak_to_peak: {degrees:.1f} deg, from: {low:g} Hz, to: {high:g}"
            " Hz, fade: 1 s}"
        )
        return _trial("chirp", motion, seconds, "joint_angle")

    spam, ppam = rng.uniform(180, 190), rng.uniform(165, 175)
    if kind == STILL:
        texts = [
            text(f"log_{c}", spam, ppam, [_trial("rest", "", 10, "joint_angle")]) for c in "abcd"
        ]
    elif kind == NARROW:
        sine = _trial(
            "sine",
            "sine: {mean: mean, peak_to_peak: 4 deg, frequency: 1 Hz, fade: 1 s}",
            12,
            "joint_angle",
        )
        texts = [text(f"log_{c}", spam, ppam, [sine]) for c in "abcd"]
    else:
        texts = [
            text("log_a", spam, ppam, [chirp(0.5, rng.uniform(1.8, 2.1), 10, 14)]),
            text("log_b", spam + 12, ppam + 10, [chirp(0.2, 0.7, rng.uniform(10, 13), 14)]),
            text(
                "log_c",
                spam - 8,
                ppam - 12,
                [chirp(1.0, 3.5, 2.5, 10), _trial("rest", "", 3, "joint_angle")],
            ),
            text("log_d", spam + 5, ppam + 3, [chirp(0.3, 1.5, 8, 14)]),
        ]
    return Plan(tuple(texts[:3]), (texts[3],))
