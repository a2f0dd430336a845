"""Hypothesis as every folder of these tests wants it: no wall clock, the same examples each
time.
"""

import os

from hypothesis import Phase, settings

# a mutant is killed by the first example that fails; the smallest one is of no interest then
phases = (Phase.explicit, Phase.generate) if os.environ.get("EPA_MUTATING") else tuple(Phase)
settings.register_profile("steady", deadline=None, database=None, derandomize=True, phases=phases)
settings.load_profile("steady")
