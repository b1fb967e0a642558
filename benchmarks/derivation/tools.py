"""Mass matrix and force vector of the planar chain by each tool: derived, counted, compiled, timed.

Every function takes the number of links and returns a dictionary: `derive s`, `operations` of M and f together,
`compile s`, `ns` a call of M and f, and `check`, the sum of all entries of M and f at a fixed state.
"""

from __future__ import annotations

import ctypes
import gc
import math
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
from chain import GRAVITY, INERTIA, LENGTH, MASS, kinematics

BATCH, REPEATS = 2000, 5


def state(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Angles and rates at which results are compared."""
    k = np.arange(1, n + 1)
    return 0.3 * np.sin(1.7 * k), 0.5 * np.cos(0.9 * k)


def symgen(n: int) -> dict[str, float]:
    """This project, from bodies' positions."""
    from symgen import Model, cos, sin

    start = time.perf_counter()
    model = Model("chain", gravity=(0, -GRAVITY))
    angles = [model.coordinate(f"q{k}") for k in range(n)]
    for k, (angle, x, y) in enumerate(kinematics(angles, sin, cos)):
        model.body(f"link{k}", mass=MASS, com=(x, y), inertia=INERTIA, angle=angle)
    model.describe()
    built = time.perf_counter() - start
    return {"build s": built, **_symgen_figures(model, n)}


def symgen_lagrangian(n: int) -> dict[str, float]:
    """This project, from the energies as two SymPy expressions with shared parts."""
    from symgen import Model, cos, dot, sin

    model = Model("chain")
    angles = [model.coordinate(f"q{k}") for k in range(n)]
    kinetic, potential = 0, 0
    for angle, x, y in kinematics(angles, sin, cos):
        kinetic += MASS / 2 * (dot(x) ** 2 + dot(y) ** 2) + INERTIA / 2 * dot(angle) ** 2
        potential += MASS * GRAVITY * y
    model.kinetic(kinetic)
    model.potential(potential)
    return _symgen_figures(model, n)


def _symgen_figures(model, n: int) -> dict[str, float]:
    from symgen.derive.derivation import Derivation
    from symgen.link import derive_text

    description = model.describe()
    gc.disable()  # as whoever derives does (`link.derive`)
    start = time.perf_counter()
    d = Derivation(description)
    zero = d.g.const(0.0)
    entries = [*(row.get(j, zero) for row in d.mass_rows for j in range(n)), *d.forces]
    derived = time.perf_counter() - start
    gc.enable()
    whole = derive_text(model)
    kernel, compiled = _compiled(d, entries, whole.text)
    y, p, out = np.concatenate(state(n)), np.zeros(1), np.zeros(len(entries))
    seconds = _best(lambda: _repeat()(np.uint64(kernel.address), 0.0, y, p, out, BATCH))
    return {
        "derive s": derived,
        "all functions s": sum(whole.seconds.values()),
        "operations": d.g.count(entries),
        "rhs operations": whole.operations["rhs"],
        "compile s": compiled,
        "ns": seconds / BATCH * 1e9,
        "check": float(out.sum()),
    }


def _compiled(d, entries: list[int], module: str):
    """M and f as one function of the generated form, compiled anew, and the seconds it took."""
    from dataclasses import replace

    from symgen import runtime
    from symgen.derive.program import Function, Program
    from symgen.emit.module import emit
    from symgen.runtime.code import stand_ins
    from symgen.runtime.kernel import compile_kernel

    source = runtime.load(module).kernel("rhs").source
    text = emit(
        Program(d.g, (Function("rhs", "M, then f.", tuple(entries)),), dict(source.system.source.header))
    )
    text = text[text.index("def rhs(") :].replace("def rhs(", "def mass_and_forces(")
    lengths = source.lengths._replace(out=len(entries))
    code = replace(source.code, name="mass_and_forces", text=text, lengths=lengths)
    start = time.perf_counter()
    with stand_ins.avoided():  # what runs come to
        kernel = compile_kernel(replace(source, code=code, n_hoisted=0))
    return kernel, time.perf_counter() - start


def _repeat():
    from bundled import repeat

    return repeat


def _best(call) -> float:
    call()
    best = math.inf
    for _ in range(REPEATS):
        start = time.perf_counter()
        call()
        best = min(best, time.perf_counter() - start)
    return best


def lagranges_method(n: int) -> dict[str, float]:
    """`sympy.physics.mechanics.LagrangesMethod`."""
    import sympy as sp
    from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

    start = time.perf_counter()
    t = dynamicsymbols._t
    q = dynamicsymbols(f"q:{n}")
    lagrangian = 0
    for angle, x, y in kinematics(q, sp.sin, sp.cos):
        lagrangian += MASS / 2 * (x.diff(t) ** 2 + y.diff(t) ** 2) + INERTIA / 2 * angle.diff(t) ** 2
        lagrangian -= MASS * GRAVITY * y
    method = LagrangesMethod(lagrangian, q)
    method.form_lagranges_equations()
    mass, forcing = method.mass_matrix, method.forcing
    derived = time.perf_counter() - start
    return {"derive s": derived, **_sympy_figures(mass, forcing, q, [s.diff(t) for s in q], n)}


def kanes_method(n: int) -> dict[str, float]:
    """`sympy.physics.mechanics.KanesMethod` with bodies and frames, as its documentation does it."""
    import sympy as sp
    from sympy.physics.mechanics import KanesMethod, Point, ReferenceFrame, RigidBody, dynamicsymbols, inertia

    start = time.perf_counter()
    t = dynamicsymbols._t
    q, u = dynamicsymbols(f"q:{n}"), dynamicsymbols(f"u:{n}")
    world, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(world, 0)
    bodies, loads, pin, before = [], [], origin, world
    rate = 0
    for k in range(n):
        rate += u[k]
        frame = before.orientnew(f"B{k}", "Axis", [q[k], world.z])
        frame.set_ang_vel(world, rate * world.z)
        com, tip = pin.locatenew(f"C{k}", -LENGTH / 2 * frame.y), pin.locatenew(f"P{k}", -LENGTH * frame.y)
        com.v2pt_theory(pin, world, frame)
        tip.v2pt_theory(pin, world, frame)
        bodies.append(RigidBody(f"link{k}", com, frame, MASS, (inertia(frame, 0, 0, INERTIA), com)))
        loads.append((com, -MASS * GRAVITY * world.y))
        pin, before = tip, frame
    method = KanesMethod(world, q_ind=q, u_ind=u, kd_eqs=[a.diff(t) - b for a, b in zip(q, u, strict=True)])
    method.kanes_equations(bodies, loads)
    mass, forcing = method.mass_matrix, method.forcing
    derived = time.perf_counter() - start
    return {"derive s": derived, **_sympy_figures(sp.Matrix(mass), sp.Matrix(forcing), q, u, n)}


def _sympy_figures(mass, forcing, q, v, n: int) -> dict[str, float]:
    """Common subexpressions, counted; as a Numba function of straight-line code, as users of SymPy do it."""
    import sympy as sp

    plain_v = sp.symbols(f"v:{n}")
    plain_q = sp.symbols(f"q:{n}")
    rename = dict(zip([*v, *q], [*plain_v, *plain_q], strict=True))
    start = time.perf_counter()
    entries = [
        entry.xreplace(dict(zip(v, plain_v, strict=True))).xreplace(rename) for entry in [*mass, *forcing]
    ]
    shared, reduced = sp.cse(entries)
    operations = sum(int(e.count_ops()) for _, e in shared) + sum(int(e.count_ops()) for e in reduced)
    extracted = time.perf_counter() - start
    start = time.perf_counter()
    call = _njit(shared, reduced, n)
    out, y = np.zeros(len(entries)), np.concatenate(state(n))
    call(y, out, 1)
    compiled = time.perf_counter() - start
    ns = _best(lambda: call(y, out, BATCH)) / BATCH * 1e9
    return {
        "cse s": extracted,
        "operations": operations,
        "compile s": compiled,
        "ns": ns,
        "check": float(out.sum()),
    }


def _njit(shared, reduced, n: int):
    from numba import njit
    from sympy.printing.pycode import pycode

    lines = ["def f(y, out):"]
    lines += [f"    q{k} = y[{k}]" for k in range(n)] + [f"    v{k} = y[{n + k}]" for k in range(n)]
    lines += [f"    {name} = {pycode(e)}" for name, e in shared]
    lines += [f"    out[{k}] = {pycode(e)}" for k, e in enumerate(reduced)]
    space = {"math": math}
    exec("\n".join(lines), space)  # our own equations, printed by SymPy
    inner = njit(error_model="numpy")(space["f"])

    @njit
    def call(y, out, times):
        for _ in range(times):
            inner(y, out)

    return call


def casadi(n: int) -> dict[str, float]:
    """CasADi's SX graph: M and f by its Hessian and Jacobians, C code compiled by gcc -O2."""
    import casadi as ca

    start = time.perf_counter()
    q, v = ca.SX.sym("q", n), ca.SX.sym("v", n)
    kinetic, potential = 0, 0
    for angle, x, y in kinematics(ca.vertsplit(q), ca.sin, ca.cos):
        velocity = ca.jtimes(ca.vertcat(x, y, angle), q, v)
        kinetic += MASS / 2 * (velocity[0] ** 2 + velocity[1] ** 2) + INERTIA / 2 * velocity[2] ** 2
        potential += MASS * GRAVITY * y
    mass, momentum = ca.hessian(kinetic, v)
    force = ca.gradient(kinetic - potential, q) - ca.jtimes(momentum, q, v)
    function = ca.Function("f", [q, v], [ca.densify(mass), force], {"cse": True})
    derived = time.perf_counter() - start
    operations = sum(
        function.instruction_id(k) not in _CASADI_MOVES for k in range(function.n_instructions())
    )
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        function.generate("f.c", {"with_header": False})
        Path("f.c").replace(Path(folder) / "f.c")
        subprocess.run(
            ["gcc", "-O2", "-shared", "-fPIC", "-o", f"{folder}/f.so", f"{folder}/f.c", "-lm"], check=True
        )
        compiled = time.perf_counter() - start
        ns, check = _time_casadi(ctypes.CDLL(f"{folder}/f.so"), n)
    return {"derive s": derived, "operations": operations, "compile s": compiled, "ns": ns, "check": check}


_CASADI_MOVES = (0, 44, 45, 46)  # OP_ASSIGN; OP_CONST, OP_INPUT, OP_OUTPUT


def _time_casadi(library, n: int) -> tuple[float, float]:
    """Nanoseconds a call from compiled code, and the check sum."""
    from numba import carray, njit, types  # noqa: F401  (Numba calls the C function without Python's overhead)

    pointers = ctypes.c_void_p * 2
    q, v = state(n)
    mass, force = np.zeros(n * n), np.zeros(n)
    inputs, outputs = pointers(q.ctypes.data, v.ctypes.data), pointers(mass.ctypes.data, force.ctypes.data)
    work = np.zeros(1_000_000)
    prototype = ctypes.CFUNCTYPE(
        ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int
    )
    call = prototype(("f", library))
    arguments = [ctypes.cast(a, ctypes.c_void_p).value for a in (inputs, outputs)]

    @njit
    def repeat(a, b, w, times):
        for _ in range(times):
            call(a, b, 0, w, 0)

    repeat(arguments[0], arguments[1], work.ctypes.data, 1)
    ns = _best(lambda: repeat(arguments[0], arguments[1], work.ctypes.data, BATCH)) / BATCH * 1e9
    return ns, float(mass.sum() + force.sum())


TOOLS = {
    "symgen": symgen,
    "symgen, energies": symgen_lagrangian,
    "LagrangesMethod": lagranges_method,
    "KanesMethod": kanes_method,
    "CasADi": casadi,
}
