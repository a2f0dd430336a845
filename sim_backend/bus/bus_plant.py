"""The simulated rig behind the emulated bus: RigModel, a step in the order of a bus that runs by
itself, the drive.
"""

from epa_rt.models.plant import advance
from sim_backend.bus.coupling import Coupling
from sim_backend.bus.epos4 import Epos4
from sim_backend.devices import LOST_MASTER_CODE, latch_outputs, sample_inputs
from sim_backend.drive_machine import NO_ACTION
from sim_backend.faults import FaultyRigModel
from sim_backend.input_filter import set_filter
from sim_backend.wiring import RPM

_SETTINGS = (  # field of the wired drive, index, subindex, value of one
    ("lost_master", 0x6007, 0, 1),
    ("quick_stop", 0x605A, 0, 1),
    ("shutdown", 0x605B, 0, 1),
    ("disable", 0x605C, 0, 1),
    ("fault", 0x605E, 0, 1),
    ("deceleration_rad_s2", 0x6084, 0, RPM),
    ("quick_stop_rad_s2", 0x6085, 0, RPM),
    ("homing_method", 0x6098, 0, 1),
    ("home_counts", 0x30B0, 0, 1),
    ("homing_speed_rad_s", 0x6099, 2, RPM),
    ("homing_rad_s2", 0x609A, 0, RPM),
)


class BusPlant(FaultyRigModel):
    """``cycle`` (of RigModel) in lock step; ``step_now`` in real time."""

    def step_now(self, outputs_raw: bytes) -> bytes:
        """Latches outputs that have come since the last step, then advances one period and samples.

        In real time outputs arrive between two steps; so, as in lock step, a command shows one
        cycle later.
        """
        self._outputs[:] = outputs_raw
        latch_outputs(self._outputs_array, self._valves, self._drive, self.machine, self.command)
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
            inputs,
            self._analog.copy(),
            self._drive,
            self.machine.copy(),
            sensors.view("f8"),
            self.t_ns,
        )
        return inputs.tobytes()

    def bind(self, drive: Epos4, coupling: Coupling) -> None:
        """Joins the drive's object dictionary to this plant and to the process image."""
        axis = drive.axis
        axis.model = self
        axis.on_lost = lambda: self._lose_bus(drive)
        axis.on_settings = lambda: self._take_settings(drive)

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
        axis.on_power_up = lambda: self._write_motor_data(drive)
        self._write_motor_data(drive)
        self._take_settings(drive)

    def _lose_bus(self, drive: Epos4) -> None:
        """The drive does what 0x6007 says; where that ends no fault, it says why all the same."""
        was_powered = self.command["enabled"][0] > 0.5
        self.lose_drive_master()
        acts = self._drive["lost_master"][0] != NO_ACTION
        if was_powered and acts and not self.machine["error_code"][0]:
            drive.report(LOST_MASTER_CODE)

    def _write_motor_data(self, drive: Epos4) -> None:
        """The objects that were set up with the motor, which the drive keeps without its supply."""
        parameters = self.params["drive"][0]
        rated_nm = float(self._drive["rated_torque_nm"][0])
        constant = float(parameters["torque_constant_nm_a"])
        for index, subindex, value in (
            (0x6076, 0, rated_nm * 1e6),
            (0x3001, 1, rated_nm / constant * 1e3),
            (0x3001, 2, float(parameters["max_current_a"]) * 1e3),
            (0x3001, 5, constant * 1e6),
        ):
            drive.dictionary.item(index, subindex).value = round(value).to_bytes(4, "little")

    def _take_settings(self, drive: Epos4) -> None:
        """Option codes, ramps and homing as they stand in the drive's objects now."""
        if not self._drive["bus"][0]:
            self._drive["lost_master"] = drive.dictionary.item(0x6007, 0).number
            return
        for field, index, subindex, scale in _SETTINGS:
            self._drive[field] = drive.dictionary.item(index, subindex).number * scale

    def hear_master(self, is_heard: bool) -> None:
        """Do the outputs of a master act on the drive now?"""
        self.machine["is_alone"] = not is_heard

    def filter_terminal(self, number: int, selection: int) -> None:
        """The filter that an EL3004's objects select; ``number`` of the terminal on the bus."""
        rows = self._analog[self._analog["slave"] == number]
        set_filter(rows, selection, self.period_s)
        self._analog[self._analog["slave"] == number] = rows
