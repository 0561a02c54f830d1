"""A worker from the wire alone (tests/wire/worker.py) learns beside ours, also under loss."""

import json

from support import EXAMPLE, PYTHON, SOURCE, ProgramTest, lcm_url

TASK = f"{PYTHON} {EXAMPLE}/pendulum.py"


class WireTest(ProgramTest):
    def learn(self, state, url, *more):
        done = self.run_program(
            "treeroll-learner", EXAMPLE / "pendulum.toml", "--lcm-url", url, "--state-dir", state,
            "--set", "study.repetitions=8", "--set", "study.rollouts=30", "--json", *more)
        return json.loads(done.stdout), (self.folder / state / "rollouts.csv").read_bytes()

    def wire_worker(self, url, *more):
        return self.start(PYTHON, SOURCE / "tests/wire/worker.py", f"{EXAMPLE}/pendulum.py:Pendulum",
                          url, *more)

    def test_the_bytes_are_those_of_our_worker(self):
        _, ours = self.learn("ours", lcm_url(7), "--local-workers", "2", "--evaluator", TASK)

        worker = self.wire_worker(lcm_url(8), "--drop", "0.2")
        summary, alone = self.learn("alone", lcm_url(8), "--evaluator", TASK)
        self.assertEqual(list(summary["numeric_classes"]), ["python"])
        self.assertEqual(alone, ours)
        worker.terminate()
        self.assertEqual(worker.wait(20), 0)

        self.wire_worker(lcm_url(9), "--drop", "0.1")
        for attempt in range(5):  # on a busy machine one of the two may come too late for any
            summary, mixed = self.learn(f"mixed_{attempt}", lcm_url(9), "--local-workers", "1",
                                        "--evaluator", TASK)
            self.assertEqual(mixed, ours)
            self.assertEqual(summary["ledger"]["conflicting"], 0)
            if len(summary["numeric_classes"]) == 2:
                return
        self.fail("five times only one of the two workers had a part")

    def test_with_keys_the_bytes_stay_and_who_has_none_is_not_heard(self):
        _, ours = self.learn("ours", lcm_url(17), "--local-workers", "2", "--evaluator", TASK)
        learner, worker = self.folder / "learner.key", self.folder / "worker.key"
        self.run_program("treeroll-keygen", learner)
        self.run_program("treeroll-keygen", worker, "--worker-of", learner)
        self.wire_worker(lcm_url(18))
        self.wire_worker(lcm_url(18), "--drop", "0.1", "--key-file", str(worker))
        summary, signed = self.learn("signed", lcm_url(18), "--evaluator", TASK,
                                     "--key-file", learner)
        self.assertEqual(signed, ours)
        self.assertEqual([w["accepted"] > 0 for w in summary["workers"]], [True])
