"""Workers that die, and what is left of the work: all of it."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from scenarios.errors import InputError
from scenarios.workers import LocalPool, ThisProcess, WorkersLostError, open_workers


def square(seed, *, progress=None):
    if progress is not None:
        progress(5)
    return seed * seed


def die_once(folder: Path, seed, *, progress=None):
    """Kill the worker that first comes to seed 2."""
    mark = folder / "died"
    if seed == 2 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return seed * seed


def always_die(seed, *, progress=None):
    os.kill(os.getpid(), signal.SIGKILL)


def refuse(seed, *, progress=None):
    raise InputError(f"no {seed}")


def slow(folder: Path, seed, *, progress=None):
    """Say which process is at work, and take a while."""
    (folder / f"{seed}-{os.getpid()}").touch()
    time.sleep(0.4)
    return seed * seed


def test_this_process_does_one_after_another():
    told = []
    with open_workers(1) as workers:
        assert isinstance(workers, ThisProcess)
        assert list(workers.each(square, [3, 1], frames=5, progress=told.append)) == [(3, 9), (1, 1)]
    assert told == [5, 5]


def test_a_worker_that_dies_loses_nothing(tmp_path):
    told = []
    with open_workers(2) as workers:
        done = list(workers.each(partial(die_once, tmp_path), range(5), frames=7, progress=told.append))
    assert (tmp_path / "died").exists()
    assert sorted(done) == [(k, k * k) for k in range(5)]
    assert told == [7] * 5
    assert not multiprocessing.active_children()


def test_workers_that_always_die_are_given_up():
    with pytest.raises(WorkersLostError, match="3 times"):
        list(LocalPool(1).each(always_die, [4], frames=1, progress=None))


def test_an_error_of_the_work_is_raised_here():
    with pytest.raises(InputError, match=r"no [45]"):
        list(LocalPool(2).each(refuse, [4, 5], frames=1, progress=None))
    # The pool's own thread waits for its processes, too: for a moment neither may know that one has ended.
    deadline = time.monotonic() + 30
    while multiprocessing.active_children() and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not multiprocessing.active_children()


def test_no_cluster_there():
    with pytest.raises(InputError, match="no Dask scheduler"), open_workers(1, "no address"):
        pass


def test_workers_end_with_a_parent_that_is_killed(tmp_path):
    program = (
        "from functools import partial\nfrom pathlib import Path\n"
        "from scenarios.workers import LocalPool\nfrom tests.scenarios.test_workers import slow\n"
        "if __name__ == '__main__':\n"
        f"    work = partial(slow, Path({str(tmp_path)!r}))\n"
        "    list(LocalPool(2).each(work, range(2000), frames=1, progress=None))\n"
    )
    (script := tmp_path.parent / "killed.py").write_text(program)
    parent = subprocess.Popen([sys.executable, str(script)], env=os.environ | {"PYTHONPATH": os.getcwd()})
    while len(workers := {entry.name.partition("-")[2] for entry in tmp_path.iterdir()}) < 2:
        assert parent.poll() is None
        time.sleep(0.05)
    parent.kill()
    parent.wait()
    while any(alive(int(worker)) for worker in workers):  # for ever, if they do not
        time.sleep(0.05)


def alive(pid):
    """Say whether a process runs; one that has ended and waits to be reaped does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.slow
def test_a_worker_of_a_cluster_that_is_killed_loses_nothing(tmp_path):
    from distributed import LocalCluster

    with (
        LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        open_workers(1, cluster.scheduler_address) as workers,
    ):
        killed, done = None, []
        for seed, result in workers.each(partial(slow, tmp_path), range(8), frames=1, progress=None):
            done.append((seed, result))
            if killed is None:
                killed = int(next(tmp_path.iterdir()).name.partition("-")[2])
                os.kill(killed, signal.SIGKILL)
    assert sorted(done) == [(k, k * k) for k in range(8)]
    assert len({entry.name.partition("-")[2] for entry in tmp_path.iterdir()}) >= 2
