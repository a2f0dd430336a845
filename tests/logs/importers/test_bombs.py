"""Small files that say or hold far more than any recording: refused before anything is unpacked."""

import io
import struct
import subprocess
import sys

import pytest
import zstandard
from foreign_files import MAT, MCAP, mcap_json
from numpy import zeros
from scipy.io import savemat

from epa_rt.cli.main import main
from epa_rt.logs.importers.mat_size import unpacked_bytes

IMPORT = """
import resource, sys
from epa_rt.cli.main import main
code = main(["import", *sys.argv[1:], "--dry"])
status = open("/proc/self/status").read()
own_kb = int(status.split("VmHWM:")[1].split()[0])  # of this program alone, not of its parent
print(code, max(own_kb, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss) // 1024)
"""


def test_a_mat_file_that_unpacks_to_a_thousand_times_its_size_is_refused(tmp_path):
    (tmp_path / "map.yaml").write_text(MAT)
    bomb = tmp_path / "bomb.mat"
    savemat(bomb, {name: zeros(20_000_000) for name in ("pos", "force")}, do_compression=True)
    assert bomb.stat().st_size < 1 << 20
    done = subprocess.run(
        [sys.executable, "-c", IMPORT, tmp_path / "map.yaml", bomb], capture_output=True, text=True
    )
    code, megabytes = map(int, done.stdout.split())
    assert code == 2 and megabytes < 300, done
    assert "bomb.mat: found 0.3 MB that unpack to over 100 times as much" in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("do_compression", [False, True])
def test_what_a_mat_file_holds_is_counted_as_it_is(do_compression):
    into = io.BytesIO()
    savemat(into, {"a": zeros(1000), "b": zeros(500)}, do_compression=do_compression)
    assert unpacked_bytes(into) == pytest.approx(8 * 1500, abs=300)


@pytest.mark.parametrize("where", ["head", "frame"])
def test_a_chunk_that_says_more_than_any_has_is_refused(where, tmp_path, capsys):
    (tmp_path / "map.yaml").write_text(MCAP)
    path = tmp_path / "bomb.mcap"
    mcap_json(path)
    data = bytearray(path.read_bytes())
    head = data.index(b"\4\0\0\0zstd") - 28  # of the first chunk, behind its opcode and length
    if where == "head":
        struct.pack_into("<Q", data, head + 16, 1 << 40)
    else:
        frame = zstandard.ZstdCompressor().compress(bytes(65 << 20))
        data[head + 44 : head + 44 + len(frame)] = frame
    path.write_bytes(data)
    assert main(["import", str(tmp_path / "map.yaml"), str(path), "--dry"]) == 2
    error = capsys.readouterr().err
    assert "bytes unpacked, more than 64 MB, expected smaller ones" in error
    assert error.count("\n") == 1
