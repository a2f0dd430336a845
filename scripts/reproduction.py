"""docs/reproduction.md: one row per claim of the paper, with our figure, whether it holds, and why.

Runs the identification (7 x 200 s through the loop), the serial study, the knee study and the
arrangements into FOLDER, keeps what is there already and comes from the same files and code
(studies go on where they were), and writes the page.

  python scripts/reproduction.py [FOLDER] [-o docs/reproduction.md]
"""

import argparse
import hashlib
import json
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from epa_rt.study.claims import Claim
from epa_rt.study.grid import LOOP_ROOMS, code_digest
from epa_rt.study.serial import load_serial, solve
from scripts.short_cells import Notes

PAPER = (
    "The paper: M. A. Sharbafi, H. Shin, G. Zhao, K. Hosoda, A. Seyfarth: *Electric-Pneumatic"
    " Actuator: A New Muscle for Locomotion*, Actuators 6(4), 30, 2017,"
    " [doi:10.3390/act6040030](https://doi.org/10.3390/act6040030). SPAM is its serial, PPAM its"
    " parallel pneumatic artificial muscle."
)
PICTURES = {
    "serial_traces": "Fig. 5",
    "serial_stroke": "Fig. 6",
    "serial_map_stroke": "Fig. 7",
    "serial_map_power": "Fig. 8",
    "serial_rule": "Best pressure over frequency",
    "serial_map_stroke_serial_eq8_no_c3": "Fig. 7 by eq. (8) without C3; white: runs away",
    "knee_saved": "Fig. 9",
    "knee_geared_knee_saved": "Fig. 9 on the knee with a slower gear",
    "knee_swing": "Achieved swing beside it",
    "knee_catalogue_0_5_hz": "Catalogue at 0.5 Hz",
    "knee_catalogue_2_0_hz": "Catalogue at 2 Hz",
    "knee_catalogue_best": "Its optimum over frequency",
    "arrangements": "Arrangements",
}
LEADS = {
    "Knee with a slower gear (3.3)": (
        (
            "The same nine conditions on a knee drawn by `python scripts/knee_crossing.py` from"
            " engineering ranges. It was drawn because its pressures cross: gear 32 on a spool of"
            " 23 mm, a thin parallel"
        ),
        (
            "muscle with some friction. They do at equal motion. Through the loop the rig's PID"
            " lets the swing fall as the pressure rises, and less motion hides the crossing."
        ),
        "",
    )
}
SHOWN = ROOT / "docs/pictures/study"
PAPER_R2 = {"static, geometry": 0.916, "Tang, geometric": 0.921, "polynomial": 0.971}
WITHIN = 0.02
EQ_8 = ("P L", "P v", "v^2", "P^2 v", "1")
ONE_ACTUATOR = (
    "At 80 rad/s the stroke is least",
    "95 to 110 rad/s take",
    "The valley of peak power rises",
)


def epa(*arguments: object) -> None:
    print("epa", *arguments, flush=True)
    subprocess.run([sys.executable, "-m", "epa_rt", *map(str, arguments)], cwd=ROOT, check=True)


def identification(folder: Path) -> dict:
    """Run and identified again where its files or its code are not those of the answer that is
    there.
    """
    digest = hashlib.sha256(code_digest(("epa_rt/identify", "epa_rt/models", *LOOP_ROOMS)).encode())
    for name in (
        "experiments/identification.yaml",
        "rigs/bench.yaml",
        "plants/bench.yaml",
        "plants/bench_paper.yaml",
    ):
        digest.update((ROOT / "config" / name).read_bytes())
    answer = folder / f"bench_paper-{digest.hexdigest()[:24]}.json"
    if not answer.exists():
        log = folder / "bench_paper.mcap"
        log.unlink(missing_ok=True)  # of a run that was interrupted before its identification
        epa(
            "run",
            "config/experiments/identification.yaml",
            "--rig",
            "config/rigs/bench.yaml",
            "--plant",
            "config/plants/bench_paper.yaml",
            "-o",
            log,
            "--quiet",
        )
        epa("identify", log, "--rig", "config/rigs/bench.yaml", "--json", answer, "--quiet")
    return json.loads(answer.read_text(encoding="utf-8"))


def study(task: str, folder: Path, name: str = "") -> dict:
    name = name or task
    answer = folder / f"{name}.json"
    pictures = folder / "pictures" / name
    epa(
        "study",
        task,
        f"config/studies/{name}.yaml",
        "--store",
        folder / "store",
        "--json",
        answer,
        "--html",
        folder / f"{name}.html",
        "--pictures",
        pictures,
        "--quiet",
    )
    SHOWN.mkdir(parents=True, exist_ok=True)
    for picture in filter(
        lambda one: (one.stem if name == task else f"{name}_{one.stem}") in PICTURES,
        pictures.iterdir(),
    ):
        shutil.copy(picture, SHOWN / (picture.name if name == task else f"{name}_{picture.name}"))
    return json.loads(answer.read_text(encoding="utf-8"))


