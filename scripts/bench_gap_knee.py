"""Logs of a knee with a drag that no law of the catalogue is, for bench_gap.py --refused: of all
that is diagnosed it takes longest to find that nothing explains a gap.
"""

from pathlib import Path

from demo_gap_rig import ROOT, played

RIG, PLANT = ROOT / "config/rigs/knee.yaml", ROOT / "config/plants/knee.yaml"
HIDDEN = {
    "knee_air_nm_s2": 1.0
}  # drag that grows with the speed squared, twenty times a typical one
# pressures of both muscles, and of two trials each the swing and its frequencies
LOGS = (
    (
        "185 kPa abs",
        "170 kPa abs",
        ("10 deg, from: 0.5 Hz, to: 2 Hz", "8 deg, from: 0.2 Hz, to: 1 Hz"),
    ),
    (
        "197 kPa abs",
        "180 kPa abs",
        ("12 deg, from: 0.2 Hz, to: 0.7 Hz", "6 deg, from: 0.5 Hz, to: 1.5 Hz"),
    ),
    (
        "177 kPa abs",
        "158 kPa abs",
        ("2.5 deg, from: 1 Hz, to: 3.5 Hz", "7 deg, from: 0.3 Hz, to: 1.2 Hz"),
    ),
)


def experiment(name: str, spam: str, ppam: str, trials: tuple[str, str], seconds: float) -> str:
    """The short knee chirp at other pressures, with two trials."""
    text = (ROOT / "config/experiments/knee_chirp_short.yaml").read_text(encoding="utf-8")
    head, rest = text.split("phases:\n", 1)
    for old, new in (
        ("experiment: knee_chirp_short", f"experiment: {name}"),
        ("185 kPa abs", spam),
        ("170 kPa abs", ppam),
    ):
        head = head.replace(old, new)
    made = [
        f"  - {{name: trial_{k}, trial: true, chirp: {{mean: mean, peak_to_peak: {motion}, fade: 1"
        f" s}}, for: {seconds:g} s, valves: {{all: hold}}}}\n"
        for k, motion in enumerate(trials)
    ]
    return head + "phases:\n" + "".join(made) + rest[rest.index("after:\n") :]


def record(out: Path, count: int, seconds: float) -> list[Path]:
    """Records ``count`` logs with trials of ``seconds`` each and returns them."""
    return played(
        out,
        RIG,
        PLANT,
        HIDDEN,
        {f"log_{k}": experiment(f"log_{k}", *LOGS[k % len(LOGS)], seconds) for k in range(count)},
    )
