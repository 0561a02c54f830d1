"""Tasks as programs: what is answered line by line."""

import io
import json
import math
import signal
import subprocess
import sys
import unittest

from support import ProgramTest, policy_text
import treeroll
from treeroll.program import converse


class Reach(treeroll.Task):
    trace_inputs = ["time_s"]
    trace_outputs = ["x_m"]

    def __init__(self, settings):
        self.goal_m = settings.number("goal_m", 0.5, above=0, most=2)
        self.mode = settings.string("mode", "well", words=["well", "broken", "bad_init", "odd"])
        self.steps = settings.integer("steps", 3, least=1, most=100)
        settings.boolean("fast", False)
        settings.numbers("weights", [1, 2], size=2)
        if self.mode == "bad_init":
            raise ZeroDivisionError("at its start")

    def describe(self):
        return treeroll.Description(input_dim=1, output_dim=1, time_limit_s=2, deterministic=False)

    def evaluate(self, policy, seed):
        if self.mode == "broken":
            raise {1: treeroll.Failed("hit the table"), 2: treeroll.Discarded("operator"),
                   3: RuntimeError("no luck")}[seed]
        if self.mode == "odd":
            return {1: math.nan, 2: -1.0, 3: True}.get(seed, "text")
        for k in range(self.steps):
            self.record(time_s=k, x_m=math.inf if k == 2 else policy(k), pose=[[0, 0, k, 1]])
        self.terms["miss_m"] = policy(0.5) - self.goal_m
        return 1 / (1 + self.terms["miss_m"] ** 2)


class Made:
    """As numpy makes numbers and arrays: of a type of its own, and to be had as Python's."""

    def __init__(self, value):
        self._value = value

    def tolist(self):
        return self._value

    def __float__(self):
        return float(self._value)

    def __iter__(self):
        return (Made(x) for x in self._value)

    def __len__(self):
        return len(self._value)

    def __bool__(self):
        if isinstance(self._value, list):
            raise ValueError("The truth value of an array is ambiguous")
        return bool(self._value)


def task_of(array, number):
    """Whatever a task may give is made by these two."""
    class Arrays(treeroll.Task):
        trace_inputs = array(["time_s"])

        def __init__(self, settings):
            self.weights = settings.numbers("weights", array([1, 0.5]), size=2)
            self.row = settings.numbers("row", [number(2)])
            self.goal_m = settings.number("goal_m", number(0.5))
            self.steps = settings.integer("steps", number(3))
            self.fast = settings.boolean("fast", number(True))

        def describe(self):
            return treeroll.Description(
                number(2), number(1), number(4.0), reward_min=number(0.0), reward_max=number(2.0),
                deterministic=number(True), repeatable=number(False), inputs=array(["t_s", "q_rad"]),
                outputs=[number("torque_nm")])

        def evaluate(self, policy, seed):
            self.terms["miss_m"] = number(0.25)
            self.record(time_s=number(0.5), pose=array([[0.0, 1.0]]))
            return number(1.5)

    return Arrays


ROBOT = """
import time, treeroll

class Robot(treeroll.Task):
    def describe(self):
        return treeroll.Description(1, 1, 100.0, repeatable=False)

    def evaluate(self, policy, seed):
        try:
            print("moves", flush=True)
            time.sleep(100)
        finally:
            print("motors off", flush=True)

treeroll.run(Robot)
"""


class Other(treeroll.Task):
    name = "another"

    def describe(self):
        return treeroll.Description(2, 3, 1.0, reward_max=7, version="2", repeatable=False,
                                    inputs=["t_s", "q_rad"], outputs=("x", "y", "z"))


def answers(*requests, tasks=(Reach, Other)):
    said = io.StringIO()
    lines = "".join(json.dumps(r) + "\n" for r in requests)
    converse(io.BytesIO(lines.encode()), said, tasks)
    return [json.loads(line) for line in said.getvalue().splitlines()]


