"""A second simulator of the rigs, written from docs/plant.md alone, with hidden effects in formulas
of its own.

It plays the real rig where a diagnosis is judged: it shares no law and no integrator with
``epa_rt.models.blocks``, so that a diagnosis that finds its effects has not merely found itself.
"""
