"""The decorator of the compiled devices, with a cache that notices a change in any of them."""

from pathlib import Path

from epa_rt.models.compiled import compiler, text_of

_PACKAGE = Path(__file__).parent
_DEVICES = (
    "analog_inputs",
    "bytes_of_image",
    "devices",
    "drive_machine",
    "drive_motion",
    "input_filter",
    "wiring",
)
compiled = compiler(_PACKAGE, text_of(_PACKAGE, (_PACKAGE / f"{name}.py" for name in _DEVICES)))
