"""Writes docs/bus-faults.md: every fault put into a run on the emulated bus, who noticed it, how
long until the rig stopped, and where its motor went.

python scripts/fault_table.py               all faults; needs no right but `unshare`
python scripts/fault_table.py --check       says whether the page holds every kind of fault that the
emulator offers
"""

import argparse
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from scripts.short_cells import left_out, short

PREFIXES = ("failed: ", "tripped: ")  # the exit code says which
PAGE = ROOT / "docs/bus-faults.md"

HEAD = """# Faults on the bus

To look up how each fault on the bus is found, how soon the rig stops, and where its motor goes
meanwhile. Written by `python scripts/fault_table.py`. Each fault is put, mid-motion, into a run of
`epa run --backend ethercat` through pysoem on the emulated bus. One plant period passes per frame
unless it says *real time*. Every figure is the plant's own.

Cycles are of 1 ms and count from the first bad cycle that a master can see. Where the plant has to
move before anybody can see it, *noticed* says how long that took, and the rest counts from there. A
dash: at once. The rig files ask for 20 ms. Where no frame gets through, drive and valves act by
their watchdogs in 100 ms.

On a real bus a cycle whose frame is lost lasts `frame_timeout`, by default 5 ms. Three of them and
the safe frame behind them are 16 ms. A fall to SAFEOP is seen at the next look at the states, 10
cycles later at most.

| Column | Meaning |
|---|---|
| stop: brakes and holds | category 1: the drive brakes and holds, muscles vent, then power goes |
| stop: power off | category 0: drive, bus or position are lost, the muscle may throw the motor |
| stop: brakes and holds by itself | nobody is left to take the power away |
| air | cycles until inlets are shut and exhausts open |
| stop (figure) | cycles until the drive brakes or is off |
| travel | where the motor went from the fault on |
| exit | 3 tripped, 4 bus lost, 0 the run goes on |
| exit, added | 10, 20, 40: drive off, vented, at rest were not measured |

## The run ends

| Fault | Noticed by | Stop | Noticed after | Air | Stop | Travel | Fastest | Exit | Sentence |
|---|---|---|---|---|---|---|---|---|---|
"""
SENTENCES = """
Sentences of which a part stands above, in full:

"""
GOES_ON = """
## The run goes on

`Departs` is how far the motor's travel departs from that of the undisturbed run within half a
second.

| Fault | Noticed by | What happens | Bad cycles counted | Departs |
|---|---|---|---|---|
"""
GAPS = """
## Not noticed

What should be noticed, and is not; these stand in the tests as expected failures.

| Fault | Should be noticed | What happened | Travel in the plant | When power went |
|---|---|---|---|---|
"""
FOOT = """
## Where a fault cannot be seen

- A **lost supply** and an **inlet stuck closed** show only while a muscle is filled, an **exhaust
  stuck closed** only while one is vented. During a trial no valve switches, so they wait until its
  end.
- A **stuck pressure sensor** looks, while a muscle is filled, like an inlet that does not open.
  While it is vented it looks like an exhaust that does not. The sentence names both, the operator
  looks at both.
- A valve that is **stuck** cannot be brought into its safe state. Its opposite, and the drive, are.
- An **inlet stuck open** keeps its muscle full. The drive holds for `rest_timeout`, then power
  goes, and the muscle throws the motor. Only a holding brake (`motor.brake`), or a shut supply,
  prevents that.
- A **drive on wires** (bench_analog) reports its status and its error on the bus, but nobody judges
  them before the end. A fault in it shows in the travel alone.
- **Sensors that lie** (`sensor_gain`, `sensor_offset`, `pressures_exchanged`, `hoses_exchanged`)
  and a `burst` muscle have a table of their own, with what asks for them: [sensors](sensors.md).
- A frame whose **data** are damaged never gets here: the slaves' and the card's check sequence
  throw it away. Damage to headers that SOEM does not look at (length, frame type) has no effect.
"""


def row_of(cells: list[object]) -> str:
    return "| " + " | ".join(str(cell).replace("|", "/") for cell in cells) + " |"


