"""``python3 -m treeroll`` as a shell uses it: Ctrl-C, readers that have seen enough, full disks."""

import json
import os
import select
import signal
import struct
import subprocess

from support import EXAMPLE, PYTHON, ProgramTest, lcm_url
from treeroll.lcm_types import Types

INTERRUPTED = -signal.SIGINT  # ended by it
READER_GONE = 128 + signal.SIGPIPE


class CommandsTest(ProgramTest):
    def command(self, *words, **streams):
        """Started as in a foreground job, where no signal is ignored."""
        process = subprocess.Popen(
            [PYTHON, "-m", "treeroll", *map(str, words)], cwd=self.folder, text=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
            **{"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **streams})

        def end():
            process.kill()
            process.wait()
            for stream in (process.stdin, process.stdout, process.stderr):
                if stream is not None:
                    stream.close()

        self.addCleanup(end)
        return process

    def ended(self, process, status):
        errors = process.stderr.read()
        self.assertEqual(process.wait(timeout=60), status, errors)
        return errors

    def log(self, num_messages):
        data = Types().encode("rollout_key_t", {"run": 3, "number": 17})
        path = self.folder / "run.lcmlog"
        path.write_bytes(b"".join(
            struct.pack(">IQQII", 0xEDA1DA01, i, i, 1, len(data)) + b"A" + data for i in range(num_messages)))
        return path

    def test_ctrl_c_ends_watching_without_a_traceback(self):
        watch = self.command("watch", "--lcm-url", lcm_url(7))
        self.assertIn("unverified", watch.stderr.readline())
        self.assertEqual(select.select([watch.stderr], [], [], 0.3)[0], [], "it waits for messages")
        watch.send_signal(signal.SIGINT)
        self.assertEqual(self.ended(watch, INTERRUPTED), "")

    def test_ctrl_c_ends_a_task_without_a_traceback(self):
        task = self.command("task", f"{EXAMPLE}/pendulum.py:Pendulum")
        task.stdin.write(json.dumps({"describe": {"name": "pendulum", "settings": {}}}) + "\n")
        task.stdin.flush()
        self.assertIn("time_limit_s", task.stdout.readline())
        task.send_signal(signal.SIGINT)
        self.assertEqual(self.ended(task, INTERRUPTED), "")

    def test_ctrl_c_ends_a_log_without_a_traceback(self):
        os.mkfifo(self.folder / "endless")
        log = self.command("log", "endless")
        with open(self.folder / "endless", "wb"):  # it has opened it too, and reads
            log.send_signal(signal.SIGINT)
            self.assertEqual(self.ended(log, INTERRUPTED), "")

    def test_a_reader_that_has_seen_enough_is_no_error(self):
        for num_messages in (1, 100_000):  # fewer than a buffer holds, and more
            path = self.log(num_messages)
            for more in ([], ["--csv", "--channel", "A"]):
                log = self.command("log", path, *more)
                log.stdout.close()
                self.assertEqual(self.ended(log, READER_GONE), "", f"{num_messages} {more}")

    def test_a_full_disk_is_told_once(self):
        with open("/dev/full", "w") as full:
            log = self.command("log", self.log(1), stdout=full)
            self.assertRegex(self.ended(log, 1), r"\A[^\n]*No space left on device\n\Z")

    def test_what_was_read_before_damage_is_written(self):
        path = self.log(2)
        path.write_bytes(path.read_bytes()[:-1])
        log = self.command("log", path)
        self.assertEqual(len(log.stdout.readlines()), 1)
        self.assertRegex(self.ended(log, 1), r"\A[^\n]*ends within a message, at byte \d+\n\Z")
