"""What pages of the tree say of other pages, of the programs' options and of pictures is so."""

import functools
import os
import re
import subprocess
import unittest
from pathlib import Path

from page import Command, Picture, steps_of

SOURCE = Path(os.environ["TREEROLL_SOURCE_DIR"])
PROGRAMS = Path(os.environ["TREEROLL_PROGRAMS"])
DOC = SOURCE / "deploy/doc"
PICTURES_BYTES_MOST = 1_500_000
ANSWER_LINES_MOST = 8


def pages():
    """Every page of the tree, by its path from the root."""
    roots = [SOURCE / name for name in
             ("common", "deploy", "lcmtypes", "learner", "sim", "tests", "workers")]
    found = [path for root in roots for path in root.rglob("*.md")] + list(SOURCE.glob("*.md"))
    return {path.relative_to(SOURCE).as_posix(): path.read_text() for path in sorted(found)}


def without_fences(text):
    return re.sub(r"^( *)```.*?^\1```$", "", text, flags=re.MULTILINE | re.DOTALL)


def anchors(text):
    """As forges make them of headings."""
    found = set()
    for heading in re.findall(r"^#+ (.*)$", without_fences(text), re.MULTILINE):
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower()
        anchor = re.sub(r"[^\w\- ]", "", words).replace(" ", "-")
        number = 0
        while (name := anchor if number == 0 else f"{anchor}-{number}") in found:
            number += 1
        found.add(name)
    return found


def broken_links(name, text, texts):
    """Links within the tree that lead nowhere."""
    broken = []
    for target in re.findall(r"\]\(([^)\s]+)\)", re.sub(r"`[^`\n]*`", "", without_fences(text))):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        there = (SOURCE / name).parent / path if path else SOURCE / name
        if not there.exists():
            broken.append(f"{name}: {target}")
        elif anchor:
            where = os.path.relpath(there.resolve(), SOURCE.resolve())
            if anchor not in anchors(texts[where]):
                broken.append(f"{name}: {target}")
    return broken


@functools.lru_cache(maxsize=None)
def help_of(program):
    """The long options that a program knows; None for a program of another name."""
    path = PROGRAMS / program
    if not path.exists() or program == "treeroll-benchmarks":  # its options are its library's
        return None
    is_script = path.read_bytes().startswith(b"#!")
    said = subprocess.run([path, "--help" if is_script else "--help-man"], capture_output=True, text=True,
                          check=True).stdout
    begins = r"^  (--[a-z-]+)" if is_script else r"^\\fB(--[a-z-]+)"
    return set(re.findall(begins, said.replace("\\-", "-"), re.MULTILINE))


def unknown_options(text):
    """Options behind the name of one of our programs, within a command, that it does not know."""
    hidden = {"--help-man", "--help-completion"}
    unknown = []
    # To the end of the line or of what is quoted, unless an arrow of a drawing comes before.
    for command in re.findall(r"(?:^|[ `/(])(treeroll-[a-z-]+)((?:\\\n|(?!-->)[^\n`;|&#])*)", text, re.MULTILINE):
        options = help_of(command[0])
        words = re.sub(r"'[^'\n]*'|\"[^\"\n]*\"", "", command[1])
        if options is None:
            continue
        for option in re.findall(r"(?<![\w-])(--[a-z][a-z-]*)(?![/\w])", words):
            if option not in options | hidden:
                unknown.append(f"{command[0]} {option}")
    return unknown


def folders_made(page):
    """In the home folder, by the commands of a tutorial."""
    texts = [step.text for step in steps_of(page) if isinstance(step, Command)]
    return {name for text in texts for name in re.findall(r"(?:mkdir -p|cp -r \S+) ~/(\S+)", text)}


