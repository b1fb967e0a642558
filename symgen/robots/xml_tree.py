"""XML from strangers as a tree of elements with their lines: no entities, no document types, bounded in every way."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from ..errors import ModelError
from ..model.files import read_plain

LARGEST_FILE = 16 << 20  # bytes; the largest robots of which we know have one tenth
MOST_ELEMENTS = 200_000
DEEPEST = 64
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\Z")


@dataclass
class Element:
    """One element of a file.

    Attributes
    ----------
    file : str
        What errors call the file.
    line : int
        Where it begins.
    tag : str
    attributes : dict
    children : list of Element
    """

    file: str
    line: int
    tag: str
    attributes: dict[str, str]
    children: list[Element] = field(default_factory=list)

    def error(self, message: str, hint: str | None = None) -> ModelError:
        """An error that names the file, the line and the element."""
        name = self.attributes.get("name")
        shown = f"<{self.tag[:40]}>" if name is None else f"<{self.tag[:40]} name={name[:60]!r}>"
        return ModelError(f"{shown}: {message}", file=self.file, line=self.line, hint=hint)

    def all(self, tag: str) -> list[Element]:
        """The children with a tag."""
        return [child for child in self.children if child.tag == tag]

    def one(self, tag: str) -> Element | None:
        """The only child with a tag, or None."""
        found = self.all(tag)
        if len(found) > 1:
            raise found[1].error(f"there are {len(found)} of it in <{self.tag}>, and one is meant")
        return found[0] if found else None

    def needed(self, tag: str) -> Element:
        """The only child with a tag."""
        found = self.one(tag)
        if found is None:
            raise self.error(f"<{tag}> is missing")
        return found

    def text(self, attribute: str, default: str | None = None) -> str:
        """An attribute; without a default it must be there."""
        value = self.attributes.get(attribute, default)
        if value is None:
            raise self.error(f"the attribute {attribute!r} is missing")
        return value

    def numbers(
        self, attribute: str, count: int, default: tuple[float, ...] | None = None
    ) -> tuple[float, ...]:
        """`count` finite numbers, separated by blanks."""
        if default is not None and attribute not in self.attributes:
            return default
        parts = self.text(attribute).split()
        if len(parts) != count:
            what = "one number" if count == 1 else f"{count} numbers"
            raise self.error(f"{attribute} = {self.attributes[attribute][:60]!r} is not {what}")
        return tuple(self._finite(attribute, part) for part in parts)

    def number(self, attribute: str, default: float | None = None) -> float:
        """One finite number."""
        return self.numbers(attribute, 1, None if default is None else (default,))[0]

    def _finite(self, attribute: str, text: str) -> float:
        value = float(text) if _NUMBER.match(text) else math.nan
        if not math.isfinite(value):
            hint = "expand the file with xacro first" if "${" in text else None
            raise self.error(f"{attribute} holds {text[:40]!r}, which is not a finite number", hint)
        return value


def read_xml(path: Path) -> Element:
    """Return the root of an XML file.

    Raises
    ------
    ModelError
        It is too large or too deep, no well-formed XML, or has a document type: entities can name other files and grow
        without bounds, and no robot needs them.
    """
    return parse_xml(read_plain(path, LARGEST_FILE, "XML file"), str(path))


def parse_xml(content: bytes, file: str) -> Element:
    """Return the root of an XML text; `file` is what errors call it."""
    parser = expat.ParserCreate()
    top = Element(file, 0, "", {})
    open_ones, n_elements = [top], 0

    def begin(tag: str, attributes: dict[str, str]) -> None:
        nonlocal n_elements
        n_elements += 1
        element = Element(file, parser.CurrentLineNumber, tag, attributes)
        if n_elements > MOST_ELEMENTS:
            raise element.error(f"the file has more than {MOST_ELEMENTS} elements")
        if len(open_ones) > DEEPEST:
            raise element.error(f"elements are nested more than {DEEPEST} deep")
        open_ones[-1].children.append(element)
        open_ones.append(element)

    def document_type(name: str, *_: object) -> None:
        raise ModelError(
            "a document type (<!DOCTYPE>), with which a file can have entities, is refused",
            file=file,
            line=parser.CurrentLineNumber,
            hint="write out what its entities stand for",
        )

    parser.StartElementHandler = begin
    parser.EndElementHandler = lambda tag: open_ones.pop()
    parser.StartDoctypeDeclHandler = document_type
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise ModelError(
            f"XML syntax: {reason}", file=file, line=error.lineno, column=error.offset + 1
        ) from None
    except (ValueError, LookupError) as error:  # an encoding that expat does not know
        raise ModelError(f"XML syntax: {error}", file=file, hint="save it as UTF-8") from None
    return top.children[0]
