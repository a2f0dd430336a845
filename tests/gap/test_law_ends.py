"""A law that wants to go on from where it ends stands for something else; one that shows faintly
may stand there as well.
"""

import pytest

from epa_rt.gap.as_one import fitted
from epa_rt.gap.attribution import attributed
from epa_rt.gap.ground import ground_of
from epa_rt.gap.law_ends import pressed
from tests.gap import toy
from tests.gap.test_in_free_run import Chained, logs, told

END_M = 3e-3
DAHL = {"spring.dahl_n": 4.0, "spring.dahl_m": 4e-3}


def at_its_end(truth, high_m: float) -> dict[str, float]:
    """What presses where a law's length may be ``high_m`` at most."""
    found = attributed(Chained(), logs(truth), floors=toy.floors)
    ground = ground_of(found.problem, found.selection.base.values)
    problem, whole = (
        one.bounded({"spring.dahl_m": (2e-4, high_m)}) for one in (found.problem, ground.whole)
    )
    start = ground.none.values | {"spring.dahl_n": truth["spring.dahl_n"], "spring.dahl_m": high_m}
    return pressed(problem, whole, ground.none, fitted(whole, ("dahl",), start))


@pytest.mark.parametrize(
    ("truth", "high_m", "expected"),
    [
        (DAHL, END_M, {"spring.dahl_m": END_M}),
        (DAHL, 2e-2, {}),
        (DAHL | {"spring.dahl_n": 0.02}, END_M, {}),
    ],
    ids=["wants to go on", "within", "faint"],
)
def test_a_length_presses_where_the_plant_wants_it_longer(truth, high_m, expected):
    assert at_its_end(truth, high_m) == expected


def test_no_name_stands_beside_logs_that_could_not_have_shown_it(monkeypatch):
    monkeypatch.setattr(
        "epa_rt.gap.weigh.Weighed.verdict", lambda self, names: ("not_excited", "No gap shows.")
    )
    assert not told(DAHL).effects


def test_a_name_that_presses_is_none(monkeypatch):
    assert [one.name for one in told(DAHL).effects] == ["dahl"]
    monkeypatch.setattr(
        "epa_rt.gap.in_free_run.pressed", lambda *arguments: {"spring.dahl_m": END_M}
    )
    refused = told(DAHL)
    assert (
        refused.verdict == "not_in_catalogue"
        and "(dahl) does so only with spring.dahl_m at 0.003" in refused.says
    )
    assert refused.free_run.nearest == ("dahl",)
