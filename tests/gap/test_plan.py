"""The next experiment is the one that sets the closest rivals furthest apart, and says so in
words.
"""

from itertools import combinations
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from epa_rt.config.rig import load_rig
from epa_rt.experiments.experiment import load_experiment
from epa_rt.gap.next.plan import Judged, Rival, next_experiment
from epa_rt.gap.rig.menu import Item, joined, menu
from epa_rt.gap.rig.menu.text import Lines
from tests.gap import toy

RIGS = Path(__file__).parents[2] / "config" / "rigs"
RIVALS = (Rival(("leak",), "a"), Rival(("heat",), "b"))
ITEMS = tuple(
    Item(name, {"at": name}, f"experiment: {name}", f"a {name} run")
    for name in ("short", "long", "failing")
)


def chosen(apart: dict[str, tuple[float, float]]):
    """``apart``: experiment to the chi-square that each rival's data leave of the other; 'failing'
    cannot be run.
    """

    def simulate(item, plant):
        return None if item.name == "failing" else toy.recording(item.name, 1, seconds=1.0)

    return next_experiment(
        RIVALS,
        ITEMS,
        simulate,
        lambda recording, truth, other: apart[recording.name][RIVALS.index(truth)],
    )


def test_the_smaller_of_both_distances_counts():
    found = chosen({"short": (100.0, 81.0), "long": (4000.0, 9.0)})
    assert (found.name, found.expected_distance, found.separates, found.file) == (
        "short",
        81.0,
        ("leak", "heat"),
        "experiment: short",
    )


def test_what_stands_in_every_answer_is_not_told_apart():
    rivals = (Rival(("creep", "leak"), "a"), Rival(("creep", "heat"), "b"))
    found = next_experiment(
        rivals,
        ITEMS[:1],
        lambda item, plant: toy.recording(item.name, 1, seconds=1.0),
        lambda recording, truth, other: 81.0,
    )
    assert found.separates == ("leak", "heat")


def test_an_experiment_that_is_beaten_already_is_not_run_for_every_rival():
    ran = []

    def simulate(item, plant):
        ran.append((item.name, plant))
        return toy.recording(item.name, 1, seconds=1.0)

    apart = {"short": (100.0, 81.0), "long": (9.0, 4000.0), "failing": (90.0, 30.0)}
    found = next_experiment(
        RIVALS,
        ITEMS,
        simulate,
        lambda recording, truth, other: apart[recording.name][RIVALS.index(truth)],
    )
    assert found.name == "short"
    assert ran == [
        ("short", "a"),
        ("short", "b"),
        ("long", "a"),
        ("failing", "a"),
        ("failing", "b"),
    ]


def test_where_no_experiment_tells_the_closest_two_apart_the_one_that_rules_out_the_others_is_taken():  # noqa: E501
    """Late valves, a regulator that droops and a seat that leaks: data of the leak look late in
    every experiment, and fills tell all the rest.
    """
    rivals = (Rival(("droop",), "a"), Rival(("late",), "b"), Rival(("seat",), "c"))
    apart = {"short": 2.0, "long": 28.0, "failing": 1.0}
    found = next_experiment(
        rivals,
        ITEMS,
        lambda item, plant: toy.recording(item.name, 1, seconds=1.0),
        lambda recording, truth, other: (
            0.0 if (truth, other) == (rivals[2], rivals[1]) else apart[recording.name]
        ),
    )
    assert (found.name, found.expected_distance) == ("long", 0.0)
    assert (
        "does not tell them apart" in found.says
        and "over all pairs they would lie 5 apart in the mean" in found.says
    )


@pytest.mark.parametrize(
    "distance, words",
    [
        (441.0, "would lie 21 standard deviations of the noise apart, which decides (5 do)"),
        (
            81.0,
            (
                "would lie 9 standard deviations of the noise apart, which decides (5 do) where the"
                " rig is just like one of them"
            ),
        ),
        (
            16.0,
            (
                "would lie 4 standard deviations of the noise apart, which helps, but does not"
                " decide (5 do)"
            ),
        ),
        (4.0, "would lie 2 standard deviations of the noise apart, which does not tell them apart"),
        (-3.0, "would lie 0 standard deviations"),
    ],
)
def test_the_distance_is_said_in_standard_deviations(distance, words):
    assert words in chosen({"short": (distance, distance), "long": (-9.0, -9.0)}).says


def drawn_out(distance: float, trial_s: float):
    """What is chosen of one experiment with rounds, whose distance grows with them; and how many
    were asked for.
    """
    asked = []

    def item(times: int = 1) -> Item:
        asked.append(times)
        return Item("sines", {"rounds": str(times)}, f"experiment: sines{times}", "sines", item)

    only = item()
    found = next_experiment(
        RIVALS,
        (only,),
        lambda item, plant: toy.recording(item.settings["rounds"], 1, seconds=trial_s),
        lambda recording, truth, other: distance * int(recording.name),
    )
    return found, asked[1:]


