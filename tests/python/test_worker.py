"""Tasks in Python as evaluators of the real programs."""

import importlib.util
import json
import os
import time

from support import EXAMPLE, PYTHON, SOURCE, ProgramTest, lcm_url, study_text

HERE = SOURCE / "tests/python"

# Its motors are stopped in every way that Python has. Each writes a file of its own.
DRIVEN = """
import atexit, os, time
from pathlib import Path

class Driver:
    def __init__(self, name):
        self.name = name
        self.file = open(name, "w")
    def stop(self, *_):
        self.file.write("off")
        self.file.close()
    def __enter__(self):
        return self
    __exit__ = stop

class Forgotten(Driver):
    __del__ = Driver.stop

atexit.register(Driver("atexit").stop)  # before treeroll is known

import treeroll

class Robot(treeroll.Task):
    def __init__(self, settings):
        self.driver = Forgotten("task")

    def describe(self):
        return treeroll.Description(1, 1, 60.0, repeatable=False)

    def evaluate(self, policy, seed):
        with Driver("evaluate"):
            if os.environ.get("HANGS"):
                Path("moves").touch()
                time.sleep(100)
            return 0.5

if __name__ == "__main__":
    program = Forgotten("program")
    try:
        with Driver("around"):
            treeroll.run(Robot)
    finally:
        time.sleep(.2)
        Driver("finally").stop()
"""
STOPS = {"atexit", "task", "evaluate", "program", "around", "finally"}


class WorkerTest(ProgramTest):
    def check(self, file, name, *more):
        said = self.run_program("treeroll-check-evaluator", f"{PYTHON} {file}", "--name", name, *more)
        self.assertIn("can be used as an evaluator", said.stdout)
        return said

    def test_the_tutorials_task_keeps_all_rules(self):
        said = self.check(EXAMPLE / "pendulum.py", "pendulum")
        self.assertNotIn("advised", said.stdout)

    def test_an_environment_is_a_task(self):
        self.check(HERE / "cart_env.py", "cart")

    def test_what_a_task_prints_disturbs_nothing(self):
        said = self.check(HERE / "prints.py", "prints")
        self.assertIn('in run 0, roll-out 0: {"reward": 7}', said.stderr)
        self.assertIn('{"reward": 9}', said.stderr)

    def test_a_class_is_run_by_its_name(self):
        self.run_program("treeroll-check-evaluator",
                         f"{PYTHON} -m treeroll task {EXAMPLE}/pendulum.py:Pendulum",
                         "--name", "pendulum")
        for place in ("nobody.py:X", f"{EXAMPLE}/pendulum.py:Nobody", "x"):
            self.run_program(PYTHON, "-m", "treeroll", "task", place, status=1)

    def off(self):
        return {name for name in STOPS
                if (self.folder / name).exists() and (self.folder / name).read_text() == "off"}

    def test_a_worker_that_ends_its_program_lets_it_stop_all_its_motors(self):
        (self.folder / "robot.py").write_text(DRIVEN)
        (self.folder / "study.toml").write_text(study_text('name = "driven"\nrollouts = 4', 'name = "robot"'))
        words = ["treeroll-learner", "study.toml", "--evaluator", f"{PYTHON} robot.py"]
        self.run_program(*words, "--check")
        self.assertEqual(self.off(), STOPS - {"evaluate"})
        for name in STOPS:
            (self.folder / name).unlink(missing_ok=True)
        self.run_program(*words, "--local-workers", "1", "--lcm-url", lcm_url(4))
        self.assertEqual(self.off(), STOPS, "its study is done, and it was idle")

    def test_a_worker_that_is_stopped_in_a_trial_lets_its_program_stop_all_its_motors(self):
        (self.folder / "robot.py").write_text(DRIVEN)
        (self.folder / "study.toml").write_text(study_text('name = "driven"\nrollouts = 4', 'name = "robot"'))
        os.environ["HANGS"] = "1"
        self.addCleanup(os.environ.pop, "HANGS")
        url = ["--lcm-url", lcm_url(5)]
        worker = self.start("treeroll-worker", "--processes", "1", "--evaluator", f"{PYTHON} robot.py", *url)
        learner = self.start("treeroll-learner", "study.toml", *url)
        deadline = time.monotonic() + 60
        while not (self.folder / "moves").exists():
            self.assertLess(time.monotonic(), deadline, "it does not move")
            time.sleep(.05)
        learner.terminate()
        for _ in range(2):
            worker.terminate()
            time.sleep(.5)
        worker.communicate(timeout=60)
        self.assertEqual(self.off(), STOPS)

    def test_an_environment_is_learnt(self):
        study = self.folder / "cart.toml"
        study.write_text("""
[study]
name = "cart"
rollouts = 60
[task]
name = "cart"
[policy]
start = "components"
layout = "reduced_cholesky"
frames = "cholesky"
[policy.layer_1]
inputs = 2
means = [[0.0, 0.0, 0.0]]
deviations = [1.0, 1.0, 1.0]
[exploration]
noise_variance = [0.01, 1.0, 1.0]
initial_noise_factor = 0.5
[[conditions]]
name = "flat"
policy.model = "flat"
""")
        self.run_program(
            "treeroll-learner", study, "--evaluator", f"{PYTHON} {HERE}/cart_env.py",
            "--local-workers", "2", "--lcm-url", lcm_url(1), "--state-dir", "state")
        rows = self.rows(self.folder / "state/rollouts.csv")
        self.assertEqual({row["status"] for row in rows}, {"ok"})
        rewards = [float(row["reward"]) for row in rows]
        self.assertGreater(max(rewards), 1.5 * rewards[0])

    def test_dart_agrees_with_the_equations_of_motion(self):
        if importlib.util.find_spec("dartpy") is None:
            self.skipTest("python3-dartpy is not installed: DART is not compared")
        study = SOURCE / "deploy/studies/swing_up.toml"
        self.run_program("treeroll-learner", study, "--local-workers", "2", "--lcm-url", lcm_url(2),
                         "--state-dir", "state", "--set", "study.rollouts=60", "--set",
                         "study.repetitions=1")
        dart = self.folder / "dart.toml"
        lines = [line for line in study.read_text().splitlines() if not line.startswith("alpha")]
        dart.write_text("\n".join(lines).replace('plant = "ode"', 'plant = "dart"'))
        program = f"{PYTHON} {EXAMPLE}/double_pendulum_dart.py"

        def reward(*words):
            return json.loads(self.run_program("treeroll-evaluate", *words, "--json").stdout)["reward"]

        for policy in ("tree-0.json", "tree-0.final.json"):
            policy = self.folder / "state/policies" / policy
            exact = reward(policy, study, "--set", "task.plant=rk4")
            fine = reward(policy, dart, "--evaluator", program, "--set", "task.step_s=0.0001")
            coarse = reward(policy, dart, "--evaluator", program, "--set", "task.step_s=0.001")
            self.assertLess(abs(fine - exact), 0.02)
            self.assertLess(abs(coarse - exact), 0.1)
