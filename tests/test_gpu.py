"""Ensembles on graphics processors, without one: threads give the bits of lanes, as machine code and as PTX."""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from ptx_machine import Machine, bits, number

from symgen.cli import main
from symgen.runtime.code.nvptx import ptx_of
from symgen.runtime.ensemble import linspace, normal, uniform
from symgen.runtime.ensemble.batch import LaneBatch
from symgen.runtime.ensemble.gpu import assembler, choose, cuda, device
from symgen.runtime.ensemble.gpu.batch import DeviceBatch
from symgen.runtime.ensemble.gpu.program import ENTRY, make_program
from symgen.runtime.ensemble.gpu.report import report_program, same_bits
from symgen.runtime.ensemble.gpu.sequential import SequentialKernel
from symgen.runtime.ensemble.gpu.thread import ARGUMENTS, KEPT
from symgen.runtime.ensemble.options import EnsembleOptions
from symgen.runtime.ensemble.plan import make_plan
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.front import load

GENERATED = Path(__file__).parents[1] / "generated"
VARIED = {
    "double_pendulum": {"parameters": {"L2": normal(1.0, 0.1)}, "start": {"theta1": uniform(-1, 1)}},
    "slider_crank": {"parameters": {"r": uniform("0.08 m", "0.12 m")}},
    "four_bar": {"parameters": {"g": uniform(5.0, 15.0)}},
    "cart_pole": {"start": {"theta": uniform(-1, 1)}},  # work
    "rolling_disc": {"parameters": {"g": uniform(5.0, 15.0)}},  # velocity constraints
    "heavy_top_absolute": {"parameters": {"m": uniform(14.0, 16.0)}},  # quaternions
    "outer_solar_system": {"rate": {"x_sun": normal(0.0, 1e-8)}},
    "turntable": {"parameters": {"radius": uniform(0.04, 0.06)}},  # terms of time
}
needs_assembler = pytest.mark.skipif(
    assembler.find_assembler() is None, reason="NVIDIA's assembler is not there"
)


def plan_of(name, t_end, method, n=8, **options):
    return make_plan(
        load(GENERATED / f"{name}.py"),
        EnsembleOptions(t_end=t_end, n=n, method=method, seed=3, rtol=1e-7, **VARIED[name], **options),
    )


def members_of(plan):
    parameters, varied = plan.members.arrays(plan.p, 0, plan.members.n)
    return parameters, plan.starts.of(parameters, varied)[0]


def program_of(plan, flat):
    settings = plan.settings
    return make_program(
        plan.system, settings.method, scale_energy=settings.scale_energy,
        with_frames=bool(len(settings.frame_times)), flat=flat,
    )  # fmt: skip


def assert_bits_of_lanes(plan, kernel):
    """Ends, verdicts and frames are those of the lanes, and members are there to compare."""
    parameters, starts = members_of(plan)
    lanes = LaneBatch(plan.system, plan.settings).run(parameters, starts)
    threads = DeviceBatch(plan.system, plan.settings, kernel).run(parameters, starts)
    assert (lanes.column("status") == 1).all() and (lanes.column("steps") > 1).all()
    np.testing.assert_array_equal(threads.end, lanes.end)
    np.testing.assert_array_equal(threads.columns[:, : len(KEPT)], lanes.columns[:, : len(KEPT)])
    np.testing.assert_array_equal(threads.frames, lanes.frames)
    assert len(plan.settings.frame_times) == 0 or np.isfinite(threads.frames).all()


@pytest.mark.parametrize(
    "name, method, flat",
    [
        ("double_pendulum", "rk4", True),
        ("double_pendulum", "dop853", True),
        ("double_pendulum", "taylor", False),
        ("slider_crank", "dop853", False),
        ("four_bar", "rk4", True),
        ("cart_pole", "rk4", False),
        ("rolling_disc", "taylor", False),
        ("heavy_top_absolute", "rk4", True),
        ("turntable", "dop853", False),
        ("double_pendulum", "verlet", True),
        ("outer_solar_system", "verlet", False),
        ("heavy_top_absolute", "verlet", False),
    ],
)
def test_threads_give_the_bits_of_lanes(name, method, flat):
    """The same program, run one after another here as a grid of three threads."""
    plan = plan_of(name, 400.0 if name == "outer_solar_system" else 0.5, method, frames=7)
    assert_bits_of_lanes(plan, SequentialKernel(program_of(plan, flat), n_threads=3))


