"""Damaged files and logs put to the verbs that read them: each must be answered, in time, in one
sentence, in bounded memory.

A variant of a rig, experiment, plant or mapping file, of a recording of others, or of a log of ours
is made from the seed and its number, and read by a process forked from one that has imported
everything. Counted are answers by exit code; a traceback, no answer in time, or more memory than
the limit is a finding, and its file is kept. With --lines every answer is a line of JSON, and a
later run with the same file leaves out what is there.

    python scripts/fuzz_files.py --files 30000 --logs 5000 --lines PATH   an hour on one core
    python scripts/fuzz_files.py --files 100 --logs 20 --seed 3           a few seconds
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import re
import resource
import select
import signal
import struct
import subprocess
import sys
import tempfile
import time
import traceback
import zlib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests/logs/importers")]

import foreign_files
import same_motion
import zstandard

from epa_rt.cli.main import main as epa
from epa_rt.logs.chunk_store import ChunkStore
from epa_rt.logs.importers import mat_child

LONGEST_S = 60.0
MOST_MB = 500
_ADDRESS_SPACE = 4 << 30
_TRACEBACK = 99
_TELL_S = 10.0  # between two lines of progress
_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:e-?\d+)?")
_NUMBERS = (b"0", b"-1", b"1e308", b"1e400", b"-1e-320", b"nan", b".inf", b"9" * 400, b"1e9", b"[]")
_VALUES = (
    b"null",
    b"true",
    b"{}",
    b"[1, [2, [3]]]",
    b"''",
    b"!!python/object:os.system x",
    b"!!timestamp x",
    b"*nobody",
    b"&a [*a]",
    b"0x" + b"f" * 40,
    "\u202e \U0001f300".encode(),
    b'"\\UFFFFFFFF"',
    b"../../../etc/passwd",
)


@dataclass(frozen=True)
class Kind:
    """A kind of file: its sound bytes, the ending of its name, and the verb that reads it."""

    name: str
    sound: bytes
    ending: str
    verbs: tuple[Callable[[Path], list[str]], ...]
    is_text: bool = True


def damaged(sound: bytes, is_text: bool, chance: random.Random) -> bytes:
    """One to three mutations of a file."""
    data = sound
    ways = TEXT_WAYS if is_text else BINARY_WAYS
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        data = chance.choice(ways)(data, chance)
    return data


def _place(data: bytes, chance: random.Random) -> int:
    return chance.randrange(len(data)) if data else 0


def flipped(data: bytes, chance: random.Random) -> bytes:
    out = bytearray(data)
    for _ in range(chance.choice((1, 1, 4, 64))):
        if out:
            out[_place(data, chance)] ^= 1 << chance.randrange(8)
    return bytes(out)


def cut(data: bytes, chance: random.Random) -> bytes:
    return data[: _place(data, chance)]


def spliced(data: bytes, chance: random.Random) -> bytes:
    a, b, c = (_place(data, chance) for _ in range(3))
    return data[:a] + data[min(b, c) : max(b, c)] + data[a:]


def without(data: bytes, chance: random.Random) -> bytes:
    a = _place(data, chance)
    return data[:a] + data[a + chance.choice((1, 3, 50, 1000)) :]


def zeroed(data: bytes, chance: random.Random) -> bytes:
    a, n = _place(data, chance), chance.choice((1, 8, 64))
    return data[:a] + bytes(n) + data[a + n :]


def huge_field(data: bytes, chance: random.Random) -> bytes:
    a = _place(data, chance)
    value = chance.choice((2**64 - 1, 2**63, 2**32 - 1, 2**31, 2**40, 1 << 20, 0))
    code = chance.choice(("<Q", ">Q", "<I", "<H"))
    field = struct.pack(code, value & (256 ** struct.calcsize(code) - 1))
    return data[:a] + field + data[a + len(field) :]


def other_number(data: bytes, chance: random.Random) -> bytes:
    found = list(_NUMBER.finditer(data))
    if not found:
        return data
    one = chance.choice(found)
    return data[: one.start()] + chance.choice(_NUMBERS) + data[one.end() :]


def other_value(data: bytes, chance: random.Random) -> bytes:
    lines = data.split(b"\n")
    i = chance.randrange(len(lines))
    key, colon, _ = lines[i].partition(b":")
    lines[i] = key + colon + b" " + chance.choice(_VALUES)
    return b"\n".join(lines)


def other_lines(data: bytes, chance: random.Random) -> bytes:
    lines = data.split(b"\n")
    i, j = chance.randrange(len(lines)), chance.randrange(len(lines))
    way = chance.randrange(3)
    if way == 0:
        lines[i], lines[j] = lines[j], lines[i]
    elif way == 1:
        del lines[i]
    else:
        lines.insert(i, lines[j] * chance.choice((1, 1, 50)))
    return b"\n".join(lines)


def nested(data: bytes, chance: random.Random) -> bytes:
    deep = chance.choice((50, 5000, 100_000))
    opening = chance.choice((b"[", b"{a: ", b"- ", b"(", b'{"a":'))
    a = _place(data, chance)
    return data[:a] + opening * deep + data[a:]


def alias_bomb(data: bytes, chance: random.Random) -> bytes:
    lines = [b"a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    for n in range(1, chance.choice((3, 9, 30))):
        lines.append(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]".encode())
    return b"\n".join([data, *lines])


def long_text(data: bytes, chance: random.Random) -> bytes:
    a = _place(data, chance)
    return data[:a] + chance.choice((b"x", b" ", b"\n", b"9", b",")) * 300_000 + data[a:]


def other_encoding(data: bytes, chance: random.Random) -> bytes:
    text = data.decode("utf-8", "replace")
    return text.encode(
        chance.choice(("utf-16", "utf-32-be", "utf-8-sig", "utf-7", "cp037")), "replace"
    )


TEXT_WAYS = (
    flipped, cut, spliced, without, zeroed, other_number, other_number, other_value, other_value,
    other_lines, other_lines, nested, alias_bomb, long_text, other_encoding,
)  # fmt: skip
BINARY_WAYS = (flipped, flipped, cut, spliced, without, zeroed, huge_field, huge_field)


def sealed_damage(sound: bytes, chance: random.Random, folder: Path) -> bytes:
    """A log with a chunk that is damaged and packed again with the right checksum, or a bomb."""
    path = folder / "sealed.mcap"
    if not path.exists():
        path.write_bytes(sound)
    store = ChunkStore(str(path))
    chunk = chance.choice(store.scan.chunks)
    head = bytearray(sound[chunk.begin + 9 : chunk.data_begin])
    content = zstandard.ZstdDecompressor().decompress(
        sound[chunk.data_begin : chunk.data_begin + chunk.data_bytes]
    )
    store.view.close()
    if chance.random() < 0.15:
        content = bytes(chance.choice((1, 30, 63, 65, 200)) << 20)
    else:
        content = damaged(content, False, chance)
    packed = zstandard.ZstdCompressor(level=1).compress(content)
    struct.pack_into("<QI", head, 16, len(content), zlib.crc32(content))
    struct.pack_into("<Q", head, len(head) - 8, len(packed))
    record = struct.pack("<BQ", 6, len(head) + len(packed)) + bytes(head) + packed
    return sound[: chunk.begin] + record + sound[chunk.data_begin + chunk.data_bytes :]


def file_kinds(folder: Path) -> list[Kind]:
    """The sound files, and those written beside them that their verbs need."""
    rig = ROOT / "config/rigs/bench.yaml"
    mapping = folder / "mapping.yaml"

    def config(path: str) -> bytes:
        return (ROOT / "config" / path).read_bytes().replace(b"../plants", b"/nowhere")

    def check(path: Path) -> list[str]:
        return ["check", "--rig", str(rig), str(path)]

    def guess(path: Path) -> list[str]:
        return ["import", "--guess", str(path)]

    def dry(path: Path) -> list[str]:
        return ["run", str(path), "--rig", str(rig), "--dry", "-o", str(folder / "dry")]

    kinds = [
        Kind(f"rig {name}", config(f"rigs/{name}.yaml"), ".yaml", (check,))
        for name in ("bench", "bench_analog", "knee")
    ]
    kinds += [
        Kind(f"experiment {name}", config(f"experiments/{name}.yaml"), ".yaml", (check, check, dry))
        for name in ("identification_short", "step", "multisine")
    ]
    kinds += [
        Kind(f"plant {name}", config(f"plants/{name}.yaml"), ".yaml", (check,))
        for name in ("bench", "knee")
    ]
    recordings = foreign_kinds(folder) | {
        "csv": (foreign_files.CSV, foreign_files.csv_text().encode()),
        "mat": (foreign_files.MAT, foreign_files.mat_bytes()),
        "mcap": (foreign_files.MCAP, _foreign_mcap(folder)),
    }
    for name, (words, sound) in recordings.items():
        mapping = folder / f"mapping_{name}.yaml"
        mapping.write_text(words, encoding="utf-8")
        data = folder / f"sound.{name}"
        data.write_bytes(sound)
        kinds += [
            Kind(
                f"mapping {name}",
                words.encode(),
                ".yaml",
                (lambda path, data=data: ["import", str(path), str(data), "--dry"],),
            ),
            Kind(
                name,
                sound,
                f".{name}",
                (lambda path, m=mapping: ["import", str(m), str(path), "--dry"],),
                name in ("csv", "jsonl"),
            ),
        ]
        if name not in ("mat", "mcap"):
            kinds.append(
                Kind(f"guess {name}", sound, f".{name}", (guess,), name in ("csv", "jsonl"))
            )
    return kinds


def foreign_kinds(folder: Path) -> dict[str, tuple[str, bytes]]:
    """Mapping and recording of the formats of robot labs, by the ending of their names."""
    made = folder / "motion"
    made.mkdir()
    bags = {kind: same_motion.write_bag(made / f"bag_{kind}", kind) for kind in ("mcap", "db3")}
    return {
        "parquet": (
            same_motion.mapping_of("parquet"),
            same_motion.write_parquet(made / "m.parquet").read_bytes(),
        ),
        "npz": (same_motion.mapping_of("npz"), same_motion.write_npz(made / "m.npz").read_bytes()),
        "jsonl": (
            same_motion.mapping_of("jsonl"),
            same_motion.write_jsonl(made / "m.jsonl").read_bytes(),
        ),
        "db3": (same_motion.BAG, next(bags["db3"].glob("*.db3")).read_bytes()),
        "bag.mcap": (same_motion.BAG, next(bags["mcap"].glob("*.mcap")).read_bytes()),
    }


def _foreign_mcap(folder: Path) -> bytes:
    path = folder / "foreign.mcap"
    foreign_files.mcap_json(path)
    return path.read_bytes()


def log_kind(folder: Path) -> Kind:
    """A short log of ours: a run on the simulated bench that trips soon. A process of its own makes
    it, so that the memory of compiling the plant is not that of every variant.
    """
    text = (ROOT / "config/rigs/bench.yaml").read_text(encoding="utf-8")
    text = text.replace("limits: [-40 N, 350 N]", "limits: [-40 N, 30 N]")
    text = text.replace("../plants", str(ROOT / "config/plants"))
    (folder / "weak.yaml").write_text(text, encoding="utf-8")
    log = folder / "run.mcap"
    experiment = ROOT / "config/experiments/identification_short.yaml"
    words = ["run", str(experiment), "--rig", str(folder / "weak.yaml"), "-o", str(log), "--quiet"]
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    subprocess.run(
        [sys.executable, "-m", "epa_rt", *words],
        env=os.environ | {"PYTHONPATH": path},
        stdout=sys.stderr,
        check=False,  # it trips
    )
    page = str(folder / "page.html")
    return Kind(
        "log",
        log.read_bytes(),
        ".mcap",
        (
            lambda path: ["info", "--check", "--events", str(path)],
            lambda path: ["info", "--check", "--json", str(path)],
            lambda path: ["info", str(path)],
            lambda path: ["replay", str(path)],
            lambda path: ["report", str(path), "--html", page],
            lambda path: ["plot", str(path), "--html", page],
            lambda path: ["ls", "--long", str(path)],
            lambda path: ["compare", str(log), str(path), "--html", page],
            lambda path: ["export", str(path), "-o", f"{page}.parquet", "--force"],
            lambda path: ["export", str(path), "-o", f"{page}.mat", "--force"],
        ),
        is_text=False,
    )


@dataclass(frozen=True)
class Answer:
    """'exit N' or what is wrong with the answer; most memory in MB and processor time in s, both
    with those of the processes that the verb started.
    """

    outcome: str
    megabytes: float
    cpu_s: float

    @property
    def is_sound(self) -> bool:
        return re.fullmatch(r"exit \d+", self.outcome) is not None


def answer(words: list[str], said: Path) -> Answer:
    """What a verb does with a file, in a process forked for it."""
    child = os.fork()
    if child == 0:
        _be_the_verb(words, said)
    descriptor = os.pidfd_open(child)
    in_time = bool(select.select([descriptor], [], [], LONGEST_S)[0])
    os.close(descriptor)
    if not in_time:
        os.killpg(child, signal.SIGKILL)
    _, status, used = os.wait4(child, 0)
    megabytes = used.ru_maxrss / 1024
    outcome = _outcome(status, said, megabytes) if in_time else f"no answer in {LONGEST_S:g} s"
    return Answer(outcome, megabytes, used.ru_utime + used.ru_stime)


def _outcome(status: int, said: Path, megabytes: float) -> str:
    if os.WIFSIGNALED(status):
        return f"signal {os.WTERMSIG(status)}"
    code, text = os.WEXITSTATUS(status), said.read_text(encoding="utf-8", errors="replace")
    if code == _TRACEBACK or "Traceback" in text:
        return "traceback"
    if megabytes > MOST_MB:
        return f"more than {MOST_MB} MB"
    if code not in (0, 1, 2, 3, 4) or (code == 2 and not text.startswith("epa ")):
        return f"exit {code} without a sentence"
    return f"exit {code}"


def _be_the_verb(words: list[str], said: Path) -> None:
    os.setsid()
    resource.setrlimit(resource.RLIMIT_AS, (_ADDRESS_SPACE, _ADDRESS_SPACE))
    resource.setrlimit(resource.RLIMIT_CPU, (int(LONGEST_S), int(LONGEST_S)))
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    os.dup2(os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), 2)
    code = _TRACEBACK
    try:
        code = epa(words)
        sys.stdout.flush()
    except SystemExit as error:
        code = error.code if isinstance(error.code, int) else _TRACEBACK
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stderr.flush()
        os._exit(code)


def _forked_reader(words: list[str], **options: object) -> subprocess.CompletedProcess[bytes]:
    """The reader of MAT files in a process forked from this one, which has scipy, and not in one
    that imports it for every variant.
    """
    out, into = os.pipe()
    child = os.fork()
    if child == 0:
        os.dup2(into, 1)
        sys.argv = words[2:]
        try:
            sys.stdout = os.fdopen(1, "w", closefd=False)
            mat_child.main()
            sys.stdout.flush()
            os._exit(0)
        finally:
            os._exit(1)
    os.close(into)
    with os.fdopen(out, "rb") as pipe:
        said = pipe.read()
    _, status = os.waitpid(child, 0)
    return subprocess.CompletedProcess(words, os.waitstatus_to_exitcode(status), said, b"")


def _load_modules(kinds: list[Kind], folder: Path) -> None:
    """Read every sound file once here, so that a forked process has all that it imports."""
    for kind in kinds:
        path = folder / f"sound_{kind.name.replace(' ', '_')}{kind.ending}"
        path.write_bytes(kind.sound)
        for verb in kind.verbs:
            with open(os.devnull, "w") as nowhere, contextlib.redirect_stdout(nowhere):
                code = epa(verb(path))
            if code > 1 and not kind.name.startswith("rig"):  # a rig's plant is not beside it
                raise SystemExit(f"fuzz_files: {kind.name}: exit {code} on the sound file")
    import scipy.io  # noqa: F401

    mat_child.subprocess = SimpleNamespace(  # type: ignore[assignment]
        run=_forked_reader, TimeoutExpired=subprocess.TimeoutExpired
    )


class Tally:
    """Answers so far, those of an earlier run with the same seed included."""

    def __init__(self, what: str, count: int, seed: int, lines: Path | None):
        self.what, self.count, self.seed, self._lines = what, count, seed, lines
        self.answers: Counter[str] = Counter()
        self.findings: list[dict[str, object]] = []
        self.most_mb, self.slowest = 0.0, ("", 0.0)
        self.done: set[tuple[int, str]] = set()
        if lines is not None and lines.exists():
            for text in lines.read_text(encoding="utf-8").splitlines():
                row = json.loads(text)
                if (row["what"], row["seed"]) == (what, seed) and row["number"] < count:
                    self._count(row)

    def add(self, number: int, kind: Kind, verb: str, found: Answer, last: str) -> None:
        row = {
            "what": self.what,
            "seed": self.seed,
            "number": number,
            "kind": kind.name,
            "verb": verb,
            "outcome": found.outcome,
            "mb": round(found.megabytes),
            "cpu_s": round(found.cpu_s, 3),
        }
        if not found.is_sound:
            row["said"] = last
        self._count(row)
        if self._lines is not None:
            with self._lines.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")

    def _count(self, row: dict[str, object]) -> None:
        self.done.add((row["number"], row["kind"]))
        self.answers[row["outcome"]] += 1
        self.most_mb = max(self.most_mb, row["mb"])
        name = f"{row['kind']} {row['number']}, {row['verb']}"
        self.slowest = max(self.slowest, (name, row["cpu_s"]), key=lambda one: one[1])
        if "said" in row:
            self.findings.append(row)

    def said(self) -> dict[str, object]:
        return {
            "variants": self.answers.total(),
            "answers": dict(self.answers),
            "most_mb": self.most_mb,
            "slowest": {"variant": self.slowest[0], "cpu_s": self.slowest[1]},
            "findings": self.findings,
        }

    def progress(self, began_s: float, before: int) -> None:
        """One line on standard error every few seconds."""
        made = self.answers.total() - before
        rate = made / max(time.monotonic() - began_s, 1e-9)
        print(
            f"{self.what}: {self.answers.total()} of {self.count}, {rate:.1f} a second,"
            f" {len(self.findings)} findings",
            file=sys.stderr,
            flush=True,
        )


def fuzz(
    kinds: list[Kind], seed: int, folder: Path, kept: Path, minutes: float, tally: Tally
) -> dict[str, object]:
    """Put the variants of a tally, of each kind in turn, to their verbs, or as many as the minutes
    allow; gives counts and findings.
    """
    _load_modules(kinds, folder)
    began_s, before = time.monotonic(), tally.answers.total()
    told_s = began_s
    for number in range(tally.count):
        kind = kinds[number % len(kinds)]
        if (number, kind.name) in tally.done:
            continue
        now_s = time.monotonic()
        if now_s > began_s + 60.0 * minutes:
            break
        if now_s > told_s + _TELL_S:
            told_s = now_s
            tally.progress(began_s, before)
        chance = random.Random(f"{seed} {number}")
        if kind.name == "log" and chance.random() < 0.4:
            data = sealed_damage(kind.sound, chance, folder)
        else:
            data = damaged(kind.sound, kind.is_text, chance)
        path = folder / f"variant{kind.ending}"
        path.write_bytes(data)
        words = chance.choice(kind.verbs)(path)
        found = answer(words, folder / "said")
        last = (folder / "said").read_text(encoding="utf-8", errors="replace").strip()
        last = last.splitlines()[-1][:300] if last else ""
        tally.add(number, kind, words[0], found, last)
        if not found.is_sound:
            kept.mkdir(parents=True, exist_ok=True)
            name = f"{kind.name.replace(' ', '_')}-{seed}-{number}{kind.ending}"
            (kept / name).write_bytes(data)
            print(f"{name}: {words[0]}: {found.outcome}: {last}", file=sys.stderr, flush=True)
    return tally.said()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--files", type=int, default=300, help="variants of files")
    parser.add_argument("--logs", type=int, default=60, help="variants of logs")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--minutes", type=float, default=600.0, help="at most, for files and for logs each"
    )
    parser.add_argument("--keep", type=Path, default=ROOT / "out/fuzz_files", help="findings")
    parser.add_argument("--lines", type=Path, help="a line of JSON a variant; go on from there")
    given = parser.parse_args()

    def put(kinds: list[Kind], what: str, count: int, folder: Path) -> dict[str, object]:
        tally = Tally(what, count, given.seed, given.lines)
        return fuzz(kinds, given.seed, folder, given.keep, given.minutes, tally)

    found = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if given.files:
            found["files"] = put(file_kinds(folder), "files", given.files, folder)
        if given.logs:
            found["logs"] = put([log_kind(folder)], "logs", given.logs, folder)
    print(json.dumps({"seed": given.seed, **found}, indent=1))
    return 1 if any(part["findings"] for part in found.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
