"""A Dask cluster as the place where runs are made."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from bslam.errors import BslamError, pip_install
from bslam.runs.sweep import code_digest

_PATIENCE_S = 10


@contextlib.contextmanager
def cluster(address: str) -> Iterator[str]:
    """joblib's back end for the scheduler at `address`, while the context lasts. Raises BslamError.

    Every worker must have this very version of the program.
    """
    try:
        from distributed import Client
    except ImportError as error:
        allowed = pip_install("dask", "distributed")
        raise BslamError(f"--cluster: {error}; allowed: {allowed}") from error
    try:
        client = Client(address, timeout=_PATIENCE_S, set_as_default=True)
    except (OSError, ValueError, TypeError) as error:
        allowed = "the address of a Dask scheduler, tcp://HOST:8786 say"
        raise BslamError(
            f"--cluster {address}: {error or type(error).__name__}; allowed: {allowed}"
        ) from error
    with client:
        _check_workers(client, address)
        yield "dask"


def _check_workers(client: object, address: str) -> None:
    try:
        there: dict[str, str] = client.run(code_digest)  # type: ignore[attr-defined]
    except Exception as error:  # whatever a worker says when it does not know the program
        raise BslamError(
            f"--cluster {address}: {error}; allowed: workers that have bslam installed"
        ) from error
    if not there:
        raise BslamError(f"--cluster {address}: it has no worker; allowed: dask worker {address}")
    here = code_digest()
    other = [worker for worker, digest in there.items() if digest != here]
    if other:
        allowed = "the version that is installed here"
        raise BslamError(f"--cluster {address}: worker {other[0]} has another bslam; allowed: {allowed}")
