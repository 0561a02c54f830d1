"""Runs every benchmark of a build, prints tables and writes JSON: what deploy/bench calls."""

import argparse
import json
import os
import platform
import re
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import comparison
import tables

HERE = Path(__file__).resolve().parent
# Of a benchmark's own output: the other numbers are counters of ours.
OWN_KEYS = {"real_time", "cpu_time", "iterations", "repetitions", "repetition_index", "threads",
            "family_index", "per_family_instance_index", "items_per_second"}
NS = {"ns": 1, "us": 1e3, "ms": 1e6, "s": 1e9}


def machine():
    processor = platform.processor() or "unknown processor"
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            processor = line.split(":", 1)[1].strip()
            break
    return {"processor": processor, "processors": len(os.sched_getaffinity(0)),
            "kernel": platform.release(),
            "system": platform.freedesktop_os_release().get("PRETTY_NAME", "unknown system"),
            "loads": [os.getloadavg()[0]]}


def sum_up_micro(runs):
    """Median and spread of each benchmark over its repetitions."""
    by_name = {}
    for run in runs:
        if run.get("error_occurred"):
            raise RuntimeError(f"{run['name']}: {run['error_message']}")
        if run.get("run_type") == "iteration":
            by_name.setdefault(run["run_name"], []).append(run)
    rows = []
    for name, repetitions in by_name.items():
        # What times itself counts processor time in its place of time on the clock.
        key = "real_time" if name.endswith("/manual_time") else "cpu_time"
        times = [run[key] * NS[run["time_unit"]] for run in repetitions]
        row = {"name": re.sub(r"/(iterations:\d+|manual_time)", "", name), "median_ns": statistics.median(times),
               "spread": (max(times) - min(times)) / statistics.median(times),
               "counters": {key: value for key, value in repetitions[0].items()
                            if isinstance(value, (int, float)) and key not in OWN_KEYS}}
        if "items_per_second" in repetitions[0]:
            row["ns_an_item"] = statistics.median(1e9 / run["items_per_second"]
                                                  for run in repetitions)
        rows.append(row)
    return rows


def micro(programs, only, repetitions, quick):
    with tempfile.TemporaryDirectory(prefix="treeroll-bench-") as folder:
        output = Path(folder) / "micro.json"
        words = [programs / "treeroll-benchmarks", f"--benchmark_out={output}",
                 f"--benchmark_repetitions={repetitions}",
                 f"--benchmark_min_time={0.001 if quick else 0.1}",
                 f"--benchmark_filter={only or '.'}"]
        done = subprocess.run([str(word) for word in words], stdout=subprocess.DEVNULL,
                              stderr=subprocess.PIPE, text=True, check=False)
        if done.returncode != 0:
            raise RuntimeError(f"treeroll-benchmarks: status {done.returncode}:\n{done.stderr}")
        text = output.read_text() if output.exists() else ""
        return sum_up_micro(json.loads(text)["benchmarks"]) if text else []


def options():
    parser = argparse.ArgumentParser(
        prog="deploy/bench", description="Measures the parts of the service, then the service "
        "beside what could be used in its place. Each figure is a median; none is judged.")
    parser.add_argument("--programs", type=Path, required=True, help=argparse.SUPPRESS)
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write all figures there")
    parser.add_argument("--quick", action="store_true",
                        help="a few cases, once: shows that everything works, not how fast it is")
    parser.add_argument("--parts", metavar="REGEX", nargs="?", const=".",
                        help="the parts alone, those whose name it finds; no comparison")
    parser.add_argument("--show", type=Path, metavar="FILE",
                        help="measure nothing: the tables of an earlier --json FILE")
    parser.add_argument("--check", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--rounds", type=int, default=3, metavar="N",
                        help="of the comparison, 1 to 100 (default 3)")
    given = parser.parse_args()
    if not 1 <= given.rounds <= 100:
        parser.error(f"argument --rounds: {given.rounds} is not within 1 and 100")
    if given.json:
        try:  # now, not after a quarter of an hour
            with given.json.open("a"):
                pass
        except OSError as error:
            parser.error(f"argument --json: {given.json}: {error.strerror}")
    return given


def show(file):
    try:
        print(tables.report(json.loads(file.read_text())), end="")
    except (OSError, ValueError, KeyError, TypeError) as error:
        sys.exit(f"deploy/bench: --show {file}: not what --json writes: {error!r}")


def main():
    given = options()
    if given.check:
        return
    if given.show:
        return show(given.show)
    measured = {"machine": machine(), "quick": given.quick, "skipped": []}
    measured["micro_repetitions"] = 1 if given.quick else 5
    comparison.say("measuring the parts: a few minutes" if not given.quick else
                   "measuring the parts")
    measured["micro"] = micro(given.programs, given.parts, measured["micro_repetitions"],
                              given.quick)
    def note_load():
        measured["machine"]["loads"].append(os.getloadavg()[0])

    note_load()
    if given.parts and not measured["micro"]:
        sys.exit(f"deploy/bench: --parts {given.parts}: no benchmark has such a name")
    measured["comparison"], measured["wire"] = [], []
    if not given.parts:
        settings = comparison.Settings(given.programs, HERE / "cluster.toml",
                                       measured_s=0.3 if given.quick else 1.5,
                                       rounds=1 if given.quick else given.rounds)
        measured["comparison"], measured["skipped"] = comparison.compare(
            settings, given.quick, after_round=note_load)
        measured["wire"] = comparison.on_the_wire(settings, given.quick)
    print(tables.report(measured), end="")
    if given.json:
        given.json.write_text(json.dumps(measured, indent=1) + "\n")


if __name__ == "__main__":
    try:
        main()
    except (RuntimeError, OSError) as error:
        sys.exit(f"deploy/bench: {error}")
    except KeyboardInterrupt:
        sys.exit(130)
