"""The experiments among which the next one is chosen, as files that ``epa run`` takes."""

from epa_rt.config.rig import Rig
from epa_rt.config.rig_rows import si_unit_of
from epa_rt.gap.rig.menu.bench import bench_menu
from epa_rt.gap.rig.menu.knee import knee_menu
from epa_rt.gap.rig.menu.text import Item, joined

__all__ = ["Item", "joined", "menu"]


def menu(rig: Rig) -> tuple[Item, ...]:
    """All experiments of the menu that this rig can run."""
    if rig.joint is not None and si_unit_of(rig.joint.position) == "rad":
        return tuple(knee_menu(rig))
    return tuple(bench_menu(rig))
