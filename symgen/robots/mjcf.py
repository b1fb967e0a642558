"""Robots from MJCF, through the model that MuJoCo's compiler makes of a file (optional package `mujoco`)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ModelError, nearest
from ..model import algebra
from ..model.description import NOTHING
from ..model.evaluate import perpendiculars
from ..model.functions import dot, maximum, minimum
from ..model.model import Model
from .build import inertia_in_link
from .mjcf_files import check_files
from .naming import WORLD, Naming, identifier, short
from .pictures import FAINTEST, Pictures, hexadecimal, written
from .surfaces import Surfaces

MOST_RATES = 600
_TURN_ROUND_OFF = 1e-15
_FILTERS = ("integrator", "filter", "filterexact")  # kinds of activation, states of first order
_SHOWN_GROUPS = 3  # those that MuJoCo's viewer shows unless told otherwise; the others are what collides
_PARALLEL = 1e-9  # directions that differ by less are one
_MESH = 7  # mjGEOM_MESH
_SHAPES = {2: "sphere", 3: "capsule", 4: "ellipsoid", 5: "cylinder", 6: "box"}  # mjtGeom


@dataclass
class MjcfImport:
    """A robot's model, and how its names and MuJoCo's numbers belong together.

    Attributes
    ----------
    file : str
    compiled : mujoco.MjModel
    model : Model
    bodies : dict of int to str
        Bodies of the model by MuJoCo's numbers.
    shifts : dict of int to ndarray
        Where in MuJoCo's frame of a body the model's frame stands: at the anchor of its last joint.
    joints : dict of int to str
        Coordinates of hinges and slides, and joints that are free or balls, by MuJoCo's numbers.
    actuators : dict of int to str
        Inputs by the numbers of controls.
    activations : dict of int to str
        First-order states by the numbers of activations.
    tendons : dict of int to str
        Definitions of lengths by the numbers of tendons.
    notes : list of str
        What was left out, or is exact here and soft there, a sentence each.
    """

    file: str
    compiled: Any
    model: Model
    bodies: dict[int, str] = field(default_factory=dict)
    shifts: dict[int, np.ndarray] = field(default_factory=dict)
    joints: dict[int, str] = field(default_factory=dict)
    actuators: dict[int, str] = field(default_factory=dict)
    activations: dict[int, str] = field(default_factory=dict)
    tendons: dict[int, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def import_mjcf(
    path: str | Path,
    expose: Iterable[str] | None = None,
    keyframe: str | None = None,
    within: str | Path | None = None,
    make: type[Model] = Model,
    pictures: Pictures | None = None,
) -> MjcfImport:
    """Read a robot from an MJCF file, and say what was left out.

    Parameters
    ----------
    path, expose, keyframe, within
        See `symgen.Model.from_mjcf`.
    make : type
        What the model shall be.
    pictures : Pictures, optional
        Where those of bodies with meshes go.

    Raises
    ------
    ModelError
        Names the file and the element; MuJoCo is not installed, or refuses the file.
    """
    try:
        import mujoco
    except ImportError:
        raise ModelError("MJCF is read by MuJoCo's compiler", hint="pip install 'symgen[mjcf]'") from None
    path = Path(path)
    check_files(path, None if within is None else Path(within))
    warnings: list[str] = []
    mujoco.set_mju_user_warning(warnings.append)  # it would write them to a file in the current folder
    try:
        compiled = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise ModelError(
            f"MuJoCo refuses the file: {' '.join(str(error).split())[:300]}", file=str(path)
        ) from None
    finally:
        mujoco.set_mju_user_warning(None)
    if compiled.nv > MOST_RATES:
        raise ModelError(f"the robot has {compiled.nv} rates, more than {MOST_RATES}", file=str(path))
    if compiled.nv == 0:
        raise ModelError("nothing moves: no body has a joint", file=str(path))
    builder = _Builder(mujoco, path, compiled, expose, keyframe, make, pictures or Pictures())
    with builder.model._reading():
        result = builder.build()
    result.notes += [f"MuJoCo says: {' '.join(text.split())[:200]}" for text in dict.fromkeys(warnings)]
    return result


class _Builder:
    def __init__(
        self,
        mujoco: Any,
        path: Path,
        compiled: Any,
        expose: Iterable[str] | None,
        keyframe: str | None,
        make: type[Model],
        pictures: Pictures,
    ) -> None:
        self._mj, self._m, self._pictures = mujoco, compiled, pictures
        stem = self._text(compiled.names[: compiled.names.find(b"\0")]) or path.stem
        gravity = compiled.opt.gravity.tolist()
        if compiled.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_GRAVITY):
            gravity = [0.0, 0.0, 0.0]
        described = f"Robot {stem!r:.60}, from {path.name!r:.60}"
        self._model = self.model = make(
            identifier(stem),
            described,
            gravity=[f"{x!r} m/s^2" if x else 0 for x in gravity],
            folder=path.parent if pictures.folder is None else pictures.folder.parent,
        )
        self._naming = Naming(self._model, str(path), expose)
        self._result = MjcfImport(str(path), compiled, self._model)
        self._has_equalities = False
        self._start, self._speed = self._keyframe(keyframe)
        self._sites: dict[int, str] = {}
        self._lengths: dict[int, algebra.Expr] = {}
        # Forces of actuators, by joints, and by tendons that bound what these make together.
        self._on_joints: dict[int, list[algebra.Expr]] = {}
        self._on_tendons: dict[int, list[algebra.Expr]] = {}
        self._unity: algebra.Expr | None = None

    def build(self) -> MjcfImport:
        m = self._m
        kinds = [self._mj.mjtJoint(k) for k in m.jnt_type]
        types = {
            "mjJNT_FREE": "free",
            "mjJNT_BALL": "spherical",
            "mjJNT_SLIDE": "prismatic",
            "mjJNT_HINGE": "revolute",
        }
        for j in range(m.njnt):  # coordinates have the joints' names, so these come first
            self._result.joints[j] = self._naming.name(self._joint_name(j), types[kinds[j].name])
        self._types = {j: types[kind.name] for j, kind in enumerate(kinds)}
        self._active = [k for k in range(m.neq) if m.eq_active0[k]]
        self._has_equalities = bool(self._active)
        for b in range(1, m.nbody):
            self._body(b)
        for t in range(m.ntendon):
            self._tendon(t)
        for k in self._active:
            self._equality(k)
        self._actuators()
        self._apply_forces()
        self._sensors()
        self._left_out()
        self._naming.check_patterns()
        return self._result

    # Names

    def _note(self, text: str) -> None:
        if text not in self._result.notes:
            self._result.notes.append(text)

    @staticmethod
    def _text(name: bytes) -> str:
        return name.decode("utf-8", "replace")

    def _named(self, kind: str, number: int, otherwise: str) -> str:
        return self._mj.mj_id2name(self._m, getattr(self._mj.mjtObj, f"mjOBJ_{kind}"), number) or otherwise

    def _joint_name(self, j: int) -> str:
        b = self._m.jnt_bodyid[j]
        return self._named("JOINT", j, f"{self._named('BODY', b, f'body{b}')}_joint")

    # Bodies and joints

    def _keyframe(self, name: str | None) -> tuple[np.ndarray, np.ndarray]:
        m = self._m
        if name is None:
            return np.array(m.qpos0), np.zeros(m.nv)
        names = [self._named("KEY", k, str(k)) for k in range(m.nkey)]
        if name not in names:
            raise ModelError(
                f"there is no keyframe {name[:60]!r}",
                file=self._result.file,
                key="keyframe",
                hint=nearest(name[:60], names),
            )
        k = names.index(name)
        return np.array(m.key_qpos[k]), np.array(m.key_qvel[k])

    def _body(self, b: int) -> None:
        """A body, on a chain of massless ones where it has several joints."""
        m, model, result = self._m, self._model, self._result
        source = self._named("BODY", b, f"body{b}")
        name = result.bodies[b] = self._naming.name(source)
        parent = int(m.body_parentid[b])
        parent_name = result.bodies.get(parent, WORLD)
        start = np.array(m.body_pos[b]) - result.shifts.get(parent, np.zeros(3))
        turn = np.array(m.body_quat[b])
        joints = (
            list(range(m.body_jntadr[b], m.body_jntadr[b] + m.body_jntnum[b])) if m.body_jntnum[b] else []
        )
        anchor = np.zeros(3)
        chain = []
        for j in joints:
            own = np.zeros(3) if self._types[j] == "free" else np.array(m.jnt_pos[j])
            if self._types[j] == "free":
                chain.append((j, np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])))
            elif not chain:
                chain.append((j, start + _rotated(turn, own), turn))
            else:
                chain.append((j, own - anchor, np.array([1.0, 0.0, 0.0, 0.0])))
            anchor = own
        result.shifts[b] = anchor
        self._inertia(b, source, name, anchor)
        if not joints:
            if m.body_mocapid[b] >= 0:
                self._note(f"the mocap body {source!r:.60} stands still")
            model.joint(self._naming.name(f"{name}_fixed"), "fixed", name, parent_name, _origin(start, turn))
            return
        for k, (j, at, quaternion) in enumerate(chain):
            child = name
            if k < len(chain) - 1:
                child = self._naming.name(f"{name}_after_{result.joints[j]}")
                model.body(child, mass=0, com=(0, 0, 0), shape=NOTHING)
            self._joint(j, child, parent_name, _origin(at, quaternion))
            parent_name = child

    def _inertia(self, b: int, source: str, name: str, anchor: np.ndarray) -> None:
        m, number = self._m, self._naming.number
        mass, moments = float(m.body_mass[b]), np.array(m.body_inertia[b])
        shape = self._shape(b, name, anchor)
        more = {"shape": shape} if shape else {}
        if mass == 0.0 and not moments.any():
            self._model.body(name, mass=0, com=(0, 0, 0), **more)
            return
        centre, rpy = np.array(m.body_ipos[b]), roll_pitch_yaw(np.array(m.body_iquat[b]))
        kinds, same = self._mj.mjtSameFrame, int(m.body_sameframe[b])
        if same == int(kinds.mjSAMEFRAME_BODY):  # within MuJoCo's tolerance, where it counts as zero
            centre = np.zeros(3)
        if same in (int(kinds.mjSAMEFRAME_BODY), int(kinds.mjSAMEFRAME_BODYROT)):
            rpy = (0.0, 0.0, 0.0)
        tensor, _ = inertia_in_link((*moments.tolist(), 0.0, 0.0, 0.0), rpy)
        largest = max(map(abs, tensor))
        tensor = tuple(0.0 if abs(x) < 1e-15 * largest else x for x in tensor)
        com = centre - anchor
        inertia = [
            number(source, key, x, "kg*m^2")
            for key, x in zip(("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"), tensor, strict=True)
        ]
        self._model.body(
            name,
            mass=number(source, "mass", mass, "kg"),
            com=[number(source, f"com_{axis}", float(x), "m") for axis, x in zip("xyz", com, strict=True)],
            inertia=inertia if any(tensor) or self._naming.is_chosen else None,
            **more,
        )

    def _shape(self, b: int, name: str, anchor: np.ndarray) -> Any:
        """What is drawn of a body: its geoms in the groups that MuJoCo shows."""
        m = self._m
        geoms = [
            g
            for g in range(m.body_geomadr[b], m.body_geomadr[b] + m.body_geomnum[b])
            if m.geom_group[g] < _SHOWN_GROUPS and self._color(g)[3] >= FAINTEST
        ]
        if not geoms:
            return NOTHING
        solids = [g for g in geoms if int(m.geom_type[g]) in _SHAPES]
        has_mesh = any(m.geom_type[g] == _MESH for g in geoms)
        if len(solids) + sum(m.geom_type[g] == _MESH for g in geoms) < len(geoms):
            self._note("planes, height fields and distance fields are not drawn")
        if has_mesh and self._pictures.folder is not None:
            return self._file(name, geoms, anchor)
        if has_mesh:
            self._note("meshes are left out of the picture")
        if not solids:
            return None
        shapes = [self._solid(g, anchor) for g in solids]
        shapes[0]["color"] = hexadecimal(self._color(solids[0]))
        return shapes

    def _solid(self, g: int, anchor: np.ndarray) -> dict[str, Any]:
        m, kind = self._m, _SHAPES[int(self._m.geom_type[g])]
        rpy = roll_pitch_yaw(np.array(m.geom_quat[g]))
        place = [short(x) for x in (np.array(m.geom_pos[g]) - anchor).tolist()]
        return {kind: self._sizes(g), "offset": place, **({"rpy": list(rpy)} if any(rpy) else {})}

    def _sizes(self, g: int) -> list[float]:
        size, kind = np.array(self._m.geom_size[g]), _SHAPES[int(self._m.geom_type[g])]
        sizes = {
            "sphere": size[:1], "capsule": (size[0], 2 * size[1]), "cylinder": (size[0], 2 * size[1]),
            "ellipsoid": size, "box": 2 * size,
        }[kind]  # fmt: skip
        return [short(float(x)) for x in sizes]

    def _color(self, g: int) -> tuple[float, ...]:
        material = int(self._m.geom_matid[g])
        rgba = self._m.geom_rgba[g] if material < 0 else self._m.mat_rgba[material]
        return tuple(min(max(float(x), 0.0), 1.0) for x in rgba)

    def _file(self, name: str, geoms: list[int], anchor: np.ndarray) -> Any:
        """The shape of a file with all geoms of a body."""
        m = self._m
        surfaces = Surfaces()
        for g in geoms:
            place = np.eye(4)
            place[:3, :3], place[:3, 3] = _matrix(np.array(m.geom_quat[g])), np.array(m.geom_pos[g]) - anchor
            if int(m.geom_type[g]) in _SHAPES:
                surfaces.add_solid(_SHAPES[int(m.geom_type[g])], self._sizes(g), place, self._color(g))
            elif m.geom_type[g] == _MESH:
                k = int(m.geom_dataid[g])
                corners = m.mesh_vert[m.mesh_vertadr[k] :][: m.mesh_vertnum[k]]
                triangles = m.mesh_face[m.mesh_faceadr[k] :][: m.mesh_facenum[k]]
                surfaces.add_arrays(
                    np.array(corners, dtype=float), np.array(triangles), place, self._color(g)
                )
        return written(self._pictures.folder, name, surfaces.content())

    def _joint(self, j: int, child: str, parent: str, origin: dict[str, list[float]] | None) -> None:
        m, name, kind = self._m, self._result.joints[j], self._types[j]
        source, first, dof = self._joint_name(j), int(m.jnt_qposadr[j]), int(m.jnt_dofadr[j])
        n_rates = {"free": 6, "spherical": 3}.get(kind, 1)
        n_coordinates = {"free": 7, "spherical": 4}.get(kind, 1)
        linear = kind == "prismatic"
        more: dict[str, Any] = {}
        start = self._start[first : first + n_coordinates]
        if n_coordinates == 1:
            more["axis"] = np.array(m.jnt_axis[j]).tolist()
            start = start - m.qpos0[first]
        key = "guess" if self._has_equalities else "start"
        if n_coordinates > 1 or start[0] != 0.0:
            values = start.tolist()
            more[key] = values if n_coordinates > 1 else values[0]
        if self._speed[dof : dof + n_rates].any():
            speeds = self._speed[dof : dof + n_rates].tolist()
            more["rate" if key == "start" else "rate_guess"] = speeds if n_rates > 1 else speeds[0]
        units = {
            "damping": "N*s/m" if linear else "N*m*s", "armature": "kg" if linear else "kg*m^2",
            "stiffness": "N/m" if linear else "N*m",
        }  # fmt: skip
        for key, table in (("damping", m.dof_damping), ("armature", m.dof_armature)):
            values = np.array(table[dof : dof + n_rates])
            if key == "armature" and n_rates > 1 and values.any():
                self._note(f"joint {source!r:.60}: the armature of a joint with a quaternion is left out")
            elif values.any():
                more[key] = (
                    self._naming.number(source, key, float(values[0]), units[key])
                    if n_rates == 1
                    else values.tolist()
                )
        if m.jnt_stiffness[j]:
            if n_rates > 1:
                self._note(f"joint {source!r:.60}: the stiffness of a joint with a quaternion is left out")
            else:
                more["stiffness"] = self._naming.number(
                    source, "stiffness", float(m.jnt_stiffness[j]), units["stiffness"]
                )
                rest = float(m.qpos_spring[first] - m.qpos0[first])
                if rest:
                    more["rest"] = rest
        if m.jnt_stiffnesspoly[j].any() or m.dof_dampingpoly[dof : dof + n_rates].any():
            self._note(f"joint {source!r:.60}: stiffness and damping of higher degree are left out")
        if m.jnt_limited[j]:
            if n_rates > 1:
                self._note(f"joint {source!r:.60}: the limit of a ball joint is left out")
            else:
                more["limits"] = [float(x - m.qpos0[first]) for x in m.jnt_range[j]]
        self._model.joint(name, kind, child, parent, origin, **more)
        if np.array(m.dof_frictionloss[dof : dof + n_rates]).any():
            if n_rates > 1:
                self._note(f"joint {source!r:.60}: the friction of a joint with a quaternion is left out")
                return
            level = self._naming.number(
                source, "friction", float(m.dof_frictionloss[dof]), "N" if linear else "N*m"
            )
            what = "force" if linear else "torque"
            self._model.friction(self._naming.name(f"{name}_friction"), coordinate=name, **{what: level})
            self._note("frictionloss is exact dry friction, which sticks; MuJoCo's creeps")

    # Sites, tendons, equalities

    def _site(self, s: int) -> str:
        """The name of a point at a site, made when it is first used."""
        if s not in self._sites:
            m, b = self._m, int(self._m.site_bodyid[s])
            name = self._naming.vector(self._named("SITE", s, f"site{s}"))
            at = np.array(m.site_pos[s]) - self._result.shifts.get(b, np.zeros(3))
            body = self._result.bodies.get(b, WORLD)
            quaternion = np.array(m.site_quat[s])
            self._model.frame(name, body, list(map(short, at.tolist())), rpy=list(roll_pitch_yaw(quaternion)))
            self._sites[s] = name
        return self._sites[s]

    def _angle(self, j: int) -> algebra.Expr:
        """MuJoCo's coordinate of a hinge or slide: it counts from `ref`."""
        return algebra.Symbol(self._result.joints[j]) + _number(self._m.qpos0[self._m.jnt_qposadr[j]])

    def _tendon(self, t: int) -> None:
        m, source = self._m, self._named("TENDON", t, f"tendon{t}")
        wraps = range(m.tendon_adr[t], m.tendon_adr[t] + m.tendon_num[t])
        kinds = [self._mj.mjtWrap(m.wrap_type[w]).name for w in wraps]
        length = algebra.ZERO
        if all(kind == "mjWRAP_JOINT" for kind in kinds):
            for w in wraps:
                length += self._coefficient(m.wrap_prm[w]) * self._angle(int(m.wrap_objid[w]))
        elif set(kinds) <= {"mjWRAP_SITE", "mjWRAP_PULLEY"}:
            divisor, before = 1.0, None
            for w, kind in zip(wraps, kinds, strict=True):
                if kind == "mjWRAP_PULLEY":
                    divisor, before = float(m.wrap_prm[w]), None
                    continue
                here = [algebra.Symbol(f"{self._site(int(m.wrap_objid[w]))}_{c}") for c in "xyz"]
                if before is not None:
                    apart = sum((a - b) ** 2 for a, b in zip(here, before, strict=True))
                    length += algebra.sqrt(apart) / _number(divisor)
                before = here
        else:
            self._note(
                f"tendon {source!r:.60}: one that wraps around geoms is left out, with all that acts on it"
            )
            return
        name = self._result.tendons[t] = self._naming.name(f"{source}_length")
        self._lengths[t] = self._model.definition(name, length)
        number = self._naming.number
        stiffness, damping = float(m.tendon_stiffness[t]), float(m.tendon_damping[t])
        low, high = (float(x) for x in m.tendon_lengthspring[t])
        if stiffness:
            k = _symbol(number(source, "stiffness", stiffness, None))
            if low == high:
                excess = self._lengths[t] - _number(low)
            else:
                excess = maximum(self._lengths[t] - _number(high), 0) + minimum(
                    self._lengths[t] - _number(low), 0
                )
            self._model.potential(k * excess**2 / 2)
        if damping:
            c = _symbol(number(source, "damping", damping, None))
            self._model.dissipation(c * dot(self._lengths[t]) ** 2 / 2)
        if m.tendon_armature[t]:
            self._model.kinetic(_number(m.tendon_armature[t]) * dot(self._lengths[t]) ** 2 / 2)
        if m.tendon_limited[t]:
            self._note(f"tendon {source!r:.60}: its limits are left out")
        if m.tendon_frictionloss[t]:
            self._note(f"tendon {source!r:.60}: its friction is left out")

    def _equality(self, k: int) -> None:
        m, mj = self._m, self._mj
        kind = mj.mjtEq(m.eq_type[k]).name.removeprefix("mjEQ_").lower()
        source = self._named("EQUALITY", k, f"{kind}{k}")
        data, first, second = np.array(m.eq_data[k]), int(m.eq_obj1id[k]), int(m.eq_obj2id[k])
        by_site = m.eq_objtype[k] == mj.mjtObj.mjOBJ_SITE
        self._note(f"the equality {source!r:.60} ({kind}) is an exact constraint; MuJoCo's is soft")
        name = self._naming.name(source)
        if kind in ("joint", "tendon"):
            measure, base = self._measures(kind)
            if (kind == "tendon") and not {first, second} - {-1} <= self._lengths.keys():
                self._note(f"the equality {source!r:.60} is left out with its tendon")
                return
            change = measure(second) - _number(base(second)) if second >= 0 else algebra.ZERO
            follows = sum(
                (self._coefficient(c) * change**i for i, c in enumerate(data[:5]) if c), algebra.ZERO
            )
            self._model.couple(name, measure(first) - _number(base(first)) - follows)
        elif kind == "connect":
            ends = (
                [self._site(first), self._site(second)]
                if by_site
                else [self._end(name, first, data[:3], 1), self._end(name, second, data[3:6], 2)]
            )
            bodies = [int(m.site_bodyid[x]) if by_site else int(x) for x in (first, second)]
            axis = self._axis_of_plane_loop(*bodies)
            if axis is None:
                self._model.coincident(name, *ends)
                return
            # Of three rows in the world's axes one would follow from the others, another one wherever the plane turns.
            self._note(
                f"the loop that {source!r:.60} closes is plane: two constraints hold it, in the axes of a body"
            )
            body = self._result.bodies.get(bodies[0], WORLD)
            for number, normal in enumerate(perpendiculars(tuple(axis)), 1):
                self._model.point_in_plane(
                    f"{name}_{number}", ends[1], ends[0], list(map(float, normal)), body
                )
        elif kind == "weld":
            self._weld(name, first, second, data, by_site)
        else:
            self._note(f"the equality {source!r:.60}: the kind {kind!r} is left out")

    def _axis_of_plane_loop(self, first: int, second: int) -> np.ndarray | None:
        """Return the direction, in the first body's axes, about which all joints between two bodies turn; else None."""
        m, mj = self._m, self._mj
        above: list[list[int]] = []
        for b in (first, second):
            above.append([b])
            while above[-1][-1] > 0:
                above[-1].append(int(m.body_parentid[above[-1][-1]]))
        moving = set(above[0]) ^ set(above[1])
        joints = [j for j in range(m.njnt) if int(m.jnt_bodyid[j]) in moving]
        data = mj.MjData(m)
        mj.mj_kinematics(m, data)
        hinges = [j for j in joints if m.jnt_type[j] == mj.mjtJoint.mjJNT_HINGE]
        if not hinges:
            return None
        axis = np.array(data.xaxis[hinges[0]])
        for j in joints:
            if j in hinges:
                off = np.linalg.norm(np.cross(axis, data.xaxis[j]))
            else:
                off = abs(axis @ data.xaxis[j]) if m.jnt_type[j] == mj.mjtJoint.mjJNT_SLIDE else 1.0
            if off > _PARALLEL:
                return None
        return np.array(data.xmat[first]).reshape(3, 3).T @ axis

    def _measures(self, kind: str):
        m = self._m
        if kind == "joint":
            return self._angle, lambda j: m.qpos0[m.jnt_qposadr[j]]
        return (lambda t: self._lengths[t]), lambda t: m.tendon_length0[t]

    def _end(self, name: str, b: int, at: np.ndarray, number: int) -> str:
        point = self._naming.vector(f"{name}_end{number}")
        place = np.array(at) - self._result.shifts.get(b, np.zeros(3))
        self._model.point(point, self._result.bodies.get(b, WORLD), list(map(short, place.tolist())))
        return point

    def _weld(self, name: str, first: int, second: int, data: np.ndarray, by_site: bool) -> None:
        """Three coordinates of a point, and three of the vectors that are parallel in both bodies.

        `data` has the anchor in the second body, the place of the second in the first, and its orientation there.
        """
        if by_site:
            ends = [self._site(first), self._site(second)]
            bodies = [int(self._m.site_bodyid[s]) for s in (first, second)]
            turns = [np.array(self._m.site_quat[s]) for s in (first, second)]
        else:
            place, relative = data[3:6], data[6:10]
            anchor = data[:3]
            ends = [
                self._end(name, first, place + _rotated(relative, anchor), 1),
                self._end(name, second, anchor, 2),
            ]
            bodies, turns = [first, second], [relative, np.array([1.0, 0, 0, 0])]
        self._model.coincident(name, *ends)
        names = [self._result.bodies.get(b, WORLD) for b in bodies]
        axes = [[_rotated(turn, unit) for unit in np.eye(3)] for turn in turns]
        self._model.parallel(f"{name}_z", names, [axes[0][2].tolist(), axes[1][2].tolist()])
        held = []
        for body, directions, which, number in ((names[0], axes[0], 0, 1), (names[1], axes[1], 1, 2)):
            label = self._naming.vector(f"{name}_axis{number}")
            vector = directions[which].tolist()
            if body == WORLD:
                held.append([_number(x) for x in vector])
            else:
                held.append(self._model.axis(label, body, vector))
        self._model.constraint(f"{name}_turn", sum(a * b for a, b in zip(*held, strict=True)))

    # Actuators and sensors

    def _actuators(self) -> None:
        m, mj = self._m, self._mj
        disabled = m.opt.disableflags & int(mj.mjtDisableBit.mjDSBL_ACTUATION)
        for k in range(len(m.actuator_trntype)):
            source = self._named("ACTUATOR", k, f"actuator{k}")
            gain, bias, dynamics, through = (
                kind(table[k]).name.split("_")[1].lower()
                for kind, table in (
                    (mj.mjtGain, m.actuator_gaintype), (mj.mjtBias, m.actuator_biastype),
                    (mj.mjtDyn, m.actuator_dyntype), (mj.mjtTrn, m.actuator_trntype),
                )
            )  # fmt: skip
            why = self._not_taken(k, gain, bias, dynamics)
            if disabled:
                why = "actuation is switched off"
            act = None if why else self._transmission(k, through)
            if act is None:
                self._note(
                    f"actuator {source!r:.60} is left out: {why or f'it acts through a {through} of this kind'}"
                )
                continue
            name = self._naming.name(source)
            control = self._model.input(name)
            self._result.actuators[int(m.actuator_ctrladr[k])] = name
            if m.actuator_ctrllimited[k]:
                control = _within(control, m.actuator_ctrlrange[k])
            if dynamics in _FILTERS:
                rate = control
                activation = self._naming.name(f"{name}_activation")
                self._result.activations[int(m.actuator_actadr[k])] = activation
                if dynamics != "integrator":
                    rate = (control - algebra.Symbol(activation)) / _number(
                        max(m.actuator_dynprm[k][0], 1e-15)
                    )
                self._naming.name(f"{activation}_integral")
                control = self._model.state(activation, rate)
                if m.actuator_actlimited[k]:
                    self._note(f"actuator {source!r:.60}: the limits of its activation are left out")
            length, apply = act
            g, b = np.array(m.actuator_gainprm[k]), np.array(m.actuator_biasprm[k])
            force = self._affine(g, length) * control if gain == "affine" else _number(g[0]) * control
            if bias == "affine":
                force += self._affine(b, length)
            if m.actuator_forcelimited[k]:
                force = _within(force, m.actuator_forcerange[k])
            apply(name, force)

    def _not_taken(self, k: int, gain: str, bias: str, dynamics: str) -> str:
        m = self._m
        if dynamics not in ("none", *_FILTERS):
            return f"it has a state of its own ({dynamics})"
        if gain not in ("fixed", "affine") or bias not in ("none", "affine"):
            return f"its gain is {gain}, its bias {bias}"
        if m.actuator_ctrlnum[k] != 1 or m.actuator_outnum[k] != 1:
            return "it has several controls or outputs"
        if m.actuator_plugin[k] >= 0:
            return "it is a plugin"
        return ""

    def _affine(self, prm: np.ndarray, length: algebra.Expr) -> algebra.Expr:
        result = _number(prm[0])
        if prm[1]:
            result += self._coefficient(prm[1]) * length
        if prm[2]:
            result += self._coefficient(prm[2]) * dot(length)
        return result

    def _coefficient(self, value: float) -> algebra.Expr:
        """A number that carries a unit, which the file does not say: it goes with a constant that fits any."""
        if self._unity is None:
            self._unity = self._model.constant(self._naming.name("one"), 1)
        return _number(value) * self._unity

    def _transmission(self, k: int, through: str):
        """The length of an actuator, and what applies its force; None for one that is not known here."""
        m, gear, target = self._m, np.array(self._m.actuator_gear[k]), int(self._m.actuator_trnid[k][0])
        if through in ("joint", "jointinparent") and self._types[target] in ("revolute", "prismatic"):
            ratio = _number(gear[0])
            forces = self._on_joints.setdefault(target, [])
            return ratio * self._angle(target), lambda _, force: forces.append(ratio * force)
        if through == "tendon" and target in self._lengths:
            ratio, length = _number(gear[0]), self._lengths[target]
            if not m.tendon_actfrclimited[target]:
                return ratio * length, lambda name, force: self._pull(target, name, ratio * force)
            forces = self._on_tendons.setdefault(target, [])
            return ratio * length, lambda _, force: forces.append(ratio * force)
        if through == "site" and m.actuator_trnid[k][1] < 0:
            frame = self._site(target)
            return algebra.ZERO, lambda name, force: self._wrench(name, frame, gear, force)
        return None

    def _apply_forces(self) -> None:
        """Apply what actuators do together on joints, and on tendons that bound that."""
        m = self._m
        for j, forces in self._on_joints.items():
            if m.jnt_actfrclimited[j]:
                forces = [_within(sum(forces, algebra.ZERO), m.jnt_actfrcrange[j])]
            for force in forces:
                self._model.force(self._result.joints[j], force)
        for t, forces in self._on_tendons.items():
            force = _within(sum(forces, algebra.ZERO), m.tendon_actfrcrange[t])
            self._pull(t, self._named("TENDON", t, f"tendon{t}"), force)

    def _pull(self, t: int, name: str, force: algebra.Expr) -> None:
        """A force along a tendon: on joints by their coefficients, at sites along its straight parts."""
        m, divisor, before = self._m, 1.0, None
        label = self._model.definition(self._naming.name(f"{name}_force"), force)
        for w in range(m.tendon_adr[t], m.tendon_adr[t] + m.tendon_num[t]):
            kind, target = self._mj.mjtWrap(m.wrap_type[w]).name, int(m.wrap_objid[w])
            if kind == "mjWRAP_JOINT":
                self._model.force(self._result.joints[target], self._coefficient(m.wrap_prm[w]) * label)
            elif kind == "mjWRAP_PULLEY":
                divisor, before = float(m.wrap_prm[w]), None
            else:
                site = self._site(target)
                if before is not None:
                    here, there = ([algebra.Symbol(f"{s}_{c}") for c in "xyz"] for s in (site, before))
                    apart = [a - b for a, b in zip(here, there, strict=True)]
                    factor = label / (_number(divisor) * algebra.sqrt(sum(x**2 for x in apart)))
                    for at, sign in ((site, 1), (before, -1)):
                        load = self._naming.name(f"{name}_on_{at}")
                        self._model.load(load, point=at, force=[sign * factor * x for x in apart])
                before = site

    def _wrench(self, name: str, frame: str, gear: np.ndarray, force: algebra.Expr) -> None:
        if gear[:3].any():
            self._model.load(
                self._naming.name(f"{name}_at_{frame}"),
                point=frame,
                force=[_number(x) * force for x in gear[:3]],
                frame=frame,
            )
        if gear[3:].any():
            self._model.load(
                self._naming.name(f"{name}_turns_{frame}"),
                body=self._body_of_site(frame),
                torque=[_number(x) * force for x in gear[3:]],
                frame=frame,
            )

    def _body_of_site(self, frame: str) -> str:
        site = next(s for s, name in self._sites.items() if name == frame)
        return self._result.bodies.get(int(self._m.site_bodyid[site]), WORLD)

    def _sensors(self) -> None:
        m, mj = self._m, self._mj
        left: dict[str, int] = {}
        for s in range(m.nsensor):
            kind = mj.mjtSensor(m.sensor_type[s]).name.removeprefix("mjSENS_").lower()
            target = int(m.sensor_objid[s])
            source = self._named("SENSOR", s, f"sensor{s}")
            measured = self._measured(kind, s, target)
            if measured is None:
                left[kind] = left.get(kind, 0) + 1
            for suffix, expression in measured or ():
                self._model.output(self._naming.name(source + suffix), expression)
        for kind, count in left.items():
            self._note(f"{count} sensor{'s' * (count > 1)} of the kind {kind} left out")

    def _measured(self, kind: str, s: int, target: int) -> list[tuple[str, algebra.Expr]] | None:
        """What a sensor says, by ends of its name; None for one that is not known here."""
        m, mj = self._m, self._mj
        if kind in ("jointpos", "jointvel") and self._types[target] in ("revolute", "prismatic"):
            angle = self._angle(target)
            return [("", angle if kind == "jointpos" else dot(angle))]
        if kind in ("tendonpos", "tendonvel") and target in self._lengths:
            return [("", self._lengths[target] if kind == "tendonpos" else dot(self._lengths[target]))]
        if (
            kind in ("framepos", "framelinvel")
            and m.sensor_refid[s] < 0
            and m.sensor_objtype[s] == mj.mjtObj.mjOBJ_SITE
        ):
            place = [algebra.Symbol(f"{self._site(target)}_{c}") for c in "xyz"]
            return [(f"_{c}", x if kind == "framepos" else dot(x)) for c, x in zip("xyz", place, strict=True)]
        return None

    def _left_out(self) -> None:
        m, disable = self._m, self._mj.mjtDisableBit
        if m.ngeom and ((np.array(m.geom_contype) | np.array(m.geom_conaffinity)) != 0).any():
            self._note("contacts are left out: geoms do not touch here")
        if m.opt.density or m.opt.viscosity or np.array(m.opt.wind).any():
            self._note("forces of the medium (density, viscosity, wind) are left out")
        if np.array(m.body_gravcomp).any():
            self._note("gravity compensation (gravcomp) is left out")
        if m.nflex:
            self._note("flexible bodies (flex) are left out")
        if len(self._active) < m.neq:
            self._note(f"{m.neq - len(self._active)} equalities are not active, and left out")
        if np.array(m.jnt_limited).any():
            self._note(
                "limits of joints are recorded when they are crossed; with `restitution` they are stops"
            )
        if m.opt.disableflags & (int(disable.mjDSBL_SPRING) | int(disable.mjDSBL_DAMPER)):
            self._note("springs or dampers are switched off in the file, and act here")


