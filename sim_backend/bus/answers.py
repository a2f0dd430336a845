"""What the emulated bus answers on its control channel: status, counters, truth."""

from dataclasses import asdict
from typing import Any

from sim_backend.bus import registers as reg
from sim_backend.bus.emulated_bus import EmulatedBus
from sim_backend.devices import (
    ENABLED,
    FAULT,
    FAULT_REACTION,
    NOT_READY,
    QUICK_STOP,
    READY,
    SWITCH_ON_DISABLED,
    SWITCHED_ON,
)
from sim_backend.faults import Fault

_DRIVE_STATES = {
    NOT_READY: "not ready to switch on",
    SWITCH_ON_DISABLED: "switch on disabled",
    READY: "ready to switch on",
    SWITCHED_ON: "switched on",
    ENABLED: "operation enabled",
    QUICK_STOP: "quick stop active",
    FAULT_REACTION: "fault reaction active",
    FAULT: "fault",
}


def status(bus: EmulatedBus) -> dict[str, Any]:
    """States of all slaves and the counters."""
    slaves = {
        name: {
            "present": slave.is_present,
            "state": reg.STATE_NAMES[slave.al.state],
            "error": slave.al.has_error,
            "al_status_code": slave.al.code,
            "watchdog_expired": slave.watchdog.expired,
            "station_address": slave.station_address,
        }
        for name, slave in bus.slaves.items()
    }
    return {
        "rig": bus.rig.name,
        "mode": "lock step" if bus.lock_step else "real time",
        "cycle": bus.cycle,
        "is_running": bus.is_running,
        "slaves": slaves,
        "counters": asdict(bus.counters),
    }


def truth(bus: EmulatedBus) -> dict[str, Any]:
    """The plant as it is: what acts on it and what it does, noise-free, in SI."""
    plant = bus.plant
    command, state, machine = plant.command[0], plant.state[0], plant.machine[0]
    inner = state["truth"]
    return {
        "cycle": bus.cycle,
        "t_s": plant.t_ns * 1e-9,
        "drive_state": _DRIVE_STATES[int(machine["state"])],
        "drive_enabled": bool(command["enabled"] > 0.5),
        "drive_mode": int(command["mode"]),
        "drive_error_code": int(machine["error_code"]),
        "drive_is_referenced": bool(machine["is_referenced"]),
        "drive_count_offset": int(machine["offset_counts"]),
        "inlet_open": [float(x) for x in command["inlet"]],
        "exhaust_open": [float(x) for x in command["exhaust"]],
        "pressure_pa": [float(x) for x in inner["pressure_pa"]],
        "supply_pa": float(inner["supply_pa"]),
        "motor_torque_nm": float(inner["motor_torque_nm"]),
        "motor_current_a": float(inner["motor_current_a"]),
        "motor_angle_rad": float(inner["motor_angle_rad"]),
        "motor_speed_rad_s": float(inner["motor_speed_rad_s"]),
        "travel_m": float(inner["travel_m"]),
        "muscle_force_n": [float(x) for x in inner["muscle_force_n"]],
        "load_position_m": float(inner["load_position_m"]),
        "joint_angle_rad": float(inner["joint_angle_rad"]),
        "outputs_raw": bytes(bus.coupling.outputs).hex(),
        "inputs_raw": bytes(bus.coupling.inputs).hex(),
    }


def fault(one: Fault) -> dict[str, Any]:
    """A fault at work or to come."""
    return {
        "kind": one.kind,
        "where": one.where,
        "value": one.value,
        "at_cycle": one.at_cycle,
        "cycles": one.cycles,
        **one.options,
    }
