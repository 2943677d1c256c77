# SPDX-License-Identifier: GPL-3.0-or-later
"""A batch on a Dask cluster: the same jobs as batch.run, on other machines.

The machines have to see the same files under the same paths: a job reads its measurement there and
writes its parameter file there. When a machine is lost, Dask gives its jobs to another; those that
had been finished find their parameter file and leave it alone. The package is sent along, so that
machines need nothing but Dask and numpy.
"""

from __future__ import annotations

import tempfile
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from ..errors import NfmError
from . import batch
from .batch import Job, Outcome, Settings

# Seconds to find the scheduler.
PATIENCE = 15


def run(jobs: Sequence[Job], settings: Settings, address: str) -> Iterator[Outcome]:
    """Fit all on the cluster at an address such as tcp://10.0.0.1:8786; yield Outcomes.

    Raises
    ------
    NfmError
        Dask is not installed here, or there is no scheduler at this address.
    """
    try:
        import distributed
    except ImportError:
        raise NfmError(
            "--dask needs the package distributed, which ./nfm fit --dask of a checkout installs"
        ) from None
    try:
        client = distributed.Client(address, timeout=PATIENCE)
    except (OSError, ValueError) as error:
        raise NfmError(
            f"--dask {address}: no Dask scheduler answers there ({error}); start one with "
            "dask scheduler"
        ) from error
    with client:
        _send_package(client)
        jobs = [Job(job.path.resolve(), job.output.resolve()) for job in jobs]
        futures = client.map(batch.fit_one, jobs, settings=settings, pure=False)
        by_key = {future.key: job for future, job in zip(futures, jobs, strict=True)}
        for future in distributed.as_completed(futures):
            job = by_key[future.key]
            error = future.exception()
            if error is None:
                yield future.result()
            else:
                yield Outcome(job, batch.FAILED, message=f"{job.path.name}: {error}")


def _send_package(client: object) -> None:
    """Put this package on every machine, also on those that join later."""
    package = Path(__file__).parents[1]
    with tempfile.TemporaryDirectory(prefix="nfm-dask-") as folder:
        archive = Path(folder, "nfm_fitter.zip")
        with zipfile.ZipFile(archive, "w") as file:
            for path in sorted(package.rglob("*.py")):
                file.write(path, path.relative_to(package.parent))
        client.upload_file(str(archive))
