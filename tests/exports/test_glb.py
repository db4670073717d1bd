"""GLB: positions at keys and between them, checked by another reader and by Khronos' validator."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from foldyn.exports import glb

pygltflib = pytest.importorskip("pygltflib")
VALIDATE = """
const validator = require("gltf-validator");
const bytes = new Uint8Array(require("fs").readFileSync(process.argv[1]));
validator.validateBytes(bytes).then((report) => console.log(JSON.stringify(report.issues)));
"""
KINDS = {5126: np.float32, 5125: np.uint32}


class Scene:
    """A file as another program reads it: arrays, and positions at a time."""

    def __init__(self, path: Path) -> None:
        self.file = pygltflib.GLTF2.load_binary(str(path))
        self.mesh = self.file.meshes[0]
        self.panels, *self.lines = self.mesh.primitives

    def array(self, number: int) -> np.ndarray:
        about = self.file.accessors[number]
        view = self.file.bufferViews[about.bufferView]
        raw = self.file.binary_blob()[view.byteOffset : view.byteOffset + view.byteLength]
        values = np.frombuffer(raw, KINDS[about.componentType])
        return values.reshape(-1, 3) if about.type == "VEC3" else values

    @property
    def targets(self) -> np.ndarray:
        return np.stack([self.array(each["POSITION"]) for each in self.panels.targets])

    def at(self, time: float, animation: int = 0) -> np.ndarray:
        """Positions (n, 3) with z up."""
        (sampler,) = self.file.animations[animation].samplers
        assert sampler.interpolation == "LINEAR"
        times = self.array(sampler.input)
        weights = self.array(sampler.output).reshape(len(times), -1)
        now = [np.interp(time, times, column) for column in weights.T]
        return self.array(self.panels.attributes.POSITION) + np.tensordot(now, self.targets, 1)


def exported(result, tmp_path, **options) -> Scene:
    (file,) = fd.export(result, tmp_path / "x.glb", **options)
    return Scene(file)


def test_positions_at_the_keys_are_those_of_the_result(motion, tmp_path):
    scene = exported(motion, tmp_path)
    x = motion["rest_position"].values + motion["displacement"].values
    for time, positions in zip(motion["time"].values, x, strict=True):
        np.testing.assert_allclose(scene.at(time - 0.5), positions, atol=1e-6)
    np.testing.assert_allclose(scene.at(0.125), 0.5 * (x[0] + x[1]), atol=1e-6)
    assert scene.mesh.extras["targetNames"][1] == "t = 0.75 s"


def test_a_folding_goes_its_way_in_even_steps(folding, tmp_path):
    way = folding
    scene = exported(way, tmp_path, seconds=4.0)
    for time, positions in enumerate(way["position"].values):
        np.testing.assert_allclose(scene.at(float(time)), positions, atol=1e-6)


def test_the_sheet_stands_upright(motion, tmp_path):
    """The format's y axis points up, ours is z."""
    x, y, z, w = exported(motion, tmp_path).file.nodes[0].rotation
    up = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    np.testing.assert_allclose(up, [0, 1, 0], atol=1e-12)


def test_panels_are_the_triangles_and_lines_the_creases_in_their_colors(motion, case, tmp_path):
    scene = exported(motion, tmp_path)
    triangles = scene.array(scene.panels.indices).reshape(-1, 3)
    np.testing.assert_array_equal(triangles, case.structure.triangles)
    materials = scene.file.materials
    assert materials[scene.panels.material].doubleSided
    assert scene.panels.attributes.NORMAL is None  # shaded flat
    pattern = case.structure.pattern
    found = {
        materials[line.material].name: {
            tuple(sorted(pair)) for pair in scene.array(line.indices).reshape(-1, 2).tolist()
        }
        for line in scene.lines
    }
    for letter, name in (("M", "mountain"), ("V", "valley")):
        rows = np.array(pattern.assignments) == letter
        assert found[name] == set(map(tuple, pattern.creases[rows].tolist()))
    assert found["boundary"] == set(map(tuple, pattern.boundary.tolist()))
    assert set(found) == {"mountain", "valley", "boundary"}
    mountain = next(m for m in materials if m.name == "mountain").pbrMetallicRoughness
    light = (np.array([0xD5, 0x5E, 0x00]) / 255) ** 2.2
    np.testing.assert_allclose(mountain.baseColorFactor[:3], light, atol=0.01)


