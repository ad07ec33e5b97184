"""Who does the work: this process, processes beside it, or a Dask cluster; the results are the same.

A worker that dies loses nothing: what it was at is done again by another.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.connection import wait
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from scenarios.errors import InputError

if TYPE_CHECKING:
    from distributed import Client

Progress = Callable[[int], None]
"""Is told how many more frames are done."""
Result_co = TypeVar("Result_co", covariant=True)
Result = TypeVar("Result")

LIVES = 3
"""So many times in a row workers may die before anything is done."""
PATIENCE = "20s"
"""So long is waited for a cluster."""


class Work(Protocol[Result_co]):
    """One seed's work; it can be pickled, and done twice does no harm."""

    def __call__(self, seed: int, *, progress: Progress | None = None) -> Result_co:
        """Do it; tell ``progress``, where given, about each frame."""


class WorkersLostError(RuntimeError):
    """Workers died again and again at the same work."""


class Workers(Protocol):
    """Whoever does work for many seeds."""

    def each(
        self, work: Work[Result], seeds: Sequence[int], *, frames: int, progress: Progress | None
    ) -> Iterator[tuple[int, Result]]:
        """Do the work for every seed.

        Args:
            work: What to do.
            seeds: For which.
            frames: How many each of them has.
            progress: Called in this process, now and then.

        Yields:
            Each seed and its result, in the order in which they are ready.

        Raises:
            WorkersLostError: If workers die at the same work again and again.
        """


@contextmanager
def open_workers(jobs: int, cluster: str | None = None) -> Iterator[Workers]:
    """Give workers, and let them go at the end.

    Args:
        jobs: Processes on this machine, where there is no cluster; 1 is this process itself.
        cluster: Address of a Dask scheduler, such as ``tcp://10.0.0.1:8786``.

    Raises:
        InputError: If the cluster cannot be reached.
    """
    if cluster is None:
        yield ThisProcess() if jobs == 1 else LocalPool(jobs)
        return
    with _client(cluster) as client:
        yield DaskCluster(client)


class ThisProcess:
    """Does one seed after another."""

    def each(
        self,
        work: Work[Result],
        seeds: Sequence[int],
        *,
        frames: int,  # noqa: ARG002 (the work itself tells)
        progress: Progress | None,
    ) -> Iterator[tuple[int, Result]]:
        """See `Workers.each`."""
        for seed in seeds:
            yield seed, work(seed, progress=progress)


class LocalPool:
    """Processes on this machine, spawned: a forked one would hang in GL."""

    def __init__(self, jobs: int) -> None:
        self._jobs = jobs

    def each(
        self, work: Work[Result], seeds: Sequence[int], *, frames: int, progress: Progress | None
    ) -> Iterator[tuple[int, Result]]:
        """See `Workers.each`."""
        # The workers share the cores: each draws on one thread. Mesa reads this when its first context is
        # made, and spawned processes inherit it before they import anything.
        os.environ["LP_NUM_THREADS"] = "1"
        left, lives = list(seeds), LIVES
        while left:
            try:
                for seed, result in self._round(work, left):
                    left.remove(seed)
                    lives = LIVES
                    yield seed, result
                    if progress is not None:
                        progress(frames)
            except BrokenProcessPool as error:
                lives -= 1
                if lives == 0:
                    raise WorkersLostError(f"workers died {LIVES} times in a row, at seeds {left}") from error

    def _round(self, work: Work[Result], seeds: Sequence[int]) -> Iterator[tuple[int, Result]]:
        """Yield what one pool gets done before it breaks, if it does."""
        spawn = multiprocessing.get_context("spawn")
        jobs = min(self._jobs, len(seeds))
        with ProcessPoolExecutor(jobs, mp_context=spawn, initializer=_start_worker) as pool:
            before = set(multiprocessing.active_children())
            try:
                futures = {pool.submit(work, seed): seed for seed in seeds}
                for future in as_completed(futures):
                    yield futures[future], future.result()
            except BaseException:
                # Whoever waits for the pool would wait for whole episodes.
                pool.shutdown(wait=False, cancel_futures=True)
                for process in set(multiprocessing.active_children()) - before:
                    process.terminate()
                raise


def _start_worker() -> None:
    """Let a worker end without a word when it is interrupted, and when its parent is gone.

    The parent is interrupted too, and speaks for all. One that is killed cannot tell its workers.
    """
    signal.signal(signal.SIGINT, lambda _number, _frame: os._exit(130))
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)


class DaskCluster:
    """The workers of a Dask cluster; what work writes, it writes to a folder that all machines see."""

    def __init__(self, client: Client) -> None:
        self._client = client

    def each(
        self, work: Work[Result], seeds: Sequence[int], *, frames: int, progress: Progress | None
    ) -> Iterator[tuple[int, Result]]:
        """See `Workers.each`."""
        from distributed import KilledWorker
        from distributed import as_completed as ready

        tasks = {self._client.submit(_alone, work, seed, pure=False): seed for seed in seeds}
        try:
            for task in ready(tasks):
                yield tasks[task], task.result()
                if progress is not None:
                    progress(frames)
        except KilledWorker as error:
            raise WorkersLostError(f"workers of the cluster died again and again: {error}") from error
        finally:
            self._client.cancel(list(tasks))


_ONE_AT_A_TIME = threading.Lock()


def _alone(work: Work[Result], seed: int) -> Result:
    """Do work while no other thread of the process does: it has one GL context."""
    with _ONE_AT_A_TIME:
        return work(seed)


@contextmanager
def _client(address: str) -> Iterator[Any]:
    try:
        from distributed import Client
    except ImportError as error:
        raise InputError("--cluster needs Dask: pip install 'testtrack[cluster]'") from error
    try:
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:  # a timeout is an OSError
        raise InputError(
            f"--cluster {address}: no Dask scheduler there ({str(error).splitlines()[0]}); "
            "wanted an address such as tcp://10.0.0.1:8786"
        ) from error
    with client:
        yield client
