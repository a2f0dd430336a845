"""Hygiene: damaged logs are found out, healthy ones are left alone."""

import dataclasses

import numpy as np
import pytest

from epa_rt.gap.hygiene.check import check, clean
from epa_rt.gap.hygiene.twice import check_twice
from tests.gap.foreign.made import one_trial
from tests.gap.recorded import (
    column,
    cut_at,
    gone,
    late,
    lost,
    recording_of,
    rig_of_name,
    rows_left,
    scaled,
    stamps,
    swapped,
    written_over,
)

LOGS = {
    "bench": "identification_short",
    "bench_analog": "step",
    "knee": "knee_chirp_short",
    "mass": "mass_sine",
}
HEALTHY = [
    *((rig, experiment, "") for rig, experiment in LOGS.items()),
    ("bench", "identification_short", "effects"),
    ("bench", "identification_short", "noisy"),
    ("knee", "knee_chirp_short", "effects"),
    ("knee", "knee_chirp_short", "noisy"),
]

P, F, X, V, I = (
    "muscle_pressure_pa",
    "muscle_force_n",
    "motor_travel_m",
    "motor_speed_m_s",
    "motor_current_a",
)
BENCH = [
    # a thousandth: test_hygiene_decimals.py
    *(
        (f"{name} x 1000", scaled(name, 1e3), "units|outside limits", "refuse", name)
        for name in (P, F, X, V, I)
    ),
    ("force in lbf", scaled(F, 0.2248089), "units", "refuse", F),
    ("force in kgf", scaled(F, 0.1019716), "units", "refuse", F),
    ("pressure in bar", scaled(P, 1e-5), "units", "refuse", P),
    ("gauge for absolute", scaled(P, 1.0, -101325.0), "zero", "refuse", P),
    ("absolute for gauge", scaled(P, 1.0, 101325.0), "zero", "refuse", P),
    *(
        (f"{name} {word}", written_over(name, value), "dropped channel", "refuse", name)
        for name in (P, F, X, I)
        for word, value in (("0", 0.0), ("nan", np.nan))
    ),
    ("speed gone", written_over(V, np.nan), "dropped channel", "refuse", V),
    ("one nan", written_over(F, np.nan, 6000, 6001), "invalid", "exclude", F),
    ("nan for a while", written_over(P, np.nan, 6000, 6300), "invalid", "exclude", P),
    *(
        (f"{name} frozen", written_over(name, None, 6300, 6900), "frozen|disagree", "exclude", name)
        for name in (P, F, X, V, I)
    ),
    *(
        (f"{name} cut off", cut_at(name, 0.9), "saturated|disagree", "exclude", name)
        for name in (P, F, X, V, I)
    ),
    *(
        (f"{name} {rows} rows late", late(name, rows), "skew", "refuse", None)
        for name, rows in ((P, -30), (F, -30), (I, 30), (I, -30))
    ),
    *(
        (f"{name} {rows} rows late, which is a law", late(name, rows), "skew", "note", name)
        for name, rows in ((P, 30), (F, 30), (F, 18))
    ),
    ("current 18 rows late, which a rig may do by itself", late(I, 18), "skew", "note", None),
    ("speed 8 rows late", late(V, 8), "skew", "refuse", V),
    # the end of what is searched: a drift while all else stands looks the same
    ("pressure 110 rows early", late(P, -110), "skew", "note", None),
    *(
        (f"{name} turned round", scaled(name, -1.0), "sign|outside limits|units", "refuse", None)
        for name in (P, F, X, V, I)
    ),
    (
        "pressure frozen while it is vented",
        written_over(P, None, 11600, 12200),
        "frozen",
        "exclude",
        P,
    ),
    ("pressure spike", written_over(P, 700e3, 9000, 9001), "spike", "exclude", P),
    ("force spike", written_over(F, 500.0, 9000, 9001), "spike", "exclude", F),
    ("force gone for a while", gone(F, 7000, 9000), "gone", "exclude", F),
    ("pressure gone for a while", gone(P, 7000, 7400), "gone", "exclude", P),
    ("travel spike", written_over(X, 0.02, 9000, 9001), "spike|disagree", "exclude", None),
    ("1 % lost", lost(0.01), "lost cycles", "exclude", ""),
    ("30 % lost", lost(0.3), "lost cycles", "refuse", ""),
    (
        "1 % lost, numbered on",
        lambda r: dataclasses.replace(lost(0.01)(r), cycle=np.arange(len(lost(0.01)(r).cycle))),
        "clock step|clock",
        None,
        "",
    ),
    (
        "clock + 5 ms",
        stamps(lambda t: t + 5_000_000 * (np.arange(len(t)) > 9000)),
        "clock step",
        "exclude",
        "",
    ),
    (
        "clock - 1 s",
        stamps(lambda t: t - 1_000_000_000 * (np.arange(len(t)) > 9000)),
        "clock step",
        "exclude",
        "",
    ),
    ("clock drifts", stamps(lambda t: (t * 1.003).astype(np.int64)), "clock drift", "refuse", ""),
    ("another period", stamps(lambda t: t * 2), "period", "refuse", ""),
    ("travel and speed swapped", swapped(X, V), "swapped|units|outside limits", "refuse", None),
    ("force and pressure swapped", swapped(F, P), "units|outside limits", "refuse", None),
    (
        "the drive never on",
        written_over("drive_status_raw", 0.0),
        "drive off",
        "refuse",
        "drive_status_raw",
    ),
    (
        "a word of another kind",
        written_over("drive_status_raw", 17.0),
        "drive off",
        "refuse",
        "drive_status_raw",
    ),
    (
        "a word that is none",
        written_over("drive_mode_raw", 8.4, 6000, 6001),
        "word",
        "refuse",
        "drive_mode_raw",
    ),
    (
        "a valve half open",
        written_over("cmd_muscle_inlet_open", 0.5, 6000, 6001),
        "word",
        "refuse",
        "cmd_muscle_inlet_open",
    ),
    (
        "a valve that counts to 255",
        scaled("cmd_muscle_inlet_open", 255.0),
        "word",
        "refuse",
        "cmd_muscle_inlet_open",
    ),
    (
        "a channel missing",
        lambda r: dataclasses.replace(r, columns={k: v for k, v in r.columns.items() if k != F}),
        "log",
        "refuse",
        None,
    ),
]
KNEE = [
    (
        "degrees for rad",
        scaled("knee_angle_rad", 57.29578),
        "units|outside limits",
        "refuse",
        "knee_angle_rad",
    ),
    (
        "pressures swapped",
        swapped("spam_pressure_pa", "ppam_pressure_pa"),
        "swapped",
        "refuse",
        None,
    ),
    *(
        (f"joint {rows} rows late", late("knee_angle_rad", rows), "skew", "note", "knee_angle_rad")
        for rows in (30, -30)
    ),
    (
        "joint frozen",
        written_over("knee_angle_rad", None, 18000, 18600),
        "frozen|saturated",
        "exclude",
        "knee_angle_rad",
    ),
    ("force pushes", scaled("spam_force_n", -1.0), "sign", "refuse", "spam_force_n"),
]


