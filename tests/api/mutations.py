"""Documents for comparing a reader with a schema: nearly right ones.

Everything is drawn from a seeded generator, so a run can be repeated. Three
sources: `sweep` puts each of a list of values in every place of one document;
`mutants` makes one to three random edits in a document; `Grammar` writes
documents of its own, mostly right.
"""
import copy
import json
import random

NUMBERS = [
    0, -0.0, 1, -1, 0.5, 0.25, 2, 3, 3.0, 2.5, 4, 16, 16.5, 64, 65, 45, 90,
    179.999, 180, 12, 13, 1e-6, 9.99e-7, 5e-324, 1e6, 1000000.1, -1e6,
    -1000000.1, 1e5, 100000.5, 8192, 8193, 65536, 65537, 4294967295,
    4294967296, 2 ** 53, 1e300, -1e300,
]
STRINGS = [
    "", "a", "A-1_b.c", "-a", "a b", "a\n", "\n", "\u00e4", "\U0001f600",
    "a" * 64, "a" * 65, "#", "#ff8000", "#FF8000", "#ff80", "#ff80000",
    "#gg8000", "#ff8000\n", "# ff800", "sphere", "torus", "sphear", "2",
    "../../etc/passwd", "null", "\u2028", "\t",
]
VALUES = [None, True, False, 0, 1, -1, 2.5, "", "a", [], {}, [0, 0, 0],
          [1, 2, 3], [1, 2], [1, 2, 3, 4], [[0, 1, 2]], {"type": "sphere"},
          {"a": 1}, "#ff8000"]

# Words of the scene document, those that are not built yet among them.
WORDS = [
    "perspective", "orthographic", "thin_lens", "x", "y", "box", "tent",
    "gaussian", "mitchell", "center", "independent", "stratified", "sobol",
    "constant", "gradient", "image", "whitted", "path", "ao", "recursive",
    "mean", "fresnel_weighted", "none", "hard", "soft", "lambert",
    "blinn_phong", "phong", "glazed", "mirror", "dielectric", "emissive",
    "conductor", "principled", "mix", "uv", "world_xz", "world_xyz",
    "object_xy", "checkerboard", "stripes", "rings", "hexagon", "brick",
    "noise", "fbm", "point", "directional", "spot", "area_grid",
    "inverse_square", "exact", "float32", "sphere", "plane", "triangle",
    "quad", "disk", "cylinder", "cone", "capsule", "torus", "mesh", "sdf",
    "group", "instance", "csg", "png", "exr", "jpeg", "beauty", "depth",
    "alpha", "uint8", "uint16", "half", "float", "srgb", "linear",
]
KEYS = [
    "type", "name", "version", "description", "time", "camera", "film",
    "sampler", "integrator", "background", "assets", "textures", "materials",
    "lights", "definitions", "objects", "extras", "eye", "target", "up",
    "fov", "focal_length", "window", "distance", "fov_axis", "height", "near",
    "far", "width", "crop", "filter", "radius", "spp", "seed", "target_error",
    "color", "bottom", "top", "max_bounces", "accumulation", "ambient",
    "shadows", "clamp_local", "fresnel", "bias", "exponent", "inside_hits",
    "ray_offset", "distance", "light_sampling", "diffuse", "emission",
    "specular", "shininess", "mirror", "reflectance", "ior", "mapping",
    "scale", "offset", "color0", "color1", "intensity", "falloff", "position",
    "direction", "to_light", "half_size", "samples", "loop", "material",
    "transform", "visible", "shadow", "reflection", "translate", "rotate",
    "axis", "angle", "matrix", "bounce", "min", "max", "normal", "point",
    "vertices", "normals", "uvs", "origin", "edge_u", "edge_v", "positions",
    "indices", "asset", "smooth", "children", "of", "maxDepth", "colour",
    "Type", "output", "__proto__", "", "a/b", "a~b", "\u00e9",
]

