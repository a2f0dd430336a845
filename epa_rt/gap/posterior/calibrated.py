"""The posterior's numbers, written by scripts/calibrate_posterior.py: not to be edited.

From 80 sealed cases of `epa gap blind make` (seeds 771201, 771202, 771001), 22 of them
once more with their effect withheld, and 18 recordings of others. Mean log
probability of the truth -0.207, on what they were not calibrated on -0.261.
"""

from epa_rt.gap.posterior.evidence import Numbers

CASES, RECORDINGS = 80, 18
CALIBRATED = Numbers(
    freedom=11.8,
    floor_share=0.0758,
    loose_share=0.292,
    further_odds=-3.07,
    unknown_odds=-2.92,
    right_left=0.0329,
    wrong_left=0.357,
    left_spread=0.327,
    imitated_odds=-0.797,
    wrong_push=2.22,
)