class PtxKernel:
    """A program's PTX on a machine that is written in Python, two blocks of two threads."""

    def __init__(self, program):
        self.machine = Machine(ptx_of(program.whole(device=True), "sm_90"))

    def run(self, given, _written):
        self.machine.run(ENTRY, placed(self.machine, given), 2, 2)

    def stop(self):
        pass


def placed(machine, given):
    """The arguments of a program: places of arrays, integers and numbers."""
    kinds = {"ptr": machine.place, "i64": int, "double": float}
    return [kinds[kind](given[name]) for name, kind in ARGUMENTS.items()]


@pytest.mark.parametrize(
    "name, method, flat, t_end",
    [
        ("double_pendulum", "rk4", True, 0.05),
        ("double_pendulum", "dop853", True, 0.3),
        ("double_pendulum", "taylor", False, 0.3),
        ("slider_crank", "rk4", True, 0.02),
        ("four_bar", "dop853", False, 0.1),
        ("heavy_top_absolute", "dop853", False, 0.02),
        ("heavy_top_absolute", "verlet", True, 0.004),
    ],
)
def test_ptx_gives_the_bits_of_lanes(name, method, flat, t_end):
    """What LLVM wrote for the device, by another machine: steps, projection, choice of steps, frames."""
    plan = plan_of(name, t_end, method, n=3, frames=3)
    assert_bits_of_lanes(plan, PtxKernel(program_of(plan, flat)))


def test_angles_beyond_all_measure_have_the_same_bits_on_a_device():
    """No C library is there to ask: 3e9 and 1e15 rad."""
    plan = replace(plan_of("double_pendulum", 0.05, "rk4", n=3))
    parameters, starts = members_of(plan)
    starts[:, 0] = 3e9, 1e15, -7e12
    kernel = PtxKernel(program_of(plan, flat=False))
    threads = DeviceBatch(plan.system, plan.settings, kernel).run(parameters, starts)
    lanes = LaneBatch(plan.system, plan.settings).run(parameters, starts)
    np.testing.assert_array_equal(threads.columns[:, : len(KEPT)], lanes.columns[:, : len(KEPT)])
    assert kernel.machine.executed["mul.hi.u64"] > 0  # digits of 2/pi


def test_members_that_fail_fail_alike():
    plan = plan_of("double_pendulum", 5.0, "dop853", max_steps=20)
    parameters, starts = members_of(plan)
    starts[2] = np.nan
    threads = DeviceBatch(plan.system, plan.settings, SequentialKernel(program_of(plan, flat=True)))
    got = threads.run(parameters, starts)
    lanes = LaneBatch(plan.system, plan.settings).run(parameters, starts)
    np.testing.assert_array_equal(got.columns[:, : len(KEPT)], lanes.columns[:, : len(KEPT)])
    assert set(got.column("status")) == {-10.0, lanes.column("status")[2]} and got.column("status")[2] != 1.0


def test_sums_and_products_are_rounded_one_by_one():
    """`add.f64` and `mul.f64` without a rounding may be fused by the assembler; no approximations either."""
    plan = plan_of("slider_crank", 1.0, "dop853")
    text = ptx_of(program_of(plan, flat=True).whole(device=True), "sm_80")
    used = set(re.findall(r"\b(?:add|sub|mul|mad|div|sqrt|rcp|fma)\.[\w.]*f64\b", text))
    assert {"add.rn.f64", "mul.rn.f64", "fma.rn.f64", "sqrt.rn.f64"} <= used
    assert all(".rn." in name for name in used), used