def test_an_experiment_that_does_not_decide_is_drawn_out_until_it_should():
    found, asked = drawn_out(70.0, 20.0)
    assert asked == [6]
    assert (found.expected_distance, found.settings["rounds"], found.file) == (
        420.0,
        "6",
        "experiment: sines6",
    )


def test_an_experiment_that_decides_by_little_is_drawn_out_too():
    found, asked = drawn_out(180.0, 20.0)
    assert asked == [3]
    assert found.expected_distance == 540.0


def test_nobody_waits_longer_than_five_minutes_of_trials():
    found, asked = drawn_out(2.0, 40.0)
    assert asked == [7]
    assert found.expected_distance == 14.0


def both(short_s: float, apart: dict[str, float], longer: float | None = None):
    """Two experiments, 'short' with trials of ``short_s`` and 'long' of 100 s; ``longer``: distance
    that more rounds give, None: as they grow.
    """

    def item(name: str, times: int = 1) -> Item:
        return Item(
            name, {"rounds": str(times)}, f"{name} {times}", name, lambda times: item(name, times)
        )

    def distance(recording, truth, other):
        name, times = recording.name.split()
        return apart[name] * int(times) if longer is None or times == "1" else longer

    return next_experiment(
        RIVALS,
        (item("long"), item("short")),
        lambda item, plant: toy.recording(
            item.text, 1, seconds=short_s if item.name == "short" else 100.0
        ),
        distance,
    )


def test_what_more_rounds_would_decide_is_preferred_to_what_they_would_not():
    found = both(20.0, {"long": 4.0, "short": 3.0})
    assert (found.name, found.settings["rounds"], found.expected_distance) == ("short", "15", 45.0)


@pytest.mark.parametrize(
    ("apart", "chosen"),
    [
        ({"long": 410.0, "short": 90.0}, "long"),
        ({"long": 110.0, "short": 90.0}, "short"),
        ({"long": 3.0, "short": 24.0}, "short"),
        ({"long": 90.0, "short": 60.0}, "short"),
    ],
)
def test_what_promises_amply_is_preferred_and_of_two_that_do_the_one_that_does_at_once(
    apart, chosen
):
    """Of trials of 100 s three rounds can be had, of trials of 20 s fifteen."""
    assert both(20.0, apart).name == chosen


@given(st.floats(0.1, 1000.0), st.floats(0.1, 1000.0), st.floats(1.0, 300.0))
def test_an_experiment_of_less_distance_never_reaches_further(one, other, trials_s):
    near, far = (
        Judged(Item("sines", {}, "", "", lambda times: None), distance, trials_s)
        for distance in sorted((one, other))
    )
    assert near.reach <= far.reach


@pytest.mark.parametrize("longer", [0.0, 2.9])
def test_rounds_that_bring_nothing_are_not_asked_for(longer):
    found = both(20.0, {"long": 1.0, "short": 3.0}, longer)
    assert (found.settings["rounds"], found.expected_distance) == ("1", 3.0)
    assert "nothing of the menu would do better" in found.says


@pytest.mark.parametrize(
    ("distance", "trial_s"), [(400.0, 20.0), (30.0, 160.0), (0.5, 20.0), (0.0, 20.0), (9.0, 160.0)]
)
def test_what_decides_amply_and_what_the_longest_would_not_tell_stay_as_they_are(distance, trial_s):
    found, asked = drawn_out(distance, trial_s)
    assert asked == []
    assert found.expected_distance == distance


def test_nothing_that_can_be_run_is_no_experiment():
    assert next_experiment(RIVALS, ITEMS[2:], lambda item, plant: None, lambda *_: 1.0) is None


@pytest.mark.parametrize("name", ["bench", "bench_analog", "knee", "knee_geared", "mass"])
@pytest.mark.parametrize("rounds", [1, 3])
def test_every_experiment_of_the_menu_is_one_that_the_rig_takes(name, rounds, tmp_path):
    rig = load_rig(RIGS / f"{name}.yaml")
    items = menu(rig)
    assert len({(item.name, *item.settings.values()) for item in items}) == len(items) >= 8
    for item in items:
        item = item if rounds == 1 else item.rounds(rounds)
        path = tmp_path / "next.yaml"
        path.write_text(item.text, encoding="utf-8")
        experiment = load_experiment(path, rig)
        assert len(experiment.trials) % rounds == 0 < len(experiment.trials), item.name


