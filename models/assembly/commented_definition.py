"""A definition of one's own, begun from one of the package: the same values, and a comment on every key."""

from __future__ import annotations

import json
import re
import textwrap
from typing import Any

from models.assembly.definition_schema import definition_schema, table_classes
from models.assembly.gearbox import FOLDER
from models.assembly.gearbox_definition import Definition
from models.definition.definition_file import OIL_OF_SEAL
from models.definition.key_texts import TEXTS
from models.definition.machine_definition import has_geometry
from models.definition.parametric_sections import ParametricDefinition
from models.files.toml_file import packaged, parse, read_text

HEADER = """\
#:schema {schema}
#
# {name}: begun from "{like}", with the values of that machine. It builds as it stands. Replace the values by those of
# your machine, and every source by where yours come from.
#
#     python -m builder check {file}                  lists faults, or what was understood
#     python -m builder build-fmu --gearbox {file}    builds the FMU
#
# A value is a number, or {{ value = 5.0, sd = "10 %", source = "drawing 4711" }}; sd is its standard deviation. With it
# a diagnosis may calibrate the value. Brackets in comments hold the unit. A line such as "# key = 1.0" shows a default.
"""
WIDTH = 120
TABLE = re.compile(r"\[\[?([\w.]+)\]\]?\s*(#.*)?$")
ASSIGNMENT = re.compile(r"(\w+)\s*=")


def commented_definition(like: str, *, name: str, file: str, schema: str) -> str:
    """Return the text of a definition begun from one of the package.

    Parameters
    ----------
    like : str
        Name of a gearbox of the package
    name : str
        Of the new machine
    file : str
        Name of the file, for the commands in its head
    schema : str
        File of the JSON schema, as editors find it from the file

    Examples
    --------
    >>> text = commented_definition("fzg", name="mine", file="mine.toml", schema="definition.schema.json")
    >>> [line for line in text.splitlines() if line.startswith("# Common face width")]
    ['# Common face width [mm]. Typically 10 to 200; 1 to 1000 is accepted.']
    """
    text = read_text(packaged(FOLDER, like))
    lines = text.splitlines()
    lines = lines[lines.index("") + 1 :]  # without the head of that machine
    document = parse(text, file=like)
    comments = _Comments(Definition if has_geometry(document) else ParametricDefinition)
    written = [*HEADER.format(name=name, like=like, file=file, schema=schema).splitlines(), ""]
    own = {"name": name, "source": f"begun from {like}: {document['source']}"}
    for line in lines:
        if match := TABLE.match(line):
            _insert(written, comments.end_of_table())
            before = comments.begin_table(match[1])
            written += [*before, line]
        elif match := ASSIGNMENT.match(line):
            key = match[1]
            if key == OIL_OF_SEAL:  # by default it follows the oil, which is soon another one
                continue
            written += comments.of(key)
            at_root = comments.path == "" and key in own
            written.append(f"{key} = {json.dumps(own[key], ensure_ascii=False)}" if at_root else line)
        else:
            written.append(line)
    _insert(written, comments.end_of_table())
    return "\n".join(written) + "\n"


def _insert(written: list[str], lines: list[str]) -> None:
    """Insert lines before the blank lines and comments at the end, which belong to what follows."""
    at = len(written)
    while at and (not written[at - 1] or (written[at - 1].startswith("#") and not written[at - 2])):
        at -= 1
    written[at:at] = lines


def _comment(text: str) -> list[str]:
    return textwrap.wrap(text, WIDTH, initial_indent="# ", subsequent_indent="# ", break_long_words=False)


class _Comments:
    """Comments on tables and keys, each where it comes first."""

    def __init__(self, root: type[Definition] | type[ParametricDefinition]) -> None:
        self.classes = table_classes(root)
        self.schema: Any = definition_schema()["definitions"]
        self.path = ""
        self._told: set[tuple[str, str]] = set()
        self._ended: set[str] = set()

    def begin_table(self, path: str) -> list[str]:
        """Lines before a table."""
        self.path = path
        parent, _, key = path.rpartition(".")
        text = TEXTS.get(self.classes.get(parent, ""), {}).get(key)
        if text is None or ("", path) in self._told:
            return []
        self._told.add(("", path))
        return [f"# {text.meaning}."]

    def of(self, key: str) -> list[str]:
        """Lines before a key."""
        table = self.classes.get(self.path, "")
        known = self.schema.get(table, {}).get("properties", {})
        if (table, key) in self._told or key not in known or key == "source":
            return []
        self._told.add((table, key))
        return _comment(self._line(known[key]))

    def end_of_table(self) -> list[str]:
        """Keys of a table that could be given too, with their defaults."""
        table = self.classes.get(self.path, "")
        if table in self._ended or table not in self.schema or not self.path:
            return []
        self._ended.add(table)
        keys = self.schema[table]["properties"].items()
        return [line for key, known in keys for line in self._optional(table, key, known)]

    def _optional(self, table: str, key: str, known: Any) -> list[str]:
        if (table, key) in self._told or key in ("source", "like") or "$ref" in known or known.get("type") == "array":
            return []
        self._told.add((table, key))
        if "default" in known:
            return [*_comment(self._line(known)), f"# {key} = {json.dumps(known['default'])}"]
        return _comment(f"Optional {key}: {self._line(known)}")

    @staticmethod
    def _line(known: Any) -> str:
        plain = known["anyOf"][0] if "anyOf" in known and "value" in known["anyOf"][-1].get("properties", {}) else known
        choices = plain.get("enum", ())
        text: str = known["description"]
        return text + (f" One of {', '.join(choices)}." if choices else "")