# One of everything that this version renders, small.
EVERYTHING = {
    "version": 1, "name": "everything", "description": "d", "extras": {"a": 1},
    "camera": {"type": "perspective", "eye": [0, 1, 5], "target": [0, 0, 0],
               "up": [0, 1, 0], "fov": 45, "fov_axis": "y"},
    "film": {"width": 64, "height": 48,
             "filter": {"type": "box", "radius": 0.5}},
    "sampler": {"type": "stratified", "spp": 4, "seed": 7},
    "integrator": {"type": "whitted", "max_bounces": 3,
                   "accumulation": "recursive", "ambient": [0.1, 0.1, 0.1],
                   "shadows": "soft", "clamp_local": None,
                   "inside_hits": True, "ray_offset": 0.0001},
    "background": {"type": "gradient", "bottom": [0, 0, 0], "top": "#8080ff"},
    "assets": {},
    "textures": [
        {"name": "check", "type": "checkerboard", "mapping": "world_xyz",
         "scale": [1, 2, 3], "offset": 0, "color0": [0, 0, 0],
         "color1": "#ffffff"},
        {"name": "plain", "type": "constant", "color": [1, 1, 1],
         "mapping": "uv", "scale": 2, "offset": [0, 1]},
    ],
    "materials": [
        {"name": "matt", "type": "lambert", "diffuse": "check",
         "ambient": [1, 1, 1], "emission": [0, 2, 0]},
        {"name": "shiny", "type": "blinn_phong", "diffuse": "#804020",
         "ambient": "plain", "specular": [1, 1, 1], "shininess": 50,
         "mirror": [0.2, 0.2, 0.2], "emission": [0, 0, 0]},
        {"name": "floor", "type": "glazed", "diffuse": [0.5, 0.5, 0.5],
         "mirror": {"type": "constant", "color": [0.3, 0.3, 0.3]}},
        {"name": "glass", "type": "mirror", "reflectance": [0.9, 0.9, 0.9]},
    ],
    "lights": [
        {"name": "p", "type": "point", "position": [0, 5, 0],
         "color": [1, 1, 1], "intensity": 2, "falloff": "inverse_square"},
        {"name": "d", "type": "directional", "to_light": [1, 2, 3]},
        {"name": "e", "type": "directional", "direction": [0, -1, 0]},
        {"name": "g", "type": "area_grid", "position": [1, 5, 0],
         "half_size": 0.5, "samples": 2, "loop": "float32",
         "falloff": "none"},
    ],
    "objects": [
        {"name": "s", "type": "sphere", "center": [0, 0, 0], "radius": 1,
         "material": "matt", "visible": {"camera": True, "shadow": False,
                                         "reflection": True}},
        {"name": "b", "type": "box", "min": [0, 0, 0], "max": [1, 1, 1],
         "material": {"type": "lambert", "diffuse": [1, 0, 0]}},
        {"name": "pl", "type": "plane", "normal": [0, 1, 0], "offset": -1,
         "material": "floor"},
        {"type": "plane", "point": [0, -1, 0]},
        {"name": "t", "type": "triangle",
         "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
         "normals": [[0, 0, 1], [0, 0, 1], [0, 0, 1]],
         "uvs": [[0, 0], [1, 0], [0, 1]]},
        {"name": "q", "type": "quad", "origin": [0, 0, 0],
         "edge_u": [1, 0, 0], "edge_v": [0, 1, 0], "material": "glass"},
        {"name": "m", "type": "mesh",
         "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
         "indices": [[0, 1, 2], [0, 2, 3]],
         "normals": [[0, 0, 1], [0, 0, 1], [0, 0, 1], [1, 0, 0]],
         "uvs": [[0, 0], [1, 0], [0, 1], [1, 1]], "smooth": True},
        {"name": "gr", "type": "group", "material": "shiny",
         "transform": [{"translate": [1, 2, 3]},
                       {"rotate": {"axis": [0, 1, 0], "angle": 30}},
                       {"scale": 2}, {"scale": [1, 2, -1]},
                       {"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0,
                                   0, 0, 0, 1]}],
         "children": [{"name": "c", "type": "sphere"}]},
    ],
}


def places(node, path=()):
    """The path of every value below (and of) a document."""
    yield path
    if isinstance(node, dict):
        for key in node:
            yield from places(node[key], path + (key,))
    elif isinstance(node, list):
        for i, item in enumerate(node):
            yield from places(item, path + (i,))


def at(document, path):
    for step in path:
        document = document[step]
    return document


def put(document, path, value):
    """A copy with another value in one place."""
    if not path:
        return copy.deepcopy(value)
    document = copy.deepcopy(document)
    at(document, path[:-1])[path[-1]] = copy.deepcopy(value)
    return document


def without(document, path):
    document = copy.deepcopy(document)
    del at(document, path[:-1])[path[-1]]
    return document


def likely(value):
    """What is interesting in place of a value of this kind."""
    if isinstance(value, bool):
        return [None, 0, 1, "true", not value]
    if isinstance(value, (int, float)):
        return NUMBERS + [None, True, "1", [1], {}]
    if isinstance(value, str):
        return STRINGS + WORDS + [None, True, 1, [], {}]
    if isinstance(value, list):
        made = [value[:-1], value + value[-1:], value[1:], [value], [],
                value + [None], value[::-1], None, 0, "", {}]
        if len(value) == 3:
            made += [[0, 0, 0], [-0.0, 0, 0], [1e-320, 0, 0], [2, 0, 0],
                     [1e6, 1e6, 1e6], [1e6 + 1, 0, 0], 0.5, "#ff8000"]
        return made
    return [None, [], {}, 0, "", True]