def identification_claims(found: dict) -> list[Claim]:
    """Claims of 3.1 (Table 1) on the muscle of config/plants/bench_paper.yaml."""
    models = {one["name"]: one for one in found["models"]}
    r2 = {name: models[name]["r2"] for name in PAPER_R2}
    rows = [
        Claim(
            "3.1, Table 1",
            f"R² of the {name} model is {paper:.3f}",
            f"{r2[name]:.3f}",
            abs(r2[name] - paper) <= WITHIN,
            "A muscle of physical parts (config/plants/bench_paper.yaml), found by search so that"
            " the table's order appears; it is not eq. (8).",
        )
        for name, paper in PAPER_R2.items()
    ]
    static, tang, polynomial = (r2[name] for name in PAPER_R2)
    every = models["Tang, all fitted"]["r2"]
    rows.append(
        Claim(
            "3.1, Table 1",
            "The order is static < Tang < polynomial",
            f"{static:.3f} < {tang:.3f} < {polynomial:.3f} where Tang keeps the geometric static"
            f" force; {every:.3f} with all its coefficients fitted",
            (
                None
                if every > polynomial and static < tang < polynomial
                else static < tang < polynomial
            ),
            "The paper does not say what of Tang's model was fitted. All fitted, it is above the"
            " polynomial, which has fewer terms.",
        )
    )
    measured = [(models[name]["has_hysteresis"], models[name]["has_damping"]) for name in PAPER_R2]
    rows.append(
        Claim(
            "3.1, Table 1",
            "Hysteresis and damping: no/no, yes/yes, yes/yes",
            ", ".join("/".join("yes" if one else "no" for one in pair) for pair in measured),
            measured == [(False, False), (True, True), (True, True)],
            "Measured: loop work over that of the measurement, and the force when speed is halved.",
        )
    )
    fitted = models.get("static, quadratic")
    if fitted:
        rows.append(
            Claim(
                "3.1",
                "The static model is not sufficient: dynamic terms are what the polynomial adds",
                f"a static law with three fitted coefficients has {fitted['r2']:.3f}, the"
                f" polynomial {polynomial:.3f}",
                fitted["r2"] < polynomial,
                (
                    ""
                    if fitted["r2"] < polynomial
                    else (
                        "On this muscle a misfit of the geometry is most of what eq. (8) repairs;"
                        " only the loop work needs a dynamic law."
                    )
                ),
            )
        )
    for way in found["terms"]:
        if "smallest coefficient" in way["name"] or way["name"].startswith("paper"):
            terms = way["chosen"]["terms"]
            rows.append(
                Claim(
                    "2.2",
                    f"Elimination from 64 products ends at eq. (8) ({way['name']})",
                    f"{len(terms)} terms, R² {way['chosen']['r2']:.3f}, condition"
                    f" {way['chosen']['condition']:.0e}",
                    set(terms) == set(EQ_8),
                    (
                        ""
                        if set(terms) == set(EQ_8)
                        else (
                            "The 64 products are collinear: the size of a coefficient says little"
                            " about what its term is worth. docs/identification.md has the sound"
                            " ways."
                        )
                    ),
                )
            )
    return rows


def consistency(serial: dict) -> list[Claim]:
    """What cannot all be true at once for a linear spring."""
    omega, best = (
        np.array(serial["frequency_rad_s"]),
        np.array(serial["best_pressure_pa"]["stroke_m"], float) / 1e3,
    )
    at80, at100 = (best[np.argmin(np.abs(omega - w))] for w in (80.0, 100.0))
    free80, free100 = without_lock()
    return [
        Claim(
            "3.2",
            "Figs 6, 7 and 8 describe one and the same actuator",
            f"{at80:.0f} kPa at 80, {at100:.0f} kPa at 100 rad/s",
            all(one["holds"] for one in serial["claims"] if one["claim"].startswith(ONE_ACTUATOR)),
            "Judged by Figs 6, 7 and 8 holding on one plant. A linear spring with k proportional to"
            " P wants 1250 kPa at 100 rad/s where it wants 800 at 80. So it takes a spring that is"
            " not linear. Below the valley the mass pulls the braid into its lock and up its own"
            " curved force, which the motor has to make good. Without the lock:"
            f" {free80:.0f} and {free100:.0f} kPa.",
        ),
        Claim(
            "2.2, 3.2",
            "Pressures are what the sensor and eqs (1) to (3) call pressure",
            "eq. (1) with gauge, eq. (3) with absolute pressure; Figs 6 to 9 read as absolute",
            None,
            "Eq. (1) is -P dV/dL of eq. (2) and gives force against the atmosphere; Boyle's law"
            " needs absolute pressure. The paper uses one symbol for both.",
        ),
    ]


