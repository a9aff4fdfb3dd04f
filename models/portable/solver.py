"""Time integration of a thermal network. numpy only: this file also runs inside the FMU.

The network is stiff (time constants: mesh 0.1 s, housing 50 min) and its right-hand side is dear (a full loss
model), so the scheme is linearly implicit with the conductance matrix alone as its Jacobian: ROS2 of Verwer, Spee, Blom
and Hundsdorfer (SIAM J. Sci. Comput. 20, 1999), second order whatever matrix is used, L-stable, two evaluations per
step. The step size follows the embedded first-order solution, so the communication step does not matter.

The stages take inputs and time at the shares gamma and 1 - gamma of the step. For inputs on a straight line that is the
method's own term with the time derivative, without an evaluation for it: a stiff node follows a ramp without error.

An error counts by the heat that the node can store: a node of less than 2.5 J/K has a tolerance of heat, 0.075 J, in
place of one of temperature. It follows its neighbours within a second whatever happened before, and small steps for
its sake alone hardly change other nodes.

Losses are the dear part. Where speed and torque are constant and no temperature that the losses depend on moves by more
than 0.1 K from the first stage to the second, the second takes over the losses of the first: they would differ by about
one part in a thousand, which is half as much over the step, and nothing in a steady state.

A switch (a discrete update of an extra state) acts at the end of a step. Where it changes the heat balance so much that
acting late matters, the step is halved around the moment of the switch until it does not.

Heat is conserved by construction: the heat brought in and the heat given off are integrated by the same formula as the
temperatures, so that stored = brought in - given off to rounding.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

GAMMA = 1.0 - np.sqrt(0.5)
TOLERANCE_K = 0.03  # of the embedded first-order solution, per step; the second-order one is far closer
FULL_WEIGHT_J_K = 2.5  # heat capacity from which on a node's temperature error counts in full
STILL_K = 0.1  # that temperatures may move in a stage before losses are evaluated again
MOST_STEPS = 100_000  # tried in one communication step
SHORTEST_STEP_S = 1e-6
FIRST_STEP_S = 0.1
SAFETY, SHRINK, GROW = 0.9, 0.2, 5.0


@dataclass(frozen=True)
class LossesAt:
    """Losses and the operating point that they belong to.

    Attributes
    ----------
    speed, torque : Array, shape (...)
        As the losses see them, [1/min] and [N m]
    temperatures : Array, shape (..., nodes)
        That the losses depend on, [degC]
    power : Array, shape (..., components)
        [W]
    """

    speed: Array
    torque: Array
    temperatures: Array
    power: Array

    def still(self, speed: Array, torque: Array, temperatures: Array) -> bool:
        """True if the losses at this point may be used at another one."""
        same = np.array_equal(self.speed, speed) and np.array_equal(self.torque, torque)
        return bool(same and (np.abs(temperatures - self.temperatures) <= STILL_K).all())


@dataclass(frozen=True)
class Balance:
    """The heat balance of all nodes at one moment.

    Attributes
    ----------
    derivative : Array, shape (..., n)
        Rate of the states (temperatures first, then extra states), [K/s] and [1/s]
    matrix : Array, shape (..., n, n)
        Its Jacobian with respect to the states at fixed conductances and losses, [1/s]
    heat_in : Array, shape (...)
        Sum of all sources, [W]
    heat_out : Array, shape (..., boundaries)
        Heat to each boundary node, [W]
    heat_out_slope : Array, shape (..., boundaries, n)
        Its derivative with respect to the states at fixed conductances, [W/K]
    losses : LossesAt or None
        What the losses are, for a later balance that may take them over
    """

    derivative: Array
    matrix: Array
    heat_in: Array
    heat_out: Array
    heat_out_slope: Array
    losses: LossesAt | None = None


class System(Protocol):
    """Interface of a network to the solver."""

    @property
    def error_weights(self) -> Array:
        """Weight of every state's error in the step control, shape (..., n); of nodes see :func:`error_weights`."""
        ...

    def balance(self, time: float, inputs: Array, states: Array, near: Balance | None = None) -> Balance:
        """Heat balance at `time` [s] with `inputs`, shape (n_inputs,), and `states`, shape (..., n).

        Losses of `near` are taken over where they are :meth:`LossesAt.still` good.
        """
        ...

    def updated(self, time: float, inputs: Array, states: Array) -> Array:
        """The states after their discrete updates (hysteresis and the like), at the end of an accepted step."""
        ...


@dataclass(frozen=True)
class State:
    """Everything that carries over from one communication step to the next.

    Attributes
    ----------
    states : Array, shape (..., n)
        Node temperatures [degC], then extra states
    step : float
        Step size that the last step recommends, [s]
    heat_in : Array, shape (...)
        Heat that the sources have brought in since the start, [J]
    heat_out : Array, shape (..., boundaries)
        Heat given to each boundary since the start, [J]
    """

    states: Array
    step: float
    heat_in: Array
    heat_out: Array