def _number(value: float) -> algebra.Expr:
    """A number as people write it."""
    value = float(value)
    return algebra.Integer(int(value)) if value == int(value) and abs(value) < 1e9 else algebra.Float(value)


def _within(value: algebra.Expr, bounds: np.ndarray) -> algebra.Expr:
    low, high = bounds
    return minimum(maximum(value, _number(low)), _number(high))


def _symbol(value: float | str) -> algebra.Expr:
    return algebra.Symbol(value) if isinstance(value, str) else _number(value)


def _rotated(quaternion: np.ndarray, vector: np.ndarray) -> np.ndarray:
    return _matrix(quaternion) @ vector


def _matrix(quaternion: np.ndarray) -> np.ndarray:
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * skew + 2 * skew @ skew


def roll_pitch_yaw(quaternion: np.ndarray) -> tuple[float, float, float]:
    """Angles of Rz(yaw) Ry(pitch) Rx(roll).

    Near a pitch of a quarter turn roll and yaw are hardly known, but what they make together is: so the others are
    those of the rotation without the roll that was found.
    """
    R = _matrix(quaternion)
    across = float(np.hypot(R[2, 1], R[2, 2]))
    roll = 0.0 if across < 1e-14 else float(np.arctan2(R[2, 1], R[2, 2]))
    c, s = np.cos(roll), np.sin(roll)
    pitch = float(np.arctan2(-R[2, 0], c * R[2, 2] + s * R[2, 1]))
    yaw = float(np.arctan2(s * R[0, 2] - c * R[0, 1], c * R[1, 1] - s * R[1, 2]))
    return tuple(0.0 if abs(x) < _TURN_ROUND_OFF else x for x in (roll, pitch, yaw))


def _origin(at: np.ndarray, quaternion: np.ndarray) -> dict[str, list[float]] | None:
    rpy = roll_pitch_yaw(quaternion)
    found = {}
    if at.any():
        found["xyz"] = list(map(short, at.tolist()))
    if any(rpy):
        found["rpy"] = list(rpy)
    return found or None
