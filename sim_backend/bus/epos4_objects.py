"""Objects of the EPOS4's axis: CiA 402 objects and configuration, live out of the plant where they
move.

Source: maxon EPOS4 firmware specification, object dictionary. Values that the plant does not model
are stored and read back, no more; docs/emulated-bus.md lists which.
"""

import math
from collections.abc import Callable

from sim_backend.bus import dictionary as od
from sim_backend.devices import position_counts, status_word

DEFAULT_MAPPING = {
    0x1600: ((0x6040, 0, 16), (0x607A, 0, 32)),
    0x1A00: ((0x6041, 0, 16), (0x6064, 0, 32)),
}
_RX, _TX, _W = od.READ | od.WRITE | od.RX_PDO, od.READ | od.TX_PDO, od.READ | od.WRITE
_OPERATING_MODES = (1, 3, 6, 8, 9, 10)

# objects that move with the plant: index, subindex, name, type
_LIVE = (
    (0x6041, 0, "Statusword", od.UINT16),
    (0x6061, 0, "Modes of operation display", od.INT8),
    (0x603F, 0, "Error code", od.UINT16),
    (0x6064, 0, "Position actual value", od.INT32),
    (0x606C, 0, "Velocity actual value", od.INT32),
    (0x6077, 0, "Torque actual value", od.INT16),
    (0x6062, 0, "Position demand value", od.INT32),
    (0x60F4, 0, "Following error actual value", od.INT32),
)
_TARGETS = (
    (0x6040, "Controlword", od.UINT16),
    (0x607A, "Target position", od.INT32),
    (0x60FF, "Target velocity", od.INT32),
    (0x6071, "Target torque", od.INT16),
    (0x60B0, "Position offset", od.INT32),
    (0x60B1, "Velocity offset", od.INT32),
    (0x60B2, "Torque offset", od.INT16),
    (0x60FE, "Digital outputs", od.UINT32),
)
# they act: sim_backend/drive_machine.py, drive_motion.py. The last column: what they may be
_SETTINGS = (  # index, name, type, value at power-up
    (0x6007, "Abort connection option code", od.INT16, 3, (0, 1, 2, 3)),
    (0x605A, "Quick stop option code", od.INT16, 6, (2, 6)),
    (0x605B, "Shutdown option code", od.INT16, 0, (0, 1)),
    (0x605C, "Disable operation option code", od.INT16, 1, (0, 1)),
    (0x605D, "Halt option code", od.INT16, 1, (1, 2)),
    (0x605E, "Fault reaction option code", od.INT16, 2, (0, 1, 2)),
    (0x6084, "Profile deceleration", od.UINT32, 10_000, None),
    (0x6085, "Quick stop deceleration", od.UINT32, 10_000, None),
    (
        0x6098,
        "Homing method",
        od.INT8,
        7,
        (-4, -3, -2, -1, 0, 1, 2, 7, 11, 17, 18, 23, 27, 33, 34, 37),
    ),
    (0x609A, "Homing acceleration", od.UINT32, 1000, None),
    (0x30B0, "Home position", od.INT32, 0, None),
)
_STORED = (  # index, name, type, value
    (0x6065, "Following error window", od.UINT32, 2000),
    (0x6067, "Position window", od.UINT32, 0xFFFFFFFF),
    (0x607F, "Max profile velocity", od.UINT32, 50_000),
    (0x6080, "Max motor speed", od.UINT32, 50_000),
    (0x6081, "Profile velocity", od.UINT32, 1000),
    (0x6083, "Profile acceleration", od.UINT32, 10_000),
    (0x60C5, "Max acceleration", od.UINT32, 0xFFFFFFFF),
    (0x6072, "Max torque", od.UINT16, 0xFFFF),
    (0x60A9, "SI unit velocity", od.UINT32, 0x00B44700),
    (0x30B1, "Home offset move distance", od.INT32, 0),
    (0x30B2, "Current threshold for homing", od.UINT16, 500),
)


class Axis:
    """The live side of the drive. ``model`` (a RigModel) and the two images are bound by the
    bus.
    """

    def __init__(self):
        self.model = None
        self.read_image: Callable[[int, int], bytes | None] = lambda index, subindex: None
        self.write_image: Callable[[int, int, bytes], None] = lambda index, subindex, data: None
        self.on_lost: Callable[[], None] = lambda: None
        self.on_settings: Callable[[], None] = lambda: None
        self.on_power_up: Callable[[], None] = lambda: None

    def bus_lost(self) -> None:
        """The bus has left OP: the drive does what 0x6007 says."""
        self.on_lost()

    def power_up(self) -> None:
        for item, value in self._defaults:
            item.value = value
        self.on_power_up()
        self.on_settings()

    def remember_defaults(self, items: list[od.Item]) -> None:
        self._defaults = [(item, item.value) for item in items]

    def live(self, index: int, subindex: int, size: int) -> bytes:
        """An object that moves, from the process image where it is there, else from the plant's
        sensors.
        """
        found = self.read_image(index, subindex)
        value = 0 if found is not None or self.model is None else self._value(index)
        return (
            found if found is not None else (value & ((1 << 8 * size) - 1)).to_bytes(size, "little")
        )

    def _value(self, index: int) -> int:
        model = self.model
        machine, sensors, drive = model.machine[0], model.sensors[0], model._drive[0]
        if index == 0x6041:
            return int(status_word(machine))
        if index == 0x6061:
            return int(machine["mode"])
        if index == 0x603F:
            return int(machine["error_code"])
        if index in (0x6064, 0x6062):
            return int(position_counts(drive, machine, sensors["motor_angle_rad"]))
        if index == 0x606C:
            return math.floor(sensors["motor_speed_rad_s"] * 60.0 / (2.0 * math.pi) + 0.5)
        if index == 0x6077:
            return math.floor(sensors["motor_torque_nm"] / drive["rated_torque_nm"] * 1e3 + 0.5)
        if index == 0x30D1:
            return math.floor(sensors["motor_current_a"] * 1e3 + 0.5)
        return 0


