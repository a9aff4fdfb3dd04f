"""Laws, their parameters and their states as tables of a TOML file.

Corrections (:mod:`models.correction.correction`) and mechanisms of users (:mod:`models.mechanisms.user_files`) share
them.
"""

from __future__ import annotations

import sympy as sp

from models.definition.sections import Name, Section, Text
from models.network.expressions import Law
from models.terms.term import Form, Kind


class LawParameter(Section):
    """A number in a law."""

    name: Name
    unit: Text = "1"
    description: str = ""


class LawState(Section):
    """A state with the time derivative `rate` [1/s], set to `update` after each step.

    `averaged_update` takes the place of `update` where temperatures are means over minutes.
    """

    name: Name
    start: float = 0.0
    rate: Law = sp.S.Zero
    update: Law | None = None
    averaged_update: Law | None = None


class LawTable(Section):
    """A law and what it acts on; see :class:`models.terms.term.Term`."""

    kind: Kind
    law: Law
    is_loss: bool = False
    form: Form | None = None
    of_measurement: bool = False
    state: tuple[LawState, ...] = ()
