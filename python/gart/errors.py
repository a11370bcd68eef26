"""What gart raises. Each message says what was wrong, where, and what to do about it.

A type is also the built-in error that it is one of, so that ``except OSError`` and ``except ValueError`` work.
"""
import re as _re


class Error(Exception):
    """Any error of gart."""

    #: What to do about it, where the message has it apart from the rest.
    remedy = ""

    @property
    def field(self):
        """The setting that the message names, as ``render_options.near``; empty where it names none."""
        found = _re.search(r"\b[a-z_]+_(?:options|request)\.[a-z_.]*[a-z_]", str(self))
        return found.group() if found else ""


class IoError(Error, OSError):
    """A file that cannot be read or written as asked."""

    #: The path, with the field or line where one is known.
    place = ""

    @property
    def file(self):
        """The path alone."""
        return self.place.split(": ")[0]


class Unsupported(Error, NotImplementedError):
    """A request that this build or this machine cannot serve."""


class InvalidArgument(Error, ValueError):
    """An option or argument out of its range, or an array of another type, shape or place."""


class OutOfMemory(Error, MemoryError):
    """Memory that could not be had: ``asked`` and ``available`` in bytes."""

    asked = 0
    available = 0


class NotFinite(Error, ArithmeticError):
    """A number of a training that is not finite any more: of which ``group``, of which ``gaussian``."""

    group = ""
    gaussian = 0
