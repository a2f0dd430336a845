"""The clock of a log whose stamps are rounded more coarsely than its period."""

import numpy as np
import pytest

from epa_rt.gap.hygiene.time import check_time
from epa_rt.gap.recording import Recording


@pytest.mark.parametrize(
    ("factor", "kinds"), [(1.0, []), (1.02, ["period"]), (0.98, ["period"]), (2.0, ["period"])]
)
def test_stamps_in_whole_milliseconds_are_no_other_period(factor, kinds):
    n, period_s = 1500, 13.34e-3
    stamps = np.round(np.arange(n) * period_s * factor * 1e3).astype(np.int64) * 1_000_000
    log = Recording("log", "log.mcap", "servo", "", "", period_s, np.arange(n), {}, (), t_ns=stamps)
    assert [one.kind for one in check_time(log, None)] == kinds
