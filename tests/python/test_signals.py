"""Names of inputs and outputs, from a task to the robot that acts with what was learnt."""

import json

from support import PYTHON, ProgramTest, lcm_url, study_text
from treeroll import Policy

TASK = """
import treeroll

class Reach(treeroll.Task):
    def describe(self):
        return treeroll.Description(input_dim=1, output_dim=1, time_limit_s=2, inputs=["phase"],
                                    outputs=["wrist_m"])

    def evaluate(self, policy, seed):
        return 1 / (1 + (policy.act_named({"phase": 0.5})["wrist_m"] - 0.3) ** 2)

treeroll.run(Reach)
"""
STUDY = study_text('name = "reach"\nrollouts = 12', 'name = "reach"', output_scale=0.5)


class SignalsTest(ProgramTest):
    def setUp(self):
        super().setUp()
        (self.folder / "reach.py").write_text(TASK)
        (self.folder / "other.py").write_text(TASK.replace("wrist_m", "elbow_m"))
        (self.folder / "nameless.py").write_text(
            TASK.replace(', inputs=["phase"],', ")").replace('outputs=["wrist_m"])', "")
            .replace('policy.act_named({"phase": 0.5})["wrist_m"]', "policy(0.5)"))
        (self.folder / "study.toml").write_text(STUDY)

    def learn(self, *words, program="reach.py", status=0):
        return self.run_program("treeroll-learner", *words, "--local-workers", "1", "--lcm-url", lcm_url(7),
                                "--evaluator", f"{PYTHON} {self.folder}/{program}", status=status)

    def policy(self, name):
        return Policy.load(self.folder / name)

    def test_they_go_with_the_policy(self):
        said = self.learn("study.toml", "--check")
        self.assertIn("signals  phase -> wrist_m", said.stdout)
        self.learn("study.toml", "--state-dir", "state")
        self.run_program("treeroll-replay", "state", "--policy", "0:3", "--output", "three.json")
        self.run_program("treeroll-replay", "state", "--start", "plain", "--output", "start.json")
        for name in ("state/policies/plain-0.json", "state/policies/plain-0.final.json", "three.json",
                     "start.json"):
            policy = self.policy(name)
            self.assertEqual((policy.input_names, policy.output_names), (["phase"], ["wrist_m"]), name)
            self.assertEqual(policy.act_named({"phase": 0.5}), {"wrist_m": policy(0.5)})
        verified = self.run_program("treeroll-replay", "state", "--verify")
        self.assertIn("files agree", verified.stdout)
        self.run_program("treeroll-report", "state", "--evaluator", f"{PYTHON} {self.folder}/reach.py")
        scripts = "".join(file.read_text() for file in (self.folder / "report/figures").rglob("*.gp"))
        self.assertIn("set xlabel 'phase'; set ylabel 'wrist (m)'", scripts)

    def test_a_program_that_acts_by_name_keeps_all_rules(self):
        said = self.run_program("treeroll-check-evaluator", f"{PYTHON} {self.folder}/reach.py", "--name",
                                "reach")
        self.assertIn("can be used as an evaluator", said.stdout)

    def test_another_task_is_refused(self):
        self.learn("study.toml", "--state-dir", "state")
        policy = "state/policies/plain-0.json"
        other = f"{PYTHON} {self.folder}/other.py"
        said = self.run_program("treeroll-evaluate", policy, "study.toml", "--evaluator", other, status=2)
        self.assertIn("its outputs are wrist_m, those of the task are elbow_m", said.stderr)
        said = self.learn("study.toml", "--set", f"policy.start_file={policy}", "--state-dir", "new",
                          program="other.py", status=2)
        self.assertIn("policy.start_file: the policy's outputs are wrist_m, those of the task are elbow_m",
                      said.stderr)
        said = self.learn("--resume", "state", "--set", "study.rollouts=20", program="other.py", status=2)
        self.assertIn("in the study the task's outputs are wrist_m, here they are elbow_m", said.stderr)

    def start_worker(self, url, program):
        self.start("treeroll-worker", "--processes", "1", "--lcm-url", url, "--evaluator",
                   f"{PYTHON} {self.folder}/{program}")

    def learn_from_afar(self, url, *words, status=0):
        """By a learner beside which nobody knows the task."""
        return self.run_program("treeroll-learner", *words, "--lcm-url", url, status=status)

    def test_they_come_from_workers_elsewhere(self):
        url = lcm_url(10)
        self.start_worker(url, "reach.py")
        said = self.learn_from_afar(url, "study.toml", "--state-dir", "state")
        self.assertIn("no worker program here knows the task", said.stderr)
        self.assertNotIn("phase", (self.folder / "state/study.toml").read_text())

        def expect_names(*files):
            for name in files:
                policy = self.policy(name)
                self.assertEqual((policy.input_names, policy.output_names), (["phase"], ["wrist_m"]), name)

        both = ("state/policies/plain-0.json", "state/policies/plain-0.final.json")
        expect_names(*both)
        # What reads the journal writes the same, and a learner that goes on.
        self.assertIn("files agree", self.run_program("treeroll-replay", "state", "--verify").stdout)
        self.run_program("treeroll-replay", "state", "--policy", "0:3", "--output", "three.json")
        self.run_program("treeroll-replay", "state", "--start", "plain", "--output", "start.json")
        expect_names("three.json", "start.json")
        self.learn_from_afar(url, "--resume", "state", "--set", "study.rollouts=16")
        expect_names(*both)
        self.run_program("treeroll-report", "state")
        scripts = "".join(file.read_text() for file in (self.folder / "report/figures").rglob("*.gp"))
        self.assertIn("set xlabel 'phase'; set ylabel 'wrist (m)'", scripts)

    def test_a_worker_that_names_them_otherwise_gets_nothing(self):
        url = lcm_url(11)
        self.start_worker(url, "reach.py")
        self.learn_from_afar(url, "study.toml", "--state-dir", "state")
        said = self.learn("--resume", "state", "--set", "study.rollouts=16", program="other.py", status=1)
        self.assertIn("outputs are wrist_m, those of this task are elbow_m", said.stderr)
        other = lcm_url(12)
        self.start_worker(other, "other.py")
        learner = self.start("treeroll-learner", "--resume", "state", "--set", "study.rollouts=16",
                             "--lcm-url", other)
        said = next(line for line in learner.stderr if "refuses the task" in line)
        self.assertIn("outputs are elbow_m, this study calls them wrist_m", said)

    def test_who_names_none_goes_on_with_who_does(self):
        self.learn("study.toml", "--state-dir", "nameless", program="nameless.py")
        text = json.loads((self.folder / "nameless/policies/plain-0.json").read_text())
        self.assertNotIn("signals", text)
        # The study began without names: its files stay as they are.
        self.learn("--resume", "nameless", "--set", "study.rollouts=16")
        self.assertNotIn("signals", (self.folder / "nameless/policies/plain-0.json").read_text())
        self.learn("study.toml", "--state-dir", "named")
        self.learn("--resume", "named", "--set", "study.rollouts=16", program="nameless.py")
        for file in ("rollouts.csv", "runs.csv"):
            self.assertEqual((self.folder / "nameless" / file).read_bytes(),
                             (self.folder / "named" / file).read_bytes(), file)
        self.assertEqual(self.policy("named/policies/plain-0.json").output_names, ["wrist_m"])
        # A start that names signals gives them to a study whose task names none.
        self.learn("study.toml", "--set", "policy.start_file=named/policies/plain-0.json", "--state-dir",
                   "on", program="nameless.py")
        self.assertEqual(self.policy("on/policies/plain-0.json").input_names, ["phase"])
        resolved = (self.folder / "on/study.toml").read_text()
        self.assertIn("signals", resolved)