def without_lock() -> np.ndarray:
    """Best pressure (kPa) for stroke at 80 and 100 rad/s where the braid does not lock."""
    asked = load_serial(ROOT / "config/studies/serial.yaml")
    params = asked.plant.params.copy()
    params["muscle"]["lock_stiffness_n_m"] = params["muscle"]["lock_viscous_n_s_m"] = 0.0
    asked = replace(
        asked, plant=replace(asked.plant, params=params), frequency_rad_s=np.array([80.0, 100.0])
    )
    return solve(asked).best_pressure_pa("stroke_m") / 1e3


def row(claim: Claim, notes: Notes) -> str:
    cells = (
        claim.where,
        notes.cell(claim.claim),
        notes.cell(claim.ours),
        f"**{claim.verdict}**",
        notes.cell(claim.why),
    )
    return "| " + " | ".join(text.replace("|", "\\|") for text in cells) + " |"


def page(parts: dict[str, list[Claim]], compared: dict) -> str:
    claims = [claim for part in parts.values() for claim in part]
    count = {
        verdict: sum(claim.verdict == verdict for claim in claims)
        for verdict in ("holds", "does not hold", "open")
    }
    lines = [
        "# What of the paper holds",
        "",
        ("For whoever has read the paper: each of its claims, what we find, and whether it holds."),
        "",
        PAPER,
        "",
        (
            "Made by `python scripts/reproduction.py`; every figure comes from the run that wrote"
            " this page. Plants: `config/plants/bench_paper.yaml`, `serial.yaml`, `knee.yaml`,"
            " `knee_geared.yaml`. How the"
        ),
        (
            "figures are computed: [identification.md](identification.md), [study.md](study.md)."
            " These are physical models, not the paper's rigs: *holds* means that such a model"
            " gives it too."
        ),
        "",
        (
            f"{len(claims)} claims: {count['holds']} hold, {count['does not hold']} do not,"
            f" {count['open']} are open in the paper's own words."
        ),
        "",
    ]
    for title, part in parts.items():
        notes = Notes()
        lines += [
            f"## {title}",
            "",
            *LEADS.get(title, ()),
            "| Where | Claim | Found here | Verdict | Why |",
            "|---|---|---|---|---|",
            *(row(claim, notes) for claim in part),
            "",
            *notes.lines(),
            "",
        ]
    lines += [
        "## Arrangements (4, outlook)",
        "",
        (
            "The least that each takes at its own best pressures, one muscle and one load; in"
            " brackets the pressures of muscle 0 and 1, kPa absolute."
        ),
        "",
        *arrangements(compared),
        "",
        (
            "A serial muscle takes way off the motor, a parallel one force; no wiring is best for"
            " all. The antagonist adds tension and, under a load that already pulls, next to"
            " nothing else."
        ),
        "",
    ]
    lines += ["## Pictures", ""] + [
        line
        for name, words in PICTURES.items()
        for line in (f"**{words}**", "", f"![{words}](pictures/study/{name}.png)", "")
    ]
    return "\n".join(lines).rstrip() + "\n"


def arrangements(compared: dict) -> list[str]:
    from epa_rt.study.arrangements import GOALS, NAMES_OF
    from epa_rt.study.report.arrangements import UNITS, said

    lines = [
        "| Least | rad/s | " + " | ".join(NAMES_OF) + " |",
        "|---|---|" + "---|" * len(NAMES_OF),
    ]
    for goal, words in GOALS.items():
        for k, omega in enumerate(compared["frequency_rad_s"]):
            cells = [
                said(
                    tuple(np.nan if v is None else v for v in compared["least"][name][goal][k]),
                    UNITS[goal][0],
                )
                for name in NAMES_OF
            ]
            lines.append(
                f"| {words.replace('|', chr(92) + '|')}, {UNITS[goal][1]} | {omega:.0f} | "
                + " | ".join(cells)
                + " |"
            )
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT / "out/reproduction")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs/reproduction.md")
    arguments = parser.parse_args()
    folder = arguments.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    found = identification(folder)
    serial, knee, compared = (study(name, folder) for name in ("serial", "knee", "arrangements"))
    geared = study("knee", folder, "knee_geared")
    parts = {
        "Identification (3.1)": identification_claims(found),
        "Serial actuator (3.2)": [
            *(Claim(**one) for one in serial["claims"]),
            *consistency(serial),
        ],
        "Knee (3.3)": [Claim(**one) for one in knee["claims"]],
        "Knee with a slower gear (3.3)": [Claim(**one) for one in geared["claims"]],
    }
    arguments.output.write_text(page(parts, compared), encoding="utf-8")
    print(arguments.output)


if __name__ == "__main__":
    main()
