"""Calibrate a force, pressure or joint reading, and write the file that the rig includes.

force: masses are hung on the cell by hand, drive and air off. With --by motor the motor pulls
muscle and a reference cell from place to place. pressure: the rig fills a muscle in steps, the
motor held, and asks for the reference gauge's reading. joint: a jig sets the angle, drive and air
off. References are typed with their unit ('49.05 N', '5.000 kg', '200 kPa abs', '30 deg').

The result is a file with gain, zero and their uncertainty. Name it in the rig file:
  calibrations: [bench.calibration.yaml]
On the simulated rig it goes into the folder of the logs, never beside the rig file.

  epa calibrate force --rig config/rigs/bench.yaml -o out --speed 1
  epa calibrate force --rig config/rigs/bench.yaml -o out --points config/calibrations/masses.yaml
  epa calibrate pressure --rig config/rigs/bench.yaml -o out --html pressure.html
  epa calibrate pressure --rig config/rigs/bench.yaml --backend ethercat --interface eth1
  epa calibrate force --rig config/rigs/bench.yaml --from out/calibrate_force-bench-001.mcap
"""

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.by_hand import RigByHand, add_rig_arguments
from epa_rt.cli.exits import COMPLETED, VerbError
from epa_rt.cli.inputs import add_supply_argument
from epa_rt.cli.outputs import add_html_argument, add_json_argument, add_old_spelling, is_screen
from epa_rt.cli.run import EMULATED
from epa_rt.cli.screen_text import filled

if TYPE_CHECKING:
    from epa_rt.calibrate.calibration import Calibration, Common
    from epa_rt.calibrate.point import Point
    from epa_rt.calibrate.reference import Reader
    from epa_rt.calibrate.refusals import Scale
    from epa_rt.config.calibration_file import SignalCalibration
    from epa_rt.config.rig import Rig
    from epa_rt.config.rig_rows import SignalRow

KINDS = ("force", "pressure", "joint")


def add_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("kind", choices=KINDS, help="what is calibrated")
    add_rig_arguments(verb)
    verb.add_argument("--signal", help="row of the rig file (default: the only one of its kind)")
    verb.add_argument("--points", type=Path, metavar="FILE", help="references: YAML or CSV")
    verb.add_argument(
        "--from", dest="taken", type=Path, metavar="LOG", help="a log or table already taken"
    )
    verb.add_argument(
        "--reference-signal", metavar="NAME", help="the log's signal that is the reference"
    )
    verb.add_argument("--leave-out", metavar="LIST", help="points not to use, by number: '3, 4'")
    verb.add_argument("--by", choices=("hand", "motor"), default="hand", help="how force is made")
    verb.add_argument("--travels", metavar="LIST", help="--by motor: '0 mm, 5 mm, 10 mm'")
    verb.add_argument("--pressure", metavar="PRESSURE", help="--by motor: in the muscle, gauge")
    add_supply_argument(verb)
    verb.add_argument("--steps", metavar="LIST", help="pressures: '0 kPa, 200 kPa, 400 kPa'")
    verb.add_argument("--ascending", action="store_true", help="points from low to high")
    verb.add_argument("--descending", action="store_true", help="from high to low; both: up, down")
    verb.add_argument("--record", metavar="TIME", default="2 s", help="of each point")
    verb.add_argument("--settle", metavar="TIME", default="1 s", help="before each record")
    add_uncertainty_arguments(verb)
    verb.add_argument("--serial", default="", help="the sensor's serial number")
    verb.add_argument("--new-sensor", action="store_true", help="do not compare with the rig file")
    verb.add_argument(
        "--write",
        dest="file",
        type=Path,
        metavar="CALIBRATION.yaml",
        help="calibration file to write (default: beside the rig file; simulated: with the logs)",
    )
    add_old_spelling(verb, "--file", now="--write", dest="file")
    add_html_argument(verb, "write the result as a page with pictures")
    verb.add_argument(
        "--picture", type=Path, metavar="PICTURE.svg", help="write points and residuals alone"
    )
    add_json_argument(verb, "the result for machines")