def test_the_machine_for_ptx_knows_carries_and_special_numbers():
    """A few instructions by themselves, against what the language's manual says."""
    text = """
.visible .entry f(
	.param .u64 .ptr .align 1 f_param_0
)
{
	.reg .pred 	%p<2>;
	.reg .b64 	%rd<20>;
	.reg .b32 	%r<9>;
	ld.param.b64 	%rd1, [f_param_0];
	mov.b64 	%rd2, -1;
	add.cc.s64 	%rd3, %rd2, 1;
	addc.cc.s64 	%rd4, %rd2, 5;
	st.global.b64 	[%rd1], %rd4;
	mov.b64 	%rd5, 0d8000000000000000;
	max.f64 	%rd6, %rd5, 0d0000000000000000;
	st.global.b64 	[%rd1+8], %rd6;
	mov.b64 	{%r1, %r2}, %rd2;
	shf.l.wrap.b32 	%r3, 4026531840, %r1, 4;
	cvt.u64.u32 	%rd7, %r3;
	st.global.b64 	[%rd1+16], %rd7;
	setp.neu.f64 	%p1, %rd2, %rd2;
	selp.b64 	%rd8, 1, 2, %p1;
	st.global.b64 	[%rd1+24], %rd8;
	@%p1 bra 	$L__BB0_2;
	st.global.b64 	[%rd1+24], 0;
$L__BB0_2:
	mul.hi.u64 	%rd9, %rd2, %rd2;
	st.global.b64 	[%rd1+32], %rd9;
	cvt.rni.f64.f64 	%rd10, 0d4004000000000000;
	st.global.b64 	[%rd1+40], %rd10;
	ret;

}
"""
    machine, out = Machine(text), np.zeros(6, dtype=np.uint64)
    machine.run("f", [machine.place(out)], 1, 1)
    assert out.tolist() == [5, 0, 0xFFFFFFFF, 1, 2**64 - 2, bits(2.0)]
    assert number(int(out[1])) == 0.0


class ImaginedCore:
    """As much of cuda-core as is used, on memory of this process; what it launches is PTX."""

    class Buffer:
        def __init__(self, size):
            self.memory = np.zeros(size, dtype=np.uint8)
            self.handle, self.closed = self.memory.ctypes.data, False

        def copy_to(self, other, *, stream):
            assert len(other.memory) == len(self.memory) and not (self.closed or other.closed)
            other.memory[:] = self.memory

        def close(self, stream=None):
            self.closed = True

    class LegacyPinnedMemoryResource:
        def allocate(self, size, *, stream=None):
            return ImaginedCore.Buffer(size)

    class Event:
        def __init__(self):
            self._asked = 0

        @property
        def is_done(self):
            self._asked += 1
            return self._asked > 2

    class Stream:
        def record(self):
            return ImaginedCore.Event()

        def sync(self):
            pass

    class Device:
        name, compute_capability = "imagined", (9, 0)

        def __init__(self, number):
            assert number == 0

        def set_current(self):
            pass

        def create_stream(self):
            return ImaginedCore.Stream()

        def allocate(self, size, *, stream):
            return ImaginedCore.Buffer(size)

    class ObjectCode:
        @staticmethod
        def from_cubin(code):
            self = ImaginedCore.ObjectCode()
            self.machine = Machine(code.decode())
            return self

        def get_kernel(self, name):
            return self.machine, name

    class LaunchConfig:
        def __init__(self, grid, block):
            self.grid, self.block = grid, block

    @staticmethod
    def launch(_stream, config, kernel, *arguments):
        machine, name = kernel
        given = [machine.place(x.memory) if isinstance(x, ImaginedCore.Buffer) else x for x in arguments]
        machine.run(name, given, config.grid, config.block)


def test_the_imagined_core_has_nothing_that_the_real_one_lacks():
    """What is called of cuda-core exists under that name, as far as that can be seen without a device."""
    core = pytest.importorskip("cuda.core")
    for name, inner in vars(ImaginedCore).items():
        if name[0] == "_":
            continue
        assert hasattr(core, name), name
        for attribute in vars(inner) if isinstance(inner, type) else ():
            assert attribute[0] == "_" or hasattr(getattr(core, name), attribute), (name, attribute)
    assert hasattr(core.Buffer, "handle")
    config = core.LaunchConfig(grid=3, block=64)
    assert config.grid == (3, 1, 1) and config.block == (64, 1, 1)


