"""The decorator of every compiled function of this package, with a cache that notices a change in
any of them.
"""

from pathlib import Path

from epa_rt.models.compiled import compiler, text_of

_PACKAGE = Path(__file__).parent
_KERNELS = ("gas", "knee", "motor", "muscle", "plant", "records", "sensors", "whole")
compiled = compiler(_PACKAGE, text_of(_PACKAGE, (_PACKAGE / f"{name}.py" for name in _KERNELS)))
