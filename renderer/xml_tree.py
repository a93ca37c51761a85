"""XML files as trees of elements, bounded in depth and number; entities are refused.

Expat reads the text; it opens nothing beyond it. A file that declares an entity is refused, so that none grows
out of a few lines ("billion laughs") and none names another file.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final, NoReturn
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from renderer.errors import SceneError

MAX_DEPTH: Final = 256
"""Deepest nesting of elements."""

MAX_ELEMENTS: Final = 2_000_000
"""Most elements of a file: about 1 GB in memory."""

_PIECE: Final = 1 << 20
"""Characters of a text that are taken apart at once: the words of a long text take ten times its memory."""

_BLANK: Final = re.compile(r"\s")

_DECIMAL_COMMA: Final = re.compile(r"(?<=\d),(?=\d)")


@dataclass(eq=False, slots=True)
class Element:
    """An element of an XML file, its name without namespace.

    Attributes:
        file: what messages call the file.
        line: where it begins.
        tag: its name.
        attributes: by name.
        text: its own text, without that of its children.
        children: the elements in it, in file order.

    Raises:
        SceneError: in every method that reads, naming the file, the line and the element.
    """

    file: str
    line: int
    tag: str
    attributes: dict[str, str]
    text: str = ""
    children: list[Element] = field(default_factory=list)

    def all(self, *tags: str) -> Iterator[Element]:
        """The children with one of these names."""
        return (child for child in self.children if child.tag in tags)

    def first(self, path: str) -> Element | None:
        """The first child at a path such as "technique_common/accessor"; None for none."""
        found: Element | None = self
        for tag in path.split("/"):
            if found is None:
                return None
            found = next(found.all(tag), None)
        return found

    def descendants(self) -> Iterator[Element]:
        """Itself and all elements in it, in file order."""
        waiting = [self]
        while waiting:
            element = waiting.pop()
            yield element
            waiting.extend(reversed(element.children))

    def floats(self) -> NDArray[np.float64]:
        """(n,) numbers of its text; commas between digits count as decimal points where no point stands."""
        text = self.text
        if "," in text:
            text = (text if "." in text else _DECIMAL_COMMA.sub(".", text)).replace(",", " ")
        try:
            return np.array(array("d", map(float, _words(text))))
        except ValueError as error:
            raise self.refuse("numbers", str(error)) from None

    def integers(self) -> NDArray[np.int64]:
        """(n,) whole numbers of its text."""
        try:
            return np.array(array("q", map(int, _words(self.text))), dtype=np.int64)
        except (ValueError, OverflowError) as error:
            raise self.refuse("whole numbers", str(error)) from None

    def number(self, path: str, default: float) -> float:
        """The finite number in the child at a path; the default where there is none."""
        found = self.first(path)
        if found is None or not found.text.strip():
            return default
        values = found.floats()
        if len(values) != 1 or not np.isfinite(values[0]):
            raise found.refuse("a finite number", found.text.strip())
        return float(values[0])

    def index(self, attribute: str, default: int) -> int:
        """The whole number from 0 in an attribute; the default where there is none."""
        text = self.attributes.get(attribute, str(default)).strip()
        if not (text.isascii() and text.isdigit() and len(text) < 18):
            raise self.refuse(f"a whole number in {attribute}", text)
        return int(text)

    def refuse(self, expected: str, found: object) -> SceneError:
        """The error for content that is not as expected; raise it."""
        shown = " ".join(str(found).split())
        shown = shown if len(shown) <= 80 else shown[:77] + "..."
        return SceneError(f"{self.file}: line {self.line}: {self.tag}: expected {expected}, found {shown}")


def _words(text: str) -> Iterator[str]:
    """The words of a text."""
    start = 0
    while start < len(text):
        blank = _BLANK.search(text, start + _PIECE)
        end = len(text) if blank is None else blank.start()
        yield from text[start:end].split()
        start = end


def read_xml(data: bytes, label: str) -> Element:
    """The root element of an XML file in an encoding that it states, or that its byte-order mark tells.

    Raises:
        SceneError: naming the file and the line, for damage, an entity, or too many or too deeply nested elements.
    """
    parser = expat.ParserCreate()
    parser.buffer_text = True
    builder = _Builder(label, parser)
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.text
    parser.EntityDeclHandler = builder.entity
    try:
        parser.Parse(data, True)
    except (expat.ExpatError, ValueError, LookupError) as error:
        raise SceneError(f"{label}: expected XML, found damage: {' '.join(str(error).split())}") from None
    assert builder.root is not None
    return builder.root


@dataclass(slots=True)
class _Builder:
    """Makes elements of what the parser reports."""

    label: str
    parser: expat.XMLParserType
    root: Element | None = None
    stack: list[Element] = field(default_factory=list)
    texts: list[list[str]] = field(default_factory=list)
    count: int = 0

    def start(self, name: str, attributes: dict[str, str]) -> None:
        self.count += 1
        line = self.parser.CurrentLineNumber
        element = Element(self.label, line, name.rpartition(":")[2], attributes)
        if len(self.stack) >= MAX_DEPTH or self.count > MAX_ELEMENTS:
            raise element.refuse(f"at most {MAX_ELEMENTS} elements, nested at most {MAX_DEPTH} deep", "more")
        if self.stack:
            self.stack[-1].children.append(element)
        else:
            self.root = element
        self.stack.append(element)
        self.texts.append([])

    def end(self, _: str) -> None:
        self.stack.pop().text = "".join(self.texts.pop())

    def text(self, text: str) -> None:
        self.texts[-1].append(text)

    def entity(self, name: str, *_: object) -> NoReturn:
        raise SceneError(
            f"{self.label}: line {self.parser.CurrentLineNumber}: expected a file without entities, found {name[:80]!r}"
        )
