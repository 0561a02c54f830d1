"""Following a study on LCM, and the bytes on the wire."""

import hashlib
import json
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

from support import EXAMPLE, PYTHON, SOURCE, ProgramTest, lcm_url
import treeroll
from treeroll.__main__ import write_whole
from treeroll.lcm_bus import UdpmBus
from treeroll.lcm_types import MessageError, Types

# Run with the classes of lcm-gen -p, in a process of its own: their package has this one's name.
GENERATED = """
import importlib, json, sys
sys.path.insert(0, sys.argv[1])
def kind(name):
    return getattr(importlib.import_module("treeroll." + name), name)
def value(x):
    if isinstance(x, dict) and "bytes" in x: return bytes.fromhex(x["bytes"])
    if isinstance(x, dict):
        made = kind(x["kind"])()
        for key, field in x["fields"].items(): setattr(made, key, value(field))
        return made
    return [value(y) for y in x] if isinstance(x, list) else x
asked = json.load(sys.stdin)
print(json.dumps({
    "fingerprints": {n: kind(n)._get_packed_fingerprint().hex() for n in asked["kinds"]},
    "bytes": value(asked["value"]).encode().hex()}))
"""


class WriteWholeTest(unittest.TestCase):
    def test_a_link_at_the_temporary_name_is_not_written_through(self):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            victim = folder / "victim"
            victim.write_text("mine")
            (folder / "best.json.part").symlink_to(victim)
            write_whole(folder / "best.json", "{}")
            self.assertEqual((folder / "best.json").read_text(), "{}")
            self.assertEqual(victim.read_text(), "mine")


class TypesTest(unittest.TestCase):
    def test_bytes_are_those_of_lcm_gen(self):
        types = Types(SOURCE / "lcmtypes")
        kinds = sorted(path.stem for path in (SOURCE / "lcmtypes").glob("*.lcm"))
        key = {"run": 3, "number": -2}
        request = {"worker_id": -5, "key": key, "attempt": 1, "content": 2**62, "task_id": b"\1" * 16,
                   "policy_id": bytes(range(16)), "task_seed": 7, "theta_dim": 3,
                   "theta": [0.1, -2.5e300, 0.0], "num_theta_ids": 1, "theta_ids": [b"\xff" * 16]}
        batch = {"learner_id": 2**63 - 1, "sequence": 1, "num_rollouts": 2, "rollouts": [request] * 2,
                 "num_acknowledgements": 1,
                 "acknowledgements": [{"worker_id": 1, "seen_index": 2, "result_index": 3}],
                 "num_word_macs": 1, "word_macs": [b"\7" * 16],
                 "key_id": 9, "signed_index": 4, "mac": bytes(range(16))}

        def asked(kind, fields, parts):
            return {"kind": kind, "fields": {
                name: [asked(parts[name], x, parts) for x in field] if name in parts
                and isinstance(field, list) else asked(parts[name], field, parts) if name in parts
                else {"bytes": field.hex()} if isinstance(field, bytes)
                else [{"bytes": x.hex()} if isinstance(x, bytes) else x for x in field]
                if isinstance(field, list) else field for name, field in fields.items()}}

        value = asked("rollout_batch_t", batch, {"rollouts": "rollout_request_t",
                                                 "acknowledgements": "acknowledgement_t",
                                                 "key": "rollout_key_t"})
        with tempfile.TemporaryDirectory() as folder:
            files = [str(SOURCE / "lcmtypes" / (kind + ".lcm")) for kind in kinds]
            subprocess.run(["lcm-gen", "-p", "--ppath", folder, *files], check=True,
                           stdout=subprocess.DEVNULL)
            done = subprocess.run([PYTHON, "-c", GENERATED, folder], text=True, capture_output=True,
                                  input=json.dumps({"kinds": kinds, "value": value}),
                                  env={**os.environ, "PYTHONPATH": ""})
        self.assertEqual(done.returncode, 0, done.stderr)
        theirs = json.loads(done.stdout)
        for kind in kinds:
            self.assertEqual(f"{types.fingerprint(kind):016x}", theirs["fingerprints"][kind], kind)
        ours = types.encode("rollout_batch_t", batch)
        self.assertEqual(ours.hex(), theirs["bytes"])
        self.assertEqual(types.decode("rollout_batch_t", ours), batch)

    def test_no_bytes_are_too_wild(self):
        types = Types()
        good = types.encode("held_rollouts_t", {
            "learner_id": 1, "last_batch": 2, "last_index": 3, "num_keys": 1,
            "keys": [{"run": 1, "number": 2}], "first": {"run": 1, "number": 2},
            "last": {"run": 1, "number": 2}})
        for size in range(len(good)):
            with self.assertRaises(MessageError, msg=size):
                types.decode("held_rollouts_t", good[:size])
        with self.assertRaises(MessageError):
            types.decode("held_rollouts_t", good + b"\0")
        at = 8 + 24
        for count in (b"\x7f\xff\xff\xff", b"\xff\xff\xff\xff"):
            with self.assertRaises(MessageError):
                types.decode("held_rollouts_t", good[:at] + count + good[at + 4:])


