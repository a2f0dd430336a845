"""Numbers written with a fixed count of decimals are no steps of a converter; a wrong unit is still
found, in counts and in decimals.
"""

import dataclasses

import numpy as np
import pytest

from epa_rt.gap.hygiene.check import check
from tests.gap.recorded import recording_of, rig_of_name, scaled

P, F, X, V, I, T = (
    "muscle_pressure_pa",
    "muscle_force_n",
    "motor_travel_m",
    "motor_speed_m_s",
    "motor_current_a",
    "motor_torque_nm",
)
LOGS = {"bench": "identification_short", "knee": "knee_chirp_short"}
PRINTED = [
    ("bench", P, 1e3, 3),
    ("bench", P, 1e5, 5),
    ("bench", F, 1.0, 3),
    ("bench", F, 1.0, 6),
    ("bench", V, 1e-3, 3),
    ("bench", X, 1e-3, 4),
    ("bench", I, 1.0, 6),
    ("bench", T, 1e-3, 4),
    ("knee", "knee_angle_rad", np.pi / 180.0, 4),
    ("knee", "knee_angle_rad", 1.0, 6),
    ("knee", "spam_pressure_pa", 1e3, 3),
]


def printed(rig, name, size, decimals, wrong=1.0):
    """A log of which one channel comes in no counts and was written in units of ``size`` with so
    many decimals; ``wrong``: what the unit was mistaken by.
    """
    log = recording_of(rig, LOGS[rig])
    values, rng = log.columns[name], np.random.default_rng(1)
    zero = 101_325.0 if name.endswith("_pa") else 0.0
    fine = (
        values
        + rng.uniform(-0.5, 0.5, len(values))
        * np.diff(np.unique(values[np.isfinite(values)])).min()
    )
    return dataclasses.replace(
        log,
        columns={
            **log.columns,
            name: np.round((fine - zero) / size, decimals) * size * wrong + zero,
        },
    )


@pytest.mark.parametrize(("rig", "name", "size", "decimals"), PRINTED)
def test_decimals_of_a_text_are_no_wrong_unit(rig, name, size, decimals):
    assert [
        f.says
        for f in check([printed(rig, name, size, decimals)], rig_of_name(rig))
        if f.kind == "units"
    ] == []


@pytest.mark.parametrize(
    ("rig", "name", "size", "decimals", "factor"),
    [
        (*one, factor)
        for one in {(rig, name): (rig, name, *how) for rig, name, *how in PRINTED}.values()
        for factor in (1e-3, 1e3)
        if (one[1], factor) != (T, 1e3)
    ],
)
def test_a_unit_wrong_by_a_thousand_is_found_in_decimals_too(rig, name, size, decimals, factor):
    """But a torque a thousand times too large: a drive's torque has no limits."""
    found = [
        f
        for f in check([printed(rig, name, size, decimals, factor)], rig_of_name(rig))
        if f.severity == "refuse"
    ]
    assert [
        f for f in found if f.channel == name and f.kind in ("units", "outside limits", "zero")
    ], [f.says for f in found]


@pytest.mark.parametrize("name", [P, F, X, V, I, T])
def test_a_unit_wrong_by_a_thousand_is_found_by_the_size_of_a_count(name):
    found = [
        f
        for f in check(
            [scaled(name, 1e-3)(recording_of("bench", LOGS["bench"]))], rig_of_name("bench")
        )
        if f.severity == "refuse"
    ]
    assert [(f.channel, f.kind) for f in found] == [(name, "units")] and (
        "thousand" in found[0].says or "limits" in found[0].says
    )


def test_degrees_for_radians_are_found_in_decimals_too():
    found = [
        f
        for f in check(
            [printed("knee", "knee_angle_rad", 1.0, 6, np.pi / 180.0)], rig_of_name("knee")
        )
        if f.severity == "refuse"
    ]
    assert [f.kind for f in found if f.channel == "knee_angle_rad"] == ["units"], [
        f.says for f in found
    ]
