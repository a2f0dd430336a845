"""The simulated rig behind bytes: devices, and the plant behind them. The emulated bus runs the
same code.
"""

import numpy as np

from epa_rt.backend import BackendError
from epa_rt.config.rig import Rig
from epa_rt.config.rig_homing import HomingOptions
from epa_rt.models import plant as nominal_physics
from epa_rt.models.plant_file import PlantFile
from epa_rt.models.ports import COMMAND, SENSORS
from epa_rt.signals.image import image_of
from sim_backend.devices import (
    LOST_MASTER_CODE,
    fail_drive,
    latch_outputs,
    lose_drive_master,
    lose_drive_supply,
    new_machine,
    sample_inputs,
)
from sim_backend.wiring import HOMING_HERE, RPM, wire_analog_inputs, wire_drive, wire_valves


class RigModel:
    """One cycle at a time: the outputs latched before act on the plant for a period, then the
    inputs are sampled, then the new outputs are latched. So a command shows in the sensors one
    cycle later, as on a bus.

    ``physics`` is what moves the plant: a module with ``new_state`` and ``advance`` as
    epa_rt.models.plant has them, and ``plant.params`` whatever those two take (with a record
    ``sensors`` that has the seed). ``referenced``: has the drive been homed? (A drive commanded by
    wires never says so.) ``count_offset``: its counts where the plant's motor angle is zero.
    """

    def __init__(
        self,
        rig: Rig,
        plant: PlantFile,
        seed: int,
        physics=nominal_physics,
        referenced: bool = True,
        count_offset: int = 0,
    ):
        self.period_s = rig.period_s
        self.period_ns = round(rig.period_s * 1e9)
        self.t_ns = 0
        self.params = plant.params.copy()
        self.params["sensors"]["seed"] = seed
        self._advance = physics.advance
        self.state = physics.new_state(self.params)
        self.command, self.sensors = np.zeros(1, COMMAND), np.zeros(1, SENSORS)
        self._substeps = plant.substeps
        self._ports = self.sensors.view("f8")
        self._analog, self._valves, self._drive = (
            wire_analog_inputs(rig),
            wire_valves(rig),
            wire_drive(rig),
        )
        self.machine = new_machine(referenced and bool(self._drive["bus"][0]), count_offset)
        self._inputs = bytearray(image_of(rig, outputs=False).size)
        self._outputs = bytearray(image_of(rig, outputs=True).size)
        self._inputs_array = np.frombuffer(self._inputs, np.uint8)
        self._outputs_array = np.frombuffer(self._outputs, np.uint8)
        latch_outputs(self._outputs_array, self._valves, self._drive, self.machine, self.command)

    def warm_up(self) -> None:
        """Compiles (or loads from the cache) everything a cycle needs, on copies: the rig's state
        stays as it is.
        """
        self._advance(
            self.params,
            self.state.copy(),
            self.command.copy(),
            self.sensors.copy(),
            self.period_s,
            self._substeps,
        )
        sample_inputs(
            self._inputs_array.copy(),
            self._analog.copy(),
            self._drive,
            self.machine.copy(),
            self._ports.copy(),
            0,
        )
        latch_outputs(
            self._outputs_array, self._valves, self._drive, self.machine.copy(), self.command.copy()
        )
        for change in (lose_drive_master, lose_drive_supply):
            change(self._drive, self.machine.copy(), self.command.copy())
        fail_drive(self._drive, self.machine.copy(), self.command.copy(), LOST_MASTER_CODE)

    def cycle(self, outputs_raw: bytes) -> bytes:
        """Advances one period and returns the input image. ``outputs_raw`` must have the image's
        size.

        Raises BackendError where the plant's sensors are no longer finite numbers.
        """
        self._advance(
            self.params, self.state, self.command, self.sensors, self.period_s, self._substeps
        )
        self.t_ns += self.period_ns
        ports = self._ports
        if not sample_inputs(
            self._inputs_array, self._analog, self._drive, self.machine, ports, self.t_ns
        ):
            raise BackendError(
                f"found sensors of the simulated plant that are no numbers {self.t_ns * 1e-9:.3f} s"
                " into the run, expected a plant that stays finite (more sub-steps, or other"
                " parameters)"
            )
        self._outputs[:] = outputs_raw
        latch_outputs(self._outputs_array, self._valves, self._drive, self.machine, self.command)
        return bytes(self._inputs)

    def set_homing(self, options: HomingOptions | None) -> None:
        """The drive's homing objects, as the driver writes them; None: nothing moves."""
        drive = self._drive
        if options is None:
            drive["homing_method"] = HOMING_HERE
            return
        drive["homing_method"], drive["home_counts"] = options.method, options.home_counts
        drive["homing_speed_rad_s"] = options.speed_rpm * RPM
        drive["homing_rad_s2"] = options.acceleration_rpm_s * RPM

    def fail_drive(self, code: int) -> None:
        """The drive falls into its fault state with an error code (0x603F), as 0x605E says."""
        fail_drive(self._drive, self.machine, self.command, code)

    def lose_drive_master(self) -> None:
        """The drive's bus has left OP: it does what 0x6007 says."""
        lose_drive_master(self._drive, self.machine, self.command)

    def lose_drive_supply(self) -> None:
        """The drive has no supply in this cycle: no torque; count and reference are lost."""
        lose_drive_supply(self._drive, self.machine, self.command)
