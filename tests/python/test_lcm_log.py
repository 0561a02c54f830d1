"""What lcm-logger has written down, and the types for other languages."""

import csv
import io
import json
import os
import shutil
import struct
import unittest

from support import PYTHON, SOURCE, ProgramTest, lcm_url, study_text
from treeroll.lcm_log import LogError, Reader, read_events, write_csv, write_lines
from treeroll.lcm_types import Types

STUDY = study_text('name = "watched"\nrollouts = 2000', 'name = "synthetic"\nduration_us = 1000')
LCM_JAR = "/usr/share/java/lcm.jar"


def recipe(language):
    """Of deploy/doc/lcm.md."""
    return (SOURCE / "deploy/doc/lcm.md").read_text().partition(f"```{language}\n")[2].partition("```")[0]


def event(number, channel, data, time_us=1_500_000):
    return struct.pack(">IQQII", 0xEDA1DA01, number, time_us, len(channel), len(data)) + \
        channel.encode() + data


def key(run, number):
    return Types().encode("rollout_key_t", {"run": run, "number": number})


class LogTest(ProgramTest):
    def log(self, *events):
        path = self.folder / "run.lcmlog"
        path.write_bytes(b"".join(events))
        return path

    def test_messages_become_lines_and_rows(self):
        path = self.log(event(0, "A", key(3, 17)), event(1, "B", key(4, 0)),
                        event(2, "A", key(3, 18), 2_000_000))
        lines = io.StringIO()
        write_lines(Reader(path), None, lines)
        self.assertEqual([json.loads(line) for line in lines.getvalue().splitlines()],
                         [{"time_s": 1.5, "channel": "A", "run": 3, "number": 17},
                          {"time_s": 1.5, "channel": "B", "run": 4, "number": 0},
                          {"time_s": 2.0, "channel": "A", "run": 3, "number": 18}])
        rows = io.StringIO()
        write_csv(Reader(path), "A", rows)
        self.assertEqual(list(csv.reader(io.StringIO(rows.getvalue()))),
                         [["time_s", "run", "number"], ["1.5", "3", "17"], ["2.0", "3", "18"]])

    def test_what_is_of_no_type_is_counted(self):
        reader = Reader(self.log(event(0, "A", b"12345678"), event(1, "B", key(1, 2)),
                                 event(2, "A", key(1, 2)[:-1])))
        self.assertEqual(len(list(reader.messages())), 1)
        self.assertEqual(reader.unknown, {"A": 2})

    def test_however_many_channels_there_are_few_are_counted_one_by_one(self):
        reader = Reader(self.log(*(event(i, f"C{i}", b"12345678") for i in range(300))))
        self.assertEqual(list(reader.messages()), [])
        self.assertEqual(len(reader.unknown), 101)
        self.assertEqual(reader.unknown["other channels"], 200)

    def test_damage_is_told_with_its_place_after_what_is_whole(self):
        whole = event(0, "A", key(1, 2))
        for rest, words in ((b"\0" * 40, f"damaged, at byte {len(whole)}"),
                            (whole[:-1], f"ends within a message, at byte {len(whole)}"),
                            (whole[:9], f"ends within a message, at byte {len(whole)}"),
                            (struct.pack(">IQQII", 0xEDA1DA01, 1, 1, 1, 2**32 - 1), "damaged, at byte")):
            found = read_events(self.log(whole, rest))
            self.assertEqual(next(found).channel, "A")
            with self.assertRaisesRegex(LogError, words):
                next(found)

    def test_the_command(self):
        path = self.log(event(0, "TREEROLL_JOURNAL", b"\1\2"), event(1, "A", key(3, 17)))
        said = self.run_program(PYTHON, "-m", "treeroll", "log", path)
        self.assertEqual(json.loads(said.stdout)["number"], 17)
        self.assertIn("treeroll-replay DIR --export lcm makes messages of them", said.stderr)
        self.run_program(PYTHON, "-m", "treeroll", "log", path, "--csv", "--channel", "A", "--output",
                         "a.csv")
        self.assertEqual(self.rows(self.folder / "a.csv"),
                         [{"time_s": "1.5", "run": "3", "number": "17"}])
        # Nothing that is there is written over, and least of all the log.
        before = path.read_bytes()
        (self.folder / "link").symlink_to(path)
        for output in (path, "link", "a.csv"):
            said = self.run_program(PYTHON, "-m", "treeroll", "log", path, "--output", output, status=1)
            self.assertIn("File exists", said.stderr)
        self.assertEqual(path.read_bytes(), before)
        self.assertEqual(len(self.rows(self.folder / "a.csv")), 1)
        self.run_program(PYTHON, "-m", "treeroll", "log", "none", "--output", "of_none", status=1)
        self.assertFalse((self.folder / "of_none").exists())
        said = self.run_program(PYTHON, "-m", "treeroll", "log", path, "--csv", status=1)
        self.assertIn("name its --channel", said.stderr)
        said = self.run_program(PYTHON, "-m", "treeroll", "log", "none", status=1)
        self.assertIn("No such file", said.stderr)
        path.write_bytes(b"no log at all, whatever it is called")
        self.assertIn("at byte 0", self.run_program(PYTHON, "-m", "treeroll", "log", path, status=1).stderr)


