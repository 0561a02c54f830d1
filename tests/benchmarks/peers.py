"""What a user would pick in place of the service: programs that measure themselves."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
LIMIT_S = 300
WARM_UP_MS = 400


def find_program(name):
    return shutil.which(name)


def run(words):
    """Runs a peer and reads the one line of JSON that it ends with."""
    words = [str(word) for word in words]
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=LIMIT_S, check=False,
                              stdin=subprocess.DEVNULL)
    except subprocess.TimeoutExpired:
        raise RuntimeError(f"{' '.join(words)}: has not ended after {LIMIT_S} s") from None
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(words)}: status {done.returncode}:\n{done.stderr[-2000:]}")
    return json.loads(done.stdout.splitlines()[-1])


def as_measurement(case, answer):
    if answer["results"] == 0:
        raise RuntimeError(f"no result within {answer['measured_s']} s")
    in_all = answer["results_in_all"]
    return with_share(case, {
        "rate": answer["results"] / answer["measured_s"],
        "learner_us": answer["master_cpu_s"] / in_all * 1e6,
        "evaluator_us": answer["workers_cpu_s"] / in_all * 1e6 - case.burnt_us(),
    })


def with_share(case, measurement):
    """Adds the share of all processor time that roll-outs themselves take. Whatever else a machine
    does, it counts less here than in a rate."""
    if case.burnt_us() > 0:
        overhead_us = sum(value for key, value in measurement.items() if key.endswith("_us"))
        measurement["share"] = case.burnt_us() / (case.burnt_us() + overhead_us)
    return measurement


def options(settings, case, batch, outstanding):
    return [settings.study, "--batch", batch, "--outstanding", outstanding,
            "--warm-up-ms", WARM_UP_MS, "--measured-ms", round(settings.measured_s * 1000),
            *case.settings_of_study()]


def outstanding(case, batch):
    """Messages a worker has, so that as many roll-outs are in flight as the service has."""
    return min(64, max(1, case.in_flight // (case.workers * batch)))


def alone(settings, case):
    return as_measurement(case, run(
        [settings.programs / "benchmark-pool", *options(settings, case, 1, 1),
         "--workers", case.workers, "--alone"]))


def pool(batch):
    def measure(settings, case):
        return as_measurement(case, run(
            [settings.programs / "benchmark-pool",
             *options(settings, case, batch, outstanding(case, batch)),
             "--workers", case.workers]))
    return measure


def mpi(batch):
    def measure(settings, case):
        # Ranks that wait give their core away: there is one rank more than cores.
        as_root = ["--allow-run-as-root"] if os.geteuid() == 0 else []
        return as_measurement(case, run(
            ["mpirun", *as_root, "--oversubscribe", "--mca", "mpi_yield_when_idle", "1",
             "--mca", "plm_rsh_agent", "", "-np", case.workers + 1,
             settings.programs / "benchmark-mpi",
             *options(settings, case, batch, outstanding(case, batch))]))
    return measure


def python(kind, batch):
    def measure(settings, case):
        return as_measurement(case, run(
            [sys.executable, HERE / "python_pools.py", kind, "--workers", case.workers,
             "--batch", batch, "--in-flight", case.in_flight, "--duration-us", case.duration_us,
             "--mode", case.mode, "--warm-up-ms", WARM_UP_MS,
             "--measured-ms", round(settings.measured_s * 1000)]))
    return measure


def why_no_mpi(settings):
    if not (settings.programs / "benchmark-mpi").exists():
        return "it was built without MPI (deploy/install-packages bench)"
    return "" if find_program("mpirun") else "there is no mpirun (deploy/install-packages bench)"


def why_no_dask():
    done = subprocess.run([sys.executable, "-c", "import distributed"], capture_output=True,
                          check=False)
    return "" if done.returncode == 0 else (
        f"{sys.executable} has no distributed (deploy/install-packages bench)")