class WatcherTest(ProgramTest):
    def learn(self, url, *more):
        return self.start("treeroll-learner", EXAMPLE / "pendulum.toml", "--lcm-url", url,
                          "--local-workers", "1", "--evaluator",
                          f"{PYTHON} {EXAMPLE}/pendulum.py", "--state-dir", "state", *more)

    def test_has_the_best_policies_that_the_study_leaves(self):
        url = lcm_url(4)
        with treeroll.Watcher("python_pendulum", url) as watcher:
            # Bytes of anybody's disturb nothing.
            noise = UdpmBus(url, set())
            for data in (b"", b"\0" * 8, os.urandom(100)):
                noise.publish("TREEROLL_BEST", data)
            learner = self.learn(url)
            first = watcher.wait_for_best(timeout_s=60)
            self.assertEqual(first.study, "python_pendulum")
            for _ in watcher.updates(silence_s=60):
                if watcher.is_done():
                    break
            noise.close()
            self.assertTrue(watcher.is_done(), "it fell silent")
            self.assertEqual(learner.wait(60), 0)
            self.assertEqual(len(watcher.all_best()), 2)
            for best in watcher.all_best():
                file = self.folder / f"state/policies/flat-{best.repetition}.json"
                self.assertEqual(best.text.strip(), file.read_text().strip())
                self.assertEqual(best.policy().theta, treeroll.Policy.load(file).theta)
            top = watcher.best("flat")
            self.assertEqual(top.reward, max(b.reward for b in watcher.all_best()))
            self.assertIsNone(watcher.best("nobody"))

    def test_the_command_keeps_the_best_policy_in_a_file(self):
        url = lcm_url(5)
        watch = self.start(PYTHON, "-m", "treeroll", "watch", "--lcm-url", url, "--output",
                           "best.json", "--timeout-s", "60")
        learner = self.learn(url)
        said, errors = watch.communicate(timeout=100)
        self.assertEqual(watch.returncode, 0, said + errors)
        self.assertEqual(learner.wait(60), 0)
        self.assertIn("python_pendulum flat 0: reward 0.9", said)
        found = treeroll.Policy.load(self.folder / "best.json").theta
        kept = [treeroll.Policy.load(self.folder / f"state/policies/flat-{i}.json").theta
                for i in (0, 1)]
        self.assertIn(found, kept)

    def test_a_resume_takes_no_better_policy_away(self):
        def status(learner):
            return {"learner_id": learner, "study": "mine", "num_runs": 2, "num_runs_done": 0}

        def tell(learner, run, reward):
            text = f'{{"run": {run}, "reward": {reward}}}'.encode()
            watcher._take("TREEROLL_RUNS", {"learner_id": learner, "run": run, "best_reward": reward,
                                            "done": False})
            watcher._take("TREEROLL_BEST", {
                "learner_id": learner, "run": run, "condition": "c", "repetition": run, "rollout": 3,
                "reward": reward, "total_bytes": len(text), "index": 0, "piece": text,
                "policy_id": hashlib.blake2b(text, digest_size=16).digest()})

        with treeroll.Watcher("mine", lcm_url(6)) as watcher:
            watcher._take("TREEROLL_LEARNER", status(1))
            tell(1, 0, .5)
            tell(1, 1, .9)
            watcher._heard -= 100  # killed, and resumed later
            watcher._take("TREEROLL_LEARNER", status(2))
            self.assertEqual(watcher.best().reward, .9)
            tell(2, 0, .6)
            self.assertEqual(sorted(b.reward for b in watcher.all_best()), [.6, .9])
            # Its last result was not on the disk: what the learner says counts in the end.
            tell(2, 1, .8)
            self.assertEqual(watcher.best().reward, .8)
            # Another study of this name begins: what it knows is told at once, which is nothing.
            watcher._heard -= 100
            watcher._take("TREEROLL_LEARNER", status(3))
            for run in (0, 1):
                watcher._take("TREEROLL_RUNS", {"learner_id": 3, "run": run, "best_reward": 0,
                                                "done": False})
            self.assertIsNone(watcher.best())

    def test_silence_and_wrong_urls_are_errors(self):
        with treeroll.Watcher(None, lcm_url(6)) as watcher:
            self.assertFalse(watcher.poll(0.0))
            with self.assertRaises(TimeoutError):
                watcher.wait_for_best(timeout_s=0.1)
        with self.assertRaises(ValueError):
            treeroll.Watcher(None, "tcpq://localhost")
        self.run_program(PYTHON, "-m", "treeroll", "watch", "--lcm-url", "nonsense", status=1)
