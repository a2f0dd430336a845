"""What each device on the bus carries: identity and process data entries, bit by bit.

Sources: Beckhoff ESI descriptions of EK1100, EL2124, EL3004, EL4034; maxon EPOS4 firmware
specification (object dictionary) and CiA 402. Identity numbers as seen in public captures.
"""

from dataclasses import dataclass

ANALOG_V_PER_COUNT = 10.0 / 32768.0  # EL3004, EL4034: 0x7FFF = 10 V, signed presentation
CONVERSION_S = 625e-6  # EL3004: about 0.625 ms for its four channels


@dataclass(frozen=True)
class Entry:
    """One value in the process image: type as in struct ('H', 'b', ...; '?' = one bit), native
    unit, unit per count.
    """

    name: str
    code: str
    unit: str = "1"
    per_count: float = 1.0
    index: int = 0
    subindex: int = 0

    @property
    def bits(self) -> int:
        return {"?": 1, "b": 8, "B": 8, "h": 16, "H": 16, "i": 32, "I": 32}[self.code]

    @property
    def counts(self) -> tuple[int, int]:
        """Lowest and highest count."""
        if self.code.islower():
            return -(1 << self.bits - 1), (1 << self.bits - 1) - 1
        return 0, (1 << self.bits) - 1


@dataclass(frozen=True)
class Device:
    """A slave type: identity and default process data (outputs: master to slave; inputs: slave to
    master).
    """

    name: str
    vendor: int
    products: tuple[int, ...]
    revisions: tuple[int, int]
    outputs: tuple[Entry, ...] = ()
    inputs: tuple[Entry, ...] = ()


def _analog_inputs() -> tuple[Entry, ...]:
    entries = []
    for channel in range(4):
        entries.append(
            Entry(f"ch{channel + 1}_status", "H", index=0x6000 + 0x10 * channel, subindex=0x01)
        )
        entries.append(
            Entry(f"ch{channel + 1}", "h", "V", ANALOG_V_PER_COUNT, 0x6000 + 0x10 * channel, 0x11)
        )
    return tuple(entries)


# status bits of an EL3004 channel, as they stand in its 16-bit status
STATUS_UNDER_RANGE = 1 << 0
STATUS_OVER_RANGE = 1 << 1
STATUS_ERROR = 1 << 6
STATUS_INVALID = 1 << 14
STATUS_TOGGLE = 1 << 15

EPOS4_OUTPUTS = (
    Entry("control_word", "H", index=0x6040),
    Entry("mode", "b", index=0x6060),
    Entry("target_position", "i", "count", 1.0, 0x607A),
    Entry("target_speed", "i", "rpm", 1.0, 0x60FF),
    Entry("target_torque", "h", "permille", 1.0, 0x6071),
)
EPOS4_INPUTS = (
    Entry("status_word", "H", index=0x6041),
    Entry("mode_display", "b", index=0x6061),
    Entry("position", "i", "count", 1.0, 0x6064),
    Entry("speed", "i", "rpm", 1.0, 0x606C),
    Entry("torque", "h", "permille", 1.0, 0x6077),
    Entry("current", "i", "mA", 1.0, 0x30D1, 0x02),
    Entry("error_code", "H", index=0x603F),
)

DEVICES: dict[str, Device] = {
    device.name: device
    for device in (
        Device("EK1100", 0x2, (0x044C2C52,), (0x00000000, 0x00120000)),
        Device(
            "EL2124",
            0x2,
            (0x084C3052,),
            (0x00100000, 0x00120000),
            outputs=tuple(
                Entry(f"ch{n + 1}", "?", index=0x7000 + 0x10 * n, subindex=1) for n in range(4)
            ),
        ),
        Device("EL3004", 0x2, (0x0BBC3052,), (0x00100000, 0x00160000), inputs=_analog_inputs()),
        Device(
            "EL4034",
            0x2,
            (0x0FC23052,),
            (0x00100000, 0x00150000),
            outputs=tuple(
                Entry(f"ch{n + 1}", "h", "V", ANALOG_V_PER_COUNT, 0x7000 + 0x10 * n, 0x11)
                for n in range(4)
            ),
        ),
        Device(
            "EPOS4",
            0xFB,
            (
                0x60500000,
                0x61500000,
                0x63500000,
                0x64500000,
                0x65510000,
                0x65520000,
                0x65530000,
                0x69500000,
            ),
            (0x01400000, 0x01800000),
            outputs=EPOS4_OUTPUTS,
            inputs=EPOS4_INPUTS,
        ),
    )
}
