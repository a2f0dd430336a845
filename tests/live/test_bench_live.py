"""The benchmark of the live view on a small size, with viewers that attack."""

import json

from tests.test_scripts import run


def test_the_benchmark_gives_its_figures_and_an_attack_loses_nothing(tmp_path):
    words = ["bench_live", "--pairs", "1", "--stretch", "4", "--attack"]
    found = json.loads(run(words, tmp_path))
    assert found["missing_from_the_log"] == [] and found["said"].startswith("stopped")
    assert found["p99_9_us_alone"] and found["p99_9_us_watched"]