@pytest.mark.parametrize(("rig", "experiment", "kind"), HEALTHY)
def test_nothing_is_found_in_a_healthy_log(rig, experiment, kind):
    assert [
        finding.says for finding in check([recording_of(rig, experiment, kind)], rig_of_name(rig))
    ] == []


@pytest.mark.parametrize(
    ("damage", "kinds", "severity", "channel"),
    [case[1:] for case in BENCH],
    ids=[case[0] for case in BENCH],
)
def test_damage_to_a_bench_log_is_found(damage, kinds, severity, channel):
    _found("bench", damage, kinds, severity, channel)


@pytest.mark.parametrize(
    ("damage", "kinds", "severity", "channel"),
    [case[1:] for case in KNEE],
    ids=[case[0] for case in KNEE],
)
def test_damage_to_a_knee_log_is_found(damage, kinds, severity, channel):
    _found("knee", damage, kinds, severity, channel)


def _found(rig, damage, kinds, severity, channel):
    recording = damage(recording_of(rig, LOGS[rig]))
    findings = check([recording], rig_of_name(rig))
    fitting = [
        f
        for f in findings
        if f.kind in kinds.split("|")
        and severity in (None, f.severity)
        and channel in (None, f.channel)
    ]
    assert fitting, [f.says for f in findings]
    for finding in findings:
        assert finding.says.startswith(recording.name) and "\n" not in finding.says
        assert finding.severity != "exclude" or finding.rows or finding.kind == "lost cycles"
    order = [finding.severity for finding in findings]
    assert order == sorted(order, key=["refuse", "exclude", "note"].index)


