"""What a page is made of. Tables are those of `amb_design.words`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, TypeAlias

from ..words.parts import Table


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    kind: ClassVar[str] = "text"
    text: str


@dataclass(frozen=True)
class Bullets:
    """A list of sentences."""

    kind: ClassVar[str] = "bullets"
    lines: tuple[str, ...]


@dataclass(frozen=True)
class Picture:
    """A drawing inside the page.

    Attributes
    ----------
    name : str
        Of the file, where the drawing is written to one.
    caption : str
        What it shows, below it.
    alt : str
        What it shows to a reader who does not see it, with the main figures.
    svg : str
        Markup without identifiers that could meet those of another picture.
    width : float
        Natural width [pt].
    """

    kind: ClassVar[str] = "picture"
    name: str
    caption: str
    alt: str
    svg: str = field(repr=False)
    width: float


@dataclass(frozen=True)
class Fold:
    """Text that opens on demand, such as a machine file."""

    kind: ClassVar[str] = "fold"
    title: str
    text: str = field(repr=False)


Block: TypeAlias = Text | Bullets | Picture | Fold | Table


@dataclass(frozen=True)
class Section:
    """A heading with what stands below it.

    Attributes
    ----------
    title : str
    blocks : tuple of Text, Bullets, Picture, Fold or Table
        Tables without rows are left out.
    sections : tuple of Section
        Under headings of the next level.
    """

    title: str
    blocks: tuple[Block, ...] = ()
    sections: tuple[Section, ...] = ()


@dataclass(frozen=True)
class Page:
    """A report.

    Attributes
    ----------
    title : str
    subtitle : str
        What was asked.
    verdict : str
        The answer in one sentence.
    good : bool or None
        Whether the answer is the one hoped for; None if that is not for us to say.
    facts : tuple of str
        Sentences below the answer.
    warnings : tuple of str
        Shown before everything else.
    sections : tuple of Section
    provenance : tuple of (str, str)
        What the figures come from.
    """

    title: str
    subtitle: str
    verdict: str
    good: bool | None
    facts: tuple[str, ...]
    warnings: tuple[str, ...]
    sections: tuple[Section, ...]
    provenance: tuple[tuple[str, str], ...]