def focus(document, path):
    """The document with only that one of its lights or objects (and one small
    object), and the path in it."""
    small = dict(document)
    for key in ("objects", "lights"):
        if path[:1] == (key,) and len(path) > 1:
            small[key] = [document[key][path[1]]]
            path = (key, 0) + path[2:]
        elif path[:1] != (key,):
            small[key] = [{"type": "sphere"}] if key == "objects" else []
    return small, path


def sweep(document):
    """Every place, and everything likely there; each member removed; each
    object with each member of another kind."""
    for place in places(document):
        small, path = focus(document, place) if place else (document, place)
        value = at(small, path)
        for other in likely(value):
            yield put(small, path, other)
        if path:
            yield without(small, path)
        if isinstance(value, dict):
            for key in KEYS:
                if key not in value:
                    yield put(small, path, {**value, key: 1})


class Editor:
    """Random edits."""

    def __init__(self, seed):
        self.random = random.Random(seed)

    def scalar(self):
        r = self.random
        return r.choice([r.choice(NUMBERS), r.choice(STRINGS),
                         r.choice(WORDS), r.choice(VALUES),
                         round(r.uniform(-2, 2), 3), r.randint(-3, 70)])

    def nested(self):
        value = self.scalar()
        for _ in range(self.random.randint(1, 20)):
            value = [value] if self.random.random() < 0.5 else {"a": value}
        return value

    def edit(self, document):
        r = self.random
        everywhere = list(places(document))
        path = r.choice(everywhere)
        value = at(document, path)
        kind = r.randrange(10)
        if kind == 0 and path:
            return without(document, path)
        if kind == 1 and isinstance(value, dict):
            return put(document, path,
                       {**value, r.choice(KEYS): self.scalar()})
        if kind == 2 and path and isinstance(path[-1], str):
            renamed = without(document, path)
            at(renamed, path[:-1])[r.choice(KEYS)] = copy.deepcopy(value)
            return renamed
        if kind == 3:  # another value of the same document
            return put(document, path, at(document, r.choice(everywhere)))
        if kind == 4 and isinstance(value, list) and value:
            items = list(value)
            r.choice([lambda: items.pop(r.randrange(len(items))),
                      lambda: items.append(r.choice(items)),
                      lambda: r.shuffle(items),
                      items.clear])()
            return put(document, path, items)
        if kind == 5:
            return put(document, path, self.nested())
        if kind == 6 and isinstance(value, dict):
            return put(document, path,
                       dict(r.sample(list(value.items()), len(value))))
        if isinstance(value, (bool, str, int, float)) and kind < 9:
            return put(document, path, r.choice(likely(value)))
        return put(document, path, self.scalar())

    def mutant(self, document):
        for _ in range(self.random.choice([1, 1, 1, 2, 3])):
            document = self.edit(document)
        return document


