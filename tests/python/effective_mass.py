"""Effective masses by Pinocchio, for cases that come as lines of JSON on standard input.

    python effective_mass.py robots        # where the descriptions of the real robots are, as JSON
    python effective_mass.py < cases       # one line of answers for each case

A case names a URDF file, a link, a point on it, a direction, joint values, the joints that are free, and perhaps a tool. The joint-space inertia and the
Jacobian are Pinocchio's; joints that follow others are taken in here, from the file's own <mimic> elements.
"""

import json
import sys
import xml.etree.ElementTree as ElementTree
from functools import lru_cache
from pathlib import Path

import numpy as np
import pinocchio

ROBOTS = {
    "ur5": "ur_description/urdf/ur5_robot.urdf",
    "ur10": "ur_description/urdf/ur10_robot.urdf",
    "panda": "panda_description/urdf/panda.urdf",
    "xarm7": "xarm_description/urdf/xarm7.urdf",
    "kinova": "kinova_description/robots/kinova.urdf",
    "z1": "z1_description/urdf/z1.urdf",
    "tiago_dual": "tiago_description/robots/tiago_dual.urdf",
    "talos": "talos_data/robots/talos_full_v2.urdf",
}


def robots():
    here = Path(pinocchio.__file__)
    prefix = next(parent for parent in here.parents if parent.name == "cmeel.prefix")
    folder = prefix / "share" / "example-robot-data" / "robots"
    found = {name: str(folder / path) for name, path in ROBOTS.items()}
    missing = [path for path in found.values() if not Path(path).is_file()]
    if missing:
        sys.exit(f"example-robot-data is not installed as expected: {missing}")
    print(json.dumps(found))


@lru_cache(maxsize=None)
def model_of(path):
    return pinocchio.buildModelFromUrdf(path)


@lru_cache(maxsize=None)
def followers_of(path):
    """Joint -> (leading joint, multiplier, offset)."""
    found = {}
    for joint in ElementTree.parse(path).getroot().findall("joint"):
        mimic = joint.find("mimic")
        if mimic is not None and joint.get("type") != "fixed":
            found[joint.get("name")] = (
                mimic.get("joint"), float(mimic.get("multiplier", 1.0)), float(mimic.get("offset", 0.0)),
            )
    return found


def led(name, followers):
    """The joint that leads, with what the follower makes of its value: multiplier, offset."""
    multiplier, offset = 1.0, 0.0
    while name in followers:
        name, factor, shift = followers[name]
        offset += multiplier * shift
        multiplier *= factor
    return name, multiplier, offset


def inverse(matrix):
    """The inverse; of a matrix that has none, Moore and Penrose's."""
    carrying = np.diag(matrix) > 1e-13 * np.diag(matrix).max()
    scale = np.sqrt(np.diag(matrix)[carrying])
    # Scaled, so that a finger's inertia beside an arm's costs no digits.
    scaled = matrix[np.ix_(carrying, carrying)] / np.outer(scale, scale)
    if np.linalg.cond(scaled) > 1e9:
        return np.linalg.pinv(matrix, rcond=1e-11, hermitian=True)
    result = np.zeros_like(matrix)
    result[np.ix_(carrying, carrying)] = np.linalg.inv(scaled) / np.outer(scale, scale)
    return result


def finite(number):
    """A number that JSON knows, or none."""
    return float(number) if np.isfinite(number) else None


def answer(case):
    model = model_of(case["urdf"])
    followers = followers_of(case["urdf"])
    frame = model.getFrameId(case["link"], pinocchio.BODY)
    tool = case.get("tool")
    if tool:
        model = model.copy()
        carrier = model.frames[model.getFrameId(tool["link"], pinocchio.BODY)]
        xx, yy, zz, xy, xz, yz = tool["inertia"]
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        body = pinocchio.Inertia(tool["mass"], np.array(tool["centre"]), inertia)
        model.appendBodyToJoint(carrier.parentJoint, body, carrier.placement)
    data = model.createData()

    free = case["free"]
    values = pinocchio.neutral(model)
    follow = np.zeros((model.nv, len(free)))
    for joint, name in enumerate(model.names):
        if joint == 0:
            continue
        leader, multiplier, offset = led(name, followers)
        value = multiplier * case["joints"][leader] + offset
        first = model.joints[joint].idx_q
        if model.joints[joint].nq == 2:
            values[first:first + 2] = np.cos(value), np.sin(value)
        else:
            values[first] = value
        if leader in free:
            follow[model.joints[joint].idx_v, free.index(leader)] = multiplier

    inertia = np.reshape(pinocchio.crba(model, data, values), (model.nv, model.nv))
    inertia = np.triu(inertia) + np.triu(inertia, 1).T
    inertia = follow.T @ inertia @ follow
    pinocchio.forwardKinematics(model, data, values)
    pinocchio.updateFramePlacements(model, data)
    jacobian = pinocchio.computeFrameJacobian(model, data, values, frame, pinocchio.LOCAL_WORLD_ALIGNED)
    # With one joint it comes as a vector.
    jacobian = np.reshape(jacobian, (6, model.nv))
    arm = data.oMf[frame].rotation @ np.array(case["point"])
    linear = (jacobian[:3] - pinocchio.skew(arm) @ jacobian[3:]) @ follow
    angular = jacobian[3:] @ follow

    direction = np.array(case["direction"])
    direction = direction / np.linalg.norm(direction)
    if case["frame"] == "link":
        direction = data.oMf[frame].rotation @ direction
    whole = np.vstack([linear, angular])
    inverted = inverse(inertia)
    mobility = whole @ inverted @ whole.T
    result = {
        "inertia": inertia.tolist(),
        "point": (data.oMf[frame].translation + arm).tolist(),
        "free": finite(np.divide(1.0, direction @ mobility[:3, :3] @ direction)),
        "moving_mass": float(sum(inertia.mass for inertia in list(model.inertias)[1:])),
    }
    if np.linalg.cond(mobility) < 1e5:
        held = np.linalg.inv(mobility)
        result["held"] = float(direction @ held[:3, :3] @ direction)
        result["held_yielding"] = 1.0 / float(direction @ np.linalg.inv(held[:3, :3]) @ direction)
    return result


if sys.argv[1:] == ["robots"]:
    robots()
else:
    np.seterr(divide="ignore")
    for line in sys.stdin:
        print(json.dumps(answer(json.loads(line))), flush=True)
