"""Each tutorial of deploy/doc/tutorials, and the README, as their reader follows them with an installed treeroll.

TREEROLL_PREFIX is where it is installed."""

import os
import tempfile
import unittest
import warnings
from pathlib import Path

from reader import Hosts, Reader, own_network

SOURCE = Path(os.environ["TREEROLL_SOURCE_DIR"])
PREFIX = Path(os.environ["TREEROLL_PREFIX"])
TUTORIALS = SOURCE / "deploy/doc/tutorials"
PICTURE_BYTES_LEAST = 2_000


class TutorialTest(unittest.TestCase):
    def follow(self, name, num_commands_least):
        return self.follow_page(TUTORIALS / f"{name}.md", num_commands_least)

    def follow_page(self, page, num_commands_least):
        """Every command does what the page says, and every picture can be made anew."""
        folder = tempfile.TemporaryDirectory(prefix="treeroll-tutorial-")
        self.addCleanup(folder.cleanup)
        pictures = []

        def see(picture, source):
            self.assertTrue(picture.path.exists(), f"{picture.path}: deploy/pictures makes it")
            if not picture.of_page:
                self.assertGreater(source.stat().st_size, PICTURE_BYTES_LEAST, source)
            pictures.append(picture)

        home = Path(folder.name)
        (home / "build").mkdir()
        (home / "build/release").symlink_to(PREFIX)  # of the clone in which the README is read
        reader = Reader(page, home, PREFIX, own_network(91))
        reader.read(see)
        self.assertGreaterEqual(reader.num_commands, num_commands_least)
        return pictures

    def test_readme(self):
        self.follow_page(SOURCE / "README.md", 4)

    def test_demonstration(self):
        self.assertGreaterEqual(len(self.follow("demonstration", 8)), 3)

    def test_report(self):
        self.assertGreaterEqual(len(self.follow("report", 4)), 4)

    def test_python_task(self):
        self.assertGreaterEqual(len(self.follow("python_task", 8)), 2)

    def test_cpp_task(self):
        self.assertGreaterEqual(len(self.follow("cpp_task", 8)), 1)

    def test_robot(self):
        self.assertGreaterEqual(len(self.follow("robot", 6)), 1)

    def test_two_hosts(self):
        refusal = Hosts.refusal()
        if refusal:
            self.skipTest(refusal)
        self.follow("two_hosts", 10)

    def test_gallery(self):
        self.assertGreaterEqual(len(self.follow("gallery", 6)), 8)


if __name__ == "__main__":
    warnings.simplefilter("error", ResourceWarning)
    unittest.main()
