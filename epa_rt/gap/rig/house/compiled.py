"""The decorator of this folder's compiled functions: that of the models, with a cache that also
knows this folder.
"""

from pathlib import Path

from epa_rt.models.compiled import TEXT, compiler, text_of

_HERE = Path(__file__).parent
compiled = compiler(_HERE, text_of(_HERE, _HERE.glob("*.py"), TEXT))
