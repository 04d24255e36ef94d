"""A glTF scene of squares, each of which shows one property of materials."""

import base64
import json
import struct
import zlib

SIDE = 0.8  # of a square, m
EYE = (0, 1.4, 4.2)  # of the scene's camera, which looks along -Z
FIELD_OF_VIEW = 0.75  # rad, up and down


def png(*rows):
    """Returns a PNG file of rows of RGBA pixels, from the top."""
    content = b"".join(b"\0" + b"".join(map(bytes, row)) for row in rows)

    def chunk(kind, content):
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 6, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(content)) + chunk(b"IEND", b"")


RED, GREEN, BLUE, SAND = (220, 40, 30, 255), (30, 160, 60, 255), (40, 60, 200, 255), (230, 210, 160, 255)
QUARTERS = png([RED, GREEN], [BLUE, SAND])
HALF_THERE = png([RED, (30, 160, 60, 0)], [BLUE, (230, 210, 160, 0)])
LEANING = png([(210, 128, 200, 255), (46, 128, 200, 255)])
# A player's page stores this image with fewer pixels.
LARGE_SIDE = 1024
LARGE = png(*[[RED] * (LARGE_SIDE // 2) + [BLUE] * (LARGE_SIDE // 2)] * LARGE_SIDE)
ROUGHNESS = png([(255, 40, 255, 255), (255, 255, 0, 255)])

IMAGES = [QUARTERS, HALF_THERE, LEANING, LARGE, ROUGHNESS]
SHARP_CLAMPED, SHARP_REPEATED, SHARP_MIRRORED, SMOOTH = range(4)
SAMPLERS = [{"magFilter": 9728, "minFilter": 9728, "wrapS": wrap, "wrapT": wrap} for wrap in [33071, 10497, 33648]]
SAMPLERS.append({"magFilter": 9729, "minFilter": 9987})
UNLIT = {"KHR_materials_unlit": {}}


def texture(image, sampler, **more):
    return {"index": len(SAMPLERS) * image + sampler, **more}


def transformed(image, sampler, **transform):
    return texture(image, sampler, extensions={"KHR_texture_transform": transform})


def surface(color=None, factor=(1, 1, 1, 1), roughness=0.9, metallic=0, **more):
    finish = {"baseColorFactor": list(factor), "roughnessFactor": roughness, "metallicFactor": metallic}
    if color:
        finish["baseColorTexture"] = color
    return {"pbrMetallicRoughness": finish, **more}


# Name, material, and where the square's centre is: two rows before the camera, all in its sight.
SQUARES = [
    ("colour", surface(texture(0, SHARP_CLAMPED)), (-1.5, 1.9, 0)),
    ("repeated", surface(transformed(0, SHARP_REPEATED, scale=[2, 1], offset=[0.25, 0.5]), extensions=UNLIT), (-0.5, 1.9, 0)),
    ("mirrored", surface(transformed(0, SHARP_MIRRORED, rotation=0.5, scale=[1.5, 1.5], offset=[1.2, 0])), (0.5, 1.9, 0)),
    ("large", surface(texture(3, SMOOTH), extensions=UNLIT), (1.5, 1.9, 0)),
    ("cut", surface(texture(1, SHARP_CLAMPED), alphaMode="MASK", doubleSided=True), (-1.5, 0.9, 0)),
    ("blended", surface(texture(0, SHARP_CLAMPED), (1, 1, 1, 0.5), alphaMode="BLEND", extensions=UNLIT, doubleSided=True), (-0.5, 0.9, 0)),
    ("leaning", surface(normalTexture=texture(2, SHARP_CLAMPED)), (0.5, 0.9, 0)),
    ("shining", surface(None, (0.1, 0.1, 0.1, 1), emissiveFactor=[0.8, 0.6, 0.2], emissiveTexture=texture(0, SHARP_CLAMPED)), (1.5, 0.9, 0)),
    ("polished", {"pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.6, 0.3, 1], "metallicRoughnessTexture": texture(4, SHARP_CLAMPED)}},
     (2.5, 1.9, 0)),
    ("vertices", surface(), (2.5, 0.9, 0)),
    ("turned away", surface(None, (1, 0, 0, 1), extensions=UNLIT), (-2.5, 0.9, 0)),
]
# A light wall, seen through the blended square and through the holes of the cut one.
BEHIND = ("behind", surface(None, (0.9, 0.85, 0.8, 1), extensions=UNLIT), (-1, 0.9, -0.3))


def quarters():
    """Yields the centres of each square's quarters, in the world."""
    for name, _, (x, y, z) in SQUARES:
        for dx in [-SIDE / 4, SIDE / 4]:
            for dy in [-SIDE / 4, SIDE / 4]:
                yield name, (x + dx, y + dy, z)


class Buffer:
    def __init__(self):
        self.bytes = b""
        self.views = []
        self.accessors = []

    def view(self, content):
        self.bytes += b"\0" * (-len(self.bytes) % 4)
        self.views.append({"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(content)})
        self.bytes += content
        return len(self.views) - 1

    def add(self, rows, kind):
        numbers = [number for row in rows for number in row]
        accessor = {"bufferView": self.view(struct.pack(f"<{len(numbers)}f", *numbers)), "componentType": 5126,
                    "count": len(rows), "type": kind}
        if kind == "VEC3":
            accessor |= {"min": [min(c) for c in zip(*rows)], "max": [max(c) for c in zip(*rows)]}
        self.accessors.append(accessor)
        return len(self.accessors) - 1


def add_square(buffer, half, colors=None, is_turned=False):
    corners = [(-half, half, 0), (-half, -half, 0), (half, -half, 0), (half, half, 0)]
    coordinates = [(0, 0), (0, 1), (1, 1), (1, 0)]
    order = [0, 2, 1, 0, 3, 2] if is_turned else [0, 1, 2, 0, 2, 3]
    attributes = {"POSITION": buffer.add([corners[i] for i in order], "VEC3"),
                  "NORMAL": buffer.add([(0, 0, -1 if is_turned else 1)] * 6, "VEC3"),
                  "TEXCOORD_0": buffer.add([coordinates[i] for i in order], "VEC2")}
    if colors:
        attributes["COLOR_0"] = buffer.add([colors[i] for i in order], "VEC4")
    return attributes


def write(file):
    buffer = Buffer()
    nodes = [{"name": "camera", "translation": list(EYE), "camera": 0},
             {"name": "lamp", "translation": [1, 2.2, 2.5], "extensions": {"KHR_lights_punctual": {"light": 0}}},
             {"name": "sun", "rotation": [-0.45, 0.3, 0.15, 0.83], "extensions": {"KHR_lights_punctual": {"light": 1}}},
             {"name": "ball", "translation": [-2.4, 2.1, 0], "extensions": {"KHR_physics_rigid_bodies": {
                 "motion": {"mass": 1}, "collider": {"geometry": {"shape": 0}}}}}]
    meshes, materials = [], []
    for name, material, place in [*SQUARES, BEHIND]:
        colors = [(0.9, 0.1, 0.1, 1), (0.1, 0.2, 0.9, 1), (0.1, 0.2, 0.9, 1), (0.9, 0.1, 0.1, 1)] if name == "vertices" else None
        attributes = add_square(buffer, 1.1 if name == "behind" else SIDE / 2, colors, name == "turned away")
        meshes.append({"primitives": [{"attributes": attributes, "material": len(materials)}]})
        materials.append({"name": name, **material})
        nodes.append({"name": name, "mesh": len(meshes) - 1, "translation": list(place)})
        if name == "behind":
            nodes[-1]["scale"] = [1, 0.4, 1]
    images = [{"bufferView": buffer.view(image), "mimeType": "image/png"} for image in IMAGES]
    textures = [{"source": i, "sampler": s} for i in range(len(IMAGES)) for s in range(len(SAMPLERS))]
    content = base64.b64encode(buffer.bytes).decode()
    extensions = ["KHR_physics_rigid_bodies", "KHR_implicit_shapes", "KHR_lights_punctual", "KHR_materials_unlit", "KHR_texture_transform"]
    file.write_text(json.dumps({
        "asset": {"version": "2.0"}, "extensionsUsed": extensions, "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes))), "extras": {"substep": {"duration": 0.2}}}], "nodes": nodes,
        "cameras": [{"type": "perspective", "perspective": {"aspectRatio": 1.78, "yfov": FIELD_OF_VIEW, "znear": 0.05, "zfar": 100}}],
        "extensions": {"KHR_implicit_shapes": {"shapes": [{"type": "sphere", "sphere": {"radius": 0.1}}]},
                       "KHR_lights_punctual": {"lights": [{"type": "point", "color": [1, 0.6, 0.3], "intensity": 6},
                                                          {"type": "directional", "intensity": 2}]}},
        "materials": materials, "meshes": meshes, "images": images, "textures": textures, "samplers": SAMPLERS,
        "accessors": buffer.accessors, "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.bytes), "uri": "data:application/octet-stream;base64," + content}]}))
