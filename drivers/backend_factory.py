"""The one door through which the command line gets a bus."""

from drivers.backend import EthercatBackend
from drivers.interface import choose
from epa_rt.config.rig import Rig
from epa_rt.config.rig_homing import HomingOptions


def open_ethercat(
    rig: Rig,
    interface: str | None,
    lock_step: bool = False,
    take_over: bool = False,
    homing: HomingOptions | None = None,
) -> EthercatBackend:
    """A backend on this interface (None: the only candidate), not opened yet: ``run`` opens and
    closes it. ``homing``: as the backend takes it.

    Raises BackendError where there is no such interface, no right to it, or ``lock_step`` asked of
    a real wire, before a log is begun.
    """
    return EthercatBackend(rig, choose(interface, lock_step), lock_step, take_over, homing)
