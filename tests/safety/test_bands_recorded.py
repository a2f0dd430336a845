"""Every band that is no key of the rig file, recorded: a change of one changes what trips on every
rig, and its reason stands in one line beside it.
"""

import importlib

import pytest

from epa_rt.safety.gas_watch import ExchangeWatch, VolumeWatch

BANDS = {
    "at_rest": {"CAUSE": "sensor at rest", "BLOCK_S": 0.05, "STILL_PA": 1e3},
    "bus_budget": {"LOST_TIME_SHARE": 0.6},
    "commands": {"JUMP_S": 0.010},
    "contradiction": {"JUMP_SHARE": 1.5, "APART_S": 0.004, "FORGET_S": 0.050},
    "fill_watch": {"MEAN_S": 0.2, "FILLED_PA": 50e3, "MOST_N": 20.0, "STRETCHED_M": 0.5e-3},
    "gas_watch": {
        "CAUSE": "implausible sensor",
        "FULL_SHARE": 0.8,
        "CHOKED_SHARE": 0.45,
        "NEAR_SHARE": 0.92,
        "CRITICAL_RATIO": 0.3,
        "UNKNOWN_VOLUME": 1.5,
        "JUMP_FLOOR_PA": 5e3,
        "STEP_PA": 20e3,
        "FORGET_S": 3.0,
        "SLOW_S": 0.5,
        "WINDOW_S": 0.05,
    },
    "hose_watch": {
        "SLOW_S": 1.0,
        "FORGET_S": 5.0,
        "REST_S": 0.5,
        "ENOUGH_S": 2e-5,
        "OTHERS": 0.4,
        "OUT_S": 0.4,
    },
    "in_motion": {"ROUND_S": 0.008, "ROUNDS": 3},
    "index_guard": {"FELT_S": 0.02},
    "let_down": {
        "GAIN_MAX": 0.2,
        "RAMP_S": 0.2,
        "CREEP": 0.05,
        "ARRIVED_S": 0.05,
        "SETTLE": 5.0,
        "TIME": 2.0,
        "TOO_FAST": 3.0,
        "AWAY_S": 0.1,
        "MARGIN": 0.05,
        "WATCHED": ("N", "A"),
    },
    "motion_watch": {
        "SPEED_STEP": 0.05,
        "SPEED_STEPS": 10,
        "MEAN_S": 1.0,
        "SETTLED_S": 2.0,
        "MOVES": 0.01,
        "FROZEN_S": 1.0,
        "FROZEN_WAY_M": 0.003,
        "STILL_M": 0.0004,
        "STILL_S": 0.2,
        "ANSWERS": 0.2,
        "PATIENCE": 4.0,
    },
    "muscle_law": {"GAS_EXPONENT": 0.9, "FILL_BANDS": 1.2, "LOCKED_N_M": 2e4, "STRETCHED": 1.25},
    "recovery": {"BACK_SHARE": 0.05, "SPEED_RATIO": 3.0, "STOWED": ("m", "rad", "N", "Pa")},
    "stopping": {"SLOW_SHARE": 0.2},
}
OF_CLASSES = {
    ExchangeWatch: {"REST_S": 0.05, "RISE_PA": 10e3, "SHARE": 0.3},
    VolumeWatch: {
        "SLOW_S": 1.0,
        "FORGET_S": 5.0,
        "REST_S": 0.5,
        "OUT_S": 0.4,
        "ENOUGH_S": 2e-5,
        "ENOUGH_HIGH_S": 6e-5,
        "FROZEN": 0.04,
        "ALIKE": 0.8,
    },
}


@pytest.mark.parametrize("name", sorted(BANDS))
def test_the_bands_of_a_room_are_the_recorded_ones(name):
    module = importlib.import_module(f"epa_rt.safety.{name}")
    assert {band: getattr(module, band) for band in BANDS[name]} == BANDS[name]


@pytest.mark.parametrize("of", sorted(OF_CLASSES, key=lambda each: each.__name__))
def test_the_bands_of_a_class_are_the_recorded_ones(of):
    assert {band: getattr(of, band) for band in OF_CLASSES[of]} == OF_CLASSES[of]
