"""Signatures as lcmtypes/PROTOCOL.md says, with its test vectors."""

import hashlib
import os
import re
import struct
import tempfile
import unittest
from pathlib import Path

from treeroll.authentication import (MAC_BYTES, SIGNATURE_BYTES, UNSIGNED, Authenticator, KeyFileError,
                                     KeyRing, _hash, announcement_id, announcement_key, worker_key)
from treeroll.lcm_types import Types

SOURCE = Path(os.environ.get("TREEROLL_SOURCE_DIR", Path(__file__).resolve().parents[2]))
KEY = bytes(range(32))
WORKER = 0x1122330000000005


class AuthenticationTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.file = Path(folder.name) / "key"
        text = (SOURCE / "lcmtypes/PROTOCOL.md").read_text()
        self.line = re.search(r"^worker 1122334455667788 .*$", text, re.M)[0]
        vectors = re.search(r"of nothing, its first message:\n(\w+)\n.*\n(\w+)\n", text)
        self.request, self.batch = (bytes.fromhex(part) for part in vectors.groups())
        self.types = Types(SOURCE / "lcmtypes")

    def keys(self, text, mode=0o600):
        self.file.unlink(missing_ok=True)
        self.file.touch(mode)
        self.file.write_text(text)
        self.file.chmod(mode)
        return KeyRing(self.file)

    def sign(self, batch, index):
        """As the learner of KEY would, to WORKER alone."""
        data = self.types.encode("rollout_batch_t", {
            **batch, **UNSIGNED, "num_word_macs": 1, "word_macs": [bytes(16)],
            "key_id": announcement_id(announcement_key(KEY)), "signed_index": index})
        digest = hashlib.blake2b(
            b"TREEROLL_ROLLOUTS\0" + data[:-SIGNATURE_BYTES - MAC_BYTES - 4] + struct.pack(">q", index),
            digest_size=32).digest()
        word = _hash(worker_key(KEY, 0x1122334455667788), digest, MAC_BYTES)
        data = data[:-SIGNATURE_BYTES - MAC_BYTES] + word + data[-SIGNATURE_BYTES:-MAC_BYTES]
        return data + _hash(announcement_key(KEY), b"TREEROLL_ROLLOUTS\0" + data, MAC_BYTES)

    def take(self, authenticator, data):
        return authenticator.is_signed("TREEROLL_ROLLOUTS", data) and authenticator.admit(
            "TREEROLL_ROLLOUTS", data, self.types.decode("rollout_batch_t", data))

    def test_the_vectors_of_the_protocol(self):
        keys = self.keys(self.line)
        self.assertEqual(keys.worker_keys[0][1], worker_key(KEY, 0x1122334455667788))
        self.assertEqual(keys.worker_id(5), WORKER)
        worker = Authenticator(keys, WORKER)
        plain = self.types.encode("definition_request_t", {
            "worker_id": WORKER, "learner_id": 77, "num_definitions": 0, "definitions": [], **UNSIGNED})
        self.assertEqual(worker.sign("TREEROLL_REQUESTS", plain).hex(), self.request.hex())
        self.assertTrue(self.take(worker, self.batch))
        self.assertFalse(self.take(worker, self.batch), "it has come before")

    def test_every_bit_counts(self):
        worker = Authenticator(self.keys(self.line), WORKER)
        for bit in range(8 * len(self.batch)):
            flipped = bytearray(self.batch)
            flipped[bit // 8] ^= 1 << bit % 8
            self.assertFalse(worker.is_signed("TREEROLL_ROLLOUTS", bytes(flipped)), bit)
        self.assertFalse(worker.is_signed("TREEROLL_DEFINITIONS", self.batch))

    def test_a_word_under_another_key_is_none(self):
        batch = self.types.decode("rollout_batch_t", self.batch)
        other = self.keys(self.line.replace("29187c57", "29187c58"))
        self.assertFalse(self.take(Authenticator(other, WORKER), self.sign(batch, 2)))
        own = self.keys(self.line)
        self.assertTrue(self.take(Authenticator(own, WORKER), self.sign(batch, 2)))

    def test_who_has_not_named_us_proves_nothing(self):
        worker = Authenticator(self.keys(self.line), WORKER + 1)
        self.assertFalse(self.take(worker, self.batch))
        watcher = Authenticator(self.keys(f"learner {KEY.hex()}"))
        self.assertTrue(self.take(watcher, self.batch))
        self.assertFalse(self.take(watcher, self.batch))

    def announce(self, worker, learner, index):
        """A status of a learner, signed with the key that learners share with all workers."""
        message = {"signed_index": index, "learner_id": learner}
        return worker.admit("TREEROLL_LEARNER", b"", message)

    def test_no_announcement_silences_a_learner(self):
        batch = self.types.decode("rollout_batch_t", self.batch)
        worker = Authenticator(self.keys(self.line), WORKER)
        self.assertTrue(self.take(worker, self.sign(batch, 2)))
        self.assertTrue(self.announce(worker, batch["learner_id"], 2**62))
        self.assertFalse(self.take(worker, self.sign(batch, 2)), "it has come before")
        self.assertTrue(self.take(worker, self.sign(batch, 3)))
        self.assertTrue(self.announce(worker, batch["learner_id"], 4))

    def test_no_learner_has_the_workers_name(self):
        batch = self.types.decode("rollout_batch_t", self.batch)
        worker = Authenticator(self.keys(self.line), WORKER)
        self.assertFalse(self.take(worker, self.sign({**batch, "learner_id": WORKER}, 2)))
        self.assertFalse(self.announce(worker, WORKER, 3))

    def test_key_files_are_read_strictly(self):
        for text, mode in ((self.line, 0o644), ("", 0o600), ("nonsense", 0o600),
                           (self.line + f"\nlearner {KEY.hex()}", 0o600), (self.line[:-1], 0o600)):
            with self.assertRaises(KeyFileError, msg=text):
                self.keys(text, mode)

    def test_keys_of_two_workers_are_no_ring(self):
        other = self.line.replace("worker 1122334455667788", "worker 1122334455667789")
        with self.assertRaisesRegex(KeyFileError, "holds keys of two workers"):
            self.keys(self.line + "\n" + other)
        self.assertEqual(len(self.keys(self.line + "\n" + self.line).worker_keys), 2)

    def test_a_credential_of_systemd_is_the_services_alone(self):
        if os.geteuid() != 0:
            self.skipTest("only root makes what belongs to root")
        with self.assertRaisesRegex(KeyFileError, "readable by its owner alone"):
            self.keys(self.line, 0o440)
        os.environ["CREDENTIALS_DIRECTORY"] = str(self.file.parent)
        self.addCleanup(os.environ.pop, "CREDENTIALS_DIRECTORY")
        self.assertEqual(len(self.keys(self.line, 0o440).worker_keys), 1)
        with self.assertRaises(KeyFileError):
            self.keys(self.line, 0o444)
        self.file.chmod(0o600)
        os.chown(self.file, 12345, -1)
        with self.assertRaisesRegex(KeyFileError, "must belong to the user"):
            KeyRing(self.file)

    def test_made_up_learners_are_forgotten_and_push_nobody_out_who_has_spoken_to_us(self):
        batch = self.types.decode("rollout_batch_t", self.batch)
        worker = Authenticator(self.keys(self.line), WORKER)
        watcher = Authenticator(self.keys(self.line))
        self.assertTrue(self.take(worker, self.batch))
        for learner in range(10_000, 13_000):
            for who in (worker, watcher):
                who.admit("TREEROLL_LEARNER", b"", {"learner_id": learner, "signed_index": 5})
        self.assertLessEqual(len(watcher._windows), 1024)
        self.assertLessEqual(len(worker._windows), 1024)
        self.assertFalse(self.take(worker, self.batch), "it has come before")
        self.assertTrue(self.take(worker, self.sign(batch, 2)))


if __name__ == "__main__":
    unittest.main()
