"""A power that is exactly its base where the exponent is one, so that what is off changes no
bit.
"""

from epa_rt.models.compiled import compiled


@compiled
def power(base, exponent):
    """base**exponent, exactly ``base`` for exponent 1."""
    return base if exponent == 1.0 else base**exponent