def describe(name="reach", **settings):
    return {"describe": {"name": name, "settings": settings}}


def evaluate(seed=0, trace=False, inputs=1):
    return {"evaluate": {"run": 0, "rollout": 0, "seed": seed, "trace": trace,
                         "policy": json.loads(policy_text(mean=0.5, inputs=inputs))}}


class ProgramLinesTest(unittest.TestCase):
    def test_describes_with_all_defaults(self):
        said, other = answers(describe(goal_m=1), describe("another"))
        self.assertEqual(said, {
            "input_dim": 1, "output_dim": 1, "time_limit_s": 2, "reward_min": 0, "reward_max": 1,
            "deterministic": False,
            "settings": {"goal_m": 1, "mode": "well", "steps": 3, "fast": False, "weights": [1, 2]}})
        self.assertEqual((other["version"], other["repeatable"], other["settings"]), ("2", False, {}))
        self.assertEqual((other["inputs"], other["outputs"]), (["t_s", "q_rad"], ["x", "y", "z"]))
        self.assertNotIn("inputs", said)

    def test_refuses_settings_and_names_the_rule(self):
        for settings, rule in (
                ({"goal_m": 0}, "goal_m: must be a finite number, greater than 0, at most 2"),
                ({"goal_m": True}, "goal_m: must be"), ({"goal_m": "a"}, "goal_m: must be"),
                ({"steps": 1.5}, "steps: must be an integer from 1 to 100"),
                ({"fast": 1}, "fast: must be true or false"),
                ({"mode": "x"}, "mode: must be one of well, broken"),
                ({"weights": [1]}, "weights: must be a list of 2 finite numbers"),
                ({"gaol_m": 1}, "gaol_m: is no setting of this task; it knows fast, goal_m"),
                ({"mode": "bad_init"}, "the task cannot be made: ZeroDivisionError: at its start")):
            self.assertIn(rule, answers(describe(**settings))[0]["refused"])
        self.assertEqual(answers(describe("nobody"))[0]["refused"],
                         "name: must be a task of this program: reach, another")

    def check_arrays(self, array, number):
        said, evaluated, asked = answers(
            describe("arrays"), evaluate(trace=True, inputs=2),
            describe("arrays", weights=[3, 4], steps=5), tasks=(task_of(array, number),))
        self.assertEqual(said, {
            "input_dim": 2, "output_dim": 1, "time_limit_s": 4.0, "reward_min": 0.0, "reward_max": 2.0,
            "deterministic": True, "repeatable": False, "inputs": ["t_s", "q_rad"], "outputs": ["torque_nm"],
            "settings": {"weights": [1, 0.5], "row": [2], "goal_m": 0.5, "steps": 3, "fast": True}})
        self.assertEqual(evaluated, {
            "reward": 1.5, "terms": {"miss_m": 0.25},
            "trace": {"columns": ["time_s"], "rows": [[0.5]], "policy_inputs": ["time_s"],
                      "poses": [[[0.0, 1.0]]]}})
        self.assertEqual(asked["settings"]["weights"], [3, 4])

    def test_takes_what_numpy_makes(self):
        self.check_arrays(Made, Made)

    def test_takes_numpys_own(self):
        try:
            import numpy
        except ImportError:
            self.skipTest("numpy is not installed: what stands for it is tried alone")
        self.check_arrays(numpy.array, numpy.array)
        self.check_arrays(numpy.array, lambda x: numpy.array(x)[()])

    def test_a_description_that_no_line_holds_names_what_is_wrong(self):
        class Odd(treeroll.Task):
            def describe(self):
                return treeroll.Description(1, 1, time_limit_s=math.inf)

        [said] = answers(describe("odd"), tasks=(Odd,))
        self.assertIn("time_limit_s = inf", said["refused"])

    def test_evaluates_with_terms_and_trace(self):
        _, plain, traced, again = answers(describe(goal_m=0.5), evaluate(), evaluate(trace=True),
                                          evaluate())
        self.assertEqual(plain, {"reward": 1.0, "terms": {"miss_m": 0.0}})
        self.assertEqual(again, plain)
        self.assertEqual(traced["reward"], 1.0)
        self.assertEqual(traced["trace"], {
            "columns": ["time_s", "x_m"], "rows": [[0, 0.25], [1, 0.75], [2, None]],
            "policy_inputs": ["time_s"], "policy_outputs": ["x_m"],
            "poses": [[[0, 0, 0, 1]], [[0, 0, 1, 1]], [[0, 0, 2, 1]]]})

    def test_what_a_task_raises_is_an_answer(self):
        _, failed, discarded, raised = answers(describe(mode="broken"), evaluate(1), evaluate(2),
                                               evaluate(3))
        self.assertEqual(failed, {"failed": "hit the table"})
        self.assertEqual(discarded, {"discarded": "operator"})
        self.assertIn("RuntimeError: no luck (test_program.py, line", raised["failed"])

    def test_a_reward_that_is_no_number_fails(self):
        _, nan, negative, text = answers(describe(mode="odd"), evaluate(1), evaluate(2), evaluate(4))
        self.assertEqual(nan, {"failed": "the reward is nan"})
        self.assertEqual(negative, {"reward": -1.0})  # the worker knows the range
        self.assertIn("ValueError", text["failed"])

    def test_without_a_task_nothing_is_evaluated(self):
        self.assertIn("failed", answers(evaluate())[0])
        self.assertIn("failed", answers(describe(), describe("nobody"), evaluate())[2])

    def test_two_tasks_of_one_name_are_an_error(self):
        with self.assertRaises(ValueError):
            answers(tasks=(Reach, Reach))
        with self.assertRaises(ValueError):
            answers(tasks=())