def ended(name: str, scenario: object, facts: dict) -> str:
    """A row for a run that ended."""
    paced = ", *real time*" if scenario.real_time and "real time" not in name else ""
    words = f"{scenario.stop}; {scenario.words}" if scenario.words else scenario.stop
    if scenario.when == "start":
        words, figures = f"no power was on; {scenario.words}", ["–"] * 5
    else:
        noticed = f"{facts['noticed_in']}" if scenario.visible is None else "–"
        first_bad = (
            facts["noticed_at"]
            if scenario.visible is None
            else facts["injected_at"] + scenario.visible
        )
        low, high = (f"{1e3 * x:.1f}" for x in facts["travel_range_m"])
        figures = [
            noticed,
            max(facts["air_out_at"] - first_bad, 0),
            max(facts["stopping_at"] - first_bad, 0),
            f"{low} to {high} mm",
            f"{1e3 * facts['fastest_m_s']:.0f} mm/s",
        ]
    return row_of(
        [name + paced, scenario.seen_by, words, *figures, facts["code"]]
        + [short(facts["sentence"], PREFIXES)]
    )


def went_on(name: str, scenario: object, facts: dict) -> str:
    """A row for a run that was to go on."""
    departs = f"{1e3 * facts['departs_m']:.3f} mm" if "departs_m" in facts else "*real time*"
    return row_of([name, scenario.seen_by, scenario.words, len(facts["bad"]) or "–", departs])


def unseen(name: str, scenario: object, facts: dict) -> str:
    """A row for what nobody noticed."""
    low, high = (1e3 * x for x in facts["travel_range_m"])
    left = facts["gauge_at_power_off_pa"]
    power = "–" if left is None else f"{1e-3 * left:.0f} kPa gauge"
    sentence = short(facts["sentence"], PREFIXES)
    return row_of([name, scenario.gap, sentence, f"{low:.1f} mm to {high:.1f} mm", power])


def page() -> str:
    """The whole page; runs everything."""
    from tests.bus.faults.runs import facts_of_run
    from tests.bus.faults.scenarios import all_scenarios
    from tests.bus.own_network import LOCK_STEP_STALL_S, STALL_S, repeated

    scenarios = all_scenarios()
    found = {}
    for name, scenario in scenarios.items():
        print(name, file=sys.stderr)
        longest_s = STALL_S if scenario.real_time else LOCK_STEP_STALL_S
        found[name] = repeated(
            name,
            lambda name=name, scenario=scenario: _as_expected(scenario, facts_of_run(name)),
            longest_s,
        )
    rows: dict[str, list[str]] = {"ended": [], "went_on": [], "unseen": []}
    said = []
    for name, scenario in scenarios.items():
        if scenario.gap and (scenario.goes_on or found[name]["code"] != scenario.code):
            rows["unseen"].append(unseen(name, scenario, found[name]))
        elif scenario.goes_on:
            rows["went_on"].append(went_on(name, scenario, found[name]))
        else:
            said.append(found[name]["sentence"])
            rows["ended"].append(ended(name, scenario, found[name]))
    gaps = GAPS + "\n".join(rows["unseen"]) + "\n" if rows["unseen"] else ""
    return (
        HEAD
        + "\n".join(rows["ended"])
        + "\n"
        + SENTENCES
        + "\n".join(left_out(said, PREFIXES))
        + "\n"
        + GOES_ON
        + "\n".join(rows["went_on"])
        + "\n"
        + gaps
        + FOOT
    )


def _as_expected(scenario: object, facts: dict) -> dict:
    """A stall of this machine may end a run by itself, which is then run again. What ends otherwise
    goes on the page.
    """
    if facts["injected_at"] is None or scenario.real_time and facts["code"] != scenario.code:
        raise RuntimeError(facts["sentence"])
    return facts


def not_on_page(text: str) -> list[str]:
    """Scenarios and kinds of the emulator that the page does not hold."""
    from sim_backend.bus.fault_kinds import ALL_FAULTS
    from tests.bus.faults.scenarios import all_scenarios

    return [name for name in all_scenarios() if f"| {name}" not in text] + [
        kind for kind in ALL_FAULTS if kind not in text
    ]


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--check", action="store_true", help="only compare names")
    arguments = parser.parse_args()
    if arguments.check:
        missing = not_on_page(PAGE.read_text(encoding="utf-8"))
        print(
            f"{PAGE.name}: found no {', '.join(missing)}"
            if missing
            else f"{PAGE.name} holds every fault"
        )
        return bool(missing)
    PAGE.write_text(page(), encoding="utf-8")
    print(f"{PAGE} written")
    return 0


if __name__ == "__main__":
    sys.exit(main())
