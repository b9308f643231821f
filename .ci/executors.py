#!/usr/bin/env python3
"""Workers of Dask, one of which is killed, and the ranks of an MPI job give the files of one machine, of a map and of a boundary.

    .ci/executors.py FOLDER

in a Python that has the module stickslip and .ci/notebooks.txt, with mpirun in the PATH. FOLDER is made.
"""

import os
import pathlib
import signal
import subprocess
import sys

import stickslip

STUDIES = pathlib.Path(__file__).resolve().parent / "studies"
NAMES = ("map", "boundary")


def sweep(folder, who, executor=None, victims=()):
    """Both studies into files of this name. A victim among the workers is killed on the way of each."""
    victims = list(victims)
    for name in NAMES:
        told = []

        def progress(done, total):
            if victims and done and not any(done for done, _ in told):
                os.kill(victims.pop(), signal.SIGKILL)
            told.append((done, total))

        output = folder / f"{name}.{who}.h5"
        stickslip.sweep(STUDIES / f"{name}.toml", executor=executor, output=output, replace=True, progress=progress)
        done, total = told[-1]
        assert done == total > 100, told[-1]


def by_dask(folder):
    from dask.distributed import Client, LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        with Client(cluster) as client:
            sweep(folder, "dask", client.get_executor(), victims=client.run(os.getpid).values())


def by_mpi(folder):
    """Of rank 0, under python -m mpi4py.futures."""
    from mpi4py.futures import MPIPoolExecutor

    with MPIPoolExecutor() as executor:
        assert executor.num_workers == 2
        sweep(folder, "mpi", executor)


def main():
    folder = pathlib.Path(sys.argv[1])
    if sys.argv[2:] == ["mpi"]:
        return by_mpi(folder)
    folder.mkdir(parents=True, exist_ok=True)
    sweep(folder, "one")
    by_dask(folder)
    # As root, and with more ranks than processors: by Open MPI 4, and by 5, which has a launcher of its own.
    allowed = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_rmaps_base_oversubscribe": "1",
               "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe"}
    command = ["mpirun", "-n", "3", sys.executable, "-m", "mpi4py.futures", __file__, str(folder), "mpi"]
    subprocess.run(command, env={**os.environ, **allowed}, check=True, timeout=600)
    for name in NAMES:
        files = {who: (folder / f"{name}.{who}.h5").read_bytes() for who in ("one", "dask", "mpi")}
        different = [who for who in files if files[who] != files["one"]]
        assert not different, f"{name}: {different} differ from the file of one machine"
        print(f"{name}: two workers of Dask and two of an MPI job: the {len(files['one'])} bytes of one machine")


if __name__ == "__main__":
    main()
