"""Hypothesis as every folder of these tests wants it: no wall clock, the same examples each
time.
"""

from hypothesis import settings

settings.register_profile("steady", deadline=None, database=None, derandomize=True)
settings.load_profile("steady")