FILE_OF_A_TASK = """
from __future__ import annotations

import dataclasses
import multiprocessing

import treeroll

@dataclasses.dataclass
class State:
    angle_rad: float

class Robot(treeroll.Task):
    def describe(self):
        # A child that is started anew finds the class by the name of its module.
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            state = pool.apply(State, (2.0,))
        return treeroll.Description(1, 1, state.angle_rad)
"""


class ProgramOfAFileTest(ProgramTest):
    def test_a_file_is_a_module_like_any_other(self):
        for name in ("arm.py", "an arm.py", "json.py"):
            file = self.folder / name
            file.write_text(FILE_OF_A_TASK if name == "arm.py" else FILE_OF_A_TASK.replace("pool.apply(State, (2.0,))",
                                                                                            "State(2.0)"))
            ran = subprocess.run([sys.executable, "-m", "treeroll", "task", f"{file}:Robot"], text=True,
                                 input=json.dumps(describe("robot")), capture_output=True, timeout=60)
            self.assertEqual(ran.returncode, 0, ran.stderr)
            self.assertEqual(json.loads(ran.stdout)["time_limit_s"], 2, ran.stderr)


class ProgramEndTest(unittest.TestCase):
    def test_a_worker_that_ends_it_lets_it_stop_its_motors(self):
        with subprocess.Popen([sys.executable, "-c", ROBOT], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True) as program:
            for asked in (describe("robot"), evaluate()):
                print(json.dumps(asked), file=program.stdin, flush=True)
            self.assertEqual(program.stderr.readline(), "moves\n")
            program.terminate()
            self.assertEqual(program.stderr.read(), "motors off\n")
            self.assertEqual(program.wait(), 128 + signal.SIGTERM, "what a worker takes for the signal")

    def test_it_may_run_in_another_thread(self):
        code = ROBOT.replace("treeroll.run(Robot)", "import threading\nthreading.Thread(target=treeroll.run, args=(Robot,)).start()")
        self.assertIn("Thread", code)
        ran = subprocess.run([sys.executable, "-c", code], text=True, input=json.dumps(describe("robot")),
                             capture_output=True, timeout=60)
        self.assertIn("time_limit_s", ran.stdout, ran.stderr)