def test_every_so_many_keys_larger_and_slower(motion, tmp_path):
    scene = exported(motion, tmp_path, frames=3, scale=2.0, seconds=10.0)
    u = motion["displacement"].values
    np.testing.assert_allclose(scene.targets, 2.0 * u[[0, 3, 6]], atol=1e-6)
    np.testing.assert_allclose(scene.array(scene.file.animations[0].samplers[0].input), [0, 5, 10])
    assert len(exported(motion, tmp_path, every=4).targets) == 3


def test_no_more_keys_than_others_can_play(motion, tmp_path, monkeypatch):
    monkeypatch.setattr(glb, "MOST_KEYS", 4)
    assert len(exported(motion, tmp_path).targets) == 4
    assert len(exported(motion, tmp_path, every=1).targets) == 7


def test_a_path_goes_on_where_its_load_falls(path, tmp_path):
    scene = exported(path, tmp_path)
    times = scene.array(scene.file.animations[0].samplers[0].input)
    assert (np.diff(times) > 0.0).all() and times[-1] == glb.PATH_SECONDS
    x = path["rest_position"].values + path["displacement"].values[3]
    np.testing.assert_allclose(scene.at(times[3]), x, atol=1e-6)
    assert scene.mesh.extras["targetNames"][3] == "load factor 0.8"


def test_modes_swing_one_after_the_other(modes, tmp_path):
    scene = exported(modes, tmp_path)
    assert len(scene.file.animations) == modes.sizes["mode"]
    rest = modes["rest_position"].values
    size = fd.case_of(modes).structure.pattern.size
    for k, shape in enumerate(modes["shape"].values):
        largest = np.linalg.norm(shape, axis=1).max()
        swing = 0.12 * size / largest * shape
        quarter = glb.SWING_SECONDS / 4
        np.testing.assert_allclose(scene.at(quarter, k), rest + swing, atol=1e-6)
        np.testing.assert_allclose(scene.at(3 * quarter, k), rest - swing, atol=1e-6)
        np.testing.assert_allclose(scene.at(4 * quarter, k), rest, atol=1e-6)
        assert scene.file.animations[k].name.startswith(f"mode {k + 1}: ")


@pytest.mark.parametrize("name", ["motion", "path", "modes"])
def test_weights_are_such_as_blender_takes(name, request, tmp_path):
    """It cuts them off below 0 and above 1."""
    scene = exported(request.getfixturevalue(name), tmp_path)
    for animation in scene.file.animations:
        weights = scene.array(animation.samplers[0].output)
        assert weights.min() == 0.0 and weights.max() == pytest.approx(1.0)


@pytest.fixture(scope="module")
def node() -> str:
    """Node with the npm package gltf-validator, where NODE_PATH says."""
    program = shutil.which("node")
    find = [program or "", "-e", "require.resolve('gltf-validator')"]
    if program is None or subprocess.run(find, capture_output=True, check=False).returncode:
        pytest.skip("needs node and gltf-validator")
    return program


@pytest.mark.parametrize("name", ["motion", "path", "modes", "shell_motion"])
def test_the_validator_finds_nothing(name, node, request, tmp_path):
    (file,) = fd.export(request.getfixturevalue(name), tmp_path / "x.glb")
    command = [node, "-e", VALIDATE, str(file)]
    told = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    assert json.loads(told.stdout)["messages"] == []


def test_one_sample_stands_still(motion, tmp_path):
    scene = exported(motion.isel(time=slice(3, 4)), tmp_path, seconds=2.0)
    x = motion["rest_position"].values + motion["displacement"].values[3]
    np.testing.assert_allclose(scene.at(0.0), x, atol=1e-6)
