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
    done = subprocess.run(words, capture_output=True, text=True, timeout=LIMIT_S, check=False,
                          stdin=subprocess.DEVNULL)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(words)}: status {done.returncode}:\n{done.stderr[-2000:]}")
    return json.loads(done.stdout.splitlines()[-1])


def as_measurement(case, answer):
    if answer["results"] == 0:
        raise RuntimeError(f"no result within {answer['measured_s']} s")
    measurement = {"rate": answer["results"] / answer["measured_s"]}
    if answer["master_cpu_s"] is not None:
        in_all = answer["results_in_all"]
        measurement["learner_us"] = answer["master_cpu_s"] / in_all * 1e6
        measurement["evaluator_us"] = answer["workers_cpu_s"] / in_all * 1e6 - case.burnt_us()
    return measurement


def options(settings, case, batch, outstanding):
    return [settings.study, "--batch", batch, "--outstanding", outstanding,
            "--warm-up-ms", WARM_UP_MS, "--measured-ms", round(settings.measured_s * 1000),
            *case.settings_of_study()]


def outstanding(case, batch):
    """Messages a worker has, so that as many roll-outs are in flight as the service has runs."""
    return min(64, max(1, case.runs // (case.workers * batch)))


def alone(settings, case):
    answer = run([settings.programs / "benchmark-pool", *options(settings, case, 1, 1),
                  "--workers", case.workers, "--alone"])
    return {"rate": answer["results"] / answer["measured_s"]}


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
             "--batch", batch, "--in-flight", case.runs, "--duration-us", case.duration_us,
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