def add_axis_objects(dictionary: od.Dictionary) -> Axis:
    """All objects of the axis, with neutral values; the bus fills in motor data and binds the
    plant.
    """
    axis = Axis()
    for index, subindex, name, data_type in _LIVE:
        size = od.BITS[data_type] // 8
        dictionary.variable(
            index, od.number(name, data_type, access=_TX, read=_reader(axis, index, subindex, size))
        )
    dictionary.record(
        0x30D1,
        "Current actual values",
        {
            1: od.number(
                "Current actual value averaged",
                od.INT32,
                access=_TX,
                read=_reader(axis, 0x30D1, 1, 4),
            ),
            2: od.number(
                "Current actual value", od.INT32, access=_TX, read=_reader(axis, 0x30D1, 2, 4)
            ),
        },
    )
    for index, name, data_type in _TARGETS:
        _add_target(dictionary, axis, index, name, data_type)
    _add_target(dictionary, axis, 0x6060, "Modes of operation", od.INT8, _check_mode)
    for index, name, data_type, value in _STORED:
        dictionary.variable(index, od.number(name, data_type, value, _W))
    _add_settings(dictionary, axis)
    dictionary.objects[0x6065].items[0].access |= od.RX_PDO
    dictionary.variable(0x6076, od.number("Motor rated torque", od.UINT32))
    dictionary.variable(
        0x1001,
        od.number(
            "Error register",
            od.UINT8,
            access=_TX,
            read=lambda: bytes([int(axis.live(0x603F, 0, 2) != b"\0\0")]),
        ),
    )
    dictionary.record(
        0x60C2,
        "Interpolation time period",
        {
            1: od.number("Interpolation time period value", od.UINT8, 1, _W),
            2: od.number("Interpolation time index", od.INT8, -3, _W),
        },
    )
    dictionary.record(
        0x3000,
        "Axis configuration",
        {
            1: od.number("Sensors configuration", od.UINT32, 0x00000001, _W),
            2: od.number("Control structure", od.UINT32, 0x00011121, _W),
            3: od.number("Commutation sensors", od.UINT32, 0x00000031, _W),
            4: od.number("Axis configuration miscellaneous", od.UINT32, 0, _W),
            5: od.number("Main sensor resolution", od.UINT32, 4096),
            6: od.number("Max system speed", od.UINT32, 50_000),
        },
    )
    dictionary.record(
        0x3001,
        "Motor data",
        {
            1: od.number("Nominal current", od.UINT32, 0, _W),
            2: od.number("Output current limit", od.UINT32, 0, _W),
            3: od.number("Number of pole pairs", od.UINT8, 1, _W),
            4: od.number("Thermal time constant winding", od.UINT16, 40, _W),
            5: od.number("Torque constant", od.UINT32, 0, _W),
        },
    )
    dictionary.record(
        0x3010,
        "Digital incremental encoder 1",
        {
            1: od.number("Number of pulses", od.UINT32, 1024, _W),
            2: od.number("Type", od.UINT16, 1, _W),
        },
    )
    axis.remember_defaults(
        [
            item
            for entry in dictionary.objects.values()
            for item in entry.items.values()
            if item.access & od.WRITE
        ]
    )
    return axis


def _add_settings(dictionary: od.Dictionary, axis: Axis) -> None:
    """What the drive does of itself, and homing: the plant is told of every value written."""
    told = lambda: axis.on_settings()  # noqa: E731
    for index, name, data_type, value, allowed in _SETTINGS:
        check = None if allowed is None else _one_of(allowed, data_type)
        item = od.number(name, data_type, value, _W, check=check, written=told)
        if data_type == od.UINT32:  # a ramp
            item.low = 1
        dictionary.variable(index, item)
    speeds = {
        1: od.number("Speed for switch search", od.UINT32, 100, _W, written=told),
        2: od.number("Speed for zero search", od.UINT32, 10, _W, written=told),
    }
    dictionary.record(0x6099, "Homing speeds", speeds)


def _one_of(allowed: tuple[int, ...], data_type: int) -> Callable[[bytes], None]:
    def check(data: bytes) -> None:
        if int.from_bytes(data, "little", signed=data_type in od.SIGNED) not in allowed:
            raise od.SdoAbort(od.VALUE_RANGE)

    return check


def _reader(axis: Axis, index: int, subindex: int, size: int) -> Callable[[], bytes]:
    return lambda: axis.live(index, subindex, size)


def _check_mode(data: bytes) -> None:
    if int.from_bytes(data, "little", signed=True) not in (0, *_OPERATING_MODES):
        raise od.SdoAbort(od.VALUE_RANGE)


def _add_target(
    dictionary: od.Dictionary,
    axis: Axis,
    index: int,
    name: str,
    data_type: int,
    check: Callable[[bytes], None] | None = None,
) -> None:
    """A target or word that comes by PDO or SDO; read back it is what acts."""
    item = dictionary.variable(index, od.number(name, data_type, access=_RX, check=check))
    item.read = lambda: found if (found := axis.read_image(index, 0)) is not None else item.value
    item.written = lambda: axis.write_image(index, 0, item.value)
