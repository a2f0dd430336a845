"""Diagnoses made up for the report's tests: what each verdict looks like. No figure in them was
measured.
"""

from dataclasses import replace

import numpy as np

from epa_rt.gap.diagnosis import (
    Diagnosis,
    Named,
    NextExperiment,
    Number,
    Origin,
    Place,
    Remainder,
    Shrinkage,
)
from epa_rt.gap.report.traces import Trace

LOGS = ("identification-bench-001", "identification-bench-002")


def place(
    block: str,
    link: str,
    channel: str,
    unit: str,
    floor: float,
    times: float,
    state: dict[str, float],
) -> Place:
    band = {
        name: 1.0 + (times - 1.0) * part
        for name, part in (
            ("0-0.1", 0.4),
            ("0.1-0.3", 1.3),
            ("0.3-1", 1.4),
            ("1-3", 0.7),
            ("3-10", 0.1),
            ("10-30", 0.0),
        )
    }
    time_s = {
        f"{log} {k * 10}-{k * 10 + 10}": 1.0 + (times - 1.0) * (0.6 + 0.07 * k)
        for log in LOGS
        for k in range(9)
        if k != 4
    }
    return Place(
        block,
        link,
        channel,
        unit,
        floor * times,
        floor,
        floor * np.sqrt(max(times**2 - 1.0, 0.0)),
        times,
        40.0 * (times - 1.0),
        state,
        band,
        time_s,
    )


LOCATION = (
    place(
        "muscle",
        "muscle0",
        "muscle_force_n",
        "N",
        0.31,
        13.2,
        {
            "muscle_speed_m_s > 0": 14.1,
            "muscle_speed_m_s < 0": 13.0,
            "muscle_speed_m_s near 0": 4.0,
            "reversal of muscle_speed_m_s": 19.5,
            "muscle_pressure_pa low": 9.0,
            "muscle_pressure_pa high": 17.0,
        },
    ),
    place(
        "transmission",
        "motor",
        "motor_current_a",
        "A",
        0.004,
        2.1,
        {
            "motor_speed_m_s > 0": 2.2,
            "motor_speed_m_s < 0": 1.9,
            "reversal of motor_speed_m_s": 2.6,
        },
    ),
    place(
        "gas",
        "gas0",
        "muscle_pressure_pa",
        "Pa",
        210.0,
        1.05,
        {"muscle_length_m low": 1.0, "muscle_length_m high": 1.1},
    ),
    place(
        "sensors",
        "encoder",
        "motor_speed_m_s",
        "m/s",
        1e-4,
        1.0,
        {"motor_speed_m_s > 0": 1.0, "motor_speed_m_s < 0": 1.0},
    ),
    place("drive", "drive", "motor_current_a", "A", 0.006, 0.99, {}),
)
SLIP = Named(
    "braid_maxwell_slip",
    "braid_friction",
    "muscle",
    (
        Number("muscle0.slip_ratio", 0.143, "1", 0.139, 0.148, 0.0),
        Number("muscle0.slip_reach_m", 1.9e-3, "m", 1.6e-3, 2.2e-3, 2e-3),
    ),
    0.98,
    48210.0,
)

GONE = replace(
    SLIP,
    who="plant_file",
    parameters=(
        Number("muscle0.slip_ratio", 0.0, "1", 0.0, 0.5, 0.06),
        Number("muscle0.slip_reach_m", 46e-3, "m", 1e-6, 0.1, 2e-3),
    ),
)


def shrunk(
    channel: str,
    unit: str,
    before: float,
    after: float,
    floor: float,
    mode: str,
    baseline: str = "refitted",
    log: str = "all",
) -> Shrinkage:
    share = 1.0 - (after**2 - floor**2) / (before**2 - floor**2) if before > 1.05 * floor else None
    return Shrinkage(
        channel,
        unit,
        mode,
        log,
        before,
        after,
        floor,
        share,
        share and (share - 0.01, share + 0.006),
        after / floor,
        "twin",
        baseline,
    )


