"""The next experiment is the one that sets the closest rivals furthest apart, and says so in words."""

from pathlib import Path

import pytest

from epa_rt.config.rig import load_rig
from epa_rt.experiments.experiment import load_experiment
from epa_rt.gap.menu import Item, menu
from epa_rt.gap.plan import Rival, next_experiment
from tests.gap import toy

RIGS = Path(__file__).parents[2] / "config" / "rigs"
RIVALS = (Rival(("leak",), "a"), Rival(("heat",), "b"))
ITEMS = tuple(Item(name, {"at": name}, f"experiment: {name}", f"a {name} run") for name in ("short", "long", "failing"))


def chosen(apart: dict[str, tuple[float, float]]):
    """``apart``: experiment to the chi-square that each rival's data leave of the other; 'failing' cannot be run."""
    def simulate(item, plant):
        return None if item.name == "failing" else toy.recording(item.name, 1, seconds=1.0)

    return next_experiment(RIVALS, ITEMS, simulate, lambda recording, truth, other: apart[recording.name][RIVALS.index(truth)])


def test_the_smaller_of_both_distances_counts():
    found = chosen({"short": (100.0, 81.0), "long": (4000.0, 9.0)})
    assert (found.name, found.expected_distance, found.separates, found.file) == ("short", 81.0, ("leak", "heat"), "experiment: short")


def test_an_experiment_that_is_beaten_already_is_not_run_for_every_rival():
    ran = []

    def simulate(item, plant):
        ran.append((item.name, plant))
        return toy.recording(item.name, 1, seconds=1.0)

    apart = {"short": (100.0, 81.0), "long": (9.0, 4000.0), "failing": (90.0, 30.0)}
    found = next_experiment(RIVALS, ITEMS, simulate, lambda recording, truth, other: apart[recording.name][RIVALS.index(truth)])
    assert found.name == "short"
    assert ran == [("short", "a"), ("short", "b"), ("long", "a"), ("failing", "a"), ("failing", "b")]


@pytest.mark.parametrize("distance, words", [(81.0, "would lie 9 standard deviations of the noise apart, which decides (5 do)"),
                                             (16.0, "would lie 4 standard deviations of the noise apart, which helps, but does not decide (5 do)"),
                                             (-3.0, "would lie 0 standard deviations")])
def test_the_distance_is_said_in_standard_deviations(distance, words):
    assert words in chosen({"short": (distance, distance), "long": (-9.0, -9.0)}).says


def test_nothing_that_can_be_run_is_no_experiment():
    assert next_experiment(RIVALS, ITEMS[2:], lambda item, plant: None, lambda *_: 1.0) is None


@pytest.mark.parametrize("name", ["bench", "knee"])
def test_every_experiment_of_the_menu_is_one_that_the_rig_takes(name, tmp_path):
    rig = load_rig(RIGS / f"{name}.yaml")
    items = menu(rig)
    assert len({(item.name, *item.settings.values()) for item in items}) == len(items) >= 8
    for item in items:
        path = tmp_path / "next.yaml"
        path.write_text(item.text, encoding="utf-8")
        experiment = load_experiment(path, rig)
        assert experiment.trials, item.name
