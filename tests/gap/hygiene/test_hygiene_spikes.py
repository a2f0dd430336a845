"""Spikes however many, wires that are off, and what is neither: a chamber that is filled and
vented, a joint that turns within a row.
"""

import numpy as np
import pytest

from epa_rt.gap.hygiene.check import check
from epa_rt.gap.recording import Recording
from tests.gap.foreign.made import one_trial

N = 20_000


def recording(name: str, values: np.ndarray, period_s: float = 1e-3) -> Recording:
    return one_trial("log", "cart", period_s, {name: values})


def sine() -> np.ndarray:
    return 0.1 * np.sin(2.0 * np.pi * 0.5 * np.arange(N) * 1e-3)


def rows(found, kind: str) -> list[int]:
    return [row for one in found if one.kind == kind for a, b in one.rows for row in range(a, b)]


def held(
    period_s: float, fill_s: float, vent_s: float, hold_s: float, noise_pa: float
) -> np.ndarray:
    """Filled, held and vented twice, Pa, as a converter of 244 Pa reads it."""
    t = np.arange(0.0, 2.0 * (hold_s + 15.0), period_s) % (hold_s + 15.0)
    venting = np.maximum(t - 5.0 - fill_s - hold_s, 0.0)
    pressure = 101_325.0 + 5e5 * np.clip((t - 5.0) / fill_s, 0.0, 1.0) * np.exp(-venting / vent_s)
    return (
        np.round((pressure + noise_pa * np.random.default_rng(3).standard_normal(len(t))) / 244.0)
        * 244.0
    )


@pytest.mark.parametrize("count", [10, 47, 100, 300, 700])
@pytest.mark.parametrize("noise_m", [0.0, 1e-5])
def test_every_spike_is_left_out_and_no_other_row(count, noise_m):
    rng = np.random.default_rng(count)
    values = sine() + noise_m * rng.standard_normal(N)
    at = 8 + 4 * np.sort(rng.choice(N // 4 - 4, count, replace=False))
    values[at] += 0.05 * rng.choice([-1.0, 1.0], count)
    found = check([recording("cart_position_m", values)], None)
    assert rows(found, "spike") == list(at) and {one.kind for one in found} == {"spike"}


def test_what_lies_between_two_stretches_of_a_wire_that_is_off_is_kept():
    off = [*range(6000, 6400), *range(6450, 6900), *range(6902, 6904)]
    values = sine() + 1e-5 * np.random.default_rng(5).standard_normal(N)
    values[off] = 0.5 + 1e-5 * np.random.default_rng(6).standard_normal(len(off))
    assert rows(check([recording("cart_position_m", values)], None), "gone") == off


def test_a_pressure_of_others_is_gone_where_a_row_is_too_short_for_any_valve():
    values = held(1e-3, 0.2, 0.3, 5.0, 150.0)
    values[7000:8000] = 0.0
    assert rows(check([recording("chamber_pressure_pa", values)], None), "gone") == list(
        range(7000, 8000)
    )


@pytest.mark.parametrize(
    ("period_s", "fill_s", "vent_s"),
    [
        (0.1, 0.1, 0.1),
        (0.1, 0.1, 0.3),
        (0.1, 0.3, 0.3),
        (0.02, 0.02, 0.02),
        (5e-3, 0.01, 0.01),
        (1e-3, 0.01, 0.01),
    ],
)
@pytest.mark.parametrize("noise_pa", [0.0, 150.0])
def test_a_chamber_that_is_filled_held_and_vented_keeps_its_holds(
    period_s, fill_s, vent_s, noise_pa
):
    assert not [
        one.says
        for one in check(
            [
                recording(
                    "chamber_pressure_pa",
                    held(period_s, fill_s, vent_s, 145.0 if period_s > 0.01 else 20.0, noise_pa),
                    period_s,
                )
            ],
            None,
        )
        if one.severity != "note"
    ]


def test_a_joint_that_turns_within_a_row_is_neither_gone_nor_frozen():
    """At 10 Hz, with rests between without a flicker: its command says where it is."""
    asked = np.repeat([0.0, 0.6, 0.0, 0.3, 0.6, 0.0, 0.6, 0.1], 200)
    turned = one_trial(
        "log",
        "arm",
        0.1,
        {
            "arm_position_rad": np.round(np.roll(asked, 1) / 1.5e-3) * 1.5e-3,
            "cmd_arm_position_rad": asked,
        },
    )
    assert not [one.says for one in check([turned], None) if one.severity != "note"]
