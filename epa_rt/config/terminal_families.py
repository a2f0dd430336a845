"""Families of terminals: what a digital output, analog input or analog output of Beckhoff's EL
series has in common. A terminal's own file gives what is its own.

Sources: Beckhoff documentation of EL20xx, EL21xx, EL30xx, EL31xx, EL40xx, EL41xx (objects, process
data, watchdog, status word), ETG.5001 (PDO numbers). Sync manager addresses of the analog families
are those of one EL3004; the driver takes them from the device's own EEPROM.
"""

from epa_rt.config.terminal import (
    ANALOG_FAULTS,
    BECKHOFF,
    GAP,
    INPUTS,
    MAILBOX_IN,
    MAILBOX_OUT,
    OUTPUTS,
    UNASSIGNED,
    Alone,
    Device,
    Entry,
    Mapped,
    Pdo,
    Record,
    Sampling,
    Setting,
    Startup,
    SyncManager,
)

DIGITAL_OUTPUTS = 0x0F00  # register of an output controller without a processor
DIGITAL_INPUTS = 0x1000
MAILBOX = (
    SyncManager(0x1000, 128, 0x26, 0x01, MAILBOX_OUT),
    SyncManager(0x1080, 128, 0x22, 0x01, MAILBOX_IN),
)
FULL_SCALE = 32768  # counts of a full range, signed presentation
CONVERTS_12_BITS = 16  # counts of one step: twelve bits, left-aligned in sixteen
USER_SCALE, PRESENTATION = (0x01, "user scale"), (0x02, "presentation")
SIEMENS_BITS = (0x05, "Siemens bits")


def digital_outputs(
    name: str, product: int, revisions: tuple[int, int], channels: int, ebus_ma: int
) -> Device:
    """A terminal of bits that go out; no processor, so that its outputs are off after the watchdog
    until data come again.
    """
    entries, pdos = _bits(channels, 0x7000, 0x1600, "Output")
    return Device(
        name,
        BECKHOFF,
        (product,),
        revisions,
        outputs=entries,
        pdos=pdos,
        sync_managers=(SyncManager(DIGITAL_OUTPUTS, 0, 0x44, 0x09, OUTPUTS),),
        channels=channels,
        ebus_ma=ebus_ma,
    )


def digital_inputs(
    name: str, product: int, revisions: tuple[int, int], channels: int, ebus_ma: int
) -> Device:
    """A terminal of bits that come in; no processor."""
    entries, pdos = _bits(channels, 0x6000, 0x1A00, "Input")
    return Device(
        name,
        BECKHOFF,
        (product,),
        revisions,
        inputs=entries,
        pdos=pdos,
        sync_managers=(SyncManager(DIGITAL_INPUTS, 1, 0x00, 0x01, INPUTS),),
        channels=channels,
        ebus_ma=ebus_ma,
    )


def _bits(
    channels: int, first_object: int, first_pdo: int, says: str
) -> tuple[tuple[Entry, ...], tuple[Pdo, ...]]:
    """An entry and a PDO of one bit for each channel."""
    objects = [first_object + 0x10 * n for n in range(channels)]
    return (
        tuple(Entry(f"ch{n + 1}", "?", index=at, subindex=1) for n, at in enumerate(objects)),
        tuple(
            Pdo(first_pdo + n, f"Channel {n + 1}", (Mapped(at, 1, "?", says),), 0)
            for n, at in enumerate(objects)
        ),
    )


def analog_inputs(
    name: str,
    product: int,
    revisions: tuple[int, int],
    *,
    unit: str,
    zero: float,
    full: float,
    sampling: Sampling,
    low: int | None = None,
    emulated: int | None = None,
    channels: int = 4,
    ebus_ma: int = 130,
    device_type: int = 0x012C1389,
    startup: tuple[Startup, ...] = (),
) -> Device:
    """Channels that convert a voltage or current: ``zero`` at 0 counts, ``full`` at 0x7FFF (one
    more, to be exact). Each has a status word and a value; a compact PDO has the value alone.
    """
    per_count = (full - zero) / FULL_SCALE
    entries: list[Entry] = []
    pdos: list[Pdo] = []
    for n in range(channels):
        index = 0x6000 + 0x10 * n
        entries += [
            Entry(f"ch{n + 1}_status", "H", index=index, subindex=0x01, faults=ANALOG_FAULTS),
            Entry(f"ch{n + 1}", "h", unit, per_count, index, 0x11, zero, low),
        ]
        value = Mapped(index, 0x11, "h", "Value")
        pdos += [
            Pdo(
                0x1A00 + 2 * n,
                f"AI TxPDO-Map Standard Ch.{n + 1}",
                (
                    Mapped(index, 1, "?", "Underrange"),
                    Mapped(index, 2, "?", "Overrange"),
                    Mapped(index, 3, "BIT2", "Limit 1"),
                    Mapped(index, 5, "BIT2", "Limit 2"),
                    Mapped(index, 7, "?", "Error"),
                    Mapped(0, 0, GAP, gap=7),
                    Mapped(0x1800 + 2 * n, 7, "?", "TxPDO State"),
                    Mapped(0x1800 + 2 * n, 9, "?", "TxPDO Toggle"),
                    value,
                ),
                3,
            ),
            Pdo(0x1A01 + 2 * n, f"AI TxPDO-Map Compact Ch.{n + 1}", (value,), UNASSIGNED),
        ]
    return Device(
        name,
        BECKHOFF,
        (product,),
        revisions,
        inputs=tuple(entries),
        emulated=emulated,
        pdos=tuple(pdos),
        sync_managers=(
            *MAILBOX,
            SyncManager(0x1100, 0, 0x04, 0x00, OUTPUTS),
            SyncManager(0x1180, 4 * channels, 0x20, 0x01, INPUTS),
        ),
        records=tuple(_input_settings(n) for n in range(channels)),
        startup=startup,
        device_type=device_type,
        ebus_ma=ebus_ma,
        channels=channels,
        chooses=True,
        process_name="AI Inputs Ch.",
        neutral=(USER_SCALE, PRESENTATION, SIEMENS_BITS),
        sampling=sampling,
    )


