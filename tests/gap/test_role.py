"""Points at another scale of the links, and fits that are begun again from the plant file."""

import numpy as np
import pytest

from epa_rt.gap.likelihood.point import linearised
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.refit import refit, settled
from epa_rt.gap.likelihood.role import _polished
from epa_rt.gap.recording import Recording, Span
from epa_rt.gap.subject import Link, Plain
from epa_rt.models.effect import Effect, Knob
from tests.gap import toy

TRUE = {
    "drive.gain_a": 1.03,
    "spring.dahl_n": 1.5,
    "spring.dahl_m": 4e-3,
    "sensors.pressure_offset_pa": -500.0,
}
MISFIT = {"drive": 1.0, "gas": 2.0, "spring": 9.0}


@pytest.fixture(scope="module")
def problem() -> Problem:
    data = [toy.recording("log", 50, TRUE, seconds=20.0)]
    return Problem(toy.Toy(), data, toy.floors(None, data, {}))


def test_a_point_at_another_scale_is_as_if_its_links_had_been_divided_by_it(problem):
    base, other = linearised(problem, (), settled(problem).values), problem.rescaled(MISFIT)
    by = np.array([(problem.scale[link] / other.scale[link]) ** 2 for link in problem.links])
    moved, fresh = base.normal.weighted(by), linearised(other, (), base.values).normal
    for name in ("matrix", "vector", "square"):
        assert np.allclose(getattr(moved, name), getattr(fresh, name), rtol=1e-6, atol=1e-9), name
    assert np.allclose(moved.weighted(1.0 / by).square, base.normal.square)


class Hum(Plain):
    """A tone whose pitch is nominal and cannot be found from afar, a slope and a step."""

    name, rate_hz = "hum", 100.0
    links = (Link("tone", "block", "y", "", "time to y"),)
    nominal = (Knob("pitch", "", 3.0, 1.0, 9.0, 0.1),)
    catalogue = tuple(
        Effect(name, name, "block", (key,), ((1.0,),), "", "", "")
        for name, key in (("step", "size"), ("slope", "rise"))
    )
    knobs = {
        knob.key: knob
        for knob in (
            *nominal,
            Knob("size", "", 0.0, -9.0, 9.0, 1.0, "step"),
            Knob("rise", "", 0.0, -9.0, 9.0, 1.0, "slope"),
        )
    }

    def touched(self, key):
        return ("tone",)

    def prepare(self, recording):
        return recording

    def residual(self, prepared, values, link):
        t = prepared.columns["t"]
        return (
            prepared.columns["y"]
            - np.sin(values.get("pitch", 3.0) * t)
            - values.get("size", 0.0) * (t > 10.0)
            - 0.1 * values.get("rise", 0.0) * t
        )


def humming(pitch: float) -> Problem:
    t = np.arange(2000) / 100.0
    y = (
        np.sin(pitch * t)
        + 0.5 * (t > 10.0)
        + 0.03 * t
        + 0.1 * np.random.default_rng(2).standard_normal(len(t))
    )
    log = Recording(
        "log",
        "",
        "hum",
        "",
        "",
        0.01,
        np.arange(len(t)),
        {"t": t, "y": y},
        (Span("trial", 0, len(t), True),),
    )
    return Problem(Hum(), [log], {"tone": toy.White("tone", 0.1)})


def fitted(problem: Problem, pitch: float):
    """The step refitted where the slope is on and the pitch stands at ``pitch``."""
    point = linearised(problem, ("slope",), {"pitch": pitch, "rise": 0.3})
    return point, refit(problem, point, "step", {"size": 1.0})


def test_a_fit_whose_nominal_parameters_went_astray_is_found_again_from_the_plant_file():
    problem = humming(3.02)
    point, fit = fitted(problem, 5.0)
    assert abs(fit.values["pitch"] - 3.02) > 0.5, "it does not find its way back by itself"
    end = _polished(problem, point, fit)
    assert end.effect == "step" and end.values == pytest.approx(
        {"pitch": 3.02, "size": 0.5, "rise": 0.3}, abs=0.03
    )
    assert (
        end.chi
        == end.normal.chi
        == pytest.approx(linearised(problem, ("slope", "step"), end.values).normal.chi)
    )
    assert end.chi < 0.1 * fit.chi


def test_a_fit_that_is_better_than_what_the_plant_file_leads_to_stays_as_it_is():
    problem = humming(5.0)  # the plant file's 3 leads nowhere
    point, fit = fitted(problem, 5.0)
    assert _polished(problem, point, fit) is fit
