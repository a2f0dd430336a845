"""Electric-pneumatic actuator: control, logs, diagnosis. ``import epa_rt as epa`` for notebooks.

Importing costs nothing: what is below is loaded with its first use (docs/runs.md).
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from epa_rt.api import EpaError, Log, compare, diagnose, identify, ls, open, simulate

__all__ = ["EpaError", "Log", "compare", "diagnose", "identify", "ls", "open", "simulate"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'epa_rt' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module("epa_rt.api"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
