"""The one door through which the command line gets a bus."""

from epa_rt.config.rig import Rig

from drivers.backend import EthercatBackend


def open_ethercat(rig: Rig, interface: str | None, lock_step: bool = False) -> EthercatBackend:
    """A backend on this interface (None: the only candidate), not opened yet: ``run`` opens and closes it."""
    return EthercatBackend(rig, interface, lock_step)
