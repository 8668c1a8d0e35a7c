"""Where a case came from: its file, the text that gives it, the lines of its keys."""

from __future__ import annotations

from pydantic import BaseModel, PrivateAttr

from femgear.casefile import tomlfile
from femgear.casefile.tomlfile import line_of
from femgear.errors import CaseError


class ReadCase(BaseModel):
    """Values of a case file that know where they were read."""

    _source: str = PrivateAttr(default="")
    _lines: str = PrivateAttr(default="")
    _name: str = PrivateAttr(default="")
    _notices: tuple[str, ...] = PrivateAttr(default=())
    _profile_files: dict[str, str] = PrivateAttr(default_factory=dict)

    def __eq__(self, other: object) -> bool:
        """Whether the values agree, from whatever text they came."""
        return isinstance(other, type(self)) and self.model_dump() == other.model_dump()

    @property
    def source(self) -> str:
        """TOML text that gives this case."""
        return self._source

    @property
    def name(self) -> str:
        """Name of the file, for messages."""
        return self._name

    def location(self, key: str) -> str | None:
        """File, and line where the file gives it, of a dotted key; of ``rack.x`` for ``sun.rack.x``."""
        found = (line_of(self._lines, name) for name in (key, key.partition(".")[2]) if name)
        line = next((number for number in found if number), None)
        return f"{self._name}:{line}" if self._name and line else self._name or None

    @property
    def profile_files(self) -> dict[str, str]:
        """Files of measured profiles or torque series, by the key of their entry."""
        return self._profile_files

    @property
    def notices(self) -> tuple[str, ...]:
        """Remarks on how the file was read."""
        return self._notices


def text_with_points(data: dict, name: str, *, points: str, remedy: str) -> str:
    """TOML text of tables that the points of other files were put into.

    Raises
    ------
    CaseError
        It is too long for a case file (E-FILE).
    """
    text = tomlfile.write(data)
    if len(text.encode()) > tomlfile.MAX_BYTES:
        raise CaseError(
            f"the case is too long with the points of its {points}",
            code="E-FILE",
            value=f"{len(text.encode())} bytes",
            limit=f"{tomlfile.MAX_BYTES} bytes",
            remedy=remedy,
            file=name or None,
        )
    return text