def _input_settings(n: int) -> Record:
    return Record(
        0x8000 + 0x10 * n,
        f"AI Settings Ch.{n + 1}",
        (
            Setting(0x01, "Enable user scale", "?", high=1),
            Setting(0x02, "Presentation", "B", high=2),
            Setting(0x05, "Siemens bits", "?", high=1),
            Setting(0x06, "Enable filter", "?", 1, high=1),
            Setting(0x07, "Enable limit 1", "?", high=1),
            Setting(0x08, "Enable limit 2", "?", high=1),
            Setting(0x0A, "Enable user calibration", "?", high=1),
            Setting(0x0B, "Enable vendor calibration", "?", 1, high=1),
            Setting(0x0E, "Swap limit bits", "?", high=1),
            Setting(0x11, "User scale offset", "h"),
            Setting(0x12, "User scale gain", "i", 65536),
            Setting(0x13, "Limit 1", "h"),
            Setting(0x14, "Limit 2", "h"),
            Setting(0x15, "Filter settings", "H", high=9),
            Setting(0x17, "User calibration offset", "h"),
            Setting(0x18, "User calibration gain", "h", 16384),
        ),
    )


def analog_outputs(
    name: str,
    product: int,
    revisions: tuple[int, int],
    *,
    unit: str,
    full: float,
    low: int | None = None,
    step: int = CONVERTS_12_BITS,
    subindex: int = 0x11,
    at_one: tuple[int, ...] = (),
    emulated: int | None = None,
    channels: int = 4,
    ebus_ma: int = 130,
    device_type: int = 0x01901389,
) -> Device:
    """Channels that put out a voltage: 0 at 0 counts, ``full`` at 0x7FFF (one more, to be exact).
    ``step``: counts of its converter. ``subindex``: where the value stands; ``at_one``: revisions
    that have it at subindex 1.
    """
    return Device(
        name,
        BECKHOFF,
        (product,),
        revisions,
        outputs=tuple(
            Entry(f"ch{n + 1}", "h", unit, full / FULL_SCALE, 0x7000 + 0x10 * n, subindex, low=low)
            for n in range(channels)
        ),
        emulated=emulated,
        pdos=tuple(
            Pdo(
                0x1600 + n,
                f"AO RxPDO-Map Ch.{n + 1}",
                (Mapped(0x7000 + 0x10 * n, subindex, "h", "Analog output"),),
                2,
            )
            for n in range(channels)
        ),
        sync_managers=(
            *MAILBOX,
            SyncManager(0x1100, 2 * channels, 0x24, 0x01, OUTPUTS),  # the master arms its watchdog
            SyncManager(0x1180, 0, 0x00, 0x00, INPUTS),
        ),
        records=tuple(_output_settings(n) for n in range(channels)),
        device_type=device_type,
        ebus_ma=ebus_ma,
        channels=channels,
        neutral=(USER_SCALE, PRESENTATION),
        output_step=step,
        at_one=at_one,
        process_name="AO Outputs Ch.",
        alone=Alone(),
    )


def _output_settings(n: int) -> Record:
    return Record(
        0x8000 + 0x10 * n,
        f"AO Settings Ch.{n + 1}",
        (
            Setting(0x01, "Enable user scale", "?", high=1),
            Setting(0x02, "Presentation", "B", high=3),
            Setting(0x05, "Watchdog", "B", high=2),
            Setting(0x07, "Enable user calibration", "?", high=1),
            Setting(0x08, "Enable vendor calibration", "?", 1, high=1),
            Setting(0x11, "Offset", "h"),
            Setting(0x12, "Gain", "i", 65536),
            Setting(0x13, "Default output", "h"),
            Setting(0x14, "Default output ramp", "H", 0xFFFF),
            Setting(0x15, "User calibration offset", "h"),
            Setting(0x16, "User calibration gain", "H", 0xFFFF),
        ),
    )
