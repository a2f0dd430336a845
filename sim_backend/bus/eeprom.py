"""The slave information interface: a master reads (and writes) the EEPROM through registers 0x0500
to 0x050F.

Sources: ETG.1000.4 (SII registers), Beckhoff ESC datasheet section II. Every read gives eight
bytes, as bit 6 of the control register says throughout.
"""

from sim_backend.bus import registers as reg
from sim_backend.bus.esc import Esc

READS_8_BYTES, TWO_ADDRESS_BYTES = 0x0040, 0x0080
_IDLE = READS_8_BYTES | TWO_ADDRESS_BYTES
_WRITE_ENABLE, _CHECKSUM_ERROR, _ACKNOWLEDGE_ERROR, _WRITE_ENABLE_ERROR = (
    0x0001,
    0x0800,
    0x2000,
    0x4000,
)
_NOP, _READ, _WRITE, _RELOAD = 0, 1, 2, 4


class Eeprom:
    """The SII content and its registers."""

    def __init__(self, esc: Esc, content: bytes):
        self.content = bytearray(content)
        self._esc = esc
        self._error = 0
        esc.on_write.append((reg.EEPROM_CONTROL, reg.EEPROM_CONTROL + 2, self._command))
        self._finish(0)

    def power_up(self) -> None:
        self._finish(0)

    def _finish(self, error: int) -> None:
        if error == 0 and self.content[14] != checksum(self.content[:14]):
            error = _CHECKSUM_ERROR
        self._esc.put(reg.EEPROM_CONTROL, 2, _IDLE | error)

    def _command(self, address: int, length: int) -> None:
        control = self._esc.get(reg.EEPROM_CONTROL, 2)
        start = 2 * self._esc.get(reg.EEPROM_ADDRESS, 4)
        command = control >> 8 & 0x07
        if command == _READ:
            data = bytes(self.content[start : start + 8])
            self._esc.memory[reg.EEPROM_DATA : reg.EEPROM_DATA + 8] = data + b"\xff" * (
                8 - len(data)
            )
            self._finish(0)
        elif command == _WRITE:
            if not control & _WRITE_ENABLE:
                self._finish(_WRITE_ENABLE_ERROR)
            elif start + 2 > len(self.content):
                self._finish(_ACKNOWLEDGE_ERROR)
            else:
                self.content[start : start + 2] = self._esc.memory[
                    reg.EEPROM_DATA : reg.EEPROM_DATA + 2
                ]
                self._finish(0)
        elif command in (_NOP, _RELOAD):
            self._finish(0)
        else:
            self._finish(_ACKNOWLEDGE_ERROR)


def checksum(first_14_bytes: bytes | bytearray) -> int:
    """CRC-8 over the configuration words, polynomial x^8 + x^2 + x + 1, start value 0xFF
    (ETG.1000.6).
    """
    crc = 0xFF
    for byte in first_14_bytes:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ 0x07) & 0xFF if crc & 0x80 else crc << 1
    return crc
