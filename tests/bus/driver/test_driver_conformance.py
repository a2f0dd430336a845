"""The driver is held to the same protocol as every backend."""

import re

import pytest

from tests.bus.own_network import call


@pytest.mark.network
@pytest.mark.timeout(900)
def test_the_conformance_suite_passes_over_the_emulated_bus():
    done = call("tests.bus.driver.conformance_run:run_suite")
    assert done["code"] == 0, done["said"][-4000:]
    passed = re.search(r"(\d+) passed", done["said"])
    assert passed and int(passed[1]) >= 42, done["said"][-500:]  # seven tests on six rigs
    assert "skipped" not in done["said"]
