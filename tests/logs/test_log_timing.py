"""The statistics of each second."""

import numpy as np

from epa_rt.logs.layout import FLAG_OVERRUN
from epa_rt.logs.reader import LogReader
from epa_rt.logs.timing import statistics


def test_each_second_is_told_apart(whole_log):
    with LogReader(whole_log) as log:
        timing = log.columns("/timing")
        cycle = log.columns("/cycle")
    assert timing["samples"].tolist() == [1000] * 9 + [500]
    assert timing["cycle"].tolist() == [*range(999, 9500, 1000), 9499]
    assert timing["overruns"].tolist() == [10] * 9 + [5]
    for quantity in ("lateness", "busy"):
        seconds = np.split(cycle[f"{quantity}_ns"], range(1000, 9500, 1000))
        for name, share in (("p50", 0.5), ("p99", 0.99), ("p999", 0.999), ("max", 1.0)):
            expected = [np.quantile(second, share, method="inverted_cdf") for second in seconds]
            np.testing.assert_array_equal(timing[f"{quantity}_{name}_ns"], expected)
        assert (timing[f"{quantity}_histogram"].sum(axis=1) == timing["samples"]).all()


def test_a_value_on_an_edge_belongs_below_it():
    values_ns = np.array([-5, 0, 1000, 1001, 2000, 10**9])
    fields = statistics(values_ns, values_ns, np.full(6, FLAG_OVERRUN, np.uint32))
    assert fields["lateness_histogram"][:3] == [3, 2, 0]
    assert fields["lateness_histogram"][-1] == 1
    assert fields["overruns"] == fields["samples"] == 6


def test_one_sample_is_its_own_statistics():
    fields = statistics(np.array([7]), np.array([9]), np.zeros(1, np.uint32))
    assert {fields[f"lateness_{name}_ns"] for name in ("p50", "p99", "p999", "max")} == {7}
    assert fields["busy_max_ns"] == 9
