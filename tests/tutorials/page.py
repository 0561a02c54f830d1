"""A tutorial as its reader takes it: files to write, commands to run, what these print, pictures.

In the Markdown of a page

- a fence with a language and a name holds a file that the reader writes: ```toml my_study.toml
- a fence with lines that begin with "$ " holds commands. Before the "$" may stand the name of a host, as in "lab1$ ".
  A command goes on in the next line after a backslash.
- the other lines there are printed by the command above them: on standard output, standard error or the
  terminal, in this order, with others in between. "..." stands for anything.
- "<!-- from FILE -->" below a picture names the file that the commands have made and that it is a copy of;
  "<!-- from the page of DIR, 1200x800 -->" says that it is a screenshot of the page of that state directory;
  "<!-- of PAGE.md -->" that the commands of another tutorial make it.
"""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Iterator, List, Optional, Union

_FENCE = re.compile(r"^```(\S*)\s*(\S*)\s*$")
_COMMAND = re.compile(r"^([a-z0-9]*)\$ (.*)$")
_PICTURE = re.compile(r"^!\[([^\]]*)\]\(([^)]+)\)")
_OF = re.compile(r"^<!-- of (\S+\.md) -->$")
_FROM = re.compile(r"^<!-- from (the page of )?(\S+)(?:, (.*))? -->$")


class PageError(Exception):
    """The page, its line, and the rule that it breaks."""


@dataclasses.dataclass
class File:
    """Which the reader writes."""

    line: int
    name: str
    text: str


@dataclasses.dataclass
class Command:
    line: int
    host: str  # "" unless the page names one
    text: str
    shown: List[str] = dataclasses.field(default_factory=list)


@dataclasses.dataclass
class Picture:
    line: int
    path: Path  # of the copy that the page shows
    source: str
    of_page: bool  # of the live page, else a file
    how: str  # of the live page: the size, the theme


Step = Union[File, Command, Picture]


def steps_of(page: Path) -> List[Step]:
    """What the reader of the page does and sees, in its order."""
    return list(_Reader(page).steps())


class _Reader:
    def __init__(self, page: Path):
        self._page = page
        self._lines = page.read_text(encoding="utf-8").splitlines()
        self._at = 0

    def _error(self, rule: str) -> PageError:
        return PageError(f"{self._page}:{self._at}: {rule}")

    def _next(self) -> Optional[str]:
        if self._at == len(self._lines):
            return None
        self._at += 1
        return self._lines[self._at - 1]

    def steps(self) -> Iterator[Step]:
        text = ""  # of the paragraphs so far
        while (line := self._next()) is not None:
            fence = _FENCE.match(line)
            if fence and fence[2]:
                if f"`{fence[2]}`" not in text:
                    raise self._error(f"name the file `{fence[2]}` in the text above: forges do not show it")
                yield File(self._at, fence[2], "\n".join(self._fenced()) + "\n")
            elif fence:
                yield from self._commands()
            elif picture := _PICTURE.match(line):
                yield from self._picture(picture[1], picture[2])
            else:
                text += line + "\n"

    def _fenced(self) -> List[str]:
        begin = self._at
        while (line := self._next()) is not None:
            if line == "```":
                return self._lines[begin:self._at - 1]
        raise self._error("a fence does not end")

    def _commands(self) -> Iterator[Command]:
        first = self._at + 1
        command: Optional[Command] = None
        for number, line in enumerate(self._fenced(), first):
            if command and command.text.endswith("\\"):
                command.text += "\n" + line
            elif begun := _COMMAND.match(line):
                if command:
                    yield command
                command = Command(number, begun[1], begun[2])
            elif command and line.strip():
                command.shown.append(line.rstrip())
        if command:
            yield command

    def _picture(self, words: str, path: str) -> Iterator[Picture]:
        if not words:
            raise self._error("say in words what the picture shows")
        below = self._next() or ""
        shown = (self._page.parent / path).resolve()
        other, source = _OF.match(below), _FROM.match(below)
        if source:
            yield Picture(self._at, shown, source[2], bool(source[1]), source[3] or "")
        elif not other:
            raise self._error("below a picture stands what it is made from: <!-- from FILE -->")
        elif shown not in [step.path for step in steps_of(self._page.parent / other[1])
                           if isinstance(step, Picture)]:
            raise self._error(f"{other[1]} does not make this picture")


def shown_as(shown: str) -> "re.Pattern[str]":
    """What a line of a page stands for."""
    return re.compile(".*".join(re.escape(part) for part in shown.strip().split("...")) + "$")


def missing(shown: List[str], texts: List[str]) -> List[str]:
    """Lines of a page that none of the texts has: each text in their order, each line once."""
    at = [0] * len(texts)
    lines = [[line.strip() for line in text.splitlines()] for text in texts]
    lost = []
    for line in shown:
        if line.strip() == "...":
            continue
        pattern = shown_as(line)
        for i, of_text in enumerate(lines):
            found = next((k for k in range(at[i], len(of_text)) if pattern.match(of_text[k])), None)
            if found is not None:
                at[i] = found + 1
                break
        else:
            lost.append(line)
    return lost