def add_uncertainty_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument(
        "--reference-uncertainty",
        metavar="U",
        help="standard, of each reference by itself (default: its last digit)",
    )
    verb.add_argument(
        "--scale-uncertainty", metavar="U", default="0 %", help="standard, common to all references"
    )
    verb.add_argument(
        "--zero-uncertainty", metavar="U", help="standard, of the references' common zero"
    )
    verb.add_argument("--gravity", metavar="G", help="for masses, as '9.8123 m/s^2'")


def main(arguments: argparse.Namespace) -> int:
    from epa_rt.calibrate.calibration import as_file, calibrate
    from epa_rt.calibrate.point import CalibrationError
    from epa_rt.cli.calibration_told import replaced_words, told
    from epa_rt.cli.write import check_writable, write_whole
    from epa_rt.cli.zero import now, who

    for name in ("operator", "serial"):
        text = getattr(arguments, name) or ""
        if len(text) > 200 or not text.isprintable():
            raise VerbError(
                f"--{name}: found {text[:40]!r}, expected one line of up to 200 letters"
            )
    check_writable(arguments.html, (".html", ".htm"))
    check_writable(arguments.picture, (".svg",))
    check_writable(arguments.json, (".json",))
    check_writable(arguments.file, (".yaml", ".yml"))
    session = Session(arguments)
    path, former = _place(arguments, session)  # before a point is taken in vain
    try:
        points, source, code = session.points()
        if code != COMPLETED:
            print("no calibration was written; --from takes the points that the log holds")
            return code
        points = _left(points, arguments.leave_out)
        found = calibrate(points, session.scale, session.common, arguments.new_sensor)
    except CalibrationError as error:
        raise VerbError(f"{session.row.name}: {error}") from None
    operator = who() if arguments.operator is None else arguments.operator
    one = as_file(
        found,
        arguments.kind,
        session.row.entry,
        source,
        now(),
        operator,
        arguments.serial,
        session.method,
    )
    replaced = next((each for each in former if each.signal == one.signal), None)
    others = tuple(each for each in former if each is not replaced)
    _write(path, session, (*others, one))
    if arguments.json:
        write_whole(arguments.json, json.dumps(told(found, one, path, replaced), indent=2) + "\n")
    if not is_screen(arguments.json):
        _print(found, one, session.rig, arguments.rig, path)
        if replaced is not None:
            print(filled(replaced_words(replaced, one)))
    _write_pages(arguments, found, one)
    return COMPLETED


def _left(points: "list[Point]", leave_out: str | None) -> "list[Point]":
    """The points without those whose numbers are left out. Raises VerbError."""
    if leave_out is None:
        return points
    try:
        numbers = {int(part) for part in leave_out.split(",")}
    except ValueError:
        numbers = set()
    if not numbers or not numbers <= set(range(1, len(points) + 1)):
        raise VerbError(
            f"--leave-out: found '{leave_out[:40]}', expected numbers of points, 1 to {len(points)}"
        )
    return [point for i, point in enumerate(points, 1) if i not in numbers]