SHRINKAGE = tuple(
    shrunk(*row, mode, baseline, log)
    for mode in ("teacher_forced", "free_run")
    for baseline in ("refitted", "plant_file")
    for log in ("all", *LOGS)
    for row in (
        ("all channels", "x floor", 6.1, 1.18, 1.0),
        ("muscle_force_n", "N", 4.1, 0.42, 0.31),
        ("motor_current_a", "A", 0.009, 0.0045, 0.004),
        ("muscle_pressure_pa", "Pa", 214.0, 212.0, 210.0),
    )
)
ASKED = (
    shrunk("energy (integral of motor_current_a squared)", "A^2*s", 1.9, 0.11, 0.05, "free_run"),
    shrunk("mean muscle_pressure_pa of a trial", "Pa", 900.0, 950.0, 820.0, "free_run"),
)
INPUTS = {
    "rig": "bench",
    "plant": "bench.yaml",
    "logs": [LOGS[0]],
    "holdout": [LOGS[1]],
    "left_out": [],
}
GATE = {
    "log": LOGS[1],
    "trials": 3,
    "of_trials": 3,
    "plant_file": "bench-patched.yaml",
    "passed": True,
    "not_judged": None,
    "predicted_share": 0.97,
    "achieved_share": 0.985,
    "points": 1.5,
    "channels": [
        {
            "channel": "all channels",
            "unit": "x floor",
            "before": 6.3,
            "after": 1.2,
            "floor": 1.0,
            "predicted_share": 0.97,
            "achieved_share": 0.985,
            "interval": (0.95, 0.99),
            "points": 1.5,
        },
        {
            "channel": "muscle_force_n",
            "unit": "N",
            "before": 4.2,
            "after": 0.44,
            "floor": 0.33,
            "predicted_share": 0.98,
            "achieved_share": 0.986,
            "interval": (0.97, 0.99),
            "points": 0.6,
        },
    ],
}
EXPLAINED = Diagnosis(
    "explained",
    "The force of muscle0 misses friction of the braid: braid maxwell slip, found with 98 %"
    " confidence, closes 98 % of the gap.",
    (),
    LOCATION,
    (SLIP,),
    (Number("muscle0.viscous_n_s_m", 12.4, "N*s/m", 12.1, 12.7, 12.0),),
    ("leak", "creep", "payload"),
    (*SHRINKAGE, *ASKED),
    gate=GATE,
    seconds=61.2,
    inputs=INPUTS,
)
NOT_SEPARABLE = replace(
    EXPLAINED,
    verdict="not_separable",
    says=(
        "The pressure falls in a way that leak, gauge offset and heat of filling explain equally"
        " well; these logs cannot tell them apart."
    ),
    effects=(
        replace(
            SLIP,
            name="leak",
            family="leak",
            block="gas",
            confidence=0.41,
            not_separable_from=("muscle0_gauge_offset", "fill_heat"),
        ),
    ),
    gate=None,
    next_experiment=NextExperiment(
        "sealed_hold",
        {"pressure": "550 kPa gauge", "for": "40 s"},
        ("leak", "muscle0_gauge_offset"),
        812.0,
        "experiment: sealed_hold\nloop: motor_position\n",
        "air shut in, nothing moves, at no load and stretched",
    ),
    found_first=(
        "identification-bench-001: 12 of 90000 cycles are missing, the first at cycle 4711",
        "identification-bench-001: muscle_force_n is saturated in 0.4 % of the samples",
    ),
)
NOT_IN_CATALOGUE = replace(
    EXPLAINED,
    verdict="not_in_catalogue",
    says=(
        "The force of muscle0 has a gap of 13 times the floor that no effect of the catalogue"
        " explains."
    ),
    effects=(),
    gate=None,
    shrinkage=(),
    nominal_moved=(),
    remainder=(
        Remainder(
            "muscle0",
            "muscle_force_n",
            "N",
            4.1,
            0.31,
            (
                ("memory of muscle_length_m", 0.61),
                ("sign of muscle_speed_m_s x muscle_pressure_pa", 0.22),
                ("muscle_length_m, slowly forgotten", 0.05),
            ),
            0.9,
            0.12,
        ),
    ),
    origins=(
        Origin(
            "muscle",
            "muscle",
            "a muscle's force, its line's stretch or its volume",
            8123.0,
            1.03,
            0.0,
        ),
        Origin(
            "spool", "transmission", "the way that the spool gives the lines", 5044.0, 0.61, 6.2
        ),
        Origin("gas", "gas", "what flows into a muscle", 12.0, 0.0, 7.0),
    ),
)
NO_GAP = Diagnosis(
    "no_gap",
    "The plant file describes these logs down to the noise floor.",
    (),
    tuple(
        replace(
            p,
            rms=p.floor,
            excess=0.0,
            times_floor=1.0,
            significance=0.4,
            state=dict.fromkeys(p.state, 1.0),
            band_hz=dict.fromkeys(p.band_hz, 1.0),
            time_s=dict.fromkeys(p.time_s, 1.0),
        )
        for p in LOCATION
    ),
    inputs=INPUTS,
    seconds=20.0,
)
ANSWERS = {
    "explained": EXPLAINED,
    "not_separable": NOT_SEPARABLE,
    "not_in_catalogue": NOT_IN_CATALOGUE,
    "no_gap": NO_GAP,
}


def curves() -> tuple[Trace, ...]:
    rng, t = np.random.default_rng(1), np.arange(0.0, 6.0, 0.01)
    force = 120.0 + 40.0 * np.sin(1.7 * t) + 4.0 * np.sign(np.cos(1.7 * t))
    lines = (
        ("the rig", "measured", force + 0.3 * rng.normal(size=len(t))),
        ("the plant as believed", "before", 120.0 + 40.0 * np.sin(1.7 * t)),
        ("the plant with the effects", "after", force),
    )
    left = (
        ("before", "before", 4.0 * np.sign(np.cos(1.7 * t)) + 0.3 * rng.normal(size=len(t))),
        ("with the effects", "after", 0.3 * rng.normal(size=len(t))),
    )
    return (
        Trace(
            "muscle_force_n: the rig, the plant as believed, the plant with the effects",
            "N",
            LOGS[1],
            t,
            lines,
            0.31,
            False,
        ),
        Trace(
            "What is left of muscle_force_n in muscle0, measured minus plant",
            "N",
            LOGS[1],
            t,
            left,
            0.31,
            True,
        ),
    )