@pytest.fixture
def imagined_device(monkeypatch, tmp_path):
    """A graphics processor that runs PTX in Python; what would be assembled is the PTX itself."""
    monkeypatch.setenv("SYMGEN_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(cuda, "_core", lambda: ImaginedCore)
    monkeypatch.setattr(cuda, "_BLOCK", 2)
    monkeypatch.setattr(choose, "check_arch", lambda arch: None)
    monkeypatch.setattr(choose, "assembler_version", lambda: "imagined")
    monkeypatch.setattr(
        choose, "assemble", lambda ptx, arch: assembler.Assembled(arch, ptx.encode(), 100, 0, 0, 64, 0.0)
    )


@pytest.mark.parametrize("frames", [None, 3])
@pytest.mark.parametrize(
    "varied", [{"parameters": {"m1": linspace(0.5, 2.0, 5)}}, {"start": {"theta1": linspace(-1, 1, 5)}}]
)
def test_an_ensemble_on_a_device_is_the_one_here(imagined_device, varied, frames):
    """Series, verdicts, statistics and members again: all that `system.ensemble` gives."""
    system = load(GENERATED / "double_pendulum.py")
    asked = dict(
        t_end=0.2, rtol=1e-6, method="dop853", frames=frames, reduce={"theta2": ["mean", "max"]}, **varied
    )
    here, there = system.ensemble(**asked), system.ensemble(device="cuda", **asked)
    assert there.method == "dop853" and there.n_done == 5 and there.health.ok
    for name in (*here.names,):
        np.testing.assert_array_equal(there[name], here[name])
    for name in ("status", "energy_error", "steps", "ok"):
        np.testing.assert_array_equal(getattr(there.verdicts, name), getattr(here.verdicts, name))
    for name, values in here.reduced["theta2"].items():
        np.testing.assert_array_equal(there.reduced["theta2"][name], values)
    end = there["theta2"][3] if frames is None else there["theta2"][3, -1]
    assert there.member(3)["theta2"][-1] == end


def test_auto_takes_a_method_that_devices_have_memory_for(imagined_device):
    system = load(GENERATED / "double_pendulum.py")
    e = system.ensemble(0.05, n=2, rtol=1e-9, device="cuda", start={"theta1": uniform(-1, 1)})
    assert e.method == "dop853" and (e.verdicts.status == 1).all()


def test_a_stopped_kernel_returns(imagined_device):
    """Ctrl-C: the main thread says so, the thread that waits for the device leaves it."""
    plan = plan_of("double_pendulum", 0.05, "rk4", n=2)
    batch = device.make_batch(plan.system, plan.settings)
    kernel = batch._kernel
    kernel._stream.record = lambda: (batch.stop(), ImaginedCore.Event())[1]
    parameters, starts = members_of(plan)
    assert not batch.run(parameters, starts).columns.any()


@pytest.mark.parametrize(
    "name, options, said",
    [
        ("bouncing_ball", {"method": "dop853"}, "it has events, which run in the lanes"),
        ("door_stop", {}, "stops and friction are for processors"),
        ("stiff_bushing_pendulum", {"method": "radau5"}, "method radau5 is for processors"),
    ],
)
def test_what_a_device_cannot_do_is_refused(imagined_device, name, options, said):
    system = load(GENERATED / f"{name}.py")
    with pytest.raises(RuntimeModelError, match=said) as refusal:
        system.ensemble(0.1, n=2, device="cuda", parameters={"m": uniform(0.9, 1.1)}, **options)
    assert "leave out the device" in str(refusal.value)


EXPONENTIAL = """
name = "soft_wall"
[parameters]
k = 1.0
[coordinates]
x = { start = 0.5 }
[energy]
kinetic = "dot(x)^2/2"
potential = "k*exp(-x) + x^2/2"
"""


def test_functions_of_the_c_library_are_refused_by_name(imagined_device, tmp_path):
    """Their bits could not be those of this machine."""
    import symgen

    path = tmp_path / "soft_wall.toml"
    path.write_text(EXPONENTIAL)
    with pytest.raises(RuntimeModelError, match="need exp of the C library"):
        symgen.load(path).ensemble(
            0.1, n=2, device="cuda", method="rk4", step=0.01, parameters={"k": uniform(0.9, 1.1)}
        )


def test_a_thread_that_needs_too_much_memory_is_refused(imagined_device, monkeypatch):
    monkeypatch.setattr(
        choose, "assemble", lambda ptx, arch: assembler.Assembled(arch, ptx.encode(), 255, 0, 0, 80_000, 0.0)
    )
    with pytest.raises(RuntimeModelError, match="takes 80000 bytes of memory for each thread"):
        load(GENERATED / "double_pendulum.py").ensemble(
            0.1, n=2, device="cuda", method="taylor", parameters={"L1": uniform(0.9, 1.1)}
        )


def test_without_a_device_the_error_says_what_to_do(monkeypatch):
    system, varied = load(GENERATED / "double_pendulum.py"), {"parameters": {"L1": uniform(0.9, 1.1)}}
    monkeypatch.setitem(sys.modules, "cuda.core", None)
    with pytest.raises(RuntimeModelError, match=r"pip install 'symgen\[gpu\]'"):
        system.ensemble(0.1, n=2, device="cuda", **varied)

    class NoDriver(ImaginedCore):
        @staticmethod
        def Device(number):
            raise RuntimeError("no driver")

    monkeypatch.setattr(cuda, "_core", lambda: NoDriver)
    with pytest.raises(
        RuntimeModelError, match=r"no graphics processor of NVIDIA can be used here \(no driver\)"
    ):
        system.ensemble(0.1, n=2, device="cuda", **varied)
    with pytest.raises(RuntimeModelError, match="device is 'tpu': give \"cpu\""):
        system.ensemble(0.1, n=2, device="tpu", **varied)


def test_without_the_assembler_the_error_says_what_to_do(monkeypatch):
    monkeypatch.setattr(assembler, "find_assembler", lambda: None)
    with pytest.raises(RuntimeModelError, match=r"pip install 'symgen\[gpu\]'"):
        report_program(load(GENERATED / "double_pendulum.py"), "rk4", "sm_90")


@needs_assembler
@pytest.mark.parametrize("arch", ["sm_80", "sm_90"])
def test_small_models_run_in_registers(arch, monkeypatch, tmp_path):
    monkeypatch.setenv("SYMGEN_CACHE_DIR", str(tmp_path))
    system = load(GENERATED / "double_pendulum.py")
    first, again = (report_program(system, "rk4", arch).program for _ in range(2))
    assert first.flat and 60 < first.assembled.registers < 255
    assert first.assembled.spill_stores == 0 and first.assembled.stack <= 64
    assert again == first and again.assembled.code == first.assembled.code  # from the cache


@needs_assembler
@pytest.mark.parametrize("method, flat", [("rk4", True), ("dop853", False)])
def test_the_size_of_a_model_decides_where_its_arrays_are(method, flat):
    """The arm has 1029 operations: with dop853 its functions are called, and its arrays are in memory."""
    program = report_program(load(GENERATED / "seven_dof_arm.py"), method, "sm_90").program
    assert program.flat == flat and program.assembled.stack < choose.LARGEST_STACK
    assert flat or program.assembled.spill_stores < 100


def test_an_installed_toolkit_has_the_assembler_too(monkeypatch, tmp_path):
    """Below CUDA_HOME, where there is no package of NVIDIA's."""
    program = tmp_path / "bin" / "ptxas"
    program.parent.mkdir()
    program.write_text("#!/bin/sh")
    program.chmod(0o755)
    monkeypatch.setattr(assembler, "_PACKAGES", ())
    monkeypatch.setenv("PATH", "")
    for name in ("CUDA_HOME", "CUDA_PATH"):
        monkeypatch.delenv(name, raising=False)
    assert assembler.find_assembler() is None
    monkeypatch.setenv("CUDA_HOME", str(tmp_path))
    assert assembler.find_assembler() == program


@needs_assembler
def test_report_on_the_command_line():
    result = CliRunner().invoke(
        main, ["gpu-report", "double_pendulum", "--arch", "sm_90", "--method", "rk4", "--check"]
    )
    assert result.exit_code == 0, result.output
    row = next(line.split() for line in result.output.splitlines() if line.split()[:2] == ["rk4", "sm_90"])
    assert row[2] == "registers" and 60 < int(row[4]) < 255
    assert "rk4: the same bits as in a lane" in result.output
    refused = CliRunner().invoke(main, ["gpu-report", "bouncing_ball", "--method", "dop853"])
    assert refused.exit_code == 1 and "it has events" in refused.output
    unknown = CliRunner().invoke(main, ["gpu-report", "double_pendulum", "--arch", "sm_91"])
    assert unknown.exit_code != 0 and "knows no architecture 'sm_91'" in unknown.output


def test_bits_are_compared_in_earnest(monkeypatch):
    """A lane that differs is seen."""
    system = load(GENERATED / "double_pendulum.py")
    assert same_bits(system, "rk4", flat=False)
    run = LaneBatch.run

    def off(self, parameters, start):
        result = run(self, parameters, start)
        result.end[0, 0] = np.nextafter(result.end[0, 0], 10.0)
        return result

    monkeypatch.setattr(LaneBatch, "run", off)
    assert not same_bits(system, "rk4", flat=False)
