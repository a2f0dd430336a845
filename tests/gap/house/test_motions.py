"""Instruments that are shown what a plant did before show what a run of its own shows."""

import numpy as np
import pytest

from tests.gap.house.runs import recorded, subject


@pytest.mark.parametrize("roughly", [False, True])
@pytest.mark.parametrize("rig", ["bench", "knee"])
def test_a_motion_that_is_kept_shows_what_a_run_shows(rig, roughly):
    house, log = subject(rig), recorded(rig, 1)
    log = house.upto(log, log.samples // 4)
    house = house.rougher(far=True) if roughly else house
    nominal = {"sensors.pressure_lag_s": 0.004}
    shapes = [
        dict(zip(effect.knobs, effect.starts[0], strict=True))
        for effect in house.catalogue
        if all(key.startswith("sensors.") for key in effect.knobs)
    ]
    assert len(shapes) > 15
    house.free_run(log, {}, None)  # so that its motion is kept from the next run on
    for values in (nominal, *shapes):
        kept = house.free_run(log, values, None)
        alone = house.on_channels(house.channels).free_run(log, values, None)
        for name, column in alone.columns.items():
            assert np.array_equal(column, kept.columns[name], equal_nan=True), f"{values}: {name}"
