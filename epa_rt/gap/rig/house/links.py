"""Which links a rig has: every block whose inputs and output its rows measure."""

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.gap.rig.house.channels import Channel
from epa_rt.gap.subject import Link
from epa_rt.models.blocks.load import FIXED, KNEE


def links_of(rig: Rig, channels: dict[str, Channel], params: np.ndarray) -> tuple[Link, ...]:
    """The links of a rig, along the chain."""
    kind = params["load"]["kind_code"][0]
    place = {FIXED: None, KNEE: "joint_angle_rad"}.get(float(kind), "load_position_m")
    has = {port: channel.column for port, channel in channels.items()}
    moves = {"motor_angle_rad", "motor_speed_rad_s"} <= has.keys() and (
        place is None or place in has
    )
    found = []
    if moves and "motor_current_a" in has:
        found.append(
            Link(
                "drive",
                "drive",
                has["motor_current_a"],
                "A",
                "commands and motor motion to current",
            )
        )
        if "force_n" in has:
            found.append(
                Link(
                    "motor",
                    "drive",
                    has["motor_current_a"],
                    "A",
                    "motor motion and force to current",
                )
            )
        if {"force_n", "motor_torque_nm"} <= has.keys():
            found.append(
                Link(
                    "torque",
                    "drive",
                    has["motor_torque_nm"],
                    "N*m",
                    "motor motion, force and current to torque",
                )
            )
    for i in (0, 1):
        port = f"muscle{i}_gauge_pa"
        if moves and port in has and params["muscle"]["present"][0, i] > 0.5:
            found.append(Link(f"gas{i}", "gas", has[port], "Pa", "valves and length to pressure"))
    if moves and {"force_n", "muscle0_gauge_pa"} <= has.keys():
        found.append(
            Link("muscle0", "muscle", has["force_n"], "N", "pressure, length and speed to force")
        )
    if (
        place in has
        and "force_n" in has
        and (params["muscle"]["present"][0, 1] < 0.5 or "muscle1_gauge_pa" in has)
    ):
        unit = "rad/s^2" if kind == KNEE else "m/s^2"
        found.append(
            Link("load", "load", has[place], unit, "muscle forces to the load's acceleration")
        )
    if moves:
        found.append(
            Link(
                "encoder",
                "sensors",
                has["motor_speed_rad_s"],
                "rad/s",
                "slope of the motor angle to its speed reading",
            )
        )
    return tuple(found)
