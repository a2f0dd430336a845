"""What a bench can run next."""

from epa_rt.config.rig import Rig
from epa_rt.gap.rig.menu.free_motion import free_motions
from epa_rt.gap.rig.menu.text import Item, fill, filled, item, move, renamed, trial

PRESSURES_KPA = (300, 550)  # gauge, at no load
LADDER = (
    (0.5, 0.05, "1 s"),
    (2.0, 0.1, "500 ms"),
    (8.0, 0.4, "500 ms"),
    (30.0, 1.0, "500 ms"),
    (60.0, 2.0, "400 ms"),
)  # mm/s, m/s^2, longest dwell
LADDER_KPA = (550, 250)  # gauge
TURNS_S = 4.0  # how long a stroke of the ladder takes at the most


def bench_menu(rig: Rig) -> list[Item]:
    """Rests, strokes of all speeds, fills, and the motor alone."""
    top_mm = 1e3 * rig.motor.places.get("stretched", 0.02)
    low_mm, middle_mm, high_mm = (round(part * top_mm, 1) for part in (0.05, 0.5, 0.9))
    low, middle, high = (f"{mm:g} mm" for mm in (low_mm, middle_mm, high_mm))
    items = []
    for kpa in PRESSURES_KPA:
        p = f"{kpa} kPa gauge"
        items += [
            item(
                "sealed_hold",
                {"pressure": p, "for": "40 s"},
                "motor_position",
                filled(rig, p),
                [
                    move("back", "no_load"),
                    trial("for: 40 s"),
                    move("stretch", high),
                    trial("for: 20 s", "hold_stretched"),
                ],
                "air shut in, nothing moves, at no load and stretched",
            ),
            item(
                "slow_strokes",
                {"pressure": p, "stroke": f"{low} to {high}", "speed": "4 mm/s"},
                "motor_speed",
                filled(rig, p),
                [
                    trial(
                        f"random_speed: {{between: [{low}, {high}], speed: 4 mm/s, acceleration:"
                        " 0.2 m/s^2, dwell: [100 ms, 2 s]}\n    for: 40 s"
                    )
                ],
                "slow strokes with rests: friction and creep without damping",
            ),
            item(
                "fast_strokes",
                {"pressure": p, "stroke": f"{low} to {high}", "speed": "60 mm/s"},
                "motor_speed",
                filled(rig, p),
                [
                    trial(
                        f"random_speed: {{between: [{low}, {high}], speed: 60 mm/s, acceleration: 2"
                        " m/s^2, dwell: [50 ms, 400 ms]}\n    for: 30 s"
                    )
                ],
                "fast strokes: damping, gas heat, lags",
            ),
            item(
                "small_strokes",
                {"pressure": p, "peak_to_peak": "2 mm", "band": "0.2 Hz to 5 Hz"},
                "motor_speed",
                filled(rig, p) + [move("go_to_mean", middle)],
                [
                    trial(
                        f"multisine: {{mean: {middle}, peak_to_peak: 2 mm, from: 0.2 Hz, to: 5 Hz,"
                        " lines: 10, period: 10 s, fade: 1 s}\n    for: 30 s"
                    )
                ],
                "small strokes over a wide band: pre-sliding, play, delays",
            ),
            item(
                "steps",
                {"pressure": p, "levels": f"{middle}, {high}"},
                "motor_position",
                filled(rig, p) + [move("go_to_middle", middle)],
                [
                    trial(
                        f"step: {{levels: [{high}, {middle}], rise: 300 ms, dwell: 2 s, times: 6}}"
                    )
                ],
                "steps and rests: creep, heat, the servo",
            ),
        ]
    items.append(_speed_ladder(rig, low_mm, high_mm))
    items.append(
        item(
            "fills_at_no_load",
            {"pressures": "150, 550, 300, 600 kPa gauge"},
            "motor_position",
            [move("go_to_no_load", "no_load")],
            [
                line
                for kpa in (150, 550, 300, 600)
                for line in (fill(rig, f"{kpa} kPa gauge"), trial("for: 4 s", f"rest_at_{kpa}"))
            ],
            "fills and vents with rests, nothing moves: valves, supply, heat of the gas",
        )
    )
    items += free_motions(rig, -8.0, -1.0)
    return items


def _speed_ladder(rig: Rig, low_mm: float, high_mm: float) -> Item:
    """The same motion at speeds up to two octaves apart: friction over the logarithm of speed,
    where laws differ that agree about any one speed.

    At two pressures, since a friction goes with the pull and a damping does not: at one of them a
    damper that is off by a third hides what the top speeds say of a friction. Slow rungs keep to a
    stroke that they can turn round in.
    """
    middle, phases = 0.5 * (low_mm + high_mm), []
    for k, kpa in enumerate(LADDER_KPA):
        ready = [*filled(rig, f"{kpa} kPa gauge"), move("go_to_middle", f"{middle:g} mm")]
        phases += [renamed(phase, f"at_{kpa}") for phase in ready]
        for n, (mm_s, acceleration, dwell) in enumerate(LADDER, k * len(LADDER) + 1):
            half = 0.5 * min(TURNS_S * mm_s, high_mm - low_mm)
            span = f"{round(middle - half, 1):g} mm, {round(middle + half, 1):g} mm"
            phases.append(
                trial(
                    f"random_speed: {{between: [{span}], speed: {mm_s:g} mm/s, acceleration:"
                    f" {acceleration:g} m/s^2, dwell: [100 ms, {dwell}]}}\n    for: 10 s",
                    f"rung_{n}",
                )
            )
    settings = {
        "pressures": ", ".join(f"{kpa}" for kpa in LADDER_KPA) + " kPa gauge",
        "strokes": f"up to {low_mm:g} mm to {high_mm:g} mm",
        "speeds": ", ".join(f"{mm_s:g}" for mm_s, *_ in LADDER) + " mm/s",
    }
    return item(
        "speed_ladder",
        settings,
        "motor_speed",
        [],
        phases,
        "strokes at speeds over two decades and at two pressures: what friction, damping and creep"
        " are made of",
    )
