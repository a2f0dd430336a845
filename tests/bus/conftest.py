"""What the machine did to a test that runs by the clock goes along with its report (tests/conftest.py shows it)."""

import pytest

from tests.bus.own_network import STALLS
from tests.conftest import STALLED


@pytest.fixture(autouse=True)
def _tell_stalls(record_property):
    STALLS.clear()
    yield
    for text in STALLS:
        record_property(STALLED, text)
