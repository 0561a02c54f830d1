"""The reader of tutorials finds what a page says wrongly."""

import os
import tempfile
import unittest
from pathlib import Path

from page import Command, File, PageError, Picture, missing, steps_of
from reader import Hosts, Reader, TutorialError
from shell import Shell


class PageTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="treeroll-tutorial-")
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def page(self, text):
        path = self.folder / "page.md"
        path.write_text(text)
        return path

    def read(self, text, see=lambda picture, source: None):
        home = Path(tempfile.mkdtemp(dir=self.folder, prefix="home"))
        reader = Reader(self.page(text), home, Path("/usr"), "udpm://239.255.76.67:7667?ttl=0")
        reader.read(see)
        return reader

    def complaint(self, text):
        with self.assertRaises((PageError, TutorialError)) as caught:
            self.read(text)
        return str(caught.exception)


class StepsTest(PageTest):
    def test_files_commands_and_pictures_come_in_the_pages_order(self):
        steps = steps_of(self.page(
            "Write `a.toml`:\n```toml a.toml\nx = 1\n```\n```\n$ one \\\n  more\nshown\n\nlab$ two\n```\n"
            "```\nno command\n```\n![what it is](p/x.svg)\n<!-- from runs/x.svg -->\n"
            "![a page](p/y.png)\n<!-- from the page of runs/x, 1200x800 -->\n"))
        self.assertEqual([type(step) for step in steps], [File, Command, Command, Picture, Picture])
        self.assertEqual((steps[0].name, steps[0].text), ("a.toml", "x = 1\n"))
        self.assertEqual((steps[1].text, steps[1].host, steps[1].shown), ("one \\\n  more", "", ["shown"]))
        self.assertEqual((steps[2].text, steps[2].host, steps[2].line), ("two", "lab", 10))
        self.assertEqual((steps[3].path, steps[3].source), (self.folder.resolve() / "p/x.svg", "runs/x.svg"))
        self.assertEqual((steps[4].of_page, steps[4].source, steps[4].how), (True, "runs/x", "1200x800"))

    def test_what_a_forge_would_not_show_is_an_error(self):
        self.assertIn("name the file `a.toml`", self.complaint("```toml a.toml\nx = 1\n```\n"))
        self.assertIn("a fence does not end", self.complaint("```\n$ true\n"))
        self.assertIn("what the picture shows", self.complaint("![](x.svg)\n<!-- from x.svg -->\n"))
        self.assertIn("what it is made from", self.complaint("![x](x.svg)\n"))

    def test_a_picture_of_another_page_is_made_there(self):
        (self.folder / "other.md").write_text("![x](x.svg)\n<!-- from x.svg -->\n")
        self.assertEqual(steps_of(self.page("![x](x.svg)\n<!-- of other.md -->\n")), [])
        self.assertIn("other.md does not make this", self.complaint("![y](y.svg)\n<!-- of other.md -->\n"))

    def test_lines_of_several_texts_come_in_their_orders(self):
        texts = ["a 1\nb\n", "c\na 2\n"]
        self.assertEqual(missing(["a 1", "c", "...", "b", "a ..."], texts), [])
        self.assertEqual(missing(["b", "a 1"], texts), ["a 1"])
        self.assertEqual(missing(["c", "c"], texts), ["c"])
        self.assertEqual(missing(["a"], texts), ["a"], "a line is a line, whole")
        self.assertEqual(missing(["a (1)"], ["a (1)"]), [])


class ReaderTest(PageTest):
    def test_a_shell_keeps_folder_variables_and_what_runs_behind(self):
        reader = self.read("Write `x`:\n```\n$ mkdir there && cd there && export WORD=kept\n```\n```text x\nin it\n```\n"
                           "```\n$ cat x; echo $WORD $HOME; echo aside >&2\nin it\nkept ...home...\naside\n"
                           "$ (sleep .3; echo late; sleep 60) &\nlate\n$ kill $!\n```\n")
        self.assertEqual(reader.num_commands, 4)

    def test_what_is_not_printed_is_a_complaint_with_its_place(self):
        complaint = self.complaint("```\n$ true\n$ echo 0.991\n0.992\n```\n")
        self.assertIn("page.md:3: echo 0.991", complaint)
        self.assertIn("shows what is not printed:\n  0.992", complaint)

    def test_a_command_that_fails_is_a_complaint(self):
        self.assertIn("exit status 3", self.complaint("```\n$ sh -c 'exit 3'\n```\n"))
        self.assertIn("exit status", self.complaint("```\n$ treeroll-none\n```\n"))

    def test_a_picture_is_seen_where_the_commands_are(self):
        seen = []
        self.read("```\n$ mkdir a; cd a; echo '<svg>' > b.svg\n```\n![b](../b.svg)\n<!-- from b.svg -->\n",
                  lambda picture, source: seen.append((picture.source, source.read_text())))
        self.assertEqual(seen, [("b.svg", "<svg>\n")])
        self.assertIn("no command of the page makes it", self.complaint("![b](b.svg)\n<!-- from b.svg -->\n"))

    def test_an_operator_types_what_the_page_says_and_then_goes_on(self):
        ask = "; ".join(f"printf 'treeroll: {question} > ' >/dev/tty; read answer </dev/tty; echo got:$answer"
                        for question in ("begin", "1. a accepts, p pauses", "2. a accepts, p pauses"))
        self.read(f"```\n$ {ask}\ntreeroll: begin >\ntreeroll: 1. a accepts, p pauses > r\n"
                  "got:\ngot:r\ngot:a\n```\n")

    def test_a_command_that_does_not_end_is_ended_with_its_children(self):
        shell = Shell(self.folder, {"PATH": os.environ["PATH"]})
        try:
            with self.assertRaises(TimeoutError):
                shell.run("sleep 61.5 & echo $!; wait", .5)
            child = int((next((self.folder / ".said").glob("*.output"))).read_text())
        finally:
            shell.close()
        with self.assertRaises(ProcessLookupError):
            os.kill(child, 0)

    def test_two_hosts_hear_each_other_and_nobody_else(self):
        refusal = Hosts.refusal()
        if refusal:
            self.skipTest(refusal)
        hear = "import socket; s = socket.socket(2, 2); s.bind(('', 9)); print(s.recvfrom(9)[1][0])"
        self.read("```\ntwo$ while sleep .1; do echo x >/dev/udp/10.77.0.1/9; done &\n"
                  f"one$ python3 -c \"{hear}\"\n10.77.0.2\none$ ip route | wc -l\n1\n```\n")


if __name__ == "__main__":
    unittest.main()
