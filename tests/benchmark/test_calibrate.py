"""Calibration of the posterior's numbers on made-up tables whose truth is known."""

import numpy as np
import pytest

from epa_rt.benchmark.calibrate import (
    Example,
    as_drawn,
    calibrated,
    left_out,
    log_score,
    mean_log,
    of_names,
    of_truth,
    probabilities,
)
from epa_rt.gap.posterior.evidence import START
from epa_rt.gap.posterior.prior import Prior
from epa_rt.gap.posterior.search import Model, Table
from epa_rt.gap.posterior.unknown import posterior
from epa_rt.gap.posterior.views import BLOCKS, Seen, View

FAMILIES = {name: name for name in ("leak", "play", "drag", "heat")}
NOISE = 4000.0


def model(effects, left):
    z, nominal = np.zeros(len(effects)), np.zeros(len(effects), bool)
    matrix = 100.0 * np.eye(len(effects))
    seen = Seen(NOISE, NOISE + left, matrix)
    return Model(effects, {BLOCKS: View({"a": seen}, effects, z, nominal)}, {})


def example(kind, gap, right_left, wrong_left, rng):
    """A case with a gap, of which the right law leaves a part and wrong ones another."""
    there = str(rng.choice(list(FAMILIES)))
    parts = dict.fromkeys(FAMILIES, 1.0)
    for name in parts:
        part = right_left if kind == "single" and name == there else wrong_left
        parts[name] = min(1.0, part * np.exp(0.3 * rng.standard_normal()))
    models = [model((), gap), *(model((name,), part * gap) for name, part in parts.items())]
    effects = [] if kind == "none" else [{"families": [there], "answers": [], "multiple": 10.0}]
    return Example(kind, Table(tuple(models), Prior(FAMILIES)), {"kind": kind, "effects": effects})


@pytest.fixture(scope="module")
def examples():
    rng = np.random.default_rng(1)
    kinds = ["single"] * 6 + ["withheld"] * 3 + ["none"] * 3
    gaps = {"single": 3e4, "withheld": 3e4, "none": 20.0}
    return [example(kind, gaps[kind], 0.02, 0.6, rng) for kind in kinds]


def test_calibration_gives_the_truth_more_and_holds_on_cases_left_out(examples):
    numbers = calibrated(examples, START)
    assert log_score(examples, numbers) > log_score(examples, START)
    assert np.mean(np.log(left_out(examples, START))) > log_score(examples, START) - 0.05
    assert min(probabilities(examples, numbers)) > 0.3


def test_a_name_too_many_counts_half():
    table = Table((model((), 1e5), model(("leak", "play"), 0.0)), Prior(FAMILIES))
    truth = {"kind": "single", "effects": [{"families": ["leak"], "answers": [], "multiple": 9.0}]}
    found = posterior(table, START)
    assert of_truth(found, FAMILIES, truth) == pytest.approx(0.5 * found.models[0][1])


def test_reliability_counts_every_first_name_once(examples):
    rows = of_names(examples, START)
    assert sum(row["names"] for row in rows) == len(examples)
    assert all(row["from"] <= row["said"] <= row["to"] for row in rows)


def test_cases_of_a_kind_are_weighed_to_their_share():
    kinds = ["withheld"] * 3 + ["single"] * 6
    made = [Example(str(i), Table((), Prior({})), {"kind": kind}) for i, kind in enumerate(kinds)]
    weighed = as_drawn(made, {"withheld": 0.25, "single": 0.75})
    assert sum(one.weight for one in weighed) == pytest.approx(len(made))
    assert sum(one.weight for one in weighed[:3]) == pytest.approx(0.25 * len(made))
    alone = as_drawn(made[:3], {"withheld": 0.25, "single": 0.75})
    assert all(one.weight == 1.0 for one in alone)
    assert mean_log(weighed, [1.0] * 3 + [0.5] * 6) == pytest.approx(0.75 * np.log(0.5))