def test_logs_of_two_rigs_are_refused():
    both = [recording_of("bench", LOGS["bench"]), recording_of("knee", LOGS["knee"])]
    first = check(both, rig_of_name("bench"))[0]
    assert (first.severity, first.kind) == (
        "refuse",
        "mixed rigs",
    ) and "found logs of 2 rigs" in first.says


def test_lost_cycles_are_counted_to_the_last():
    recording = recording_of("bench", LOGS["bench"])
    kept = np.random.default_rng(5).random(recording.samples) >= 0.01
    kept[[0, -1]] = True
    finding = next(
        f
        for f in check([rows_left(recording, kept)], rig_of_name("bench"))
        if f.kind == "lost cycles"
    )
    assert f"found {(~kept).sum()} lost cycles" in finding.says


def test_what_is_excluded_is_taken_out_and_the_rest_stays_as_it_was():
    recording = recording_of("bench", LOGS["bench"])
    kept = np.random.default_rng(5).random(recording.samples) >= 0.01
    kept[[0, -1]] = True
    damaged = column(
        rows_left(recording, kept),
        F,
        np.where(np.arange(kept.sum()) == 5000, np.nan, recording.columns[F][kept]),
    )
    cleaned = clean([damaged], check([damaged], rig_of_name("bench")))[0]
    assert (
        np.array_equal(cleaned.cycle, recording.cycle)
        and cleaned.spans == recording.spans
        and np.array_equal(cleaned.t_ns, recording.t_ns)
    )
    nan_row = np.flatnonzero(kept)[5000]
    for name in (P, F, X):
        gone = ~kept | (np.arange(len(kept)) == nan_row) * (name == F)
        assert np.array_equal(np.isnan(cleaned.columns[name]), gone)
        assert np.array_equal(cleaned.columns[name][~gone], recording.columns[name][~gone])
    assert np.isfinite(cleaned.columns["cmd_motor_speed_m_s"]).all()
    assert any("lost cycles" in sentence for sentence in cleaned.found) and any(
        "no valid value" in sentence for sentence in cleaned.found
    )


@pytest.mark.parametrize("rows", [None, 9000])
def test_one_recording_under_two_names_is_refused(rows):
    """A copy, or a copy cut short, would weigh twice, or judge itself as its own holdout."""
    recording = recording_of("bench", LOGS["bench"])
    copy = dataclasses.replace(
        recording if rows is None else rows_left(recording, np.arange(recording.samples) < rows),
        name="copy",
    )
    for pair in ([recording, copy], [copy, recording]):
        twice = [
            finding for finding in check(pair, rig_of_name("bench")) if finding.kind == "twice"
        ]
        assert (
            [finding.severity for finding in twice] == ["refuse"]
            and "copy" in twice[0].says
            and recording.name in twice[0].says
        )
    other = recording_of("bench", LOGS["bench"], "noisy")
    assert not any(
        finding.kind == "twice"
        for finding in check(
            [recording, dataclasses.replace(other, name="other")], rig_of_name("bench")
        )
    )


