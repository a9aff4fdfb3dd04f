"""Random sequences of FMI calls to a native FMU, beside an oracle that knows which of them are allowed.

    python -m tests.contract.native_state_machine FOLDER [EXAMPLES] [SEED]

FOLDER is an unpacked FMU. A program of its own, so that a crash of the FMU is an exit status. The oracle is the state
machine of FMI 2.0 for co-simulation, and where that leaves a choice what this project promises: inputs and parameters
can be read at once, what cannot be used may be corrected after a discarded step and the step tried again, and whatever
is refused with fmi2Error changes nothing at all.
"""

from __future__ import annotations

import copy
import ctypes as ct
import math
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import hypothesis
from fmpy import fmi2
from hypothesis import HealthCheck, settings, stateful
from hypothesis import strategies as st
from hypothesis.stateful import initialize, invariant, precondition, rule

from tests.contract.native_hosts import Unpacked

OK, WARNING, DISCARD, ERROR = range(4)
INSTANTIATED, INITIALIZATION, COMPLETE, FAILED, TERMINATED = range(5)
STEPPING = (COMPLETE, FAILED)
UNKNOWN = 123456  # a value reference that nobody has
LONGEST_STEP_S = 1e9


class Subject:
    """The FMU under test: its library, and its variables by what may be done with them."""

    def __init__(self, folder: Path) -> None:
        fmu = Unpacked(folder)
        of = {v.valueReference: v for v in fmu.description.modelVariables}
        self.guid = fmu.description.guid.encode()
        self.library = ct.CDLL(str(fmu.library))
        self.library.fmi2Instantiate.restype = ct.c_void_p
        self.references = [*of, UNKNOWN, 2**32 - 1]
        self.booleans = {r for r, v in of.items() if v.type == "Boolean"}
        self.reals = set(of) - self.booleans
        self.inputs = [r for r, v in of.items() if v.causality == "input"]
        self.outputs = [r for r, v in of.items() if v.causality in ("output", "local") and r in self.reals]
        self.fixed = {r for r, v in of.items() if v.variability == "fixed"}
        self.settable = [r for r, v in of.items() if v.causality in ("input", "parameter") and r in self.reals]
        texts = {"true": 1.0, "false": 0.0}
        self.starts = {r: float(texts.get(v.start, v.start)) for r, v in of.items() if v.start}
        self.valid = {r: (0.0, 1.0) if r in self.booleans else bounds(of[r]) for r in self.starts}
        self.working = {r: self.valid[r] for r in self.settable} | {
            fmu.variables["speed"].valueReference: (-800.0, 800.0),
            fmu.variables["torque"].valueReference: (-400.0, 400.0),
        }


SUBJECT: Subject  # set before anything is called


@dataclass
class Oracle:
    """What an instance must be like."""

    values: dict[int, float]
    slopes: dict[int, float] = field(default_factory=dict)
    mode: int = INSTANTIATED
    experiment: bool = False
    time: float = 0.0
    last_step: int = OK


def bounds(variable: Any) -> tuple[float, float]:
    return float(variable.min or -math.inf), float(variable.max or math.inf)


def usable(reference: int, value: float) -> bool:
    low, high = SUBJECT.valid[reference]
    slack = 1e-9 * max(1.0, abs(value)) if math.isfinite(value) else 0.0
    return math.isfinite(value) and low - slack <= value <= high + slack


def doubles(values: list[float]) -> Any:
    return (ct.c_double * len(values))(*values)


def unsigned(values: list[int]) -> Any:
    return (ct.c_uint * len(values))(*values)


def same(a: list[float], b: list[float]) -> bool:
    return bytes(doubles(a)) == bytes(doubles(b)) or all(
        x == y or (math.isnan(x) and math.isnan(y)) for x, y in zip(a, b, strict=True)
    )


# ------------------------------------------------------------------------------------------- what is called with what

references = st.deferred(lambda: st.sampled_from(SUBJECT.references))
settable = st.deferred(lambda: st.one_of(st.sampled_from(SUBJECT.inputs), st.sampled_from(SUBJECT.settable)))
mostly_inputs = st.deferred(
    lambda: st.one_of(st.sampled_from(SUBJECT.inputs), st.sampled_from(SUBJECT.inputs), references)
)
mostly_outputs = st.deferred(lambda: st.one_of(st.sampled_from(SUBJECT.outputs), references))
durations = st.sampled_from([1.0, 0.1, 10.0, 1e-9, 3600.0, 1e7])
impossible = st.sampled_from([0.0, -1.0, -0.0, 5e-324, 1e300, math.nan, math.inf, -math.inf])
nonsense = st.sampled_from([math.nan, math.inf, -math.inf, 1e300, -1e300])


