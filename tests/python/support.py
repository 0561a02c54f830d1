"""What tests of the Python package share: programs of the build, policies, networks of their own."""

import csv
import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ["TREEROLL_SOURCE_DIR"])
PROGRAMS = Path(os.environ["TREEROLL_PROGRAMS"])
EXAMPLE = SOURCE / "deploy/own_task_python"
PYTHON = sys.executable
os.environ["PATH"] = f"{PROGRAMS}:{os.environ['PATH']}"


def policy_text(mean=0.25, inputs=1, outputs=1):
    """One Gaussian, whose outputs are `mean` at the inputs 0.5; each rises by half of an input."""
    dim = inputs + outputs
    covariance = [1.0 if row == column else 0.5 if column < inputs and column == row - inputs else 0.0
                  for row in range(dim) for column in range(row + 1)]
    return json.dumps({
        "format": "treeroll-policy", "version": 1, "kind": "tree", "frames": "cholesky",
        "input_dim": inputs, "layer": 1, "layout": "means",
        "layers": [[{"parent": -1, "prior": 1, "mean": [0.5] * inputs + [mean] * outputs,
                     "covariance": covariance}]]})


def study_text(study, task, *conditions, output_scale=1.0):
    """A spline that is learnt from nothing. `study`, `task` and each of `conditions` are lines of these tables."""
    tables = "".join(f"[[conditions]]\n{lines}\n" for lines in conditions or ('name = "plain"',))
    return f"""[study]
{study}
[task]
{task}
[policy]
kind = "spline"
start = "constant"
range = [0.0, 1.0]
[exploration]
output_scale = {output_scale}
{tables}"""


def lcm_url(salt):
    """A multicast group and port of the test's own, on this host."""
    pid = os.getpid()
    return f"udpm://239.255.{78 + salt}.{pid % 250 + 1}:{20000 + pid % 20000}?ttl=0"


class ProgramTest(unittest.TestCase):
    """Runs programs of the build in a folder of the test's own."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="treeroll-python-")
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    @staticmethod
    def rows(path):
        with open(path, newline="") as file:
            return list(csv.DictReader(file))

    def run_program(self, *words, status=0, folder=None):
        done = subprocess.run([str(w) for w in words], cwd=folder or self.folder, text=True,
                              capture_output=True, timeout=120)
        self.assertEqual(done.returncode, status, f"{words}\n{done.stdout}\n{done.stderr}")
        return done

    def start(self, *words):
        process = subprocess.Popen([str(w) for w in words], cwd=self.folder, text=True,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)

        def end():
            process.kill()
            process.communicate()

        self.addCleanup(end)
        return process
