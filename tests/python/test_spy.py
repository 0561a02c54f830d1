"""treeroll-spy: lcm-spy with rewards, on a display that nobody sees."""

import os
import shutil
import struct
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

from support import PROGRAMS, ProgramTest, lcm_url, study_text

SPY = PROGRAMS / "treeroll-spy"
STUDY = study_text('name = "spied"\nrollouts = 400\nrepetitions = 2',
                   'name = "synthetic"\nmode = "sleep"\nduration_us = 20000',
                   'name = "one"', 'name = "two"\nexploration.output_scale = 0.5')
# Runs that are drawn as an envelope of each condition.
MANY_RUNS = (STUDY.replace("repetitions = 2", "repetitions = 200").replace("rollouts = 400", "rollouts = 100")
             .replace("duration_us = 20000", "duration_us = 1000"))
# Of the first two conditions, RewardChart.java.
COLOURS = (0x0072B2, 0xD55E00)


def pixels(file):
    """Each pixel of the screen as Xvfb keeps it in a file (the format of xwd), as RRGGBB."""
    data = file.read_bytes()
    head = struct.unpack(">25I", data[:100])
    size, width, height, line, colours = head[0], head[4], head[5], head[12], head[19]
    start = size + 12 * colours
    for y in range(height):
        row = data[start + y * line:start + y * line + 4 * width]
        yield from (pixel & 0xFFFFFF for pixel in struct.unpack(f"<{width}I", row))


class SpyTest(ProgramTest):
    def setUp(self):
        super().setUp()
        if not SPY.exists():
            self.skipTest("treeroll-spy is not built: deploy/install-packages spy")

    def test_what_is_wrong_is_said(self):
        for words, display, said in ((["--nonsense"], ":9", "--nonsense: is no option"),
                                     (["--lcm-url"], ":9", "--lcm-url takes a value"),
                                     (["--lcm-url", "nonsense"], ":9", "nonsense: must begin"),
                                     (["--lcm-url="], ":9", "must begin with udpm://"),
                                     (["--channel="], ":9", "--channel: must be the name"),
                                     ([], "", "no display")):
            done = subprocess.run([SPY, *words], env={**os.environ, "DISPLAY": display}, text=True,
                                  capture_output=True, timeout=60)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(said, done.stderr)
        done = subprocess.run([SPY], env={**os.environ, "DISPLAY": ":64999"}, text=True,
                              capture_output=True, timeout=60)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertRegex(done.stderr, r"\Atreeroll-spy: cannot open a window: [^\n]*:64999[^\n]*\n\Z")
        self.assertIn("Usage: treeroll-spy", self.run_program(SPY, "--help").stdout)

    def display(self):
        """A screen of the test's own, and the file that it is kept in."""
        reads, writes = os.pipe()
        screens = tempfile.TemporaryDirectory(prefix="treeroll-screen-")
        self.addCleanup(screens.cleanup)
        server = subprocess.Popen(["Xvfb", "-displayfd", str(writes), "-screen", "0", "1400x700x24",
                                   "-nolisten", "tcp", "-fbdir", screens.name],
                                  pass_fds=(writes,), stderr=subprocess.DEVNULL)
        os.close(writes)
        self.addCleanup(server.wait)
        self.addCleanup(server.terminate)
        with os.fdopen(reads) as number:
            name = ":" + number.readline().strip()
        return name, Path(screens.name) / "Xvfb_screen0"

    @unittest.skipUnless(shutil.which("Xvfb"), "needs Xvfb: deploy/install-packages spy")
    def test_the_runs_of_a_study_are_drawn_beside_lcm_spy(self):
        self.expect_drawn(STUDY, lcm_url(6))

    @unittest.skipUnless(shutil.which("Xvfb"), "needs Xvfb: deploy/install-packages spy")
    def test_hundreds_of_runs_are_drawn_as_what_they_come_to(self):
        self.expect_drawn(MANY_RUNS, lcm_url(7))

    def expect_drawn(self, study, url):
        display, screen = self.display()
        output = self.folder / "spy.log"
        with output.open("w") as log:
            spy = subprocess.Popen([SPY, "--lcm-url", url], stdout=log, stderr=log,
                                   env={**os.environ, "DISPLAY": display})

        def end():
            spy.terminate()
            spy.wait()

        self.addCleanup(end)
        (self.folder / "study.toml").write_text(study)
        learner = self.start("treeroll-learner", "study.toml", "--local-workers", "2", "--lcm-url", url)

        def drawn():
            counted = dict.fromkeys(COLOURS, 0)
            for pixel in pixels(screen):
                if pixel in counted:
                    counted[pixel] += 1
            return counted

        deadline = time.monotonic() + 90
        while min(drawn().values()) < 300 and time.monotonic() < deadline:
            self.assertIsNone(spy.poll(), output.read_text())
            time.sleep(0.5)
        kept = os.environ.get("TREEROLL_SCREENSHOT")
        if kept:
            learner.wait(60)
            time.sleep(6)
            shutil.copy(screen, kept)
        self.assertGreaterEqual(min(drawn().values()), 300, output.read_text())
        # lcm-spy has found the plug-in by itself, and knows every message that was sent.
        said = output.read_text()
        self.assertIn("treeroll.spy.RewardPlugin", said)
        for trouble in ("Exception", "Unrecognized", "rror"):
            self.assertNotIn(trouble, said)


if __name__ == "__main__":
    unittest.main()
