"""What is known of a recording hangs on what that recording alone was asked, and is looked for once
however many threads ask.
"""

import gc
import threading
import time
from dataclasses import replace

import numpy as np

from epa_rt.gap.rig.house.known import MOST_PLANTS, AllKnown
from epa_rt.models.ports import COMMAND
from tests.gap.house.runs import recorded, subject


def told() -> np.ndarray:
    return np.zeros(0, COMMAND)


def apart(one, other) -> float:
    return abs(one["x"] - other["x"])


def test_the_least_that_any_plant_leaves_counts_and_near_ones_are_not_looked_at():
    known, asked = AllKnown().of(recorded("bench", 1), lambda: 3, told), []

    def noise(x: float, left: float) -> float:
        return known.noise({"x": x}, apart, lambda: asked.append(x) or {"force_n": left})["force_n"]

    assert known.phase == 3
    assert [
        noise(0.0, 2.0),
        noise(0.4, 1.0),
        noise(1.0, 1.5),
        noise(2.0, 7.0),
        noise(3.0, 1.7),
        noise(9.0, 0.1),
    ] == [2.0, 2.0, 1.5, 1.5, 1.5, 1.5]
    assert asked == [0.0, 1.0, 2.0, 3.0] and len(asked) == MOST_PLANTS


def test_two_threads_look_for_it_once():
    all_known, log, asked = AllKnown(), recorded("bench", 1), []

    def look() -> None:
        all_known.of(log, lambda: asked.append("phase") or 0, told).noise(
            {"x": 0.0}, apart, lambda: time.sleep(0.05) or asked.append("noise") or {"force_n": 1.0}
        )

    threads = [threading.Thread(target=look) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(asked) == ["noise", "phase"]


def test_recordings_that_are_gone_are_forgotten_and_no_others():
    all_known, kept = AllKnown(), replace(recorded("bench", 1))
    all_known.of(kept, lambda: 1, told)
    for phase in range(100):
        assert (
            all_known.of(replace(kept), lambda phase=phase: phase, told).phase == phase
        )  # a copy is another recording, also at the place of one that is gone
    gc.collect()
    assert len(all_known._found) == 1 and all_known.of(kept, lambda: 9, told).phase == 1


def test_a_run_with_noise_is_the_same_whatever_other_recordings_were_run():
    house, log = subject("bench"), recorded("bench", 1)
    alone = house.free_run(replace(log), {}, 5).columns["muscle_force_n"]
    for _ in range(40):
        house.free_run(replace(log), {}, None)
    mine = replace(log)
    house.free_run(mine, {}, None)
    assert house.free_run(mine, {}, 5).columns["muscle_force_n"].tobytes() == alone.tobytes()