class PagesTest(unittest.TestCase):
    def test_every_link_leads_somewhere(self):
        texts = pages()
        self.assertGreater(len(texts), 40)
        self.assertEqual([b for name, text in texts.items() for b in broken_links(name, text, texts)], [])

    def test_a_link_that_leads_nowhere_is_found(self):
        texts = {"README.md": "# A `b` (c)\n## Twice\n## Twice\n"}
        for good in ("[x](#a-b-c)", "[x](README.md#twice-1)", "[x](https://none.example)", "`[x](none.md)`"):
            self.assertEqual(broken_links("README.md", good, texts), [], good)
        for bad in ("[x](none.md)", "[x](#none)", "[x](README.md#twice-2)"):
            self.assertEqual(len(broken_links("README.md", bad, texts)), 1, bad)

    def test_every_option_in_a_command_is_one_of_its_program(self):
        self.assertEqual([f"{name}: {option}" for name, text in pages().items()
                          for option in unknown_options(text)], [])

    def test_an_option_that_no_program_has_is_found(self):
        self.assertEqual(unknown_options("`treeroll-learner x --local-workers 2 --lokal`"),
                         ["treeroll-learner --lokal"])
        self.assertEqual(unknown_options("    treeroll-worker --evaluator 'python3 x.py --mine'\n"), [])
        self.assertEqual(unknown_options("treeroll-learner \\\n  --none\n"), ["treeroll-learner --none"])


class DocumentationTest(unittest.TestCase):
    def test_pictures_are_few_bytes_and_each_is_on_a_page(self):
        shown = {step.path for page in (DOC / "tutorials").glob("*.md") for step in steps_of(page)
                 if isinstance(step, Picture)}
        there = {path.resolve() for path in (DOC / "pictures").iterdir()}
        self.assertEqual(shown ^ there, set())
        self.assertLess(sum(path.stat().st_size for path in there), PICTURES_BYTES_MOST)
        for path in there:
            self.assertIn(path.suffix, (".svg", ".png"))

    def test_what_quickstart_builds_is_all_that_tutorials_install(self):
        page = (DOC / "README.md").read_text()
        preset = re.search(r"^cmake --preset (\w+) && cmake --build --preset \1$", page, re.MULTILINE)[1]
        script = (SOURCE / "deploy/quickstart").read_text()
        self.assertIn(f"cmake --preset {preset})", script)
        builds = re.findall(r"^ *cmake --build (.*)$", script, re.MULTILINE)
        # No target is named: nothing is left to compile for `cmake --install`.
        self.assertEqual(builds, [f'"$root/build/{preset}" --parallel "$(nproc)"'])
        self.assertIn(f"cmake --install build/{preset} --prefix ~/opt/treeroll\n", page)

    def test_a_tutorial_begins_with_what_one_will_have_and_how_long_it_takes(self):
        tutorials = sorted(path.name for path in (DOC / "tutorials").glob("*.md"))
        self.assertGreaterEqual(len(tutorials), 7)
        index = (DOC / "README.md").read_text()
        for name in tutorials:
            head = (DOC / "tutorials" / name).read_text().split("\n## ")[0]
            self.assertIn(f"(tutorials/{name})", index)
            if name == "gallery.md":
                continue
            self.assertRegex(head, r"At the end you have", name)
            self.assertRegex(head, r"It takes about\s\d+ minutes", name)

    def test_a_reader_of_all_tutorials_finds_each_in_a_folder_of_its_own(self):
        made = {page.name: folders_made(page) for page in (DOC / "tutorials").glob("*.md")}
        names = [name for folders in made.values() for name in folders]
        self.assertGreaterEqual(len(names), 6)
        self.assertEqual(sorted(names), sorted(set(names)), made)
        self.assertNotIn("opt", {name.partition("/")[0] for name in names})  # where it is installed

    def test_every_page_is_in_the_index(self):
        index = (DOC / "README.md").read_text()
        for path in DOC.glob("*.md"):
            if path.name != "README.md":
                self.assertIn(f"({path.name})", index)

    def test_answers_are_short_and_say_what_to_do(self):
        text = (DOC / "faq.md").read_text()
        questions = re.split(r"^### ", text, flags=re.MULTILINE)[1:]
        self.assertGreaterEqual(len(questions), 30)
        for question in questions:
            title, _, answer = question.split("\n## ")[0].partition("\n")
            lines = [line for line in answer.splitlines()
                     if line.strip() and not line.startswith("```")]
            self.assertLessEqual(len(lines), ANSWER_LINES_MOST, title)
            self.assertRegex(answer, r"`|\]\(", f"{title}: a command, or a link")
            self.assertTrue(title.endswith("?") or title.startswith("`"), title)


if __name__ == "__main__":
    unittest.main()