class Session:
    """One calibration: the rig, its reading, how references are read. Raises VerbError, ConfigError
    for what is asked in vain.
    """

    def __init__(self, arguments: argparse.Namespace):
        from epa_rt.calibrate.readings import NoReading, chosen_row, scale_of

        self.arguments = arguments
        if arguments.taken is None:
            self.by_hand: RigByHand | None = _by_hand(arguments)
            self.rig: Rig = self.by_hand.rig
        else:
            self.by_hand, self.rig = None, _rig(arguments)
        try:
            self.row: SignalRow = chosen_row(self.rig, arguments.kind, arguments.signal)
        except NoReading as error:
            raise VerbError(str(error)) from None
        self.scale: Scale = scale_of(self.rig, self.row)
        self.reader: Reader = self._reader()
        self.used_mass = False
        self.record_s = _quantity(arguments, "record", "s", 0.05, 600.0)
        self.settle_s = _quantity(arguments, "settle", "s", 0.0, 600.0)
        self._scale_u = _quantity(arguments, "scale_uncertainty", "1", 0.0, 0.5)
        self._zero_u = _quantity(arguments, "zero_uncertainty", self.row.si_unit, 0.0, 1e9)
        self.method, self._source = "", "log"

    def _reader(self) -> "Reader":
        from epa_rt.calibrate.reference import STANDARD_GRAVITY, reader_of

        arguments = self.arguments
        gravity = (
            STANDARD_GRAVITY
            if arguments.gravity is None
            else _quantity(arguments, "gravity", "m/s^2", 9.7, 9.9)
        )
        given = arguments.reference_uncertainty is not None
        u = (
            _quantity(arguments, "reference_uncertainty", self.row.si_unit, 0.0, 1e9)
            if given
            else None
        )
        return reader_of(self.rig, self.row.name, gravity, u)

    @property
    def common(self) -> "Common":
        """What all references share; of masses, gravity where nobody says it."""
        import math

        from epa_rt.calibrate.calibration import Common
        from epa_rt.calibrate.reference import UNKNOWN_GRAVITY_U

        unknown = self.used_mass and self.arguments.gravity is None
        scale = math.hypot(self._scale_u, UNKNOWN_GRAVITY_U if unknown else 0.0)
        return Common(scale, self._zero_u)

    def points(self) -> "tuple[list[Point], str, int]":
        """The points, where they come from, and the exit code of taking them."""
        if self.by_hand is None:
            points = self._taken()
            return points, self._source, COMPLETED
        from epa_rt.cli.calibrate_rig import take_points

        points, code = take_points(self, self.by_hand)
        return points, "rig" if self.by_hand.is_real else "simulation", code

    def _taken(self) -> "list[Point]":
        from epa_rt.calibrate.points_file import read_taken

        path = self.arguments.taken
        self.method = f"from {path.name}"
        if path.suffix.lower() == ".mcap":
            return self._of_log(path)
        points, self.used_mass = read_taken(path, self.reader, self.scale.native, self.scale.step)
        return points

    def _of_log(self, path: Path) -> "list[Point]":
        from epa_rt.calibrate.from_log import points_of_log
        from epa_rt.calibrate.readings import scale_of
        from epa_rt.config.rig import rig_from
        from epa_rt.config.source import parse_yaml
        from epa_rt.logs.reader import LogError, LogReader

        try:
            with LogReader(path) as log:
                text = log.attachments.get("rig.yaml", b"").decode("utf-8", "replace")
                run = log.metadata.get("run", {})
                if run.get("backend") == "sim" or EMULATED.items() <= run.items():
                    self._source = "simulation"
            rig = rig_from(parse_yaml(text, f"{path}[rig.yaml]"))
            if rig.name != self.rig.name or self.row.name not in {r.name for r in rig.inputs}:
                raise VerbError(
                    f"{path}: found a log of the rig '{rig.name}', expected one of"
                    f" '{self.rig.name}' with {self.row.name}"
                )
            reference = self.arguments.reference_signal
            if reference is not None and reference not in {r.name for r in rig.inputs}:
                raise VerbError(
                    f"found --reference-signal {reference}, expected a signal of the log"
                )
            if reference is not None and rig.row(reference).si_unit != self.row.si_unit:
                raise VerbError(
                    f"found --reference-signal {reference}, expected one in {self.row.si_unit}"
                )
            row = rig.row(self.row.name)
            points, self.used_mass = points_of_log(
                path, rig, row, scale_of(rig, row), reference, self.reader.uncertainty,
                self.record_s,
            )  # fmt: skip
        except LogError as error:
            raise VerbError(str(error)) from None
        return points


def _rig(arguments: argparse.Namespace) -> "Rig":
    from epa_rt.cli.sound_rig import sound_rig
    from epa_rt.config.source import load_yaml

    return sound_rig(load_yaml(arguments.rig)).rig


