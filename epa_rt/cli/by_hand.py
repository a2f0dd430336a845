"""What epa home and epa jog share: files, backend, and runs one after the other on one rig."""

import argparse
import dataclasses
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.calibration_age import refuse_simulated
from epa_rt.cli.exits import FAILED, VerbError
from epa_rt.cli.inputs import (
    PLANT,
    RIG,
    VERSION,
    Inputs,
    add_backend_arguments,
    add_simulation_arguments,
    code_version,
    load_plant_of,
)
from epa_rt.cli.progress import said_when_slow
from epa_rt.cli.run import EMULATED, run_recorded
from epa_rt.cli.run_record import add_record_arguments, record_attachment
from epa_rt.cli.sound_rig import sound_rig
from epa_rt.cli.zero import is_emulated, keep_end, load_rig_source

if TYPE_CHECKING:
    from epa_rt.backend import Backend
    from epa_rt.config.rig_homing import HomingOptions
    from epa_rt.logs.recorder import LogSummary
    from epa_rt.loop.assembly import Assembly
    from epa_rt.loop.requests import OperatorRequests
    from epa_rt.loop.run import RunResult
    from epa_rt.signals.codec import Decoder
    from sim_backend.reference_standard import ReferenceStandard
    from sim_backend.rig_model import RigModel


def add_rig_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("--rig", type=Path, required=True, help="rig file (config/rigs/*.yaml)")
    verb.add_argument(
        "--plant",
        type=Path,
        help="plant file of the simulated rig (default: the one the rig names)",
    )
    add_backend_arguments(verb)
    verb.add_argument(
        "-o", "--out", type=Path, default=Path("out"), help="folder for logs (default: %(default)s)"
    )
    add_simulation_arguments(verb)
    verb.add_argument(
        "--start-travel",
        metavar="LENGTH",
        help="where the simulated motor stands at the start, such as '40 mm'",
    )
    verb.add_argument(
        "--unreferenced", action="store_true", help="the simulated drive has lost its zero"
    )
    verb.add_argument("--quiet", action="store_true", help="no progress line")
    add_record_arguments(verb)


class RigByHand:
    """One rig and its backend, over several runs. Raises ConfigError and VerbError."""

    def __init__(
        self,
        arguments: argparse.Namespace,
        with_zero: bool,
        standard: "ReferenceStandard | None" = None,
    ):
        self.is_sim = arguments.backend == "sim"
        self.standard = standard  # of a simulated rig: what is applied to a sensor
        self._physics = {} if standard is None else {"physics": standard}
        self.arguments = arguments
        self._refuse_of_simulation_only()
        self.is_emulated = is_emulated(arguments)
        source, self.rig = load_rig_source(
            arguments.rig, with_zero and not self.is_sim, self.is_emulated
        )
        if self.is_real:
            refuse_simulated(self.rig)
        self.unprotected = sound_rig(source).unprotected
        for sentence in self.unprotected:
            print(f"UNPROTECTED: {sentence}", file=sys.stderr)
        self.attachments = {
            RIG: source.text.encode(),
            VERSION: json.dumps(code_version(), sort_keys=True).encode(),
        }
        self._plant = None
        self._model: RigModel | None = None
        if self.is_sim:
            plant_source, plant = load_plant_of(arguments.rig, self.rig, arguments.plant)
            self.attachments[PLANT] = plant_source.text.encode()
            if arguments.start_travel is not None:
                plant = dataclasses.replace(plant, params=plant.params.copy())
                plant.params["load"]["start_travel_m"] = _start(arguments.start_travel)
            self._plant = plant

    @property
    def is_real(self) -> bool:
        """Whether it is neither simulated nor emulated: what is found holds for the rig itself."""
        return not (self.is_sim or self.is_emulated)

    def keep_end(
        self,
        decoder: "Decoder",
        summary: "LogSummary",
        result: "RunResult",
        found_zero: bool | None,
    ) -> None:
        """As ``zero.keep_end``; a simulated rig keeps no end. Raises VerbError."""
        if not self.is_sim:
            path, emulated = self.arguments.rig, self.is_emulated
            keep_end(self.rig, path, decoder, summary, result, found_zero, emulated)

    def attached(self) -> dict[str, bytes]:
        """The attachments of a log that starts now."""
        said = self.arguments
        return self.attachments | record_attachment(self.rig, said.rig, said.operator, said.note)

    def _refuse_of_simulation_only(self) -> None:
        """Raises VerbError for what only a simulated rig can be told to be."""
        for option in ("unreferenced", "start_travel"):
            if not self.is_sim and getattr(self.arguments, option):
                raise VerbError(
                    f"found --{option.replace('_', '-')} beside --backend ethercat, expected it of"
                    " the simulated rig only (an emulated bus is told so by epa bus run)"
                )

    def run(
        self, assembly: "Assembly", requests: "OperatorRequests | None" = None, line: bool = True
    ) -> "tuple[LogSummary, RunResult]":
        """One recorded run, on the rig as the last one left it."""
        arguments = self.arguments
        experiment = assembly.experiment
        inputs = Inputs(self.rig, experiment, self._plant, self.attached(), self.unprotected)
        paced = arguments.speed is not None if self.is_sim else not arguments.lock_step
        facts = self.facts(experiment.name, paced)
        progress = line and not arguments.quiet
        backend = self.backend(assembly.homing)
        return run_recorded(
            inputs, backend, arguments.out, facts, paced, progress, assembly, requests
        )

    def facts(self, name: str, paced: bool) -> dict[str, str]:
        """What the log's metadata say of the run."""
        arguments = self.arguments
        facts = {
            "rig": self.rig.name,
            "experiment": name,
            "backend": arguments.backend,
            "speed": f"{arguments.speed or 1:g}" if paced else "unpaced",
            "period_s": f"{self.rig.period_s:g}",
        }
        if self.is_sim and arguments.start_travel is not None:
            facts["start_travel"] = arguments.start_travel
        if self.is_emulated:
            facts |= EMULATED
        return facts

    def backend(self, homing: "HomingOptions | None" = None) -> "Backend":
        """The rig's backend, not yet open; a simulated rig is as the last run left it. ``homing``:
        what the drive's own homing is set to; None: to one that moves nothing.
        """
        if not self.is_sim:
            from drivers.backend_factory import open_ethercat
            from epa_rt.backend import BackendError

            try:
                given = self.arguments
                return open_ethercat(
                    self.rig, given.interface, given.lock_step, given.take_over, homing
                )
            except BackendError as error:
                raise VerbError(str(error), FAILED) from None
        from sim_backend.backend import SimBackend

        assert self._plant is not None
        backend = SimBackend(
            self.rig,
            self._plant,
            self.arguments.seed,
            self.arguments.speed,
            referenced=not self.arguments.unreferenced,
            model=self._model,
            homing=homing,
            **self._physics,
        )
        if self._model is None:
            self._model = backend.model
            with said_when_slow("loading the plant; compiled the first time, a minute or two ..."):
                self._model.warm_up()
        return backend


def _start(text: str) -> float:
    from epa_rt.config.units import UnitError, parse_quantity

    try:
        return parse_quantity(text, "m")
    except UnitError as error:
        raise VerbError(f"--start-travel: {error}") from None