def value_for(reference: int) -> st.SearchStrategy[float]:
    """Values at which the model works, and some that cannot be used."""
    low, high = SUBJECT.working[reference]
    return st.one_of(st.floats(low, high), st.floats(low, high), st.sampled_from([low, high]), nonsense)


class Calls(stateful.RuleBasedStateMachine):
    """One instance and its oracle; saved states may come from any earlier moment."""

    states = stateful.Bundle("states")

    @initialize(logging=st.booleans(), started=st.booleans())
    def instantiate(self, logging: bool, started: bool) -> None:
        self.said: list[tuple[int, str]] = []
        self.hears_errors = True
        self.callbacks = fmi2.fmi2CallbackFunctions()
        self.callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(
            lambda e, i, status, c, text: self.said.append((status, text))
        )
        if logging:  # with the host's memory, else with the FMU's own
            libc = ct.CDLL(None)
            self.callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(("calloc", libc))
            self.callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(("free", libc))
        self.callbacks.stepFinished = fmi2.fmi2StepFinishedTYPE()
        callbacks = ct.byref(self.callbacks)
        self.c = ct.c_void_p(SUBJECT.library.fmi2Instantiate(b"random", 1, SUBJECT.guid, None, callbacks, 0, logging))
        assert self.c
        self.oracle = Oracle(dict(SUBJECT.starts))
        self.saved: list[ct.c_void_p] = []
        if started:
            self.start()

    def teardown(self) -> None:
        for state in self.saved:
            assert SUBJECT.library.fmi2FreeFMUstate(self.c, ct.byref(state)) == OK
        SUBJECT.library.fmi2FreeInstance(self.c)

    # ------------------------------------------------------------------ checks that hold for every call

    def call(self, name: str, *arguments: Any, expect: int | tuple[int, ...], **then: Any) -> int:
        """Call; the status must be expected, an error be told and change nothing; else the oracle changes to `then`."""
        before, told = self.snapshot(), len(self.said)
        status: int = getattr(SUBJECT.library, f"fmi2{name}")(self.c, *arguments)
        allowed = expect if isinstance(expect, tuple) else (expect,)
        assert status in allowed, (name, status, expect, self.oracle.mode, self.said[-3:])
        if status == ERROR:
            assert [status for status, _ in self.said[told:]] == [ERROR] * self.hears_errors
            assert self.snapshot() == before
        else:
            vars(self.oracle).update(then)
        return status

    def snapshot(self) -> bytes:
        """Everything that the future depends on, as the FMU itself serializes it."""
        state, size = ct.c_void_p(), ct.c_size_t()
        assert SUBJECT.library.fmi2GetFMUstate(self.c, ct.byref(state)) == OK
        assert SUBJECT.library.fmi2SerializedFMUstateSize(self.c, state, ct.byref(size)) == OK
        content = ct.create_string_buffer(size.value)
        assert SUBJECT.library.fmi2SerializeFMUstate(self.c, state, content, size) == OK
        assert SUBJECT.library.fmi2FreeFMUstate(self.c, ct.byref(state)) == OK
        return content.raw

    def outputs(self) -> list[float]:
        found = doubles([0.0] * len(SUBJECT.outputs))
        assert SUBJECT.library.fmi2GetReal(self.c, unsigned(SUBJECT.outputs), len(SUBJECT.outputs), found) in (
            OK,
            WARNING,
        )
        return list(found)

    def faulty(self, after: float = 0.0) -> bool:
        o = self.oracle
        return not all(usable(r, v + o.slopes.get(r, 0.0) * after) for r, v in o.values.items())

    @invariant()
    def settable_values_are_what_was_set(self) -> None:
        if not hasattr(self, "c"):
            return
        reals = [r for r in self.oracle.values if r not in SUBJECT.booleans]
        found = doubles([0.0] * len(reals))
        assert SUBJECT.library.fmi2GetReal(self.c, unsigned(reals), len(reals), found) == OK
        expected = [self.oracle.values[r] for r in reals]
        for reference, a, b in zip(reals, found, expected, strict=True):
            assert same([a], [b]) or math.isclose(a, b, rel_tol=1e-12), (reference, a, b)

    @invariant()
    def outputs_are_numbers_where_they_can_be(self) -> None:
        if hasattr(self, "c") and self.oracle.mode != INSTANTIATED:
            assert all(map(math.isnan, self.outputs())) if self.faulty() else all(map(math.isfinite, self.outputs()))

    # ------------------------------------------------------------------ life

    @rule(start=st.sampled_from([0.0, 5.5, -3.0, 1e9, math.nan, math.inf]))
    def set_up(self, start: float) -> None:
        good = self.oracle.mode == INSTANTIATED and math.isfinite(start)
        zero = ct.c_double(0.0)
        self.call("SetupExperiment", 0, zero, ct.c_double(start), 0, zero, expect=OK if good else ERROR, time=start,
                  experiment=True)  # fmt: skip

    @rule()
    def enter(self) -> None:
        good = self.oracle.mode == INSTANTIATED and self.oracle.experiment
        self.call("EnterInitializationMode", expect=OK if good else ERROR, mode=INITIALIZATION)

    @rule()
    def leave(self) -> None:
        good = self.oracle.mode == INITIALIZATION and not self.faulty()
        self.call("ExitInitializationMode", expect=OK if good else ERROR, mode=COMPLETE)

    @precondition(lambda self: self.oracle.mode == INSTANTIATED)
    @rule()
    def start(self) -> None:
        self.set_up(0.0)
        self.enter()
        self.leave()

    @rule(seldom=st.integers(0, 4))
    def terminate(self, seldom: int) -> None:
        good = self.oracle.mode in STEPPING
        if good and seldom:
            return
        self.call("Terminate", expect=OK if good else ERROR, mode=TERMINATED)

    @rule(seldom=st.integers(0, 4))
    def reset(self, seldom: int) -> None:
        if seldom:
            return
        self.call("Reset", expect=OK)
        self.oracle = Oracle(dict(SUBJECT.starts))

    # ------------------------------------------------------------------ values

    @rule(data=st.data(), chosen=st.lists(settable, max_size=4))
    def set_usual(self, data: st.DataObject, chosen: list[int]) -> None:
        self.set_reals(chosen, [data.draw(value_for(reference)) for reference in chosen])

    @rule(chosen=st.lists(references, min_size=1, max_size=3), value=st.floats(250.0, 300.0))
    def set_any(self, chosen: list[int], value: float) -> None:
        self.set_reals(chosen, [value] * len(chosen))

    def set_reals(self, chosen: list[int], values: list[float]) -> None:
        o = self.oracle
        modes = (INSTANTIATED, INITIALIZATION, *STEPPING)
        open_now = set(SUBJECT.settable) - (SUBJECT.fixed if o.mode in STEPPING else set())
        good = o.mode in modes and all(r in open_now for r in chosen)
        new = dict(zip(chosen, values, strict=True))
        self.call("SetReal", unsigned(chosen), len(chosen), doubles(values), expect=OK if good else ERROR,
                  values=o.values | new)  # fmt: skip

    @rule(reference=references, value=st.integers(-1, 2))
    def set_boolean(self, reference: int, value: int) -> None:
        good = (
            reference in SUBJECT.booleans
            and reference in SUBJECT.starts
            and self.oracle.mode in (INSTANTIATED, INITIALIZATION)
        )
        self.call("SetBoolean", unsigned([reference]), 1, (ct.c_int * 1)(value), expect=OK if good else ERROR,
                  values=self.oracle.values | {reference: float(value != 0)})  # fmt: skip

    @rule(chosen=st.lists(references, max_size=4))
    def get_any(self, chosen: list[int]) -> None:
        calculated = any(r in SUBJECT.outputs for r in chosen)
        good = all(r in SUBJECT.reals for r in chosen) and not (calculated and self.oracle.mode == INSTANTIATED)
        expect = ERROR if not good else WARNING if calculated and self.faulty() else OK
        self.call("GetReal", unsigned(chosen), len(chosen), doubles([0.0] * len(chosen)), expect=expect)

    @rule(reference=references, kind=st.sampled_from(["Integer", "String"]), set_it=st.booleans())
    def other_types(self, reference: int, kind: str, set_it: bool) -> None:
        content = ct.create_string_buffer(8)
        self.call(f"{'Set' if set_it else 'Get'}{kind}", unsigned([reference]), 1, content, expect=ERROR)

    @rule(name=st.sampled_from(["SetReal", "GetReal", "SetBoolean", "GetBoolean"]), which=st.integers(0, 2))
    def null_arrays(self, name: str, which: int) -> None:
        here = unsigned([SUBJECT.settable[0]])
        arrays = [(None, doubles([0.0])), (here, None), (None, None)][which]
        self.call(name, arrays[0], 1, arrays[1], expect=ERROR)

    @rule(chosen=st.lists(mostly_inputs, min_size=1, max_size=2), order=st.sampled_from([1, 1, 1, 0, 2, -1]),
          slope=st.one_of(st.floats(-1.0, 1.0), nonsense))  # fmt: skip
    def ramp(self, chosen: list[int], order: int, slope: float) -> None:
        good = (
            self.oracle.mode != TERMINATED
            and all(r in SUBJECT.inputs for r in chosen)
            and order == 1
            and math.isfinite(slope)
        )
        count = len(chosen)
        self.call("SetRealInputDerivatives", unsigned(chosen), count, (ct.c_int * count)(*[order] * count),
                  doubles([slope] * count), expect=OK if good else ERROR,
                  slopes=self.oracle.slopes | dict.fromkeys(chosen, slope))  # fmt: skip

    @rule(unknown=mostly_outputs, known=mostly_inputs, seed=st.floats(-2.0, 2.0))
    def derivative(self, unknown: int, known: int, seed: float) -> None:
        o = self.oracle
        real = known in SUBJECT.settable and known not in SUBJECT.booleans
        good = o.mode != INSTANTIATED and unknown in SUBJECT.outputs and real and not self.faulty()
        good = good and (known not in SUBJECT.fixed or o.mode == INITIALIZATION)
        before = self.outputs() if o.mode != INSTANTIATED else []
        found = doubles([0.0])
        self.call("GetDirectionalDerivative", unsigned([unknown]), 1, unsigned([known]), 1, doubles([seed]), found,
                  expect=OK if good else ERROR)  # fmt: skip
        if good:
            assert math.isfinite(found[0])
            assert same(self.outputs(), before)

    # ------------------------------------------------------------------ steps

    @rule(duration=durations)
    def step(self, duration: float) -> None:
        self.do_step(self.oracle.time, duration)

    @precondition(lambda self: self.oracle.mode in STEPPING)
    @rule(data=st.data(), duration=durations, slope=st.floats(-1.0, 1.0))
    def drive(self, data: st.DataObject, duration: float, slope: float) -> None:
        """What a host does all day: usable inputs, perhaps a ramp, a step."""
        wanted = [data.draw(st.floats(*SUBJECT.working[reference])) for reference in SUBJECT.inputs]
        self.set_reals(SUBJECT.inputs, wanted)
        self.ramp(SUBJECT.inputs[:1], 1, slope)
        self.do_step(self.oracle.time, duration)

    @rule(duration=impossible)
    def impossible_step(self, duration: float) -> None:
        self.do_step(self.oracle.time, duration)

    @rule(time=st.sampled_from([math.nan, math.inf, -1e6, 17.0, 1e12]))
    def step_from_elsewhere(self, time: float) -> None:
        self.do_step(time, 1.0)

    @rule(off=st.sampled_from([1.0, -1.0, 0.1, 1e-4, -1e-4]))
    def step_from_nearby(self, off: float) -> None:
        """A step is left out or repeated, or the host's clock has rounded otherwise."""
        self.do_step(self.oracle.time + off, 1.0)

    def do_step(self, time: float, duration: float) -> None:
        o = self.oracle
        possible = math.isfinite(time) and math.isfinite(duration) and 0.0 < duration <= LONGEST_STEP_S
        possible = possible and abs(time - o.time) <= 1e-3 * duration + 16.0 * sys.float_info.epsilon * abs(time)
        good = possible and not self.faulty() and not self.faulty(duration)
        before = self.outputs() if o.mode in STEPPING else []
        then: dict[str, Any] = {"mode": FAILED, "last_step": DISCARD}
        if good:
            values = {r: v + o.slopes.get(r, 0.0) * duration for r, v in o.values.items()}
            then = {"mode": COMPLETE, "values": values, "slopes": {}, "time": time + duration}
        expect = ERROR if o.mode not in STEPPING else (OK, WARNING) if good else DISCARD
        status = self.call("DoStep", ct.c_double(time), ct.c_double(duration), 1, expect=expect, **then)
        if status == DISCARD:
            assert same(self.outputs(), before)
        elif status != ERROR:
            o.last_step = status

    @rule()
    def ask(self) -> None:
        status, time, flag = ct.c_int(), ct.c_double(), ct.c_int(7)
        self.call("GetStatus", 0, ct.byref(status), expect=OK)
        self.call("GetRealStatus", 2, ct.byref(time), expect=OK)
        self.call("GetBooleanStatus", 3, ct.byref(flag), expect=OK)
        refused = self.oracle.last_step == DISCARD
        assert (status.value, time.value, flag.value) == (self.oracle.last_step, self.oracle.time, refused)
        self.call("GetStatus", 2, ct.byref(status), expect=DISCARD)
        self.call("GetStringStatus", 1, ct.byref(ct.c_char_p()), expect=DISCARD)
        self.call("GetIntegerStatus", 0, None, expect=ERROR)
        self.call("CancelStep", expect=ERROR)
        self.call(
            "GetRealOutputDerivatives",
            unsigned(SUBJECT.outputs[:1]),
            1,
            (ct.c_int * 1)(1),
            doubles([0.0]),
            expect=ERROR,
        )

    @rule(name=st.sampled_from([b"logAll", b"logStatusError", b"logStatusWarning", b"logEverything", b"", None]))
    def debug_logging(self, name: bytes | None) -> None:
        known = name in (b"logAll", b"logStatusError", b"logStatusWarning")
        self.call("SetDebugLogging", 1, ct.c_size_t(1), (ct.c_char_p * 1)(name), expect=OK if known else ERROR)
        self.hears_errors = name != b"logStatusWarning" if known else self.hears_errors

    # ------------------------------------------------------------------ saved states

    @rule(target=states)
    def save(self) -> tuple[ct.c_void_p, Oracle, list[float]]:
        state = ct.c_void_p()
        self.call("GetFMUstate", ct.byref(state), expect=OK)
        self.saved.append(state)
        outputs = self.outputs() if self.oracle.mode != INSTANTIATED else []
        return state, copy.deepcopy(self.oracle), outputs

    @rule(saved=states)
    def restore(self, saved: tuple[ct.c_void_p, Oracle, list[float]]) -> None:
        state, oracle, outputs = saved
        self.call("SetFMUstate", state, expect=OK)
        self.oracle = copy.deepcopy(oracle)
        if outputs:
            assert same(self.outputs(), outputs)

    @rule(saved=states, cut=st.integers(0, 200), data=st.data())
    def restore_from_bytes(self, saved: tuple[ct.c_void_p, Oracle, list[float]], cut: int, data: st.DataObject) -> None:
        """Whole bytes give the state again; one changed bit or missing bytes are noticed."""
        size, copied = ct.c_size_t(), ct.c_void_p()
        self.call("SerializedFMUstateSize", saved[0], ct.byref(size), expect=OK)
        content = ct.create_string_buffer(size.value)
        short = ct.c_size_t(max(0, size.value - 1 - cut))
        self.call("SerializeFMUstate", saved[0], content, short, expect=ERROR)
        self.call("SerializeFMUstate", saved[0], content, size, expect=OK)
        self.call("DeSerializeFMUstate", content, short, ct.byref(copied), expect=ERROR)
        place, bit = data.draw(st.integers(0, size.value - 1)), data.draw(st.integers(0, 7))
        damaged = bytearray(content.raw)
        damaged[place] ^= 1 << bit
        wrong = ct.create_string_buffer(bytes(damaged), size.value)
        self.call("DeSerializeFMUstate", wrong, size, ct.byref(copied), expect=ERROR)
        assert not copied
        self.call("DeSerializeFMUstate", content, size, ct.byref(copied), expect=OK)
        self.restore((copied, saved[1], saved[2]))
        self.call("FreeFMUstate", ct.byref(copied), expect=OK)

    @rule()
    def no_state(self) -> None:
        self.call("SetFMUstate", None, expect=ERROR)
        self.call("GetFMUstate", None, expect=ERROR)
        self.call("SerializedFMUstateSize", None, None, expect=ERROR)
        self.call("DeSerializeFMUstate", None, ct.c_size_t(0), None, expect=ERROR)
        self.call("FreeFMUstate", None, expect=OK)


def main(folder: str, examples: str = "100", seed: str = "0") -> None:
    global SUBJECT
    SUBJECT = Subject(Path(folder))
    hypothesis.seed(int(seed))(Calls)
    chosen = settings(
        max_examples=int(examples), stateful_step_count=50, deadline=None, database=None,
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    stateful.run_state_machine_as_test(Calls, settings=chosen)


if __name__ == "__main__":
    main(*sys.argv[1:])
