"""Electric-pneumatic actuator: control, logs, diagnosis. ``import epa_rt as epa`` for notebooks.

Importing costs nothing: what is below is loaded with its first use (docs/runs.md).
"""

import sys
from types import ModuleType
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


class _CallableRoom(ModuleType):
    """``epa_rt.identify`` is a room of the package and a verb: called, it is the verb."""

    def __call__(self, *logs: Any, **options: Any) -> Any:
        from epa_rt.api import identify

        return identify(*logs, **options)


class _Package(ModuleType):
    """Importing a room sets the attribute of its name, over any function of that name."""

    def __setattr__(self, name: str, value: Any) -> None:
        if name == "identify" and isinstance(value, ModuleType):
            value.__class__ = _CallableRoom
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
