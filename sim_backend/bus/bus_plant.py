"""The simulated rig behind the emulated bus: RigModel, a step in the order of a bus that runs by
itself, the drive.
"""

from epa_rt.models.plant import advance
from sim_backend.bus.coupling import Coupling
from sim_backend.bus.epos4 import Epos4
from sim_backend.bus.epos4_objects import COMMUNICATION_LOST
from sim_backend.devices import (
    ENABLED,
    FAULT,
    FAULT_REACTION,
    NOT_READY,
    QUICK_STOP,
    STANDSTILL_RAD_S,
    latch_outputs,
    sample_inputs,
)
from sim_backend.faults import FaultyRigModel


class BusPlant(FaultyRigModel):
    """``cycle`` (of RigModel) in lock step; ``step_now`` in real time."""

    def step_now(self, outputs_raw: bytes) -> bytes:
        """Latches outputs that have come since the last step, then advances one period and samples.

        In real time outputs arrive between two steps; so, as in lock step, a command shows one
        cycle later.
        """
        self._outputs[:] = outputs_raw
        speed = self.sensors["motor_speed_rad_s"][0]
        latch_outputs(
            self._outputs_array,
            self._valves,
            self._drive,
            self.machine,
            self.command,
            abs(speed) < STANDSTILL_RAD_S,
        )
        if self.faults:
            self.faults.start_due(self, self.cycle_number)
            self.faults.hold(self)
        advance(self.params, self.state, self.command, self.sensors, self.period_s, self._substeps)
        self.t_ns += self.period_ns
        sample_inputs(
            self._inputs_array, self._analog, self._drive, self.machine, self._ports, self.t_ns
        )
        if not self.faults:
            return bytes(self._inputs)
        inputs = bytearray(self._inputs)
        self.faults.change(inputs)
        return bytes(inputs)

    def present_inputs(self) -> bytes:
        """The input image before the first cycle: one period is run on copies, the rig's state
        stays as it is.
        """
        sensors, inputs = self.sensors.copy(), self._inputs_array.copy()
        advance(
            self.params,
            self.state.copy(),
            self.command.copy(),
            sensors,
            self.period_s,
            self._substeps,
        )
        sample_inputs(
            inputs, self._analog, self._drive, self.machine.copy(), sensors.view("f8"), self.t_ns
        )
        return inputs.tobytes()

    def bind(self, drive: Epos4, coupling: Coupling) -> None:
        """Joins the drive's object dictionary to this plant and to the process image."""
        axis = drive.axis
        axis.model = self
        axis.on_lost = lambda: self.fail_drive(COMMUNICATION_LOST)

        def read_image(index: int, subindex: int) -> bytes | None:
            for outputs in (False, True):
                found = coupling.field(drive.name, index, subindex, outputs)
                if found is not None:
                    image, start, end = found
                    return bytes(image[start:end])
            return None

        def write_image(index: int, subindex: int, data: bytes) -> None:
            found = coupling.field(drive.name, index, subindex, True)
            if found is not None:
                image, start, end = found
                image[start:end] = data

        axis.read_image, axis.write_image = read_image, write_image
        parameters = self.params["drive"][0]
        rated_nm = float(self._drive["rated_torque_nm"][0])
        constant = float(parameters["torque_constant_nm_a"])
        objects = drive.dictionary
        objects.item(0x6076, 0).value = round(rated_nm * 1e6).to_bytes(4, "little")
        objects.item(0x3001, 1).value = round(rated_nm / constant * 1e3).to_bytes(4, "little")
        objects.item(0x3001, 2).value = round(float(parameters["max_current_a"]) * 1e3).to_bytes(
            4, "little"
        )
        objects.item(0x3001, 5).value = round(constant * 1e6).to_bytes(4, "little")

    def fail_drive(self, code: int) -> None:
        """A drive that is on falls into its fault state with an error code (0x603F)."""
        machine = self.machine[0]
        if machine["state"] in (ENABLED, QUICK_STOP):
            machine["state"], machine["error_code"] = (
                (FAULT_REACTION if self._drive["bus"][0] else FAULT),
                code,
            )
            self.command["enabled"] = 0.0

    def switch_drive_off(self) -> None:
        """The drive has no supply: no torque, and it starts from the beginning when the supply
        comes back.
        """
        machine = self.machine[0]
        (
            machine["state"],
            machine["age_cycles"],
            machine["control"],
            machine["error_code"],
            machine["mode"],
        ) = (NOT_READY, 0, 0, 0, 0)
        self.lose_zero()
        self.command["enabled"] = 0.0
