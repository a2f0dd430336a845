"""The benchmark of the live view on a small size, with viewers that attack."""

import json

from scripts.bench_live import rates, silent
from tests.test_scripts import run


def test_the_benchmark_gives_its_figures_and_an_attack_loses_nothing(tmp_path):
    words = ["bench_live", "--pairs", "1", "--stretch", "4", "--attack"]
    found = json.loads(run(words, tmp_path))
    assert found["missing_from_the_log"] == [] and found["said"].startswith("stopped")
    assert found["p99_9_us_alone"] and found["p99_9_us_watched"]
    assert found["silent"] == [] and found["foxglove"]["/cycle"]["messages"] > 1000


def test_a_stretch_in_which_the_client_had_nothing_is_counted():
    whole = {
        "stated_hz": {"/cycle": 1000.0, "/state": 10.0},
        "seen": {"/cycle": (1001, 0, 1_000_000_000), "/state": (11, 0, 1_000_000_000)},
    }
    part = {"stated_hz": {}, "seen": {"/state": (11, 0, 1_000_000_000)}}
    nothing = {"stated_hz": {}, "seen": {}}
    assert silent([whole]) == []
    assert silent([whole, part, nothing]) == [
        "watched stretch 1: no /cycle",
        "watched stretch 2: no message at all",
    ]
    assert silent([nothing]) == ["watched stretch 0: no message at all"]
    assert rates([whole, part])["/cycle"]["received_hz"] == [1000.0, None]