def _by_hand(arguments: argparse.Namespace) -> RigByHand:
    from epa_rt.calibrate.readings import NoReading, chosen_row

    is_sim = arguments.backend == "sim"
    if not is_sim:
        return RigByHand(arguments, with_zero=True)
    try:
        port = chosen_row(_rig(arguments), arguments.kind, arguments.signal).port
    except NoReading as error:
        raise VerbError(str(error)) from None
    if port is None:
        raise VerbError(
            f"{arguments.rig}: found a {arguments.kind} reading without a port, which"
            " the simulation cannot move, expected one with a port"
        )
    from sim_backend.reference_standard import ReferenceStandard

    standard = ReferenceStandard(port)
    return RigByHand(arguments, with_zero=False, standard=standard)


def _quantity(
    arguments: argparse.Namespace, name: str, si_unit: str, low: float, high: float
) -> float:
    """The value of an option with its unit; 0 where it was not given. Raises VerbError."""
    from epa_rt.config.fields import bounded
    from epa_rt.config.units import UnitError, parse_quantity

    text = getattr(arguments, name)
    if text is None:
        return 0.0
    try:
        return bounded(parse_quantity(text, si_unit), si_unit, low, high, text)
    except UnitError as error:
        raise VerbError(f"--{name.replace('_', '-')}: {error}") from None


def _place(
    arguments: argparse.Namespace, session: Session
) -> "tuple[Path, tuple[SignalCalibration, ...]]":
    """The calibration file, and what it holds until now. Raises ConfigError, VerbError where
    it is no such file or cannot be written.
    """
    from epa_rt.cli.write import check_writable
    from epa_rt.config.calibration_file import calibration_path, read_calibrations

    beside = calibration_path(arguments.rig)
    on_rig = session.by_hand is not None and session.by_hand.is_real
    path = arguments.file or (beside if on_rig else arguments.out / beside.name)
    check_writable(path, (".yaml", ".yml"))
    if not path.exists():
        return path, ()
    _, before = read_calibrations(path, session.rig.name)
    return path, before.signals


def _write(path: Path, session: Session, signals: "tuple[SignalCalibration, ...]") -> None:
    """Writes the calibration file. Raises VerbError."""
    from epa_rt.cli.write import cannot_write
    from epa_rt.config.calibration_file import CalibrationFile, write_calibrations

    file = CalibrationFile(calibration_of=session.rig.name, signals=signals)
    try:
        write_calibrations(path, file)
    except OSError as error:
        raise cannot_write(path, error) from None


def _print(
    found: "Calibration", one: "SignalCalibration", rig: "Rig", rig_path: Path, path: Path
) -> None:
    from epa_rt.cli.calibration_told import lines

    for line in lines(found, one):
        print(line)
    print(filled(f"calibration file: {path}"))
    if path.resolve().parent != rig_path.resolve().parent:  # a simulated rig's, or --write
        named = f"calibrations: [{path.name}]"
        said = f"{rig_path} reads only files beside itself: copy it there, with {named}"
        if one.source == "simulation":
            print(filled("it is of a simulated sensor: a run on a real rig refuses it"))
            said = f"for simulated runs copy it beside {rig_path}, and name it there: {named}"
        print(filled(said))
    elif path.name not in {Path(name).name for name in rig.calibrations}:
        print(filled(f"{rig_path} does not name it yet: calibrations: [{path.name}]"))


def _write_pages(
    arguments: argparse.Namespace, found: "Calibration", one: "SignalCalibration"
) -> None:
    from epa_rt.cli.write import write_whole

    if arguments.html is not None:
        from epa_rt.calibrate.page import calibration_page

        write_whole(arguments.html, calibration_page(found, one))
        print(str(arguments.html))
    if arguments.picture is not None:
        from epa_rt.calibrate.picture import calibration_picture

        write_whole(arguments.picture, calibration_picture(found, one))
        print(str(arguments.picture))
