"""The page of claims: verdicts that follow the figures, and a page that shows every claim once."""

import importlib.util

import pytest

from epa_rt.study.claims import Claim
from tests.study.made import ROOT


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("reproduction", ROOT / "scripts/reproduction.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def answer(**r2):
    names = {
        "static": "static, geometry",
        "tang": "Tang, geometric",
        "every": "Tang, all fitted",
        "polynomial": "polynomial",
        "quadratic": "static, quadratic",
    }
    dynamic = {"Tang, geometric", "Tang, all fitted", "polynomial"}
    return {
        "models": [
            {
                "name": name,
                "r2": r2[key],
                "has_hysteresis": name in dynamic,
                "has_damping": name in dynamic,
            }
            for key, name in names.items()
        ],
        "terms": [],
    }


def verdicts(script, **r2):
    return [claim.holds for claim in script.identification_claims(answer(**r2))]


def test_table_1_as_printed_holds(script):
    assert (
        verdicts(script, static=0.916, tang=0.921, every=0.93, polynomial=0.971, quadratic=0.95)
        == [True] * 6
    )


def test_the_order_hangs_on_the_reading_of_tang(script):
    assert verdicts(
        script, static=0.916, tang=0.921, every=0.98, polynomial=0.971, quadratic=0.975
    )[3:] == [None, True, False]


def test_another_table_does_not_hold(script):
    assert verdicts(script, static=0.95, tang=0.93, every=0.93, polynomial=0.92, quadratic=0.9)[
        :4
    ] == [False, True, False, False]


def test_a_claim_is_one_row(script):
    row = script.row(Claim("3.2", "peak of |F v|", "1", False, ""), script.Notes())
    assert row.count("\n") == 0 and "**does not hold**" in row and "\\|F v\\|" in row
