"""How the columns of a recorder differ from the machine: tables ``[[sensor]]`` and ``[[input]]`` of a correction.

```toml
[[sensor]]
channel = "oil"                # a node, <node>__<sensor>, or P_loss
bias = 0.8                     # reading less truth, [K] or [W]
bias_stderr = 0.1
lag = 25.0                     # time constant, [s]
mix = [{ node = "housing_lower", share = 0.05, stderr = 0.02 }, { node = "oil", share = 0.1, lag = 150.0 }]

[[input]]
name = "T_ambient"
offset = -1.5                  # truth = gain * recorded (clock seconds before) + offset
```

They are for recordings; a network or an FMU holds nothing of them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Annotated, Self

from pydantic import Field, model_validator

from models.base.errors import did_you_mean
from models.definition.sections import Name, NotNegative, Positive, Section
from models.quantities.quantities import TOTAL_LOSS, is_total_loss, node_of_channel

AIR = "air"  # the surroundings, for a machine whose network has no such node
Number = Annotated[float, Field(ge=-1e9, le=1e9)]


class Mix(Section):
    """Share of another node in a reading, or of the sensor's own node behind time: ``lag`` is a time constant, [s].

    reading = (1 - share) own node + share mixed node
    """

    node: Name
    share: Annotated[float, Field(ge=-1.0, le=1.0)]
    stderr: NotNegative = 0.0
    lag: NotNegative = 0.0


class SensorCorrection(Section):
    """``[[sensor]]``: a channel of the recorder. The mix comes first, then lag or delay, gain, and bias."""

    channel: Name
    bias: Number = 0.0
    bias_stderr: NotNegative = 0.0
    lag: NotNegative = 0.0
    lag_stderr: NotNegative = 0.0
    gain: Positive = 1.0
    gain_stderr: NotNegative = 0.0
    delay: Number = 0.0
    delay_stderr: NotNegative = 0.0
    mix: tuple[Mix, ...] = ()

    @model_validator(mode="after")
    def _fits_its_channel(self) -> Self:
        if is_total_loss(self.channel) and (self.lag or self.mix):
            raise ValueError(f"{TOTAL_LOSS} has gain, delay and bias; lag and mix are those of a temperature")
        if not is_total_loss(self.channel) and (self.gain != 1.0 or self.delay):
            raise ValueError(f"gain and delay are those of {TOTAL_LOSS}; a temperature has mix, lag and bias")
        mixed = [(one.node, one.lag) for one in self.mix]
        if len(set(mixed)) < len(mixed):
            raise ValueError("a node is mixed in twice with the same lag; keep one")
        return self

    def faults(self, nodes: Collection[str]) -> Iterator[str]:
        """Yield a fault for the channel and every mixed node if a machine with these nodes lacks it."""
        node = node_of_channel(self.channel, nodes)
        if not is_total_loss(self.channel) and node not in nodes:
            yield f"[[sensor]] {self.channel!r} is at no node{did_you_mean(node, nodes)}"
        for one in self.mix:
            if one.node not in (*nodes, AIR):
                yield f"[[sensor]] {self.channel!r} mixes in {one.node!r}, no node{did_you_mean(one.node, nodes)}"


class InputCorrection(Section):
    """``[[input]]``: truth = gain * recorded + offset, of the moment `clock` seconds before."""

    name: Name
    gain: Positive = 1.0
    gain_stderr: NotNegative = 0.0
    offset: Number = 0.0
    offset_stderr: NotNegative = 0.0
    clock: Number = 0.0
    clock_stderr: NotNegative = 0.0
