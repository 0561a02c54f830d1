"""A task with an operator: over a pseudo-terminal, alone and as a worker's evaluator."""

import fcntl
import json
import os
import pty
import select
import signal
import subprocess
import termios
import time
import unittest

from support import PYTHON, ProgramTest, lcm_url, policy_text, study_text

TASK = '''
import treeroll

class Reach(treeroll.Task):
    """One trial of a robot."""
    def describe(self):
        return treeroll.Description(input_dim=1, output_dim=1, time_limit_s=5)

    def evaluate(self, policy, seed):
        with open("moved", "a") as file:
            file.write(f"{seed}\\n")
        if seed == 13:
            raise treeroll.Failed("hit the table")
        self.terms["miss_m"] = policy(0.5) - 1
        return 1 / (1 + self.terms["miss_m"] ** 2)

if __name__ == "__main__":
    treeroll.run(treeroll.with_operator(Reach))
'''

STUDY = study_text('name = "operated"\nrollouts = 4', 'name = "reach"')


class OperatorTest(ProgramTest):
    def setUp(self):
        super().setUp()
        (self.folder / "reach.py").write_text(TASK)
        self.open_terminal()

    def open_terminal(self):
        self.master, self.slave = pty.openpty()
        self.addCleanup(os.close, self.master)
        self.shown = ""

    def until(self, text, limit_s=60):
        """Reads the terminal until it shows the text, which counts once."""
        deadline = time.monotonic() + limit_s
        while text not in self.shown:
            left = deadline - time.monotonic()
            self.assertGreater(left, 0, f"no {text!r} in {self.shown!r}")
            if select.select([self.master], [], [], left)[0]:
                self.shown += os.read(self.master, 4096).decode()
        before, _, self.shown = self.shown.partition(text)
        return before

    def type(self, text):
        os.write(self.master, text.encode())

    def moved(self):
        file = self.folder / "moved"
        return file.read_text().split() if file.exists() else []

    def program(self, **environment):
        return self.piped([PYTHON, "reach.py"], env={
            **os.environ, "TREEROLL_OPERATOR_TERMINAL": os.ttyname(self.slave), **environment})

    def piped(self, words, **more):
        process = subprocess.Popen(words, cwd=self.folder, text=True, stdin=subprocess.PIPE,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, **more)
        self.addCleanup(lambda: (process.kill(), process.communicate()))
        return process

    def take_terminal(self):
        """In a child: the terminal becomes its own."""
        os.setsid()
        fcntl.ioctl(self.slave, termios.TIOCSCTTY, 0)

    def say(self, process, request):
        process.stdin.write(json.dumps(request) + "\n")
        process.stdin.flush()

    def described(self, process):
        self.say(process, {"describe": {"name": "reach", "settings": {}}})
        return json.loads(process.stdout.readline())

    def evaluate(self, process, seed, bounds=None, rollout=17):
        policy = json.loads(policy_text(0.5))
        if bounds:
            policy["bounds"] = bounds
        self.say(process, {"evaluate": {"run": 3, "rollout": rollout, "seed": seed, "trace": False,
                                        "policy": policy}})

    def test_nothing_moves_before_the_operator_says_so_and_nothing_counts_before_it_is_accepted(self):
        process = self.program()
        said = self.described(process)
        self.assertEqual((said["time_limit_s"], said["repeatable"], said["deterministic"]),
                         (7205.0, False, False))
        self.type("\n\n\n")  # typed before the question: no answer
        time.sleep(.2)
        self.evaluate(process, 5)
        self.until("reach, run 3, roll-out 17, seed 5: Enter begins")
        self.until("> ")
        time.sleep(.3)
        self.assertEqual(self.moved(), [])
        self.type("what\n")  # no answer either
        self.until("Enter begins")
        self.until("> ")
        self.assertEqual(self.moved(), [])
        self.type("\n")
        self.until("reward 0.8, miss_m -0.5. a accepts")
        self.until("> ")
        self.assertEqual(self.moved(), ["5"])
        self.assertFalse(select.select([process.stdout], [], [], .3)[0])
        self.type("a\n")
        self.assertEqual(json.loads(process.stdout.readline()),
                         {"reward": 0.8, "terms": {"miss_m": -0.5}})

    def test_the_operator_is_told_whether_it_is_a_trial_or_an_evaluation(self):
        process = self.program()
        self.described(process)
        for rollout, words in ((-2, "the start policy"), (-1, "the final policy"), (-3, "the final policy")):
            self.evaluate(process, 5, rollout=rollout)
            self.until(f"reach, run 3, {words}, seed 5: Enter begins, r rejects, p pauses > ")
            self.type("r\n")
            self.assertEqual(json.loads(process.stdout.readline()), {"discarded": "operator"})

    def test_a_rejected_trial_is_void_before_and_after_it_has_moved(self):
        process = self.program()
        self.described(process)
        self.evaluate(process, 5)
        self.until("p pauses > ")
        self.type("r\n")
        self.assertEqual(json.loads(process.stdout.readline()), {"discarded": "operator"})
        self.assertEqual(self.moved(), [])
        self.evaluate(process, 6)
        self.until("p pauses > ")
        self.type("\n")
        self.until("a accepts, r tries again, p pauses > ")
        self.type("r\n")
        self.assertEqual(json.loads(process.stdout.readline()), {"discarded": "operator"})
        self.assertEqual(self.moved(), ["6"])

    def test_a_pause_lasts_until_the_operator_goes_on_and_then_asks_again(self):
        process = self.program()
        self.described(process)
        self.evaluate(process, 5)
        self.until("p pauses > ")
        self.type("p\n")
        self.until("paused. Enter goes on > ")
        self.type("\n")
        self.until("Enter begins, r rejects, p pauses > ")
        self.assertEqual(self.moved(), [])
        self.type("\n")
        self.until("a accepts, r tries again, p pauses > ")
        self.type("a\n")
        self.assertIn("reward", json.loads(process.stdout.readline()))

    def test_a_failure_counts_only_if_it_is_accepted(self):
        process = self.program()
        self.described(process)
        for answer, said in (("r", {"discarded": "operator"}), ("a", {"failed": "hit the table"})):
            self.evaluate(process, 13)
            self.until("p pauses > ")
            self.type("\n")
            self.until("failed: hit the table. a accepts that")
            self.until("> ")
            self.type(answer + "\n")
            self.assertEqual(json.loads(process.stdout.readline()), said)

    def test_whatever_fails_is_shown_to_the_operator(self):
        source = TASK.replace('        if seed == 13:', """        if seed == 14:
            raise OSError("the driver is gone")
        if seed == 15:
            return float("nan")
        if seed == 17:
            return 1.02
        if seed == 18:
            self.terms["miss_m"] = "far"
            return .5
        if seed == 19:
            self.terms["x" * 65] = 1
            return .5
        if seed == 13:""")
        (self.folder / "reach.py").write_text(source)
        process = self.program()
        self.described(process)
        bounds = {"outside": "refuse", "output_min": [], "output_max": [0.0], "output_rate_max": [],
                  "theta_min": [], "theta_max": [], "sample_time_s": 0, "output_start": []}
        for seed, of_policy, words in ((14, None, "the driver is gone"), (15, None, "the reward is nan"),
                                       (17, None, "the reward 1.02 is outside its range 0.0 .. 1.0"),
                                       (18, None, "could not convert string to float: 'far'"),
                                       (19, None, "terms must be at most 64, with names of 1 to 64 bytes"),
                                       (16, bounds, "output 1 is 0.5, must be at most 0")):
            for answer, key in (("r", "discarded"), ("a", "failed")):
                self.evaluate(process, seed, of_policy)
                self.until("p pauses > ")
                self.type("\n")
                self.until(f"failed: {words}")
                self.until("> ")
                self.type(answer + "\n")
                self.assertIn(key, json.loads(process.stdout.readline()))

    def test_terms_of_any_kind_of_number_are_shown(self):
        source = TASK.replace('        if seed == 13:', """        if seed == 14:
            self.terms["hit_m"] = Length()
        if seed == 13:""").replace("import treeroll\n", """import treeroll

class Length:  # as numpy.array([.1]): a float, and of no format
    def __float__(self):
        return .1
""", 1)
        (self.folder / "reach.py").write_text(source)
        process = self.program()
        self.described(process)
        self.evaluate(process, 14)
        self.until("p pauses > ")
        self.type("\n")
        self.until("reward 0.8, hit_m 0.1, miss_m -0.5. a accepts")
        self.until("> ")
        self.type("a\n")
        self.assertEqual(json.loads(process.stdout.readline())["terms"], {"hit_m": 0.1, "miss_m": -0.5})

    def test_a_trial_that_nobody_begins_is_void(self):
        (self.folder / "reach.py").write_text(TASK.replace("(Reach)", "(Reach, patience_s=.2)"))
        process = self.program()
        self.described(process)
        self.evaluate(process, 5)
        self.assertEqual(json.loads(process.stdout.readline()),
                         {"discarded": "nobody answered"})
        self.assertEqual(self.moved(), [])

    def test_an_operator_who_is_away_ends_no_run_and_may_change_the_patience(self):
        (self.folder / "reach.py").write_text(TASK.replace("(Reach)", "(Reach, patience_s=.2)"))
        learner = self.learner_at_a_terminal(subprocess.PIPE, "study.toml", "--set", "study.discards_max=2")
        for _ in range(5):
            self.until("the start policy, seed ")
        learner.terminate()
        learner.communicate(timeout=60)
        self.assertEqual(learner.returncode, 3)
        self.open_terminal()  # the end of who had it has hung it up
        (self.folder / "reach.py").write_text(TASK)
        learner = self.learner_at_a_terminal(subprocess.PIPE, "--resume", "treeroll-runs/operated")
        for _ in range(6):
            self.until("Enter begins, r rejects, p pauses > ")
            self.type("\n")
            self.until("a accepts, r tries again, p pauses > ")
            self.type("a\n")
        _, errors = learner.communicate(timeout=60)
        self.assertEqual(learner.returncode, 0, errors)
        rows = self.rows(self.folder / "treeroll-runs/operated/rollouts.csv")
        self.assertEqual([row["status"] for row in rows], ["ok"] * 4)

    def test_its_own_terminal_is_known_however_often_it_is_described(self):
        process = self.piped(["sh", "-c", f"{PYTHON} reach.py; true"], preexec_fn=self.take_terminal)
        for _ in range(3):
            said = self.described(process)
            self.assertIn("time_limit_s", said, said)

    def test_without_a_terminal_the_task_is_refused_with_what_to_do(self):
        for place, rule in (("/dev/null", "/dev/null must be a terminal"),
                            ("/dev/pts/none", "cannot open the operator's terminal")):
            said = self.described(self.program(TREEROLL_OPERATOR_TERMINAL=place))
            self.assertIn(rule, said["refused"])
        process = self.piped(["setsid", PYTHON, "reach.py"])
        self.assertIn("TREEROLL_OPERATOR_TERMINAL=/dev/pts/N", self.described(process)["refused"])

    def test_checking_a_study_does_not_move_the_robot(self):
        (self.folder / "study.toml").write_text(STUDY)
        os.environ["TREEROLL_OPERATOR_TERMINAL"] = os.ttyname(self.slave)
        self.addCleanup(os.environ.pop, "TREEROLL_OPERATOR_TERMINAL")
        said = self.run_program("treeroll-learner", "study.toml", "--check", "--evaluator",
                                f"{PYTHON} reach.py")
        self.assertIn("start    not tried", said.stdout)
        (self.folder / "reach.py").write_text(TASK.replace("time_limit_s=5", "time_limit_s=5, repeatable=False")
                                              .replace("treeroll.with_operator(Reach)", "Reach"))
        said = self.run_program("treeroll-learner", "study.toml", "--check", "--evaluator",
                                f"{PYTHON} reach.py")
        self.assertIn("start    not tried", said.stdout)
        self.assertEqual(self.moved(), [])

    def learner_at_a_terminal(self, errors, *study):
        """The worker is a background job there, which a terminal would stop."""
        (self.folder / "study.toml").write_text(STUDY)
        learner = subprocess.Popen(
            ["treeroll-learner", *(study or ["study.toml"]), "--local-workers", "2", "--lcm-url", lcm_url(3),
             "--evaluator", f"{PYTHON} reach.py"], cwd=self.folder, text=True, preexec_fn=self.take_terminal,
            env={**os.environ, "TERM": "xterm"}, stdin=self.slave, stdout=subprocess.PIPE, stderr=errors)

        def end():
            if learner.poll() is None:
                learner.send_signal(signal.SIGKILL)
            learner.communicate()

        self.addCleanup(end)
        return learner

    def test_a_question_stays_on_the_terminal_until_it_is_answered(self):
        """The learner's bar would be drawn over it."""
        self.learner_at_a_terminal(self.slave)
        for _ in range(2):  # nothing is shown before the first one has been accepted
            self.until("Enter begins, r rejects, p pauses > ")
            self.type("\n")
            self.until("a accepts, r tries again, p pauses > ")
            self.type("a\n")
        self.until("Enter begins, r rejects, p pauses > ")
        time.sleep(3)
        if select.select([self.master], [], [], 0)[0]:
            self.shown += os.read(self.master, 4096).decode()
        self.assertEqual(self.shown, "")

    def test_a_learner_at_a_terminal_asks_its_operator(self):
        learner = self.learner_at_a_terminal(subprocess.PIPE)
        rejected = False
        for _ in range(6):  # the start, four roll-outs, the final policy
            self.until("Enter begins, r rejects, p pauses > ")
            self.type("\n")
            self.until("a accepts, r tries again, p pauses > ")
            if not rejected:
                rejected = True
                self.type("r\n")
                self.until("Enter begins, r rejects, p pauses > ")
                self.type("\n")
                self.until("a accepts, r tries again, p pauses > ")
            self.type("a\n")
        _, errors = learner.communicate(timeout=60)
        self.assertEqual(learner.returncode, 0, errors)
        self.assertEqual(len(self.rows(self.folder / "treeroll-runs/operated/rollouts.csv")), 4)
        self.assertEqual(len(self.moved()), 7)


if __name__ == "__main__":
    unittest.main()
