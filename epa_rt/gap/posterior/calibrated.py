"""The posterior's numbers, written by scripts/calibrate_posterior.py: not to be edited.

From 36 sealed cases of `epa gap blind make` (seeds 580100, 591100), 18 of them
once more with their effect withheld, and 18 recordings of others. Mean log
probability of the truth -0.248, on what they were not calibrated on -0.307.
"""

from epa_rt.gap.posterior.evidence import Numbers

CASES, RECORDINGS = 36, 18
CALIBRATED = Numbers(
    freedom=7.25,
    floor_share=0.0174,
    loose_share=0.303,
    effect_odds=-0.952,
    further_odds=-3.04,
    unknown_odds=-1.63,
    right_left=0.0105,
    wrong_left=0.585,
    left_spread=1.12,
    wrong_push=5.0,
)
