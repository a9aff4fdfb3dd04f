"""Changing cells of a CSV file: everything else keeps its characters."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

from diagnosis.proof.injection.csv_text import read_csv_text
from models.base.errors import InputError
from models.files.table_file import TextForm

TEXT = '# remark\r\nt;a ;note\r\n0;1,50;x\r\n\r\n1;;"b;c"\r\n2;-0,25;y\r\n'


def test_only_the_named_cells_change(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_bytes(TEXT.encode())
    text = read_csv_text(file, TextForm(separator=";", decimal=","))
    changed = text.with_shifts({"a": np.array([1.0, 1.0, 0.25])})
    assert changed.lines == ("0;2,50;x\r\n", '1;;"b;c"\r\n', "2;0,00;y\r\n")
    assert gzip.decompress(changed.compressed).decode().startswith("# remark\r\nt;a ;note\r\n")


def test_decimals_are_those_of_the_column(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_text("t,a\n0,20.125\n1,20.1\n2,20.25\n")
    text = read_csv_text(file, TextForm())
    shifted = text.with_shifts({"a": np.array([0.375, np.nan, 0.0])})
    assert shifted.lines == ("0,20.5\n", "1,\n", "2,20.25\n")


def test_encoding_and_skipped_lines_are_kept(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_bytes("t,Öl\ns,°C\n0,20.5\n1,20.5\n".encode("cp1252"))
    text = read_csv_text(file, TextForm(encoding="cp1252", skip_lines=(2,)))
    changed = text.with_shifts({"Öl": np.array([1.0, 0.0])})
    assert gzip.decompress(changed.compressed) == "t,Öl\ns,°C\n0,21.5\n1,20.5\n".encode("cp1252")
    with pytest.raises(InputError, match="line 4 of skip_lines is among the rows"):
        read_csv_text(file, TextForm(encoding="cp1252", skip_lines=(1, 4)))


def test_rows_across_lines_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_text('t,a\n0,"x\ny"\n')
    with pytest.raises(InputError, match="within quotes"):
        read_csv_text(file, TextForm())