@pytest.mark.parametrize(("start", "stop"), [(12_000, 15_000), (1, None), (-40, None)])
def test_a_piece_of_a_recording_is_refused_wherever_it_begins(start, stop):
    recording = recording_of("bench", LOGS["bench"])
    rows = np.zeros(recording.samples, bool)
    rows[start:stop] = True
    piece = dataclasses.replace(rows_left(recording, rows), name="piece")
    first = start % recording.samples
    for pair in ([recording, piece], [piece, recording]):
        twice = [
            finding for finding in check(pair, rig_of_name("bench")) if finding.kind == "twice"
        ]
        assert [finding.severity for finding in twice] == ["refuse"]
        assert twice[0].says.startswith(
            f"piece: found every one of its {rows.sum()} rows in {recording.name} too, from"
            f" {first * recording.period_s:.3f} s on"
        )
    noisy = column(
        piece, F, np.where(np.arange(rows.sum()) == 20, piece.columns[F] + 1e-3, piece.columns[F])
    )
    assert not [
        finding
        for finding in check([recording, noisy], rig_of_name("bench"))
        if finding.kind == "twice"
    ]


def test_two_rests_without_noise_are_two():
    """Of which one is as long as a stretch of the other, to the last digit, and has no more than a
    step.
    """
    place = np.concatenate(
        [0.1 * np.sin(np.arange(3000) * 1e-2), np.full(4000, 0.02), np.full(3000, 0.05)]
    )
    moved, rested = (
        one_trial(name, "cart", 1e-3, {"cart_position_m": values})
        for name, values in (("moved", place), ("rested", place[5000:9000]))
    )
    assert not check_twice([moved, rested])


@pytest.mark.parametrize(
    ("factor", "kind", "words"),
    [
        (1.0, "", ""),
        (1.3, "", ""),
        (1e3, "units", "by a thousand"),
        (-1.0, "sign", "expected it to follow"),
    ],
)
def test_a_position_of_others_is_held_against_what_it_was_asked_to_be(factor, kind, words):
    recording = recording_of("bench", LOGS["bench"])
    theirs = dataclasses.replace(
        recording,
        attachments={},
        columns={
            "cart_position_m": factor * recording.columns[X],
            "ref_cart_position_m": recording.columns[X],
        },
    )
    found = [finding for finding in check([theirs], None) if finding.severity == "refuse"]
    assert [finding.kind for finding in found] == [kind][: bool(kind)] and all(
        words in finding.says for finding in found
    )


def test_a_factor_is_named_as_a_mistake_that_this_unit_can_be():
    recording = recording_of("bench", LOGS["bench"])
    says = [
        f.says
        for f in check([scaled(F, 1e-3)(recording)], rig_of_name("bench"))
        if f.kind == "units"
    ]
    assert says and says[0].endswith("by a thousandth"), says


def test_cycles_twice_are_left_out():
    recording = recording_of("bench", LOGS["bench"])
    rows = np.sort(np.concatenate([np.arange(recording.samples), np.arange(2000, 2050)]))
    twice = dataclasses.replace(
        recording,
        cycle=recording.cycle[rows],
        t_ns=recording.t_ns[rows],
        spans=(),
        columns={name: values[rows] for name, values in recording.columns.items()},
    )
    findings = check([twice], rig_of_name("bench"))
    assert any(f.kind == "repeated cycles" and "found 50 cycles twice" in f.says for f in findings)
    assert np.array_equal(clean([twice], findings)[0].cycle, recording.cycle)


def test_a_healthy_recording_is_not_touched():
    recording = recording_of("knee", LOGS["knee"])
    cleaned = clean([recording], ())[0]
    assert all(
        np.array_equal(cleaned.columns[name], values, equal_nan=True)
        for name, values in recording.columns.items()
    )


@pytest.mark.parametrize("most", [1e40, 1e200, 1e308])
def test_a_recording_that_ran_away_is_refused_in_one_sentence(most):
    values = np.geomspace(1e-3, most, 2000) * np.tile([1.0, -1.0], 1000)
    log = one_trial("loop", "slide", 1e-3, {"x_m": np.sin(values), "f_n": values})
    (one,) = check([log], None)
    assert (one.severity, one.kind, one.channel) == ("refuse", "ran away", "f_n")
    assert one.says.startswith(f"loop: f_n: found values of up to {most:.3g}, expected none above")