class Grammar:
    """Scenes of its own. `flaw` is how often a value is not what it should
    be."""

    def __init__(self, seed, flaw=0.01):
        self.random = random.Random(seed)
        self.editor = Editor(seed)
        self.flaw = flaw
        self.named = 0

    def maybe(self, share=0.5):
        return self.random.random() < share

    def flawed(self, value):
        return self.editor.scalar() if self.maybe(self.flaw) else value

    def number(self, low=-10.0, high=10.0):
        r = self.random
        return self.flawed(r.choice([low, high, r.uniform(low, high),
                                     round(r.uniform(low, high), 1),
                                     int(r.uniform(low, high))]))

    def integer(self, low, high):
        return self.flawed(self.random.choice(
            [low, high, self.random.randint(low, high),
             float(self.random.randint(low, high))]))

    def length(self):
        return self.flawed(self.random.choice(
            [1e-6, 1e6, 1, round(self.random.uniform(0.1, 5), 2)]))

    def vec(self, n=3):
        return self.flawed([self.number() for _ in range(n)])

    def direction(self):
        v = [round(self.random.uniform(-1, 1), 2) for _ in range(3)]
        return self.flawed(v if any(v) else [0, 0, 1])

    def word(self, *words):
        return self.flawed(self.random.choice(words))

    def flag(self):
        return self.flawed(self.maybe())

    def name(self, object_):
        self.named += 1
        object_["name"] = self.flawed(f"n{self.named}")

    def color(self, most=1.0):
        if self.maybe(0.3):
            return self.flawed(
                "#" + "".join(self.random.choice("0123456789abcdefABCDEF")
                              for _ in range(6)))
        return self.flawed([self.number(0, most) for _ in range(3)])

    def fill(self, object_, **members):
        """Some of the optional members."""
        for key, make in members.items():
            if self.maybe(0.4):
                object_[key] = make()
        return object_

    def texture(self, most=1.0):
        mapping = self.word("uv", "world_xz", "world_xy", "world_yz",
                            "world_xyz", "object_xz", "object_xyz")
        n = 3 if isinstance(mapping, str) and mapping.endswith("xyz") else 2
        texture = {"type": self.word("checkerboard", "constant"),
                   "mapping": mapping}
        if texture["type"] == "constant":
            texture["color"] = self.color(most)
        per = lambda: self.number() if self.maybe() else self.vec(n)
        return self.fill(texture, scale=per, offset=per,
                         color0=lambda: self.color(most),
                         color1=lambda: self.color(most))

    def paint(self, most=1.0):
        if self.maybe(0.15) and self.textures:
            return self.flawed(self.random.choice(self.textures))
        return self.texture(most) if self.maybe(0.15) else self.color(most)

    def material(self):
        paint = self.paint
        glow = lambda: self.paint(4.0)
        kind = self.word("lambert", "blinn_phong", "glazed", "mirror")
        material = {"type": kind}
        if kind == "mirror":
            return self.fill(material, reflectance=paint)
        self.fill(material, diffuse=paint, ambient=paint, emission=glow)
        if kind == "blinn_phong":
            self.fill(material, specular=paint, mirror=paint,
                      shininess=lambda: self.number(0, 1e5))
        elif kind == "glazed":
            self.fill(material, mirror=paint)
        return material

    def light(self):
        kind = self.word("point", "directional", "area_grid")
        light = {"type": kind}
        self.fill(light, color=self.color,
                  intensity=lambda: self.number(0, 1e6))
        if kind == "directional":
            light[self.word("direction", "to_light") if self.maybe(0.99)
                  else "position"] = self.direction()
            return light
        light["position"] = self.vec()
        self.fill(light, falloff=lambda: self.word("none", "inverse_square"))
        if kind == "area_grid":
            self.fill(light, half_size=self.length,
                      samples=lambda: self.integer(1, 4),
                      loop=lambda: self.word("exact", "float32"))
        return light

    def step(self):
        kind = self.random.choice(["translate", "rotate", "scale", "matrix"])
        if kind == "rotate":
            return {kind: self.flawed({"axis": self.direction(),
                                       "angle": self.number(-360, 360)})}
        if kind == "scale":
            factor = lambda: self.flawed(self.random.choice([0.5, -1, 2, 1e3]))
            return {kind: factor() if self.maybe()
                    else [factor() for _ in range(3)]}
        if kind == "matrix":
            return {kind: [self.flawed(v) for v in
                           [1, 0, 0.5, 2, 0, 1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]]}
        return {kind: self.vec()}

    def object(self, depth=0):
        kinds = ["sphere", "box", "plane", "triangle", "quad", "mesh"]
        kind = self.word(*(kinds + ["group"] if depth < 3 else kinds))
        one = {"type": kind}
        if self.maybe(0.3):
            self.name(one)
        if self.maybe(0.3):
            one["material"] = (self.random.choice(self.materials)
                               if self.materials and self.maybe()
                               else self.material())
        self.fill(one, transform=lambda: [self.step() for _ in range(
            self.random.randint(0, 2))])
        if self.maybe(0.1):
            one["visible"] = self.fill({}, camera=self.flag,
                                       shadow=self.flag, reflection=self.flag)
        getattr(self, f"shape_{kind}", lambda *a: None)(one, depth)
        return one

    def shape_sphere(self, one, _):
        self.fill(one, center=self.vec, radius=self.length)

    def shape_box(self, one, _):
        low = [round(self.random.uniform(-3, 3), 2) for _ in range(3)]
        one["min"] = self.flawed(low)
        one["max"] = self.flawed([v + self.random.choice([1e-3, 1, 2])
                                  for v in low])

    def shape_plane(self, one, _):
        self.fill(one, normal=self.direction)
        if self.maybe(0.7):
            one["offset" if self.maybe() else "point"] = None
            for key in ("offset", "point"):
                if key in one:
                    one[key] = self.number() if key == "offset" else self.vec()

    def shape_triangle(self, one, _):
        one["vertices"] = self.flawed([self.vec() for _ in range(3)])
        self.fill(one, normals=lambda: [self.direction() for _ in range(3)],
                  uvs=lambda: [self.vec(2) for _ in range(3)])

    def shape_quad(self, one, _):
        one["origin"] = self.vec()
        one["edge_u"] = self.direction()
        one["edge_v"] = self.direction()

    def shape_mesh(self, one, _):
        n = self.random.randint(3, 6)
        one["positions"] = [self.vec() for _ in range(n)]
        one["indices"] = [
            self.flawed([self.flawed(self.random.randrange(n))
                         for _ in range(3)]) for _ in range(3)]
        self.fill(one, uvs=lambda: [self.vec(2) for _ in range(n)])
        if self.maybe():
            one["normals"] = [self.direction() for _ in range(n)]
            self.fill(one, smooth=self.flag)

    def shape_group(self, one, depth):
        one["children"] = [self.object(depth + 1) for _ in range(
            self.random.randint(0 if self.maybe(self.flaw) else 1, 3))]

    def camera(self):
        kind = self.word("perspective", "orthographic")
        camera = {"type": kind} if kind != "perspective" or self.maybe() else {}
        if self.maybe():
            camera["eye"] = [self.number() for _ in range(3)]
        self.fill(camera, target=self.vec, up=self.direction)
        window = lambda: [-1, self.number(0, 2), -1, self.number(0, 2)]
        if kind == "orthographic":
            one = self.random.choice(["height", "window", None])
            if one:
                camera[one] = self.length() if one == "height" else window()
            return camera
        one = self.random.choice(["fov", "focal_length", "window", None])
        if one == "fov":
            camera["fov"] = self.number(1, 179)
        elif one == "focal_length":
            camera["focal_length"] = self.length()
        elif one == "window":
            camera["window"] = window()
            self.fill(camera, distance=self.length)
        return self.fill(camera, fov_axis=lambda: self.word("x", "y"))

    def integrator(self):
        one = self.fill(
            {}, type=lambda: self.word("whitted"),
            max_bounces=lambda: self.integer(0, 64),
            accumulation=lambda: self.word("recursive", "mean",
                                           "fresnel_weighted"),
            ambient=lambda: self.color(2.0),
            shadows=lambda: self.word("none", "hard", "soft"),
            clamp_local=lambda: self.word(None, 1, 0.5, 1e6),
            inside_hits=self.flag, ray_offset=lambda: self.number(0, 1))
        if one.get("accumulation") == "fresnel_weighted" and self.maybe():
            one["fresnel"] = self.fill({}, bias=lambda: self.number(0, 1),
                                       exponent=lambda: self.number(0, 16))
        return one

    def sampler(self):
        one = self.fill({}, seed=lambda: self.integer(0, 4294967295))
        if self.maybe():
            one["type"] = self.word("center", "stratified", "sobol")
        if one.get("type") in ("stratified", "sobol"):
            self.fill(one, spp=lambda: self.integer(1, 16))
        elif self.maybe(0.2):
            one["spp"] = self.integer(1, 1)
        return one

    def background(self):
        if self.maybe():
            return {"type": self.word("gradient"), "bottom": self.color(2.0),
                    "top": self.color(2.0)}
        return self.fill({}, type=lambda: self.word("constant"),
                         color=lambda: self.color(2.0))

    def scene(self):
        r = self.random
        self.textures = [f"t{i}" for i in range(r.randint(0, 2))]
        self.materials = [f"m{i}" for i in range(r.randint(0, 3))]
        scene = self.fill(
            {}, version=lambda: self.flawed(1),
            name=lambda: self.flawed("scene"), camera=self.camera,
            film=lambda: self.fill({}, width=lambda: self.integer(1, 2000),
                                   height=lambda: self.integer(1, 2000)),
            sampler=self.sampler, integrator=self.integrator,
            background=self.background,
            lights=lambda: [self.light() for _ in range(r.randint(0, 3))],
            extras=lambda: self.flawed({"note": [1, {"x": None}]}))
        if self.textures:
            scene["textures"] = [{"name": n, **self.texture()}
                                 for n in self.textures]
        if self.materials:
            scene["materials"] = [{"name": n, **self.material()}
                                  for n in self.materials]
        scene["objects"] = [self.object() for _ in range(r.randint(1, 4))]
        return dict(r.sample(list(scene.items()), len(scene)))


def text(document):
    """Compact JSON; Python's own writer keeps -0.0 and the shortest form."""
    return json.dumps(document, ensure_ascii=False).encode()
