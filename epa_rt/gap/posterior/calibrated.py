"""The posterior's numbers, written by scripts/calibrate_posterior.py: not to be edited.

From 36 sealed cases of `epa gap blind make` (seeds 580100, 591100), 18 of them
once more with their effect withheld, and 18 recordings of others. Mean log
probability of the truth -0.202, on what they were not calibrated on -0.283.
"""

from epa_rt.gap.posterior.evidence import Numbers

CASES, RECORDINGS = 36, 18
CALIBRATED = Numbers(
    step_freedom=7.41,
    run_freedom=2.53,
    floor_share=0.0208,
    loose_share=0.304,
    effect_odds=-0.843,
    further_odds=-2.94,
    unknown_odds=-1.61,
    right_left=0.00752,
    wrong_left=0.515,
    left_spread=0.95,
)
