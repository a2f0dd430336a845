"""Every terminal that is known, one file each. A new file is found by itself: it sets TERMINAL."""

from importlib import import_module
from pkgutil import iter_modules

from epa_rt.config.terminal import Device

TERMINALS: dict[str, Device] = {}


def register(terminal: Device) -> None:
    """Makes a terminal known. Raises ValueError for a name or an identity that is taken."""
    for other in TERMINALS.values():
        if other.name == terminal.name:
            raise ValueError(f"found a second terminal {terminal.name!r}, expected each name once")
        if other.vendor == terminal.vendor and set(other.products) & set(terminal.products):
            raise ValueError(
                f"found the product of {other.name} again in {terminal.name}, expected its own"
            )
    TERMINALS[terminal.name] = terminal


for _found in sorted(module.name for module in iter_modules(__path__)):
    register(import_module(f"{__name__}.{_found}").TERMINAL)