def start(states: Array, boundaries: int) -> State:
    """The state at the start of a simulation, `states` of shape (..., n), of a network with some boundaries."""
    shape = states.shape[:-1]
    none, none_out = np.zeros(shape), np.zeros((*shape, boundaries))
    return State(states=np.array(states, dtype=float), step=FIRST_STEP_S, heat_in=none, heat_out=none_out)


def error_weights(capacities: Array) -> Array:
    """Weights of the errors of nodes in the step control.

    Parameters
    ----------
    capacities : Array, shape (..., n)
        Heat capacities, [J/K]

    Returns
    -------
    Array, shape (..., n)
        In (0, 1], [-]
    """
    return np.minimum(capacities / FULL_WEIGHT_J_K, 1.0)


def advance(system: System, state: State, time: float, duration: float, inputs: Array, inputs_end: Array) -> State:
    """Integrate over one communication step in which the inputs go linearly from `inputs` to `inputs_end`.

    Parameters
    ----------
    time, duration : float
        Start and length of the step, [s]
    inputs, inputs_end : Array, shape (n_inputs,)

    Raises
    ------
    ArithmeticError
        If the temperatures leave all bounds, the step size falls below 1e-6 s, or 100 000 steps are not enough.
    """
    elapsed = 0.0
    slope = (inputs_end - inputs) / duration if duration > 0.0 else np.zeros_like(inputs)
    identity = np.eye(state.states.shape[-1])
    switch_by, narrow = np.inf, 0.0  # a switch acts before that moment; a step so long that meets it is short enough
    tried = 0
    while elapsed < duration:
        if tried == MOST_STEPS:
            raise ArithmeticError(
                f"the communication step needs more than {MOST_STEPS} steps; make it shorter. They end at "
                f"{time + elapsed:g} s"
            )
        tried += 1
        remaining = duration - elapsed
        # Two even steps instead of a full one and a sliver.
        h = remaining if state.step >= remaining else min(state.step, 0.5 * remaining)
        to_switch = switch_by - elapsed
        h = min(h, to_switch if to_switch <= narrow else 0.5 * to_switch)
        early, late = elapsed + GAMMA * h, elapsed + (1.0 - GAMMA) * h
        now = system.balance(time + early, inputs + slope * early, state.states)
        inverse = np.linalg.inv(identity - (GAMMA * h) * now.matrix)
        k_1 = times(inverse, now.derivative)
        then = system.balance(time + late, inputs + slope * late, state.states + h * k_1, now)
        k_2 = times(inverse, then.derivative - 2.0 * k_1)
        # Filtered once more by the implicit matrix: what a stiff node relaxes within the step is no error of the step.
        errors = system.error_weights * np.abs(times(inverse, k_1 + k_2))
        error = float(np.max(errors)) * 0.5 * h / TOLERANCE_K
        if not error < np.inf:
            raise ArithmeticError(f"the heat balance is not finite at {time + elapsed:g} s")
        next_step = h * min(GROW, max(SHRINK, SAFETY / np.sqrt(max(error, 1e-12))))
        if error > 1.0:
            if next_step < SHORTEST_STEP_S:
                raise ArithmeticError(f"the step size fell below {SHORTEST_STEP_S:g} s at {time + elapsed:g} s")
            state = replace(state, step=next_step)
            continue
        end = duration if h == remaining else switch_by if h == to_switch else elapsed + h
        at_end = (time + end, inputs + slope * end)
        later = state.states + h * (1.5 * k_1 + 0.5 * k_2)
        switched = system.updated(*at_end, later)
        switches = not np.array_equal(switched, later)
        if switches:
            jump = system.balance(*at_end, switched).derivative - system.balance(*at_end, later).derivative
            narrow = TOLERANCE_K / max(float(np.max(system.error_weights * np.abs(jump))), 1e-12)
            if h > max(narrow, SHORTEST_STEP_S):
                switch_by = end
                continue
        if switches or end >= switch_by:
            switch_by = np.inf
        elapsed = end
        # The two stages with the weights of the temperatures, 3/2 and 1/2: what leaves the nodes arrives there.
        flow = 0.5 * (now.heat_out + then.heat_out + GAMMA * h * times(now.heat_out_slope, k_1 + k_2))
        state = State(
            states=switched,
            # A short communication step says nothing about the step that the network would allow.
            step=max(next_step, state.step) if h < state.step else next_step,
            heat_in=state.heat_in + 0.5 * h * (now.heat_in + then.heat_in),
            heat_out=state.heat_out + h * flow,
        )
    return state


def times(matrix: Array, vector: Array) -> Array:
    """Product of matrices and vectors."""
    return np.asarray(matrix @ vector if vector.ndim == 1 else (matrix @ vector[..., None])[..., 0])
