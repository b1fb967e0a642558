"""URDF files as a tree of links and joints: what the file says, checked, and nothing else.

The meaning of elements is that of the specification of URDF (wiki.ros.org/urdf/XML) and of its reference parser,
urdfdom.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from .slips import slips
from .xml_tree import Element, read_xml

Vector = tuple[float, float, float]
ZEROS: Vector = (0.0, 0.0, 0.0)
Color = tuple[float, ...] | None
# The attributes of each, and how many numbers they hold.
_GEOMETRIES = {
    "box": (("size", 3),),
    "cylinder": (("radius", 1), ("length", 1)),
    "capsule": (("radius", 1), ("length", 1)),
    "sphere": (("radius", 1),),
    "mesh": (),
}
MOVING = ("revolute", "continuous", "prismatic", "floating", "planar")


@dataclass(frozen=True)
class Visual:
    """What is drawn of a link.

    Attributes
    ----------
    kind : str
        box, cylinder, sphere, capsule or mesh.
    sizes : tuple of float
        box: edges; cylinder and capsule: radius, length; sphere: radius; mesh: scale along x, y, z [m].
    xyz, rpy : tuple of 3 floats
        Its frame in the link's [m], [rad].
    color : tuple of 4 floats, or None
        Red, green, blue, opacity, 0 to 1.
    mesh : str
        The name of its file.
    place : Element
    """

    kind: str
    sizes: tuple[float, ...]
    xyz: Vector
    rpy: Vector
    color: tuple[float, ...] | None
    mesh: str
    place: Element


@dataclass(frozen=True)
class Link:
    """A rigid body.

    Attributes
    ----------
    name : str
    mass : float
        [kg]; 0 for a frame without a body.
    com, rpy : tuple of 3 floats
        The frame of the inertia in that of the link [m], [rad].
    inertia : tuple of 6 floats
        Ixx, Iyy, Izz, Ixy, Ixz, Iyz about the centre of mass, in axes of the inertial frame [kg m^2].
    visuals : tuple of Visual
    place : Element
        Where it stands in the file.
    """

    name: str
    mass: float
    com: Vector
    rpy: Vector
    inertia: tuple[float, ...]
    visuals: tuple[Visual, ...]
    place: Element


@dataclass(frozen=True)
class RobotJoint:
    """A joint.

    Attributes
    ----------
    name, type, parent, child : str
        The type is URDF's.
    xyz, rpy : tuple of 3 floats
        The joint's frame in the parent's [m], [rad].
    axis : tuple of 3 floats
    limits : tuple of 2 floats, or empty
        [rad] or [m].
    effort : float
        Largest force of its motor [N m] or [N]; 0 where none is given.
    damping, friction : float
        Viscous [N m s] or [N s/m]; dry [N m] or [N].
    armature : float
        Inertia of its rotor behind the gear [kg m^2].
    mimic : tuple of (str, float, float), or None
        Of which joint it follows the coordinate: name, multiplier, offset.
    place : Element
    """

    name: str
    type: str
    parent: str
    child: str
    xyz: Vector
    rpy: Vector
    axis: Vector
    limits: tuple[float, ...]
    effort: float
    damping: float
    friction: float
    armature: float
    mimic: tuple[str, float, float] | None
    place: Element


@dataclass(frozen=True)
class Robot:
    """Links and joints, parents before children.

    Attributes
    ----------
    name : str
    root : Link
    links : dict of str to Link
    joints : tuple of RobotJoint
        In the order of a walk through the tree, children in the order of the file.
    file : str
    slips : tuple of str
        What the file says in words that are read over, and look like a slip.
    """

    name: str
    root: Link
    links: dict[str, Link]
    joints: tuple[RobotJoint, ...]
    file: str
    slips: tuple[str, ...]


def read_urdf(path: str | Path) -> Robot:
    """Read a URDF file.

    Raises
    ------
    ModelError
        Names the file, the line and the element.
    """
    return robot_of(read_xml(Path(path)))


def robot_of(root: Element) -> Robot:
    """Return the robot that a `<robot>` element describes."""
    if root.tag != "robot":
        hint = "MJCF (<mujoco>) and SDF (<sdf>) are not read" if root.tag in ("mujoco", "sdf") else None
        raise root.error("a URDF file begins with <robot>", hint)
    for child in root.children:
        if child.tag.startswith("xacro:"):
            raise child.error(
                "this is a xacro file, a program that makes a URDF", "expand it with xacro first"
            )
    colors = {element.text("name", ""): _color(element) for element in root.all("material")}
    links = _named([_link(element, colors) for element in root.all("link")])
    if not links:
        raise root.error("the robot has no <link>")
    rotors = _rotors(root)
    joints = _named([_joint(element, rotors) for element in root.all("joint")])
    _check_ends(links, joints)
    first = _root(root, links, joints)
    in_order = _in_order(first, links, joints)
    return Robot(root.text("name", "robot"), first, links, in_order, root.file, tuple(slips(root)))


def _named(items: list) -> dict:
    """Links or joints by name."""
    found: dict[str, Link | RobotJoint] = {}
    for item in items:
        if item.name in found:
            first = found[item.name].place.line
            raise item.place.error(f"the name is taken by another one in line {first}")
        found[item.name] = item
    return found


def _link(element: Element, colors: dict[str, Color]) -> Link:
    name, inertial = element.text("name"), element.one("inertial")
    visuals = tuple(_visual(visual, colors) for visual in element.all("visual"))
    if inertial is None:
        return Link(name, 0.0, ZEROS, ZEROS, (0.0,) * 6, visuals, element)
    com, rpy = _origin(inertial)
    mass = inertial.needed("mass").number("value")
    if mass < 0:
        raise inertial.needed("mass").error(f"the link {name[:60]!r} has a negative mass, {mass:g} kg")
    tensor = inertial.one("inertia")
    keys = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    inertia = (0.0,) * 6 if tensor is None else tuple(tensor.number(key, 0.0) for key in keys)
    return Link(name, mass, com, rpy, inertia, visuals, element)


def _visual(element: Element, colors: dict[str, Color]) -> Visual:
    (xyz, rpy), geometry = _origin(element), element.needed("geometry")
    if len(geometry.children) != 1 or geometry.children[0].tag not in _GEOMETRIES:
        known = ", ".join(_GEOMETRIES)
        raise geometry.error(f"one geometry is expected here, of {known}")
    shape, material = geometry.children[0], element.one("material")
    color = None
    if material is not None:
        color = _color(material) or colors.get(material.text("name", ""))
    if shape.tag == "mesh":
        scale = shape.numbers("scale", 3, (1.0, 1.0, 1.0))
        if not all(scale):
            raise shape.error("a scale of the mesh is zero")
        return Visual("mesh", scale, xyz, rpy, color, shape.text("filename"), shape)
    sizes = tuple(x for key, count in _GEOMETRIES[shape.tag] for x in shape.numbers(key, count))
    if min(sizes) < 0:
        raise shape.error(f"a size is negative: {min(sizes):g} m")
    return Visual(shape.tag, sizes, xyz, rpy, color, "", shape)


def _color(material: Element) -> Color:
    color = material.one("color")
    if color is None:
        return None
    return tuple(min(max(x, 0.0), 1.0) for x in color.numbers("rgba", 4))


def _origin(element: Element) -> tuple[Vector, Vector]:
    origin = element.one("origin")
    if origin is None:
        return ZEROS, ZEROS
    return origin.numbers("xyz", 3, ZEROS), origin.numbers("rpy", 3, ZEROS)


def _joint(element: Element, rotors: dict[str, float]) -> RobotJoint:
    name, kind = element.text("name"), element.text("type")
    if kind not in (*MOVING, "fixed"):
        known = ", ".join((*MOVING, "fixed"))
        raise element.error(f"{kind[:40]!r} is not a type of joint", f"types: {known}")
    xyz, rpy = _origin(element)
    ends = [element.needed(end).text("link") for end in ("parent", "child")]
    axis, limit, dynamics = element.one("axis"), element.one("limit"), element.one("dynamics")
    direction = (1.0, 0.0, 0.0) if axis is None else axis.numbers("xyz", 3, (1.0, 0.0, 0.0))
    if kind not in ("fixed", "floating") and not any(direction):
        raise axis.error(f"the axis of the joint {name[:60]!r} has no direction: it is zero")
    damping = friction = 0.0
    if dynamics is not None:
        damping, friction = (dynamics.number(key, 0.0) for key in ("damping", "friction"))
    for key, value in (("damping", damping), ("friction", friction)):
        if value < 0:
            raise dynamics.error(f"the {key} of the joint {name[:60]!r} is negative, {value:g}")
    return RobotJoint(
        name, kind, *ends, xyz, rpy, direction, _limits(element, kind, limit),
        0.0 if limit is None else limit.number("effort", 0.0), damping, friction, rotors.get(name, 0.0),
        _mimic(element), element,
    )  # fmt: skip


def _limits(joint: Element, kind: str, limit: Element | None) -> tuple[float, ...]:
    """Lower and upper; empty where there are none: many files say 0 and 0 for that."""
    if limit is None or kind not in ("revolute", "prismatic"):
        return ()
    lower, upper = limit.number("lower", 0.0), limit.number("upper", 0.0)
    if lower > upper:
        raise limit.error(
            f"of {joint.text('name')[:60]!r}: the lower limit {lower:g} is above the upper one {upper:g}"
        )
    return () if lower == upper == 0 else (lower, upper)


def _mimic(joint: Element) -> tuple[str, float, float] | None:
    mimic = joint.one("mimic")
    if mimic is None or joint.text("type") == "fixed":
        return None
    return mimic.text("joint"), mimic.number("multiplier", 1.0), mimic.number("offset", 0.0)


def _rotors(root: Element) -> dict[str, float]:
    """Inertias of rotors behind their gears, by joint, as Drake writes them into the actuators of transmissions."""
    found = {}
    for transmission in root.all("transmission"):
        for actuator in transmission.all("actuator"):
            inertia, ratio = actuator.one("drake:rotor_inertia"), actuator.one("drake:gear_ratio")
            if inertia is not None:
                gear = 1.0 if ratio is None else ratio.number("value")
                for joint in transmission.all("joint"):
                    found[joint.text("name")] = inertia.number("value") * gear * gear
    return found


def _check_ends(links: dict[str, Link], joints: dict[str, RobotJoint]) -> None:
    parents: dict[str, RobotJoint] = {}
    for joint in joints.values():
        for end, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in links:
                raise joint.place.error(f"its {end}, the link {link[:60]!r}, is not in the file")
        if joint.child in parents:
            other = parents[joint.child]
            raise joint.place.error(
                f"the link {joint.child[:60]!r} is the child of the joint {other.name[:60]!r} already",
                "a link has one parent; close loops with constraints",
            )
        parents[joint.child] = joint
        if joint.mimic is not None:
            followed = joints.get(joint.mimic[0])
            if followed is None:
                raise joint.place.error(f"it mimics {joint.mimic[0][:60]!r}, which is no joint of this file")
            if followed is joint:
                raise joint.place.error("it mimics itself")
            for one in (joint, followed):
                if one.type not in ("revolute", "continuous", "prismatic"):
                    raise joint.place.error(
                        f"mimic couples single coordinates, and {one.name[:60]!r} is {one.type}"
                    )


def _root(place: Element, links: dict[str, Link], joints: dict[str, RobotJoint]) -> Link:
    """The link that is nobody's child."""
    children = {joint.child for joint in joints.values()}
    roots = [link for name, link in links.items() if name not in children]
    if not roots:
        raise place.error("every link is the child of a joint: the joints form a circle")
    if len(roots) > 1:
        shown = ", ".join(repr(link.name[:40]) for link in roots[:4])
        raise roots[1].place.error(
            f"the robot has {len(roots)} roots, links that no joint places: {shown}",
            "join them with a joint of type fixed, or take the loose ones out",
        )
    return roots[0]


def _in_order(root: Link, links: dict[str, Link], joints: dict[str, RobotJoint]) -> tuple[RobotJoint, ...]:
    below: dict[str, list[RobotJoint]] = {}
    for joint in joints.values():
        below.setdefault(joint.parent, []).append(joint)
    found, pending = [], list(reversed(below.get(root.name, [])))
    while pending:
        joint = pending.pop()
        found.append(joint)
        pending += reversed(below.get(joint.child, []))
    if len(found) < len(joints):
        lost = next(joint for joint in joints.values() if joint not in found)
        raise lost.place.error(f"the joints above the link {lost.child[:60]!r} form a circle")
    return tuple(found)
