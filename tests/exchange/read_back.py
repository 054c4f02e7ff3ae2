"""Reads exported trees with the tools they are meant for and holds them against the skeleton in JSON."""

import json
import math
import sys
from pathlib import Path

import mujoco
import numpy as np
import trimesh
import yourdfpy
from pxr import Usd, UsdGeom, UsdPhysics

TOLERANCE = 1e-6


def rotate(q, v):
    """Rotates v by the quaternion (x, y, z, w)."""
    u, w = np.array(q[:3]), q[3]
    return v + 2 * np.cross(u, np.cross(u, v) + w * v)


def from_skeleton(path, density):
    """The truth: radii, tips and mass of capsules, by their closed form."""
    segments = json.loads(path.read_text())["segments"]
    radii = np.array([s["radius"] for s in segments])
    lengths = np.array([s["length"] for s in segments])
    up = np.array([0.0, 0.0, 1.0])
    tips = [np.array(s["p_base_world"]) + rotate(s["r_world_segment"], up * s["length"]) for s in segments]
    volume = np.sum(math.pi * radii**2 * lengths + 4 / 3 * math.pi * radii**3)
    return radii, np.array(tips), density * volume


def from_mjcf(path):
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    bodies = [i for i in range(model.nbody) if model.body(i).name.startswith("link")]
    bodies.sort(key=lambda i: int(model.body(i).name[4:]))
    geoms = [g for i in bodies for g in range(model.body_geomadr[i], model.body_geomadr[i] + model.body_geomnum[i])]
    assert all(model.geom_type[geoms] == mujoco.mjtGeom.mjGEOM_CAPSULE)
    half = model.geom_size[geoms, 1][:, None]
    axes = data.geom_xmat[geoms].reshape(-1, 3, 3)[:, :, 2]
    return model.geom_size[geoms, 0], data.geom_xpos[geoms] + half * axes, model.body_mass[bodies].sum()


def from_urdf(path):
    robot = yourdfpy.URDF.load(str(path), load_meshes=False, build_scene_graph=True)
    links = {name: link for name, link in robot.link_map.items() if link.inertial is not None}
    names = sorted(links, key=lambda name: int(name[4:]))
    radii, tips = [], []
    for name in names:
        cylinder = links[name].visuals[0].geometry.cylinder
        radii.append(cylinder.radius)
        tips.append((robot.get_transform(name, "ground") @ [0, 0, cylinder.length, 1])[:3])
    return np.array(radii), np.array(tips), sum(links[name].inertial.mass for name in names)


def from_usd(path):
    stage = Usd.Stage.Open(str(path))
    assert UsdGeom.GetStageUpAxis(stage) == "Z" and UsdGeom.GetStageMetersPerUnit(stage) == 1
    links = [p for p in stage.GetDefaultPrim().GetChildren() if p.HasAPI(UsdPhysics.RigidBodyAPI)]
    radii, tips, mass, cache = [], [], 0.0, UsdGeom.XformCache()
    for link in links:
        capsule = UsdGeom.Capsule(link.GetChild("wood"))
        x_world = cache.GetLocalToWorldTransform(capsule.GetPrim())
        radii.append(capsule.GetRadiusAttr().Get())
        tips.append(x_world.Transform((0, 0, 0.5 * capsule.GetHeightAttr().Get())))
        mass += UsdPhysics.MassAPI(link).GetMassAttr().Get()
    joints = [UsdPhysics.Joint(p) for p in stage.Traverse() if p.IsA(UsdPhysics.Joint)]
    assert len(joints) == len(links)
    for joint in joints:
        # On the unloaded tree both frames of a joint are one.
        bodies = [joint.GetBody0Rel().GetTargets(), joint.GetBody1Rel().GetTargets()]
        frames = [joint.GetLocalPos0Attr().Get(), joint.GetLocalPos1Attr().Get()]
        ends = [
            np.array(cache.GetLocalToWorldTransform(stage.GetPrimAtPath(to[0])).Transform(p) if to else p)
            for to, p in zip(bodies, frames)
        ]
        assert np.abs(ends[0] - ends[1]).max() < TOLERANCE, joint.GetPath()
    return np.array(radii), np.array([list(tip) for tip in tips]), mass


def from_gltf(path):
    scene = trimesh.load(str(path))
    names = sorted((n for n in scene.graph.nodes if n.startswith("link")), key=lambda n: int(n[4:]))
    # y is up in glTF.
    z_up = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    radii, tips, mass = [], [], 0.0
    for name in names:
        x_world, mesh = scene.graph[name]
        points = scene.geometry[mesh].vertices
        x_world = z_up @ x_world
        placed = trimesh.transform_points(points, x_world)
        tip = trimesh.transform_points([[0, 0, 1]], x_world)[0]
        rim = placed[(points[:, 2] > 0.5) & (np.hypot(points[:, 0], points[:, 1]) > 0.5)]
        radii.append(np.linalg.norm(rim - tip, axis=1).mean())
        tips.append(tip)
        mass += extras(scene, name)["mass"]
    return np.array(radii), np.array(tips), mass


def extras(scene, name):
    """What a node carries beside its shape: on the edge to it."""
    parent = scene.graph.transforms.parents[name]
    return scene.graph.transforms.edge_data[(parent, name)]["metadata"]


def main(cases):
    readers = {"xml": from_mjcf, "urdf": from_urdf, "usda": from_usd, "glb": from_gltf}
    failed = False
    for case in map(Path, cases):
        told = json.loads(case.read_text())
        stem = case.parent / told["name"]
        radii, tips, mass = from_skeleton(Path(f"{stem}.json"), told["density"])
        for ending, read in readers.items():
            found_radii, found_tips, found_mass = read(Path(f"{stem}.{ending}"))
            problems = []
            if len(found_radii) != len(radii):
                problems.append(f"{len(found_radii)} segments, not {len(radii)}")
            else:
                gaps = {
                    "radius [m]": np.abs(found_radii - radii).max(),
                    "tip [m]": np.abs(found_tips - tips).max(),
                    "height [m]": abs(found_tips[:, 2].max() - tips[:, 2].max()),
                    "mass, relative": abs(found_mass / mass - 1),
                }
                problems += [f"{what} off by {gap:.1e}" for what, gap in gaps.items() if not gap <= TOLERANCE]
            largest = "; ".join(problems) or ", ".join(f"{what} {gap:.0e}" for what, gap in gaps.items())
            print(f"{'FAIL' if problems else 'pass'}  {told['name']}.{ending}: {len(found_radii)} segments; {largest}")
            failed |= bool(problems)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