@unittest.skipUnless(shutil.which("lcm-gen"), "lcm-gen is not here")
class GeneratedTypesTest(ProgramTest):
    """The .lcm files as they are installed, for every language that Debian's lcm-gen writes."""

    def setUp(self):
        super().setUp()
        self.files = sorted((SOURCE / "lcmtypes").glob("*.lcm"))
        self.names = [file.stem for file in self.files]

    def generated(self, *options, pattern):
        self.run_program("lcm-gen", *options, *self.files)
        found = sorted(self.folder.glob(pattern))
        self.assertEqual(len(found), len(self.names), [str(f) for f in found])
        return found

    def test_c(self):
        sources = self.generated("-c", "--c-cpath", self.folder, "--c-hpath", self.folder, pattern="*.c")
        self.run_program("cc", "-fsyntax-only", "-I", self.folder, *sources)

    def test_cpp(self):
        headers = self.generated("-x", "--cpp-std", "c++11", "--cpp-hpath", self.folder,
                                 pattern="treeroll/*.hpp")
        (self.folder / "watch.cc").write_text(recipe("cpp"))
        self.run_program("c++", "-I", self.folder, "watch.cc", "-o", "watch", "-llcm")
        everything = self.folder / "all.cc"
        everything.write_text("".join(f'#include "{header}"\n' for header in headers))
        self.run_program("c++", "-fsyntax-only", "-I", self.folder, everything)

    def test_python(self):
        modules = self.generated("-p", "--ppath", self.folder, pattern="treeroll/*_t.py")
        for module in modules:
            compile(module.read_text(), str(module), "exec")

    @unittest.skipUnless(shutil.which("javac") and os.path.exists(LCM_JAR), "no Java here")
    def test_java(self):
        sources = self.generated("-j", "--jpath", self.folder, pattern="treeroll/*.java")
        self.run_program("javac", "-nowarn", "-cp", LCM_JAR, "-d", self.folder / "classes", *sources)

    def test_lua_and_csharp(self):
        for file in self.generated("-l", "--lpath", self.folder, pattern="treeroll/*_t.lua"):
            self.assertIn("function", file.read_text())
        for file in self.generated("--csharp", "--csharp-path", self.folder, pattern="**/*_t.cs"):
            self.assertIn("class " + file.stem, file.read_text())


class ExportedJournalTest(ProgramTest):
    """A journal as messages, read with nothing but the .lcm files."""

    def test_every_message_is_understood(self):
        (self.folder / "study.toml").write_text(STUDY.replace("2000", "40"))
        self.run_program("treeroll-learner", "study.toml", "--local-workers", "1", "--lcm-url", lcm_url(5),
                         "--state-dir", "state")
        self.run_program("treeroll-replay", "state", "--export", "lcm", "--output", "state.lcmlog")
        reader = Reader(self.folder / "state.lcmlog")
        told = [(event.channel, fields) for event, fields in reader.messages()]
        self.assertEqual(reader.unknown, {})
        self.assertEqual({channel for channel, _ in told}, {
            f"REPLAYED_TREEROLL_{name}" for name in
            ("BEST", "DEFINITIONS", "LEARNER", "REWARDS", "ROLLOUTS", "RUNS", "WORKERS")})
        rewards = [row["reward"] for row in self.rows(self.folder / "state/rollouts.csv")]
        runs = [run for channel, run in told if channel == "REPLAYED_TREEROLL_RUNS"]
        self.assertEqual([repr(run["last_reward"]) for run in runs if not run["done"]][-40:],
                         [repr(float(reward)) for reward in rewards])


class SubscriberTest(ProgramTest):
    """The recipes of deploy/doc/lcm.md."""

    def test_python(self):
        (self.folder / "watch.py").write_text(recipe("python").replace("timeout_s=10", "timeout_s=30"))
        url = lcm_url(4)
        os.environ["LCM_DEFAULT_URL"] = url
        self.addCleanup(os.environ.pop, "LCM_DEFAULT_URL")
        watcher = self.start(PYTHON, "-u", "watch.py")
        (self.folder / "study.toml").write_text(STUDY)
        self.run_program("treeroll-learner", "study.toml", "--local-workers", "1")
        line = watcher.stdout.readline().split()
        self.assertEqual(line[:2], ["plain", "0"])


if __name__ == "__main__":
    unittest.main()
