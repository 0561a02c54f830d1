"""LCM types from their .lcm files: values as dicts, to bytes and back.

``lcm-gen -p`` would give classes in a package named as this one. So the files are read themselves, which
has the messages in one place too. Of LCM's language this takes what the files of treeroll use: one
struct a file, no constants or enumerations.
"""

from __future__ import annotations

import re
import struct
from pathlib import Path
from typing import Any, Optional, Union

_PRIMITIVES = {"int8_t": "b", "byte": "B", "boolean": "?", "int16_t": "h", "int32_t": "i",
               "int64_t": "q", "float": "f", "double": "d"}
_MASK = 2**64 - 1


class MessageError(ValueError):
    """Bytes that are no message of the type they are read as."""


class _Field:
    def __init__(self, kind: str, name: str, sizes: list[Union[int, str]]):
        self.kind, self.name, self.sizes = kind, name, sizes


class Types:
    """The types of a folder of .lcm files.

    :param folder: the installed ``lcmtypes``; None: that of this package
    """

    def __init__(self, folder: Optional[Path] = None):
        self._structs: dict[str, list[_Field]] = {}
        for path in sorted((folder or default_folder()).glob("*.lcm")):
            text = re.sub(r"//[^\n]*|/\*.*?\*/", "", path.read_text(), flags=re.S)
            for name, body in re.findall(r"struct\s+(\w+)\s*\{(.*?)\}", text, flags=re.S):
                self._structs[name] = [_field(line) for line in body.split(";") if line.strip()]
        if not self._structs:
            raise OSError(f"no .lcm files in {folder or default_folder()}")
        self._fingerprints = {name: self._fingerprint(name, ()) for name in self._structs}

    def fingerprint(self, kind: str) -> int:
        """The 64 bits before each message: they tell types and versions apart."""
        return self._fingerprints[kind]

    def kind_of(self, data: bytes) -> str:
        """The type whose fingerprint a message begins with.

        :raises MessageError: if it is none of these
        """
        for kind, fingerprint in self._fingerprints.items():
            if data[:8] == struct.pack(">Q", fingerprint):
                return kind
        raise MessageError("a message of no type that is known here")

    def encode(self, kind: str, value: dict) -> bytes:
        """:param value: every field by name; lists for arrays, bytes for arrays of bytes"""
        parts = [struct.pack(">Q", self._fingerprints[kind])]
        self._put(kind, value, parts)
        return b"".join(parts)

    def decode(self, kind: str, data: bytes) -> dict:
        """:raises MessageError: unless it is one whole message of this type"""
        if data[:8] != struct.pack(">Q", self._fingerprints[kind]):
            raise MessageError(f"not a {kind} of this version")
        reader = _Reader(data)
        value = self._take(kind, reader)
        if reader.left():
            raise MessageError(f"{reader.left()} bytes behind a {kind}")
        return value

    def _put(self, kind: str, value: dict, parts: list[bytes]) -> None:
        for field in self._structs[kind]:
            sizes = [s if isinstance(s, int) else value[s] for s in field.sizes]
            self._put_array(field.kind, value[field.name], sizes, parts)

    def _put_array(self, kind: str, value: Any, sizes: list[int], parts: list[bytes]) -> None:
        if sizes and len(value) != sizes[0]:
            raise MessageError(f"{len(value)} elements where {sizes[0]} are announced")
        if len(sizes) == 1 and kind == "byte":
            parts.append(bytes(value))
        elif sizes:
            for element in value:
                self._put_array(kind, element, sizes[1:], parts)
        elif kind == "string":
            text = value.encode() + b"\0"
            parts.append(struct.pack(">i", len(text)) + text)
        elif kind in _PRIMITIVES:
            parts.append(struct.pack(">" + _PRIMITIVES[kind], value))
        else:
            self._put(kind, value, parts)

    def _take(self, kind: str, reader: "_Reader") -> dict:
        value: dict[str, Any] = {}
        for field in self._structs[kind]:
            sizes = [s if isinstance(s, int) else value[s] for s in field.sizes]
            value[field.name] = self._take_array(field.kind, sizes, reader)
        return value

    def _take_array(self, kind: str, sizes: list[int], reader: "_Reader") -> Any:
        if len(sizes) == 1 and kind == "byte":
            return reader.take(sizes[0])
        if len(sizes) == 1 and kind in _PRIMITIVES:
            return reader.numbers(_PRIMITIVES[kind], sizes[0])
        if sizes:
            reader.need(sizes[0])  # an element has a byte at least: no count outgrows the message
            return [self._take_array(kind, sizes[1:], reader) for _ in range(sizes[0])]
        if kind == "string":
            text = reader.take(reader.numbers("i", 1)[0])
            if not text.endswith(b"\0"):
                raise MessageError("a string without an end")
            return text[:-1].decode("utf-8", "replace")
        if kind in _PRIMITIVES:
            return reader.numbers(_PRIMITIVES[kind], 1)[0]
        return self._take(kind, reader)

    def _fingerprint(self, kind: str, above: tuple[str, ...]) -> int:
        """As lcm-gen computes it: of names, types and sizes of the fields, then of theirs."""
        if kind in above:
            return 0
        total = _own_hash(self._structs[kind])
        for field in self._structs[kind]:
            if field.kind in self._structs:
                total += self._fingerprint(field.kind, (*above, kind))
        total &= _MASK
        return ((total << 1) | (total >> 63)) & _MASK


class _Reader:
    def __init__(self, data: bytes):
        self._data, self._at = data, 8

    def left(self) -> int:
        return len(self._data) - self._at

    def need(self, count: int) -> None:
        if count < 0 or count > self.left():
            raise MessageError("a count that the message has no room for")

    def take(self, count: int) -> bytes:
        self.need(count)
        self._at += count
        return self._data[self._at - count:self._at]

    def numbers(self, code: str, count: int) -> list:
        self.need(count)
        size = count * struct.calcsize(">" + code)
        return list(struct.unpack(f">{count}{code}", self.take(size)))


def default_folder() -> Path:
    """Where the files lie: in the installed package, or in the source tree."""
    here = Path(__file__).resolve().parent
    return here / "lcmtypes" if (here / "lcmtypes").is_dir() else here.parents[2] / "lcmtypes"


def _field(line: str) -> _Field:
    match = re.fullmatch(r"\s*(\w+)\s+(\w+)\s*((?:\[\s*\w+\s*\]\s*)*)", line)
    if match is None:
        raise MessageError(f"a line of a type that is not understood: {line.strip()}")
    sizes = re.findall(r"\w+", match[3])
    return _Field(match[1], match[2], [int(s) if s.isdigit() else s for s in sizes])


def _own_hash(fields: list[_Field]) -> int:
    value = 0x12345678

    def add(number: int) -> None:
        nonlocal value
        # The shift to the right is that of a signed number.
        signed = value - 2**64 if value >= 2**63 else value
        value = (((value << 8) ^ (signed >> 55)) + number) & _MASK

    def add_text(text: str) -> None:
        add(len(text))
        for character in text.encode():
            add(character)

    for field in fields:
        add_text(field.name)
        if field.kind in _PRIMITIVES or field.kind == "string":
            add_text(field.kind)
        add(len(field.sizes))
        for size in field.sizes:
            add(0 if isinstance(size, int) else 1)
            add_text(str(size))
    return value
