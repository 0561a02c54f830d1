#!/usr/bin/env python3
"""A task of the lines of EVALUATOR.md alone, with nothing of treeroll: what the tests put through
every case. Its one setting `mode` says how it misbehaves, `goal_m` what is to be reached. The reward
compares the last mean of the finest layer with the goal. With REACH_LIES in its environment it says
too little, now and then, as a broken host might."""

import json
import os
import resource
import signal
import sys
import threading
import time

NOISY = ("seed", "small_seeds", "fails_by_chance", "as_it_comes")
settings = {}
num_evaluated = 0


def answer(said):
    print(json.dumps(said), flush=True)


def describe(task):
    known = {"goal_m": 0.5, "mode": "well", "time_limit_s": 10}
    if task["name"] != "reach":
        return {"refused": "name: must be reach"}
    for key in task["settings"]:
        if key not in known and task["settings"].get("mode") != "takes_anything":
            return {"refused": key + ": is no setting of this task"}
    settings.clear()
    settings.update(known, **task["settings"])
    if not isinstance(settings["goal_m"], (int, float)):
        return {"refused": "goal_m: must be a number"}
    said = {"input_dim": 1, "output_dim": 1, "reward_min": 0, "reward_max": 1,
            "time_limit_s": settings["time_limit_s"], "deterministic": settings["mode"] not in NOISY,
            "settings": dict(settings)}
    if settings["mode"] == "robot":
        said["repeatable"] = False
    if settings["mode"] == "describes_slowly":
        until = time.process_time() + 1
        while time.process_time() < until:
            pass
    if settings["mode"] == "not_repeatable":
        said["repeatable"] = False
    if settings["mode"] == "describes_nonsense":
        said["input_dim"] = "one"
    if settings["mode"] == "defaults_drift":
        said["settings"]["goal_m"] += 1
    if settings["mode"] == "dies_describing":
        sys.exit("cannot describe")
    return said


def last_mean(policy):
    """Of the output of the last Gaussian of the finest layer, whatever the rest is."""
    return policy["layers"][-1][-1]["mean"][-1]


def evaluate(asked):
    global num_evaluated
    num_evaluated += 1
    mode = settings["mode"]
    miss = last_mean(asked["policy"]) - settings["goal_m"]
    reward = 1 / (1 + miss * miss)
    if mode == "chatty":
        print("a line of standard output\x1b[2J \u009b")
        print("a line of standard error", file=sys.stderr, flush=True)
    if mode == "once_per_process" and num_evaluated > 1:
        os.kill(os.getpid(), signal.SIGSEGV)
    if mode == "segfault":
        os.kill(os.getpid(), signal.SIGSEGV)
    if mode == "exits":
        print("the arm is gone", file=sys.stderr, flush=True)
        sys.exit(3)
    if mode == "handles_sigterm":
        sys.exit(128 + signal.SIGTERM)
    if mode == "descriptors":
        for number in os.listdir("/proc/self/fd"):
            link = f"/proc/self/fd/{number}"
            if os.path.lexists(link) and os.readlink(link).startswith("socket:"):
                return {"failed": "it has a socket of the worker's"}
    if mode == "burns":
        while True:
            pass
    if mode == "child_burns":
        # From another thread: each has children of its own.
        thread = threading.Thread(
            target=lambda: os.system("exec python3 -c 'while True: pass'"))
        thread.start()
        thread.join()
    if mode == "burns_a_while" and num_evaluated == 1:
        until = time.process_time() + .7
        while time.process_time() < until:
            pass
    if mode == "sleeps":
        time.sleep(1000)
    if mode == "waits" and num_evaluated == 2:
        time.sleep(4.5)
    if mode == "not_repeatable":
        print("moves", file=sys.stderr, flush=True)
    if mode in ("moves", "moves_in_a_long_line"):
        signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
        try:
            print("moves", file=sys.stderr, flush=True)
            if mode == "moves_in_a_long_line":
                print("x" * 3_000_000, end="", flush=True)
            time.sleep(1000)
        finally:
            time.sleep(0.5)
            print("motors off", file=sys.stderr, flush=True)
    if mode == "moves_on":
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        print("moves", file=sys.stderr, flush=True)
        time.sleep(1000)
    if mode == "closes_output":
        os.close(1)
        time.sleep(1000)
    if mode == "memory":
        limit = resource.getrlimit(resource.RLIMIT_DATA)[0]
        if limit == resource.RLIM_INFINITY:
            return {"failed": "no limit"}
        hoard = []
        try:
            while True:
                hoard.append(bytearray(10_000_000))
        except MemoryError:
            hoard.clear()
            sys.exit("no memory")
    if mode == "nan":
        return {"reward": float("nan")}
    if mode == "too_much":
        return {"reward": 7}
    if mode == "nothing":
        return {}
    if mode == "two_words":
        return {"reward": reward, "failed": "both"}
    if mode == "unknown_key":
        return {"reward": reward, "rewrad": 3}
    if mode == "long_line":
        print("x" * 3_000_000, flush=True)
    if mode == "fails_above" and last_mean(asked["policy"]) > 0:
        return {"failed": "the arm is too short"}
    if mode == "small_seeds" and asked["seed"] >= 2**32:
        return {"failed": "ValueError: Seed must be between 0 and 2**32 - 1"}
    if mode == "fails_by_chance" and asked["seed"] not in (1, 2):
        return {"failed": "the arm slipped"}
    if mode == "as_it_comes":
        reward = 1 / (1 + num_evaluated)
    if mode == "failed":
        return {"failed": "arm hit\nthe \x1btable"}
    if mode == "discards_first" and num_evaluated % 2 == 1:
        return {"discarded": "operator"}
    if mode == "signed_seed" and asked["seed"] >= 2**63:
        return {"failed": "the seed is no long"}
    if mode == "seed":
        reward = (asked["seed"] % 1000) / 1000
    if mode == "forgets_itself":
        reward /= num_evaluated
    if mode == "names_matter":
        reward = 1 / (2 + asked["rollout"])
    if mode == "refuses_more" and len(asked) > 5:
        return {"failed": "what is this"}
    if mode == "twice":
        answer({"reward": 0})
    if os.environ.get("REACH_LIES") and int(abs(miss) * 1e6) % 3 == 0:
        reward /= 2
    said = {"reward": reward, "terms": {"miss_m": miss}}
    if asked["trace"] and mode != "no_trace":
        said["trace"] = {"columns": ["time_s", "x_m"], "rows": [[0, 0], [1, miss], [2, None]],
                         "policy_inputs": ["time_s"], "policy_outputs": ["x_m"],
                         "poses": [[[0, 0, 1, 1]], [], [[1, 2]]]}
    if mode == "bad_trace" and asked["trace"]:
        said["trace"]["rows"][0] = [1]
    return said


for line in sys.stdin:
    request = json.loads(line)
    if "describe" in request:
        answer(describe(request["describe"]))
    elif "evaluate" in request:
        answer(evaluate(request["evaluate"]))

if settings.get("mode") == "ignores_end":
    time.sleep(1000)
