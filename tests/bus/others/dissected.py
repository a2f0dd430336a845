"""What tshark says of a capture, as Python values. The dissector knows nothing of us: no layout of
ours comes in here.
"""

import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

READS_ONLY, WRITES = 1, 2  # FMMU types
DOWNLOAD, UPLOAD = "download", "upload"
_GROUP_ADDRESS = (  # SOEM sends from 01:01:01:01:01:01, as it always has
    "Source MAC must not be a group address"
)


@dataclass(frozen=True)
class Sync:
    """One mapping of logical bits to a slave, as it stood on the wire (ETG.1000.4, FMMU)."""

    station: int
    start: int
    length: int
    first_bit: int
    last_bit: int
    type: int

    def cut(self, image: bytes) -> bytes:
        """Its bits of a logical image that begins at address zero."""
        bits = (self.length - 1) * 8 + self.last_bit - self.first_bit + 1
        number = (
            int.from_bytes(image[self.start : self.start + self.length], "little") >> self.first_bit
            & (1 << bits) - 1
        )
        return number.to_bytes(-(-bits // 8), "little")


@dataclass
class Process:
    """One frame of process data: what went out, what came back (None: nothing), working counters of
    both datagrams.
    """

    sent: bytes
    back: bytes | None = None
    counters: tuple[int, int] = (0, 0)
    time_ns: int = 0


def tshark(path: Path, fields: list[str], only: str) -> list[dict[str, str]]:
    """Fields of the frames that a display filter lets through."""
    command = [
        "tshark",
        "-r",
        str(path),
        "-Y",
        only,
        "-T",
        "fields",
        "-E",
        "occurrence=a",
        "-E",
        "aggregator=|",
    ]
    for name in fields:
        command += ["-e", name]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    return [dict(zip(fields, line.split("\t"), strict=True)) for line in done.stdout.splitlines()]


def is_there() -> bool:
    return shutil.which("tshark") is not None


def complaints(path: Path) -> list[dict[str, str]]:
    """Every frame that is malformed, not EtherCAT, or has an expert remark, other than the one
    about SOEM's address.
    """
    fields = ["frame.number", "_ws.expert.message", "_ws.malformed", "ecat.idx"]
    rows = tshark(
        path,
        fields,
        "_ws.expert || _ws.malformed || ecat_mailbox.invalid || ecat_mailbox.coe.invalid || !ecat",
    )
    return [
        row
        for row in rows
        if row["_ws.malformed"]
        or any(
            not remark.startswith(_GROUP_ADDRESS) for remark in row["_ws.expert.message"].split("|")
        )
    ]


def senders(path: Path) -> list[tuple[str, int]]:
    """(source address, frames) of everything, masters and slaves."""
    counts: dict[str, int] = {}
    for row in tshark(path, ["eth.src"], "ecat"):
        counts[row["eth.src"]] = counts.get(row["eth.src"], 0) + 1
    return sorted(counts.items())


def mappings(path: Path, master: str) -> list[Sync]:
    """The FMMUs that the master switched on."""
    names = ["lstart", "llen", "lstartbit", "lendbit", "type", "activate"]
    rows = tshark(
        path,
        ["ecat.adp", *(f"ecat.fmmu.{name}" for name in names)],
        f"ecat.fmmu && ecat.cmd == 0x05 && eth.src == {master}",
    )
    numbers = [[int(value, 0) for value in row.values()] for row in rows]
    return [Sync(*row[:6]) for row in numbers if row[6] == 1]


def process_data(path: Path, master: str) -> list[Process]:
    """Every LRW with its answer, and the reference clock's datagram behind it (FRMW to 0x0910)."""
    fields = [
        "eth.src",
        "ecat.sub1.idx",
        "ecat.sub1.data",
        "ecat.sub1.cnt",
        "ecat.sub2.cnt",
        "ecat.reg.dc.systime",
    ]
    found: list[Process] = []
    asked: dict[str, Process] = {}
    for row in tshark(
        path, fields, "ecat.sub1.cmd == 0x0c && ecat.sub2.cmd == 0x0e && ecat.sub2.ado == 0x0910"
    ):
        data = bytes.fromhex(row["ecat.sub1.data"].replace(":", ""))
        if row["eth.src"] == master:
            found.append(Process(data))
            asked[row["ecat.sub1.idx"]] = found[-1]
        else:
            last = asked[row["ecat.sub1.idx"]]
            assert last.back is None, "two answers to one frame"
            last.back, last.time_ns = data, int(row["ecat.reg.dc.systime"], 0)
            last.counters = int(row["ecat.sub1.cnt"], 0), int(row["ecat.sub2.cnt"], 0)
    return found


def objects(path: Path, master: str) -> list[tuple[int, str, int, int, int | None, str]]:
    """Requests for objects in order: station, 'download' or 'upload', index, subindex, number
    (None: longer), abort code.
    """
    coe = "ecat_mailbox.coe."
    fields = [
        "eth.src",
        "ecat.adp",
        "ecat.cnt",
        *(coe + name for name in ("sdoreq", "sdores", "sdoidx", "sdosub", "sdodata", "abortcode")),
    ]
    asked: dict[str, dict[str, str]] = {}
    found = []
    for row in tshark(
        path,
        fields,
        f"ecat_mailbox.coe && ((eth.src == {master} && {coe}type == 2 && ecat.cmd == 0x05) ||"
        f" (eth.src != {master} && ecat.cmd == 0x04))",
    ):
        station = row["ecat.adp"]
        if row["eth.src"] == master:
            asked[station] = row
            continue
        request = asked.pop(station)
        kind = {1: DOWNLOAD, 2: UPLOAD}[int(request[coe + "sdoreq"], 0)]
        place = [request[coe + name] for name in ("sdoidx", "sdosub")]
        abort = row[coe + "abortcode"]
        assert abort or place == [row[coe + name] for name in ("sdoidx", "sdosub")], (request, row)
        value = (request if kind == DOWNLOAD else row)[coe + "sdodata"]
        found.append(
            (
                int(station, 0),
                kind,
                *(int(part, 0) for part in place),
                int(value, 0) if value else None,
                abort,
            )
        )
    return found
