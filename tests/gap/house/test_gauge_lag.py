"""A slow tube or filter before the pressure readings: the links of pressures and forces say how
slow it is.
"""

import numpy as np
import pytest
from scipy.optimize import least_squares

from tests.gap.house.runs import plant_with, recorded, rms, subject
from tests.gap.house.test_links import QUIET

KEY, OWN = "sensors.gauge_lag_s", "sensors.pressure_lag_s"
LAG_S = 0.03


@pytest.mark.parametrize("rig", ["bench", "knee"])
def test_a_slow_tube_is_found_in_every_link_that_it_reaches(rig):
    house = subject(rig)
    prepared = house.prepare(
        recorded(rig, 1, plant_with(rig, f"{rig}_tube", sensors__gauge_lag_s=LAG_S))
    )
    links = house.touched(KEY)
    assert set(links) == {link.name for link in house.links} & {"gas0", "gas1", "muscle0", "load"}
    for link in links:
        assert rms(house.residual(prepared, {}, link)) > 1.8 * rms(
            house.residual(prepared, {KEY: LAG_S}, link)
        ), link
        assert rms(house.residual(prepared, {KEY: LAG_S}, link)) < QUIET[rig][link], link
        found = least_squares(
            lambda x, link=link: left(house, prepared, {KEY: float(x[0])}, link, rig),
            [0.01],
            bounds=([0.0], [1.0]),
            diff_step=1e-2,
            x_scale=[0.01],
        ).x[0]
        assert found == pytest.approx(LAG_S, rel=0.05), link


def test_it_is_told_from_the_sensors_own_lag():
    """Both free, the nominal one believed to its 20 %: the tube takes what is there, the sensor
    keeps its own.
    """
    house = subject("bench")
    prepared = house.prepare(
        recorded("bench", 1, plant_with("bench", "bench_tube", sensors__gauge_lag_s=LAG_S))
    )
    own = house.knobs[OWN]

    def both(x):
        parts = [
            left(house, prepared, {KEY: float(x[0]), OWN: float(x[1])}, link, "bench")
            for link in house.touched(KEY)
        ]
        return np.concatenate([*parts, [(x[1] - own.value) / own.spread]])

    tube_s, own_s = least_squares(
        both,
        [0.01, own.value],
        bounds=([0.0, 0.0], [1.0, 1.0]),
        diff_step=1e-2,
        x_scale=[0.01, own.spread],
    ).x
    assert tube_s == pytest.approx(LAG_S, rel=0.03)
    assert abs(own_s - own.value) < 2.0 * own.spread


def left(house, prepared, values, link, rig):
    return np.nan_to_num(house.residual(prepared, values, link)) / QUIET[rig][link]
