"""How long and how large a run may be, so that planning, showing and recording it fit a machine."""

from epa_rt.experiments.oscillations import Multisine
from epa_rt.experiments.profiles import Pieces, Profile

# a day of a rig with eleven rows at 1 kHz is 86 million samples, some 30 GB of log
LONGEST_S = 86_400.0
# each phase of each repetition is planned before the run and named in its log
MOST_PHASES = 10_000
# a piece takes some 300 bytes: 150 MB for the whole run
MOST_PIECES = 500_000
# a multisine's table has 64 pieces for each wave of its highest line within one period
MOST_WAVES_OF_PERIOD = 2000
# of a sine or chirp, for which 100 points each are looked at: a few seconds of planning
MOST_WAVES = 250_000


def pieces_of(profile: Profile | None) -> int:
    """Pieces that a planned profile keeps in memory."""
    return profile.size if isinstance(profile, (Pieces, Multisine)) else 0
