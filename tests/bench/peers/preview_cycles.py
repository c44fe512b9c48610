"""Runs inside Blender: blender -b --factory-startup -P preview_cycles.py -- WEFT FOLDER

A ball of radius 50 under one point light, seen by an orthographic camera: Cycles against "weft preview".  Both
pictures are linear; the strength of Cycles' lamp follows from a Lambertian ball of both, once.
"""
import subprocess
import sys

import bpy
import numpy as np

WEFT, FOLDER = sys.argv[-2:]
SIDE, RADIUS, SHARE = 512, 50.0, 0.92  # the share of the picture's side that weft's ball takes
LIGHT = (-150.0, 200.0, 300.0)


def make_scene():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = 1
    scene.cycles.use_denoising = False
    scene.cycles.light_sampling_threshold = 0  # no light is left out by chance
    scene.cycles.blur_glossy = 0
    scene.cycles.max_bounces = 0
    scene.cycles.pixel_filter_type = "BOX"
    scene.cycles.filter_width = 0.01  # at the middles of the pixels
    scene.render.resolution_x = scene.render.resolution_y = SIDE
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.view_settings.view_transform = "Raw"
    scene.world = bpy.data.worlds.new("black")
    scene.world.color = (0, 0, 0)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=1024, ring_count=512, radius=RADIUS)
    bpy.ops.object.shade_smooth()
    ball = bpy.context.object
    bpy.ops.object.camera_add(location=(0, 0, 500))
    camera = bpy.context.object
    camera.data.type = "ORTHO"
    camera.data.ortho_scale = 2 * RADIUS / SHARE
    camera.data.clip_end = 1000
    scene.camera = camera
    bpy.ops.object.light_add(type="POINT", location=LIGHT)
    lamp = bpy.context.object
    lamp.data.shadow_soft_size = 0
    return scene, ball, lamp


def set_material(ball, kind, alpha):
    material = bpy.data.materials.new(kind)
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    out = nodes.new("ShaderNodeOutputMaterial")
    if kind == "lambert":
        node = nodes.new("ShaderNodeBsdfDiffuse")
        node.inputs["Roughness"].default_value = 0
    else:
        node = nodes.new("ShaderNodeBsdfGlossy")
        node.distribution = kind.upper()
        node.inputs["Roughness"].default_value = alpha ** 0.5
    node.inputs["Color"].default_value = (1, 1, 1, 1)
    material.node_tree.links.new(node.outputs[0], out.inputs["Surface"])
    ball.data.materials.clear()
    ball.data.materials.append(material)


def load(path):
    image = bpy.data.images.load(path)
    image.colorspace_settings.name = "Raw" if "Raw" in image.colorspace_settings.bl_rna.properties["name"].enum_items else "Linear"
    pixels = np.empty(SIDE * SIDE * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(SIDE, SIDE, 4)[:, :, 1].astype(float)


def cycles(scene, ball, kind, alpha):
    set_material(ball, kind, alpha)
    scene.render.filepath = f"{FOLDER}/cycles-{kind}-{alpha}.exr"
    bpy.ops.render.render(write_still=True)
    return load(scene.render.filepath)


def weft(kind, alpha):
    path = f"{FOLDER}/weft-{kind}-{alpha}.exr"
    model = {"lambert": ["lambert", "-p", "albedo=1"], "ggx": ["ggx-specular", "-p", "f0=1"],
             "beckmann": ["beckmann", "-p", "f0=1"]}[kind]
    alphas = [] if kind == "lambert" else ["-p", f"alpha={alpha}"]
    subprocess.run([WEFT, "preview", "-q", "--force", "-o", path, "--shape", "sphere", "--size", f"{SIDE}x{SIDE}",
                    "--ambient", "0", "--background", "0", "--lamp", "mm:" + ",".join(map(str, LIGHT)),
                    "--brdf", *model, *alphas], check=True, stdout=subprocess.DEVNULL)
    return load(path)


def angles():
    """n.v and n.l of every pixel's middle, rows from the bottom as Blender has them; 0 beside the ball."""
    at = (np.arange(SIDE) + 0.5 - SIDE / 2) / (SHARE * SIDE / 2)
    x, y = np.meshgrid(at, at)
    rest = 1 - x * x - y * y
    z = np.sqrt(np.maximum(rest, 0))
    to = np.stack([LIGHT[0] - RADIUS * x, LIGHT[1] - RADIUS * y, LIGHT[2] - RADIUS * z])
    nl = (to[0] * x + to[1] * y + to[2] * z) / np.sqrt((to * to).sum(0))
    return np.where(rest > 0, z, 0), np.where(rest > 0, nl, 0)


def main():
    scene, ball, lamp = make_scene()
    nv, nl = angles()
    inside = (nv > 0.15) & (nl > 0.1)
    lamp.data.energy = 1e6
    gain = np.median(weft("lambert", 0)[inside] / cycles(scene, ball, "lambert", 0)[inside])
    print(f"n.v > 0.15, n.l > 0.1: {inside.sum()} pixels; relative to Cycles {bpy.app.version_string}, of its values above 1e-4")
    print("closure    alpha   mean |d|   99 %     largest   at n.v, n.l")
    worst = 0.0
    for kind, alpha in [("lambert", 0), ("ggx", 0.1), ("ggx", 0.2), ("ggx", 0.4), ("ggx", 0.7), ("ggx", 1.0),
                        ("beckmann", 0.2), ("beckmann", 0.5)]:
        theirs, ours = gain * cycles(scene, ball, kind, alpha), weft(kind, alpha)
        off = np.where(inside & (theirs > 1e-4), np.abs(ours / np.maximum(theirs, 1e-9) - 1), 0)
        place = np.unravel_index(off.argmax(), off.shape)
        seen = off[inside & (theirs > 1e-4)]
        print(f"{kind:9} {alpha:6}   {seen.mean():.2e}  {np.percentile(seen, 99):.2e}  {seen.max():.2e}  "
              f"{nv[place]:.3f}, {nl[place]:.3f}")
        if kind == "ggx":
            worst = max(worst, seen.max())
    print(f"largest difference of GGX: {100 * worst:.2f} %")
    return 0 if worst < 0.01 else 1


sys.exit(main())
