"""The posterior's numbers, written by scripts/calibrate_posterior.py: not to be edited.

From 36 sealed cases of `epa gap blind make` (seeds 580100, 591100), 18 of them
once more with their effect withheld, and 18 recordings of others. Mean log
probability of the truth -0.240, on what they were not calibrated on -0.293.
"""

from epa_rt.gap.posterior.evidence import Numbers

CASES, RECORDINGS = 36, 18
CALIBRATED = Numbers(
    step_freedom=6.46,
    run_freedom=6,
    floor_share=0.0261,
    loose_share=0.302,
    effect_odds=0.0882,
    further_odds=-1.73,
    unknown_odds=-1.51,
    right_left=0.00977,
    wrong_left=0.451,
    left_spread=0.945,
)
