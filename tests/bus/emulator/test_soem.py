"""Plain pysoem in front of the emulated bus, in a network of its own, as an ordinary user."""

import json
import sys
import textwrap
from pathlib import Path

import pytest

from sim_backend.bus.namespace import run_beside
from tests.bus.emulator.conftest import RIGS

pytestmark = pytest.mark.network
MASTER = Path(__file__).with_name("soem_master.py")


def beside(name, *command, options=()):
    rig = RIGS / f"{name}.yaml"
    return run_beside([sys.executable, *map(str, command)], rig, options)


def master(name, *arguments, options=()):
    done = beside(name, MASTER, RIGS / f"{name}.yaml", *arguments, options=options)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("bench", ()),
        ("bench_analog", ["--lock-step"]),
        ("mass", ["--lock-step"]),
        ("knee", ["--lock-step"]),
    ],
)
def test_every_rig_comes_to_op_and_exchanges_data(name, options):
    seen = master(name, options=options)
    assert (seen["found"], seen["has_clock"], seen["state"]) == (5, True, 8)
    assert seen["names"] == ["EK1100", "EL2124", "EL3004", "EL4034", "EPOS4"]
    assert [product for _, product, _ in seen["identity"]] == [
        0x044C2C52,
        0x084C3052,
        0x0BBC3052,
        0x0FC23052,
        0x65520000,
    ]
    expected = 2 + 1 + 2 + (1 if name == "bench_analog" else 3)
    assert seen["expected"] == expected and seen["counters"] == [expected] * 50
    assert seen["sizes"] == [
        [0, 0],
        [1, 0],
        [0, 16],
        [8, 0],
        [0, 12] if name == "bench_analog" else [13, 19],
    ]
    assert bytes.fromhex(seen["inputs"])[16] & 0x4F == 0x40  # the drive: switch on disabled


@pytest.mark.parametrize(
    "name", ["bench", pytest.param("bench_analog", marks=pytest.mark.slow)]
)  # all rigs: through the driver, and in memory
def test_in_lock_step_soem_reads_the_simulated_backends_bytes(name):
    assert master(name, "compare", 1500, options=["--lock-step"]) == {"differs": None}


def test_a_killed_master_leaves_a_safe_rig():
    """kill -9 with the inlet open: the slaves' own watchdogs close it and switch the drive off."""
    after = textwrap.dedent(f"""
        import json, os, subprocess, sys, time
        from sim_backend.bus.control import ControlClient
        master = subprocess.run([sys.executable, {str(MASTER)!r}, {str(RIGS / "bench.yaml")!r}, "die"], capture_output=True, text=True)
        assert master.returncode == -9, master.stderr
        with ControlClient(os.environ["EPA_BUS_CONTROL"]) as control:
            for _ in range(500):
                if control.ask("status")["counters"]["watchdogs"].get("drive"):
                    break
                time.sleep(0.01)
            print(json.dumps([json.loads(master.stdout), control.ask("truth"), control.ask("status")]))
    """)  # noqa: E501
    done = beside("bench", "-c", after)
    assert done.returncode == 0, done.stderr
    before, truth, status = json.loads(done.stdout)
    assert before == {"state": 8}
    assert (
        truth["inlet_open"][0] == 0.0
        and truth["exhaust_open"][0] == 1.0
        and not truth["drive_enabled"]
    )
    assert status["slaves"]["drive"]["al_status_code"] == 0x1B and set(
        status["counters"]["watchdogs"]
    ) == {"valves", "drive"}  # an EL4034's has to be armed, which SOEM does not


def test_the_exit_code_of_the_command_comes_back():
    assert beside("bench", "-c", "raise SystemExit(7)").returncode == 7


def test_a_broken_rig_file_is_one_sentence(tmp_path):
    rig = tmp_path / "rig.yaml"
    rig.write_text("rig: bench\n")
    done = run_beside([sys.executable, "-c", "pass"], rig)
    assert done.returncode == 2 and "rig.yaml" in done.stderr and "Traceback" not in done.stderr
