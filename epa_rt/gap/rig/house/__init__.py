"""The Subject of this house's rigs."""

from epa_rt.gap.rig.house.subject import HouseSubject, open_house

__all__ = ["HouseSubject", "open_house"]
