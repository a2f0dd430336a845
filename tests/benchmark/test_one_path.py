"""The benchmark asks as users do: what their logs are refused for, it is refused for."""

import pytest

from epa_rt.cli.exits import VerbError
from epa_rt.cli.gap.blind.diagnose import diagnose_files
from tests.cli.shell import RIGS
from tests.gap.recorded import PLANTS, log_of


def test_the_benchmark_is_refused_what_users_are():
    log = log_of("bench", "identification_short")
    with pytest.raises(VerbError, match="expected every log once"):
        diagnose_files(RIGS / "bench.yaml", PLANTS / "bench.yaml", [log, log], [], [])
