"""The pools of Python as contestants: a process that measures itself and ends with a line of JSON.

usage: python_pools.py executor|dask --workers 2 --batch 16 --in-flight 64 --duration-us 1000 ...
"""

import argparse
import concurrent.futures
import json
import queue
import tempfile
import time
from pathlib import Path


def roll_out(duration_us, mode, thetas):
    """As the synthetic task: processor time or time on the clock, then a reward for each theta."""
    rewards = []
    for theta in thetas:
        if mode == "sleep":
            time.sleep(duration_us * 1e-6)
        else:
            end_ns = time.thread_time_ns() + duration_us * 1000
            while time.thread_time_ns() < end_ns:
                pass
        rewards.append(1 / (1 + sum(number * number for number in theta)))
    return rewards


def processor_s():
    """Processor time of this process and of the children that it has now."""
    pids = [int(pid) for task in Path("/proc/self/task").iterdir()
            for pid in (task / "children").read_text().split()]
    # What clock_getcpuclockid(3) names.
    return time.process_time(), sum(time.clock_gettime((~pid << 3) | 2) for pid in pids)


def measure(submit, arguments):
    """Keeps so many roll-outs in flight; counts those that come within the measured time."""
    done = queue.SimpleQueue()
    number = 0

    def submit_next():
        nonlocal number
        thetas = [[0.001 * ((number + i) % 97)] * 12 for i in range(arguments.batch)]
        number += arguments.batch
        future = submit(roll_out, arguments.duration_us, arguments.mode, thetas)
        future.add_done_callback(done.put)

    master_s, workers_s = processor_s()
    begin_s = time.monotonic() + 1e-3 * arguments.warm_up_ms
    end_s = begin_s + 1e-3 * arguments.measured_ms
    for _ in range(max(arguments.workers, arguments.in_flight // arguments.batch)):
        submit_next()
    counted = 0
    received = 0
    while received < number:
        rewards = done.get().result()
        now_s = time.monotonic()
        received += len(rewards)
        if begin_s <= now_s < end_s:
            counted += len(rewards)
        if now_s < end_s:
            submit_next()
    master_end_s, workers_end_s = processor_s()
    return {"results": counted, "results_in_all": received,
            "measured_s": 1e-3 * arguments.measured_ms,
            "master_cpu_s": master_end_s - master_s, "workers_cpu_s": workers_end_s - workers_s}


def with_executor(arguments):
    with concurrent.futures.ProcessPoolExecutor(arguments.workers) as pool:
        for future in [pool.submit(roll_out, 0, "burn", [[0]]) for _ in range(arguments.workers)]:
            future.result()
        return measure(pool.submit, arguments)


def with_dask(arguments):
    import distributed

    with (tempfile.TemporaryDirectory(prefix="treeroll-bench-") as folder,
          distributed.LocalCluster(n_workers=arguments.workers, threads_per_worker=1,
                                   processes=True, dashboard_address=None,
                                   local_directory=folder) as cluster,
          distributed.Client(cluster) as client):
        def submit(function, *rest):
            return client.submit(function, *rest, pure=False)

        for future in [submit(roll_out, 0, "burn", [[0]]) for _ in range(arguments.workers)]:
            future.result()
        return measure(submit, arguments)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("kind", choices=["executor", "dask"])
    parser.add_argument("--mode", choices=["burn", "sleep"], default="burn")
    for name in ("workers", "batch", "in-flight", "duration-us", "warm-up-ms", "measured-ms"):
        parser.add_argument(f"--{name}", type=int, required=True)
    arguments = parser.parse_args()
    pools = {"executor": with_executor, "dask": with_dask}
    print(json.dumps(pools[arguments.kind](arguments)))


if __name__ == "__main__":
    main()
