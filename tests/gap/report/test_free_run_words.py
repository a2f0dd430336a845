"""What free run says, in a sentence that does not name what the diagnosis does not name."""

from epa_rt.gap.diagnosis import Diagnosis, FreeRun, Named
from epa_rt.gap.report.words import free_run_words

LEAK = Named("leak", "leak", "gas", (), 0.9, 500.0)


def told(heard, effects=()):
    return free_run_words(
        Diagnosis(
            "explained" if effects else "not_in_catalogue", "", effects=effects, free_run=heard
        )
    )


def test_without_a_model_of_the_whole_nothing_is_said():
    assert told(None) == ""


def test_no_gap_is_said_to_be_none():
    assert "shows no gap" in told(FreeRun(12.0, 12.0, None, ()))


def test_a_named_effect_explains():
    says = told(FreeRun(900.0, 18.0, 0.98, ("leak",)), (LEAK,))
    assert "leak explains 98 % of it" in says


def test_what_is_not_named_only_comes_nearest():
    assert "what comes nearest (frame mode) explains 11 %" in told(
        FreeRun(900.0, 801.0, 0.11, ("frame_mode",))
    )
    assert "nothing named explains" in told(FreeRun(900.0, 900.0, 0.0, ()))