def test_a_mass_on_a_line_has_no_chirps_of_a_knee_and_no_slack():
    names = {item.name for item in menu(load_rig(RIGS / "mass.yaml"))}
    assert names >= {"slow_strokes", "sealed_hold"}
    assert not any("knee" in name for name in names) and "free_motion" not in names


def test_the_rests_of_a_sealed_hold_come_back_to_no_load_in_every_round():
    item = next(
        item for item in menu(load_rig(RIGS / "bench.yaml")) if item.name == "sealed_hold"
    ).rounds(2)
    places = [
        line.split("to: ")[1].split(",")[0]
        for line in item.text.splitlines()
        if "{name: back" in line or "{name: stretch" in line
    ]
    assert places == ["no_load", "25.2 mm"] * 2


def two_of(apart: dict[str, dict[tuple[str, str], float]], lines: bool = True):
    """What is chosen of experiments that each tell some pairs of three rivals; in one file what
    they tell adds up. And what was run.
    """
    rivals, ran = tuple(Rival((name,), name) for name in "abc"), []
    items = tuple(
        Item(
            name,
            {"at": name},
            name,
            f"a {name} run",
            None,
            Lines("motor_speed", [], [f"  - {{name: {name}}}"]) if lines else None,
        )
        for name in apart
    )

    def simulate(item, plant):
        ran.append(item.name)
        return toy.recording(item.name, 1, seconds=1.0)

    def distance(recording, truth, other):
        return sum(
            apart[part].get((truth.plant_text, other.plant_text), 0.0)
            for part in recording.name.split("_and_")
        )

    return next_experiment(rivals, items, simulate, distance), ran


ALL = {(one, two): 30.0 for one in "abc" for two in "abc" if one != two}
NO_AB, NO_BC = (
    {pair: far for pair, far in ALL.items() if set(pair) != without}
    for without in ({"a", "b"}, {"b", "c"})
)


def test_two_experiments_that_tell_what_the_other_does_not_are_proposed_in_one_file():
    found, ran = two_of({"fills": NO_AB, "ladder": NO_BC, "nothing": {}})
    assert (found.name, found.expected_distance) == (
        "fills_and_ladder",
        30.0,
    ) and "decides" in found.says
    assert found.settings == {
        "at of fills": "fills",
        "at of ladder": "ladder",
    }  # its rounds bring nothing here
    assert "name: fills" in found.file and "name: ladder_then" in found.file
    assert ran.count("fills_and_ladder") == 6  # for each rival, and drawn out


@pytest.mark.parametrize(
    ("apart", "lines"),
    [
        ({"fills": NO_AB, "ladder": ALL}, True),
        ({"fills": NO_AB, "ladder": NO_AB}, True),
        ({"fills": NO_AB, "ladder": NO_BC}, False),
    ],
)
def test_where_one_does_or_two_do_not_or_have_no_lines_there_is_one(apart, lines):
    found, ran = two_of(apart, lines)
    assert found.name in apart and not any("_and_" in name for name in ran)


def test_any_two_experiments_of_a_bench_go_into_one_file_and_a_knees_with_their_own_loop(tmp_path):
    for name in ("bench", "mass", "knee"):
        rig = load_rig(RIGS / f"{name}.yaml")

        def trials(item, rig=rig):
            (tmp_path / "next.yaml").write_text(item.text, encoding="utf-8")
            return len(load_experiment(tmp_path / "next.yaml", rig).trials)

        alone = [(item, trials(item)) for item in menu(rig)]
        for (first, some), (second, more) in combinations(alone, 2):
            both = joined(first, second)
            assert (both is None) == (name == "knee" and first.lines.loop != second.lines.loop), (
                first.name,
                second.name,
            )
            assert both is None or trials(both) == some + more


def test_one_experiment_at_two_settings_in_one_file_says_both():
    low, high = [
        item for item in menu(load_rig(RIGS / "bench.yaml")) if item.name == "slow_strokes"
    ]
    said = joined(low, high).settings
    assert (
        said["pressure of slow_strokes"] == "300 kPa gauge, then 550 kPa gauge"
        and said["speed of slow_strokes"] == "4 mm/s"
    )


def test_a_speed_ladder_has_two_pressures_and_turns_round_on_every_rung():
    item = next(item for item in menu(load_rig(RIGS / "bench.yaml")) if item.name == "speed_ladder")
    assert "name: fill_550_at_550" in item.text and "name: fill_250_at_250" in item.text
    for rung in [line for line in item.text.splitlines() if "random_speed" in line]:
        low, high = (
            float(place)
            for place in rung.split("between: [")[1].split("]")[0].replace(" mm", "").split(",")
        )
        assert high - low <= 4.0 * float(rung.split(" speed: ")[1].split()[0]) + 0.11
