"""A reader of another make, @mcap/core on node, reads a log whole and finds the same in each
signal.
"""

import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from log_samples import ATTACHMENTS, METADATA

from epa_rt.logs.reader import LogReader

CHECK = Path(__file__).parents[2] / "scripts" / "mcap_js" / "check.sh"
NO_NETWORK = ("ENOTFOUND", "EAI_AGAIN", "ECONNREFUSED", "ETIMEDOUT", "ENETUNREACH")


@pytest.fixture(scope="module")
def check(tmp_path_factory):
    """Runs the other reader over a log."""
    for command in ("npm", "node"):
        if shutil.which(command) is None:
            pytest.skip(f"{command} is not installed")
    build = tmp_path_factory.mktemp("mcap_js")

    def run(path):
        environment = os.environ | {"MCAP_JS_BUILD": str(build)}
        done = subprocess.run([CHECK, path], capture_output=True, text=True, env=environment)
        if any(sign in done.stderr for sign in NO_NETWORK):
            pytest.skip("the npm registry cannot be reached")
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return run


def test_it_finds_the_same_in_each_signal(check, whole_log):
    found = check(whole_log)
    with LogReader(whole_log) as log:
        tables = {topic: log.columns(topic) for topic in log.topics}
        event_count = len(log.events())
    assert found["topics"].keys() == {*tables, "/event"}
    for topic, columns in tables.items():
        assert list(found["topics"][topic]["signals"]) == list(columns)
        for name, column in columns.items():
            signal = found["topics"][topic]["signals"][name]
            assert (signal["count"], signal["nan"]) == (column.size, 0)
            numbers = column.astype(float)
            assert (signal["min"], signal["max"]) == (numbers.min(), numbers.max())
            assert signal["mean"] == pytest.approx(
                numbers.mean(), rel=1e-9, abs=1e-9 * np.abs(numbers).max()
            )
    messages = {topic: one["messages"] for topic, one in found["topics"].items()}
    assert messages["/event"] == event_count
    assert found["indexed"] == messages
    assert found["attachments"] == {name: len(data) for name, data in ATTACHMENTS.items()}
    assert found["metadata"]["run"] == METADATA["run"]


def test_a_cut_log_is_read_up_to_its_last_whole_chunk(check, whole_log, tmp_path):
    path = tmp_path / "cut.mcap"
    path.write_bytes(whole_log.read_bytes()[: whole_log.stat().st_size // 2])
    found = check(path)
    with LogReader(path) as log:
        assert found["topics"]["/cycle"]["messages"] == len(log.columns("/cycle")["cycle"]) > 0
    assert found["indexed"] is None
