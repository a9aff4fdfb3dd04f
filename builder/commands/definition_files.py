"""The verbs ``new`` and ``schema``."""

from __future__ import annotations

import json
from pathlib import Path

import click

from builder.base import console
from builder.base.options import example
from models.assembly.commented_definition import commented_definition
from models.assembly.definition_schema import definition_schema
from models.assembly.gearbox import known_gearboxes, load_gearbox
from models.base.atomic_write import atomic_file
from models.base.errors import InputError
from models.files.toml_file import ENDING

SCHEMA_FILE = "definition.schema.json"


@click.command("new", epilog=example("new mine.toml --like conveyor"))
@click.argument("file", type=click.Path(path_type=Path), metavar="FILE")
@click.option("--like", type=click.Choice(known_gearboxes()), default="fzg", show_default=True,
              help="Machine of the package to begin from: heated_rod, la_haute_borne and reducer have no geometry, the "
                   "others have one.")  # fmt: skip
@click.option("--replace", is_flag=True, help="Write over a file that exists.")
def new(file: Path, like: str, replace: bool) -> None:
    """Begin a commented definition of your own machine.

    It has the values of a machine of the package and builds as it stands. The schema for editors is written next to it;
    Even Better TOML, Taplo and others complete keys by it.
    """
    if file.suffix != ENDING:
        raise InputError(f"{file}: a definition ends in {ENDING}; choose such a name")
    schema = file.with_name(SCHEMA_FILE)
    if file.exists() and not replace:
        raise InputError(f"{file}: exists already; choose another name, or give --replace to write over it")
    text = commented_definition(like, name=file.stem, file=file.name, schema=SCHEMA_FILE)
    _write(file, text)
    _write(schema, _schema_text())
    console.out.print(f"wrote {file}, begun from {like} ({load_gearbox(like).name}), and {schema} for editors")
    console.out.print(f"change its values, then: python -m builder check {file}")


@click.command("schema", epilog=example("schema --output definition.schema.json"))
@click.option("--output", type=click.Path(path_type=Path, dir_okay=False), default=None, metavar="FILE",
              help="File to write.  [default: print it]")  # fmt: skip
def schema(output: Path | None) -> None:
    """Write the JSON schema of definitions, for editors.

    It has keys, units, limits and meanings. A definition names it in its first line, as in '#:schema
    definition.schema.json'.
    """
    if output is None:
        click.echo(_schema_text(), nl=False)
        return
    _write(output, _schema_text())
    console.out.print(f"wrote {output}; name it in the first line of a definition: #:schema {output.name}")


def _schema_text() -> str:
    return json.dumps(definition_schema(), indent=1, ensure_ascii=False) + "\n"


def _write(path: Path, text: str) -> None:
    with atomic_file(path) as partial:
        partial.write_text(text, encoding="utf-8")
