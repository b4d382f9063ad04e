"""A glTF 2.0 writer for small levels: one object per line, geometry in a .bin file beside the .gltf."""

import json
import math
import struct

FLOAT, UINT16 = 5126, 5123
ARRAY, ELEMENT_ARRAY = 34962, 34963


def look_along(direction):
    """Quaternion (x, y, z, w) that turns -Z, where cameras and spots look, to `direction`."""
    x, y, z = direction
    length = math.sqrt(x * x + y * y + z * z)
    pitch = math.asin(y / length)
    yaw = math.atan2(-x, -z) if math.hypot(x, z) > 1e-6 else 0.0
    sy, cy, sp, cp = math.sin(yaw / 2), math.cos(yaw / 2), math.sin(pitch / 2), math.cos(pitch / 2)
    return [round(value, 7) + 0.0 for value in (cy * sp, sy * cp, -sy * sp, cy * cp)]


class Gltf:
    def __init__(self, generator, scene_extras):
        self.generator = generator
        self.scene_extras = scene_extras
        self.nodes, self.meshes, self.materials, self.cameras, self.lights = [], [], [], [], []
        self.accessors, self.views = [], []
        self.material_index = {}
        self.buffer = bytearray()

    def node(self, name, extras=None, **fields):
        node = {"name": name, **fields}
        if extras:
            node["extras"] = extras
        self.nodes.append(node)

    def camera(self, name, position, target, vertical_fov_degrees):
        perspective = {"yfov": round(math.radians(vertical_fov_degrees), 6), "znear": 0.05, "zfar": 100}
        self.cameras.append({"name": name, "type": "perspective", "perspective": perspective})
        direction = [t - p for t, p in zip(target, position)]
        self.node(name, camera=len(self.cameras) - 1, translation=position, rotation=look_along(direction))

    def light(self, name, light, extras, **placement):
        self.lights.append({"name": name, **light})
        self.node(name, extras, **placement, extensions={"KHR_lights_punctual": {"light": len(self.lights) - 1}})

    def mesh(self, name, parts, material, extras=None, origin=(0, 0, 0)):
        """A node with one mesh. `parts` are (positions, normals, indices) in world space."""
        positions, normals, indices = [], [], []
        for part_positions, part_normals, part_indices in parts:
            indices += [index + len(positions) for index in part_indices]
            positions += [[round(p - o, 6) for p, o in zip(point, origin)] for point in part_positions]
            normals += part_normals
        primitive = {
            "attributes": {"POSITION": self._vec3(positions, bounds=True), "NORMAL": self._vec3(normals)},
            "indices": self._accessor(struct.pack(f"<{len(indices)}H", *indices), UINT16, "SCALAR", len(indices)),
            "material": self._material(material),
        }
        self.meshes.append({"name": name, "primitives": [primitive]})
        placement = {"translation": list(origin)} if any(origin) else {}
        self.node(name, extras, mesh=len(self.meshes) - 1, **placement)

    def write(self, path, bin_path, node_extras=lambda node: {}, more_nodes=()):
        """`node_extras` gives what a variant of the level adds to a node's extras, `more_nodes` what it has besides."""
        nodes = []
        for node in [*self.nodes, *more_nodes]:
            extras = {**node.get("extras", {}), **node_extras(node)}
            nodes.append({**node, "extras": extras} if extras else node)
        document = {
            "asset": {"version": "2.0", "generator": self.generator},
            "extensionsUsed": [
                "KHR_lights_punctual",
                "KHR_materials_specular",
                "KHR_materials_emissive_strength",
            ],
            "extensions": {"KHR_lights_punctual": {"lights": self.lights}},
            "scene": 0,
            "scenes": [{"nodes": list(range(len(nodes))), "extras": self.scene_extras}],
            "nodes": nodes,
            "cameras": self.cameras,
            "meshes": self.meshes,
            "materials": self.materials,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"uri": bin_path.name, "byteLength": len(self.buffer)}],
        }
        path.write_text(_one_object_per_line(document), encoding="utf-8")
        bin_path.write_bytes(self.buffer)

    def _material(self, material):
        name, color, emission_cd_m2 = material
        if name not in self.material_index:
            self.material_index[name] = len(self.materials)
            entry = {
                "name": name,
                "pbrMetallicRoughness": {"baseColorFactor": [*color, 1], "metallicFactor": 0, "roughnessFactor": 1},
                "extensions": {"KHR_materials_specular": {"specularFactor": 0}},
            }
            if emission_cd_m2:
                strength = max(emission_cd_m2)
                entry["emissiveFactor"] = [round(channel / strength, 6) for channel in emission_cd_m2]
                entry["extensions"]["KHR_materials_emissive_strength"] = {"emissiveStrength": strength}
            self.materials.append(entry)
        return self.material_index[name]

    def _vec3(self, values, bounds=False):
        flat = [component for value in values for component in value]
        extra = {}
        if bounds:
            # The file holds 32-bit floats: state the bounds that a reader will find.
            as_stored = [struct.unpack("<f", struct.pack("<f", component))[0] for component in flat]
            extra = {"min": [min(as_stored[i::3]) for i in range(3)], "max": [max(as_stored[i::3]) for i in range(3)]}
        return self._accessor(struct.pack(f"<{len(flat)}f", *flat), FLOAT, "VEC3", len(values), extra)

    def _accessor(self, data, component, kind, count, extra=None):
        target = ELEMENT_ARRAY if kind == "SCALAR" else ARRAY
        self.views.append(
            {"buffer": 0, "byteOffset": len(self.buffer), "byteLength": len(data), "target": target}
        )
        self.buffer += data + bytes(-len(data) % 4)
        view = len(self.views) - 1
        self.accessors.append(
            {"bufferView": view, "componentType": component, "type": kind, "count": count, **(extra or {})}
        )
        return len(self.accessors) - 1


def _one_object_per_line(document):
    """JSON that a diff can show: lists of objects get one line per object."""
    lines = []
    for key, value in document.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            rows = ",\n".join("  " + json.dumps(row) for row in value)
            lines.append(f' {json.dumps(key)}: [\n{rows}\n ]')
        else:
            lines.append(f" {json.dumps(key)}: {json.dumps(value)}")
    return "{\n" + ",\n".join(lines) + "\n}\n"
