"""Open an executor on a Dask cluster: a scheduler and workers that somebody has started."""

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from importlib.metadata import version

from fabweave.core.errors import CannotMakeError, InputError
from fabweave.core.parallel.executors import Executors, SignalSafeExecutor

_ANSWER_S = 30.0  # how long to wait for a scheduler and a first worker
_SAME = ("fabweave", "numpy", "scipy", "shapely")  # what decides every bit of a layout


def cluster_at(address: str) -> Executors:
    """Return what opens an executor on the Dask cluster at an address.

    Parameters
    ----------
    address : str
        Of the scheduler, such as ``tcp://192.168.1.20:8786``.

    Returns
    -------
    callable
        Raises InputError, when it is called, if nobody answers there, or if a worker has another
        version of anything that decides the result. When it has lost its last worker, it waits
        for the next one.

    Raises
    ------
    InputError
        If Dask is not installed: this is known before anything is made.

    References
    ----------
    https://distributed.dask.org: ``Client.get_executor``. A scheduler hands the tasks of a worker
    that it has lost to another one.
    """
    try:
        from distributed import Client, KilledWorker  # noqa: PLC0415 -- an extra, and slow to import
    except ImportError as error:
        raise InputError(
            "--cluster needs Dask: install it with pip install 'fabweave[cluster]'"
        ) from error

    @contextmanager
    def opened() -> Iterator[Executor]:
        try:
            client = Client(address, timeout=_ANSWER_S, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            raise InputError(
                f"no Dask scheduler answers at {address!r} ({error}); start one with "
                "`dask scheduler` and workers with `dask worker ADDRESS`, and give its address, "
                "such as tcp://192.168.1.20:8786"
            ) from error
        with client:
            try:
                client.wait_for_workers(1, timeout=_ANSWER_S)
            except TimeoutError as error:
                raise InputError(
                    f"the cluster at {address} has no worker: start some with "
                    f"`dask worker {address}`"
                ) from error
            require_same(address, client.run(versions, on_error="return"))
            executor = SignalSafeExecutor(client.get_executor(pure=False))
            try:
                yield executor
            except KilledWorker as error:
                raise CannotMakeError(
                    f"part of the work was lost on the cluster at {address} again and again "
                    f"({error}); make sure that its workers have enough memory"
                ) from error
            finally:
                executor.shutdown(wait=False)

    return opened


def versions() -> dict[str, str]:
    """Return the versions of what decides a result, as they are installed here."""
    return {name: version(name) for name in _SAME}


def require_same(address: str, found: dict[str, object]) -> None:
    """Raise InputError unless each worker has what is installed here.

    Parameters
    ----------
    address : str
        Of the cluster.
    found : dict
        What `versions` returned on each worker, by the worker's address.
    """
    mine = versions()
    other = []
    for worker, theirs in sorted(found.items()):
        if not isinstance(theirs, dict):
            other.append(f"{worker} (no fabweave: {theirs})")
        elif theirs != mine:
            differ = [f"{name} {theirs.get(name)}" for name in _SAME if theirs[name] != mine[name]]
            other.append(f"{worker} ({', '.join(differ)})")
    if other:
        wanted = ", ".join(f"{name} {mine[name]}" for name in _SAME)
        raise InputError(
            f"{len(other)} of {len(found)} workers of the cluster at {address} would not give "
            f"the same result: {'; '.join(other[:4])}; install the versions that are here: {wanted}"
        )
