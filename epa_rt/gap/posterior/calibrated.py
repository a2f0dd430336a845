"""The posterior's numbers, written by scripts/calibrate_posterior.py: not to be edited.

From 43 sealed cases of `epa gap blind make` (seeds 661129, 661130), 10 of them
once more with their effect withheld, and 18 recordings of others. Mean log
probability of the truth -0.279, on what they were not calibrated on -0.332.
"""

from epa_rt.gap.posterior.evidence import Numbers

CASES, RECORDINGS = 43, 18
CALIBRATED = Numbers(
    freedom=8.25,
    floor_share=0.0484,
    loose_share=0.297,
    further_odds=-3.12,
    unknown_odds=-2.41,
    right_left=0.0155,
    wrong_left=0.35,
    left_spread=0.354,
    imitated_odds=-1.4,
    wrong_push=22.8,
)
