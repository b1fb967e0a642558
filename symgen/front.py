"""What users hold in their hands: the builder of models, with doors to all that is done with one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from symgen.runtime.lazy import Late

from . import link
from .model import algebra, model, toml_reader
from .robots.build import EARTH, import_urdf
from .robots.mjcf import import_mjcf
from .robots.pictures import Pictures

# These import SymPy, which a model that is read from a file does without.
equations, lagrangians = Late("symgen.equations"), Late("symgen.model.lagrangian")

if TYPE_CHECKING:
    import sympy

    from symgen.runtime import System
    from symgen.runtime.robot import Robot


class Model(model.Model):
    __doc__ = model.Model.__doc__

    @staticmethod
    def _symbol(name: str) -> sympy.Symbol:
        from .model.from_sympy import to_sympy  # who takes symbols writes expressions with SymPy

        return to_sympy(algebra.Symbol(name))

    def derive(self, jacobian: bool = False) -> System:
        """Derive the equations of motion and load them, ready to run.

        Parameters
        ----------
        jacobian : bool
            Whether the module has `rhs_by_state` and `rhs_by_parameters` as well: exact derivatives of dq/dt and dv/dt
            by q and v, and by parameters and inputs, row by row. `system.kernel("rhs_by_state")(t, y, p)`.

        Raises
        ------
        ModelError
            The model is wrong, or Jacobians are asked for where stops or dry friction switch.
        """
        return link.derive(self, jacobian)

    def robot(
        self,
        functions: str | Sequence[str] = "robot",
        frames: Sequence[str] = (),
        actuators: Sequence[str] = (),
    ) -> Robot:
        """Derive what robot programs call, and nothing else; arguments are those of `symgen.robot`.

        Raises
        ------
        ModelError
            The model is wrong, or cannot have one of the functions.
        """
        return link.robot(self, functions, frames, actuators)

    def equations(
        self, *, shared: bool = False, simplify: bool = False, time_limit: float = 10.0
    ) -> equations.Equations:
        """Return the equations of motion in SymPy, derived as `derive` does.

        Parameters
        ----------
        shared : bool
            Whether subexpressions that stand in several places get names (`equations.shared`), as long models need.
        simplify : bool
            Whether SymPy simplifies each element first.
        time_limit : float [s]
            For that.

        Returns
        -------
        symgen.equations.Equations
            Of what stands in a bundled model: `symgen.equations.equations_of(symgen.load(name))`.

        Examples
        --------
        >>> found = model.equations(simplify=True)
        >>> found.M, found.f, found.T - found.V
        >>> found.of_time().f  # in functions of time
        """
        found = equations.equations_of(self.derive())
        if simplify:
            found = found.simplified(time_limit)
        return found.named() if shared else found

    @classmethod
    def from_toml(cls, source: str | Path, folder: str | Path | None = None) -> Model:
        """Read a model from a TOML file, or from its text.

        Parameters
        ----------
        source : path or str
            A `Path`, a path's text ending in `.toml`, or TOML text.
        folder : path, optional
            Where the meshes of a model given as text are.
        """
        if isinstance(source, Path) or (source.lower().endswith(".toml") and "\n" not in source):
            return toml_reader.read_file(Path(source), cls)
        return toml_reader.read_text(source, folder=None if folder is None else Path(folder), make=cls)

    @classmethod
    def from_urdf(
        cls,
        path: str | Path,
        base: str = "fixed",
        expose: Iterable[str] | None = None,
        motors: bool = True,
        gravity: Sequence[float | str] = EARTH,
        meshes: str | Path | None = None,
        package_path: str | Path | Iterable[str | Path] = (),
        start: Mapping[str, float | str] = MappingProxyType({}),
    ) -> Model:
        """Read a robot from a URDF file.

        Parameters
        ----------
        path : path-like
        base : {"fixed", "free"}
            Whether the first link is fixed to the world or moves freely (coordinates `root_x`, …, a quaternion).
        expose : iterable of str, optional
            Patterns of the numbers that become parameters, as `"wrist_*.mass"`: of links `mass`, `com_x`, `com_y`,
            `com_z`, `Ixx` … `Iyz`, of joints `damping`, `friction`, `armature`. All that are not zero by default; the
            others are folded into the code.
        motors : bool
            Whether joints that a motor may move (not those that mimic another) get an input, a force [N] or
            torque [N m].
        gravity : sequence of 3
            Acceleration [m/s^2].
        meshes : path-like, optional
            A folder for the pictures of links with meshes, a file each, which are made now (package `trimesh`); the
            folder above it is the model's, and the `mesh_folder` of recordings. Without it these links have none.
        package_path : path-like or iterable of path-like
            Folders of the packages that hold meshes, `package://NAME/FILE`; also asked are packages above the file,
            ROS_PACKAGE_PATH, AMENT_PREFIX_PATH, and Python's installed packages.
        start : mapping of str to float or str
            Where coordinates of the model start, as `{"elbow": "40 deg", "root_z": 0.4}`. Others start at zero, or at
            the limit that is nearer to it.

        Returns
        -------
        Model

        Raises
        ------
        ModelError
            Names the file, the line and the element.
        """
        pictures = Pictures.of(meshes, package_path)
        return import_urdf(path, base, expose, motors, gravity, cls, pictures, start).model

    @classmethod
    def from_mjcf(
        cls,
        path: str | Path,
        expose: Iterable[str] | None = None,
        keyframe: str | None = None,
        within: str | Path | None = None,
        meshes: str | Path | None = None,
    ) -> Model:
        """Read a robot from an MJCF file, through MuJoCo's compiler (package `mujoco`).

        Parameters
        ----------
        path : path-like
        expose : iterable of str, optional
            As of `from_urdf`; of joints `stiffness`, too.
        keyframe : str, optional
            The keyframe where it starts; its reference position by default.
        within : path-like, optional
            The folder in which all files lie that it names, that of the file by default: nothing else is read.
        meshes : path-like, optional
            As of `from_urdf`.

        Returns
        -------
        Model

        Raises
        ------
        ModelError
            Names the file and the element; MuJoCo is not installed, or refuses the file.
        """
        return import_mjcf(path, expose, keyframe, within, cls, Pictures.of(meshes, ())).model

    @classmethod
    def from_lagrangian(
        cls,
        name: str,
        lagrangian: sympy.Expr,
        coordinates: Sequence[sympy.Expr],
        *,
        parameters: Mapping[sympy.Symbol, Any] = MappingProxyType({}),
        forces: Mapping[sympy.Expr, Any] = MappingProxyType({}),
        constraints: Mapping[str, Any] = MappingProxyType({}),
        velocity_constraints: Mapping[str, Any] = MappingProxyType({}),
        start: Mapping[sympy.Expr, Any] = MappingProxyType({}),
        rate: Mapping[sympy.Expr, Any] = MappingProxyType({}),
        inputs: Mapping[sympy.Expr, Any] = MappingProxyType({}),
    ) -> Model:
        """Make a model of a Lagrangian in SymPy's functions of time.

        Parameters
        ----------
        name : str
        lagrangian : sympy.Expr
            L = T - V [J] of `dynamicsymbols`, their first derivatives, the time and other symbols. V is -L at rest.
        coordinates : sequence of sympy.Expr
            The `dynamicsymbols`, in the order of q.
        parameters : mapping of sympy.Symbol to number or quantity
            Values of all other symbols.
        forces : mapping of sympy.Expr to expression
            Generalised forces on coordinates, beyond those of V.
        constraints, velocity_constraints : mapping of str to expression
            What is held at zero, by names; of positions, and linear in rates.
        start, rate : mapping of sympy.Expr to number or quantity
            Values and rates of coordinates at the start; those left out are guesses of 0.
        inputs : mapping of sympy.Expr to number or quantity
            The `dynamicsymbols` that are no coordinates, which a run may be given, and their values otherwise.

        Returns
        -------
        Model

        Raises
        ------
        ModelError
            A symbol has no value, or something is neither a coordinate nor its rate.

        Examples
        --------
        >>> from sympy import cos, symbols
        >>> from sympy.physics.mechanics import dynamicsymbols
        >>> q, (m, g, l) = dynamicsymbols("q"), symbols("m g l")
        >>> L = m * l**2 * q.diff() ** 2 / 2 + m * g * l * cos(q)
        >>> pendulum = Model.from_lagrangian("pendulum", L, [q], parameters={m: 1, g: 9.81, l: 0.5}, start={q: 0.1})
        """
        return lagrangians.from_lagrangian(
            cls,
            name,
            lagrangian,
            coordinates,
            lagrangians.Given(parameters, forces, constraints, velocity_constraints, start, rate, inputs),
        )

    @classmethod
    def from_sympy(
        cls,
        name: str,
        problem: Any,
        *,
        parameters: Mapping[sympy.Symbol, Any] = MappingProxyType({}),
        start: Mapping[sympy.Expr, Any] = MappingProxyType({}),
        rate: Mapping[sympy.Expr, Any] = MappingProxyType({}),
        inputs: Mapping[sympy.Expr, Any] = MappingProxyType({}),
    ) -> Model:
        """Make a model of a problem of `sympy.physics.mechanics`.

        Coordinates, forces and constraints (`position_1`, …, `velocity_1`, …) are taken over: of a `LagrangesMethod`
        with its Lagrangian; of a `KanesMethod` or `System` with the kinetic energy of the bodies and the loads, as
        Kane's method takes them (a potential energy that a body has been given is none of these). Generalised speeds
        are replaced by rates of coordinates.

        Parameters
        ----------
        name : str
        problem : LagrangesMethod, KanesMethod or System
            A `KanesMethod` after `kanes_equations`, or with `bodies` and `forcelist`.
        parameters, start, rate, inputs
            As in `from_lagrangian`.

        Returns
        -------
        Model

        Raises
        ------
        ModelError
            Speeds do not follow from rates, or as in `from_lagrangian`.
        """
        return lagrangians.from_sympy(
            cls, name, problem, parameters=parameters, start=start, rate=rate, inputs=inputs
        )
