"""Where the values of a TOML or XML text are, so that a number can be replaced and all else stays."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeAlias
from xml.parsers import expat

Path: TypeAlias = tuple[str | int, ...]
"""Keys and, in arrays, positions that lead to a value"""
Span: TypeAlias = tuple[int, int]
"""First character of a value, and the one after its last"""

_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_KEY = re.compile(r"""[ \t]*([A-Za-z0-9_-]+|"(?:[^"\\\n]|\\.)*"|'[^'\n]*')[ \t]*""")
_TEXT = re.compile(r'''"""(?:[^\\]|\\.)*?"{3,5}|\'\'\'.*?'{3,5}|"(?:[^"\\\n]|\\.)*"|'[^'\n]*\'''', re.DOTALL)
_BARE = re.compile(r"[^\s,\]}#]+(?: \d[^\s,\]}#]*)?")


def toml_spans(text: str) -> dict[Path, Span]:
    """Return the span of every value in a valid TOML text that is no table and no array."""
    return dict(_Toml(text).values())


class _Toml:
    """A walk over a TOML text that `tomllib` reads without an error."""

    def __init__(self, text: str) -> None:
        self.text, self.at = text, 0

    def values(self) -> Iterator[tuple[Path, Span]]:
        table: Path = ()
        counts: dict[Path, int] = {}
        while self._after_blanks():
            if self._take("[["):
                table = _resolved(self._keys(), counts)
                counts[table] = counts.get(table, -1) + 1
                table = (*table, counts[table])
                self._take("]]")
            elif self._take("["):
                keys = self._keys()
                table = _resolved(keys, counts)
                self._take("]")
            else:
                keys = self._keys()
                self._take("=")
                yield from self._value((*table, *keys))

    def _value(self, path: Path) -> Iterator[tuple[Path, Span]]:
        self._after_blanks()
        if self._take("["):
            position = 0
            while self._after_blanks() and not self._take("]"):
                yield from self._value((*path, position))
                position += 1
                self._after_blanks()
                self._take(",")
        elif self._take("{"):
            while self._after_blanks() and not self._take("}"):
                keys = self._keys()
                self._take("=")
                yield from self._value((*path, *keys))
                self._after_blanks()
                self._take(",")
        else:
            found = _TEXT.match(self.text, self.at) or _BARE.match(self.text, self.at)
            assert found is not None, "tomllib has read the text"
            self.at = found.end()
            yield path, found.span()

    def _keys(self) -> Path:
        keys: list[str] = []
        while True:
            found = _KEY.match(self.text, self.at)
            assert found is not None, "tomllib has read the text"
            self.at = found.end()
            word = found[1]
            quoted = word[0] in "\"'"
            keys.append(next(iter(tomllib.loads(f"{word} = 0"))) if quoted else word)
            if not self._take("."):
                return tuple(keys)

    def _after_blanks(self) -> bool:
        found = _BLANK.match(self.text, self.at)
        assert found is not None, "it matches the empty text"
        self.at = found.end()
        return self.at < len(self.text)

    def _take(self, word: str) -> bool:
        found = self.text.startswith(word, self.at)
        self.at += len(word) if found else 0
        return found


def _resolved(keys: Path, counts: dict[Path, int]) -> Path:
    """Return a header's path; of an array of tables before its last key the last table is meant."""
    path: Path = ()
    for key in keys[:-1]:
        path = (*path, key)
        path = (*path, counts[path]) if path in counts else path
    return (*path, keys[-1])


@dataclass
class Element:
    """An element of an XML file."""

    tag: str
    attributes: dict[str, str]
    start: int
    """Byte of its ``<``"""
    inside: int = 0
    """First byte after its start tag"""
    end: int = 0
    """First byte of its end tag"""
    children: list[Element] = field(default_factory=list)

    def all(self, tag: str, **attributes: str) -> list[Element]:
        """Return the children with this tag and these attributes."""
        return [
            child
            for child in self.children
            if child.tag == tag and attributes.items() <= child.attributes.items()
        ]

    def first(self, tag: str, **attributes: str) -> Element | None:
        """Return the first such child."""
        return next(iter(self.all(tag, **attributes)), None)

    def attribute_span(self, data: bytes, name: str) -> Span:
        """Return the bytes of an attribute's value, without its quotes."""
        tag = data[self.start : self.inside]
        found = re.search(rb"\s" + re.escape(name.encode()) + rb"\s*=\s*(?:\"([^\"]*)\"|'([^']*)')", tag)
        assert found is not None, "the parser has found the attribute"
        group = 1 if found[1] is not None else 2
        return self.start + found.start(group), self.start + found.end(group)


def elements_of(data: bytes) -> Element:
    """Return the root element of an XML file.

    Raises:
        ValueError: It is no XML.

    """
    parser = expat.ParserCreate()
    document = Element("", {}, 0)
    path = [document]

    def started(tag: str, attributes: dict[str, str]) -> None:
        found = Element(tag, attributes, parser.CurrentByteIndex)
        found.inside = _end_of_tag(data, found.start)
        path[-1].children.append(found)
        path.append(found)

    def ended(_: str) -> None:
        path.pop().end = parser.CurrentByteIndex

    parser.StartElementHandler, parser.EndElementHandler = started, ended
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise ValueError(f"it is no XML: {error}") from None
    return document.children[0]


def _end_of_tag(data: bytes, start: int) -> int:
    quote = 0
    for position in range(start, len(data)):
        byte = data[position]
        if quote:
            quote = 0 if byte == quote else quote
        elif byte in b"\"'":
            quote = byte
        elif byte == ord(">"):
            return position + 1
    raise AssertionError("the parser has found the end of the tag")
