"""The three ways in which amb_design says no."""

from __future__ import annotations


class AmbDesignError(Exception):
    """Base of every error that amb_design raises on purpose."""


class SpecError(AmbDesignError, ValueError):
    """The description of a machine or problem is wrong.

    Parameters
    ----------
    problem : str
        What is wrong with the value, as the end of a sentence that starts with the field:
        ``"must be positive"``.
    field : str
        Path of the field inside the object that found the problem, ``"disks[2].position"``.
    got : object
        The offending value, as the user wrote it; left out of the sentence when ``None``.
    remedy : str
        What to do about it.
    file : str
        File that was being read, if any.
    """

    def __init__(self, problem: str, *, field: str = "", got: object = None, remedy: str = "", file: str = ""):
        self.problem, self.field, self.got, self.remedy, self.file = problem, field, got, remedy, file
        super().__init__(self.sentence())

    def sentence(self) -> str:
        """The whole message: file, field, value, problem and remedy in one sentence."""
        subject = self.field or "the file"
        if self.got is not None:
            subject += f" = {_short(self.got)}"
        text = f"{subject} {self.problem}"
        if self.file:
            text = f"{self.file}: {text}"
        text = f"{text}; {self.remedy}" if self.remedy else text
        return " ".join(text.splitlines())  # one line, whatever the user's names contain

    def inside(self, prefix: str) -> SpecError:
        """The same error seen from an object that holds the failing one.

        Parameters
        ----------
        prefix : str
            Field or index under which it holds it, such as ``"disks[2]"``.
        """
        joint = "" if not prefix or not self.field or self.field.startswith("[") else "."
        return SpecError(
            self.problem, field=f"{prefix}{joint}{self.field}", got=self.got, remedy=self.remedy, file=self.file
        )

    def in_file(self, file: str) -> SpecError:
        """The same error with the name of the file that it was found in.

        Parameters
        ----------
        file : str
        """
        return SpecError(self.problem, field=self.field, got=self.got, remedy=self.remedy, file=file)


class ModelError(AmbDesignError, ValueError):
    """The model cannot be built or evaluated for what was asked."""


class SolveError(AmbDesignError, RuntimeError):
    """A numerical solution did not arrive; the message names the status and what was violated."""


def _short(value: object, limit: int = 60) -> str:
    try:
        text = f"{value:g}" if isinstance(value, float) else repr(value) if isinstance(value, str) else str(value)
    except ValueError:  # Python refuses to print integers of thousands of digits
        text = "a huge number"
    return text if len(text) <= limit else text[: limit - 3] + "..."
