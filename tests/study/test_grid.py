"""Grids: stored per point, gone on with after an interruption, the same on threads, processes and a
Dask cluster.
"""

import math

import pytest

from epa_rt.models.plant_file import load_plant
from epa_rt.study import grid
from tests.study.made import SERIAL, task

POINTS = [
    (p * 1e3, w) for w in (60.0, 80.0) for p in (300.0, 500.0, 600.0, 700.0, 800.0, 900.0, 1000.0)
]


@pytest.fixture(scope="module")
def job():
    return task(load_plant(SERIAL).params)


@pytest.fixture(scope="module")
def wanted(job):
    return grid.solve(job, POINTS, grid.Store(None, "x", "y"), grid.How(jobs=1))


class Counted:
    """Says how often it was called, and stops after some."""

    def __init__(self, job, most=10**9):
        self.job, self.calls, self.most = job, 0, most

    def __call__(self, at):
        if self.calls == self.most:
            raise KeyboardInterrupt
        self.calls += 1
        return self.job(at)


def test_an_interrupted_grid_goes_on_where_it_was(job, wanted, tmp_path):
    store = grid.Store(tmp_path, "serial", "key")
    with pytest.raises(KeyboardInterrupt):
        grid.solve(Counted(job, len(POINTS) // 2), POINTS, store, grid.How(jobs=1))
    kept = len(store.read())
    assert 0 < kept < len(POINTS)
    rest = Counted(job)
    assert grid.solve(rest, POINTS, store, grid.How(jobs=1)) == wanted
    assert rest.calls == len(POINTS) - kept
    again = Counted(job)
    assert grid.solve(again, POINTS, store, grid.How(jobs=1)) == wanted
    assert again.calls == 0


def test_a_line_cut_off_is_computed_again(job, wanted, tmp_path):
    store = grid.Store(tmp_path, "serial", "key")
    grid.solve(job, POINTS, store, grid.How(jobs=1))
    whole = store.path.read_bytes()
    store.path.write_bytes(whole[: len(whole) * 2 // 3])
    rest = Counted(job)
    assert grid.solve(rest, POINTS, store, grid.How(jobs=1)) == wanted
    assert 0 < rest.calls < len(POINTS)
    assert (
        grid.solve(Counted(job, 0), POINTS, store, grid.How(jobs=1)) == wanted
    )  # a cut line spoils no later one


def test_threads_give_the_same(job, wanted):
    assert grid.solve(job, POINTS, grid.Store(None, "x", "y"), grid.How(jobs=2)) == wanted


def test_other_inputs_have_another_key():
    assert grid.key_of("serial", 1.0) != grid.key_of("serial", 2.0)
    assert grid.key_of("serial", 1.0) == grid.key_of("serial", 1.0)


def test_what_ran_away_is_remembered_as_such(tmp_path):
    store = grid.Store(tmp_path, "serial", "key")
    store.add([((1.0, 2.0), {"stroke_m": math.nan})])
    assert math.isnan(store.read()[(1.0, 2.0)]["stroke_m"])


def test_a_store_that_cannot_be_written_says_so(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(grid.GridError, match="cannot be written"):
        grid.Store(tmp_path / "file", "serial", "key").add([((1.0,), {"a": 1.0})])


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("distributed")
    try:
        made = distributed.LocalCluster(
            n_workers=1,
            threads_per_worker=1,
            processes=False,
            dashboard_address=None,
            host="127.0.0.1",
            protocol="tcp",
        )
    except (OSError, RuntimeError) as error:
        pytest.skip(f"no local Dask cluster here: {error}")
    with made:
        yield made.scheduler_address


@pytest.mark.filterwarnings("ignore")
def test_a_dask_cluster_gives_the_same(job, wanted, cluster, tmp_path):
    store = grid.Store(tmp_path, "serial", "key")
    assert grid.solve(job, POINTS[:8], store, grid.How(cluster=cluster)) == wanted[:8]
    assert len(store.read()) == 8
    assert grid.solve(job, POINTS, store, grid.How(cluster=cluster)) == wanted


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense://x", "nonsense"])
@pytest.mark.filterwarnings("ignore")
def test_no_cluster_is_one_sentence(job, address):
    with pytest.raises(grid.GridError, match="--cluster: found no Dask scheduler"):
        grid.solve(job, POINTS[:1], grid.Store(None, "x", "y"), grid.How(cluster=address))


@pytest.mark.parametrize(
    "spoil",
    [
        lambda text: b"\xff\xfe\x00" + text,
        lambda text: text.replace(b'"stroke_m"', b'"stroke"', 1),
        lambda text: text.replace(b'"stroke_m": ', b'"stroke_m": "much", "x": ', 1),
        lambda text: text.replace(b'"at": [', b'"at": ["a", ', 1),
    ],
    ids=("binary", "figure lost", "figure of text", "place of text"),
)
def test_a_spoilt_line_is_computed_again(job, wanted, tmp_path, spoil):
    store = grid.Store(tmp_path, "serial", "key")
    grid.solve(job, POINTS, store, grid.How(jobs=1))
    store.path.write_bytes(spoil(store.path.read_bytes().lstrip()))
    rest = Counted(job)
    assert grid.solve(rest, POINTS, store, grid.How(jobs=1)) == wanted
    assert rest.calls == 1


def test_a_store_that_cannot_be_read_says_so(job, tmp_path):
    store = grid.Store(tmp_path, "serial", "key")
    store.path.mkdir()
    with pytest.raises(grid.GridError, match="cannot be read"):
        grid.solve(job, POINTS, store, grid.How(jobs=1))
